# SPDX-License-Identifier: Apache-2.0
"""The programs that make docs/accuracy.md; that it is up to date is checked by `make docs-check`."""

from __future__ import annotations

from types import ModuleType

import pytest
from ruamel.yaml import YAML
from study_page import load_study


@pytest.fixture(scope="module")
def studies() -> ModuleType:
    return load_study("accuracy")


def test_a_page_without_a_marker_is_refused(studies: ModuleType) -> None:
    with pytest.raises(ValueError, match=r"accuracy\.md: expected the markers <!-- study: presets -->"):
        studies.page("# Nothing\n")


def test_every_preset_kept_its_promise() -> None:
    """On every scene, shipped or of the first ten unseen, with every integrator, or it is said why it has no figure."""
    promises = load_study("promises")
    later = {file.stem for file in promises.LATER_SCENES.glob("*.yaml")}
    rows = [row for row in promises.read() if row["scene"] not in later]
    assert {row["scene"] for row in rows} == promises.scene_files().keys() - later
    kept = 0
    for row in rows:
        for measured in ("impacts", "resting"):
            if row[measured]:
                kept += 1
                assert float(row[measured]) <= float(row["promised"]), row
        assert row["impacts"] or row["failure"], row
    assert kept > 300


def test_rk4_is_not_predicted_better_than_measured() -> None:
    """It expects nearly the most that a jump can be missed by, so that few impacts are no worse; but for the later."""
    promises = load_study("promises")
    later = {file.stem for file in promises.LATER_SCENES.glob("*.yaml")}
    rows = [row for row in promises.read() if row["integrator"] == "rk4" and row["impacts"]]
    rows = [row for row in rows if row["scene"] not in later]
    assert len(rows) > 50
    for row in rows:
        assert float(row["impacts"]) <= float(row["impacts_predicted"]), row


@pytest.mark.parametrize(("folder", "numbers", "count"), [("SCENES", "FIRST", 10), ("LATER_SCENES", "LATER", 5)])
def test_the_unseen_scenes_are_those_of_the_generator(folder: str, numbers: str, count: int) -> None:
    promises, generator = load_study("promises"), load_study("unseen_scenes")
    read = {file.stem: YAML(typ="safe").load(file) for file in sorted(getattr(promises, folder).glob("*.yaml"))}
    assert read == generator.unseen_scenes(getattr(generator, numbers))
    assert len(read) == count
