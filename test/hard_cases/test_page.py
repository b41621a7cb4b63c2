# SPDX-License-Identifier: Apache-2.0
"""The program that makes docs/stability.md; that it is up to date is checked by `make docs-check`."""

from __future__ import annotations

from types import ModuleType

import pytest
from study_page import load_study


@pytest.fixture(scope="module")
def studies() -> ModuleType:
    return load_study("stability")


def test_a_page_without_a_marker_is_refused(studies: ModuleType) -> None:
    with pytest.raises(ValueError, match=r"stability\.md: expected the markers <!-- study: summary -->"):
        studies.page("# Nothing\n", studies.FOLDER)
