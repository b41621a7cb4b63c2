"""docs/stability.md says what its studies say."""

from __future__ import annotations

from types import ModuleType

import pytest
from study_page import load_study


@pytest.fixture(scope="module")
def studies() -> ModuleType:
    return load_study("stability")


def test_the_page_is_that_of_its_studies(studies: ModuleType) -> None:
    """Made by `make stability ARGS=--tables`, and so after a row was added or its words were changed."""
    text = studies.PAGE.read_text(encoding="utf-8")
    assert studies.page(text, studies.FOLDER) == text


def test_a_page_without_a_marker_is_refused(studies: ModuleType) -> None:
    with pytest.raises(ValueError, match=r"stability\.md: expected the markers <!-- study: summary -->"):
        studies.page("# Nothing\n", studies.FOLDER)
