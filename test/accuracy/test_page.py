"""docs/accuracy.md says what its studies say."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def studies() -> ModuleType:
    specification = importlib.util.spec_from_file_location("page", ROOT / "docs" / "studies" / "accuracy.py")
    assert specification is not None
    assert specification.loader is not None
    module = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(module)
    return module


def test_the_page_is_that_of_its_studies(studies: ModuleType) -> None:
    """Made by the command that is named there; after a change of presets or of a prediction it is to be made anew."""
    text = studies.PAGE.read_text(encoding="utf-8")
    assert studies.page(text) == text
    assert "**not kept**" not in text


def test_a_page_without_a_marker_is_refused(studies: ModuleType) -> None:
    with pytest.raises(ValueError, match="expected the markers <!-- study: presets -->"):
        studies.page("# Nothing\n")
