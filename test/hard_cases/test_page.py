"""docs/stability.md says what its studies say."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def studies() -> ModuleType:
    specification = importlib.util.spec_from_file_location("stability", ROOT / "docs" / "studies" / "stability.py")
    assert specification is not None
    assert specification.loader is not None
    module = importlib.util.module_from_spec(specification)
    before = list(sys.path)
    specification.loader.exec_module(module)
    sys.path[:] = before
    return module


def test_the_page_is_that_of_its_studies(studies: ModuleType) -> None:
    """Made by `make stability ARGS=--tables`, and so after a row was added or its words were changed."""
    text = studies.PAGE.read_text(encoding="utf-8")
    assert studies.page(text, studies.FOLDER) == text


def test_a_page_without_a_marker_is_refused(studies: ModuleType) -> None:
    with pytest.raises(ValueError, match="expected the markers <!-- study: summary -->"):
        studies.page("# Nothing\n", studies.FOLDER)
