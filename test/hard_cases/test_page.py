# SPDX-License-Identifier: Apache-2.0
"""The program that makes docs/stability.md; that it is up to date is checked by `make docs-check`."""

from __future__ import annotations

import csv
from pathlib import Path
from types import ModuleType

import pytest
from study_page import load_study


@pytest.fixture(scope="module")
def studies() -> ModuleType:
    return load_study("stability")


def test_a_page_without_a_marker_is_refused(studies: ModuleType) -> None:
    with pytest.raises(ValueError, match=r"stability\.md: expected the markers <!-- study: summary -->"):
        studies.page("# Nothing\n", studies.FOLDER)


def test_rows_of_older_sources_stay_until_they_are_measured_again(studies: ModuleType, tmp_path: Path) -> None:
    """`make stability ARGS=row` measures one row: the others are in the file as before."""
    matrix, path = studies.stability_matrix, tmp_path / "matrix.csv"
    first, second, *_ = matrix.jobs(matrix.read_table())
    old, other, new = (
        dict.fromkeys(matrix.COLUMNS, "") | {**vars(job), "sources": sources, "verdict": verdict}
        for job, sources, verdict in ((first, "old", "broken"), (second, "old", "kept"), (first, "new", "kept"))
    )
    matrix.write(path, [old, other])
    matrix.write(path, [new])
    with path.open(newline="", encoding="utf-8") as file:
        assert list(csv.DictReader(file)) == [new, other]
