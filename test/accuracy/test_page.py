"""docs/accuracy.md says what its studies say."""

from __future__ import annotations

from types import ModuleType

import pytest
from study_page import load_study


@pytest.fixture(scope="module")
def studies() -> ModuleType:
    return load_study("accuracy")


def test_the_page_is_that_of_its_studies(studies: ModuleType) -> None:
    """Made by the command that is named there; after a change of presets or of a prediction it is to be made anew."""
    text = studies.PAGE.read_text(encoding="utf-8")
    assert studies.page(text) == text
    assert "**not kept**" not in text


def test_a_page_without_a_marker_is_refused(studies: ModuleType) -> None:
    with pytest.raises(ValueError, match=r"accuracy\.md: expected the markers <!-- study: presets -->"):
        studies.page("# Nothing\n")
