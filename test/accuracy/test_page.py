"""docs/accuracy.md says what its studies say."""

from __future__ import annotations

from types import ModuleType

import pytest
from ruamel.yaml import YAML
from study_page import load_study


@pytest.fixture(scope="module")
def studies() -> ModuleType:
    return load_study("accuracy")


def test_the_page_is_that_of_its_studies(studies: ModuleType) -> None:
    """Made by the command that is named there; after a change of presets or of a prediction it is to be made anew."""
    text = studies.PAGE.read_text(encoding="utf-8")
    assert studies.page(text) == text
    for path, tables in studies.tables().items():
        assert path.read_text(encoding="utf-8") == tables, path


def test_a_page_without_a_marker_is_refused(studies: ModuleType) -> None:
    with pytest.raises(ValueError, match=r"accuracy\.md: expected the markers <!-- study: presets -->"):
        studies.page("# Nothing\n")


def test_the_page_is_that_of_the_promises() -> None:
    """Every preset kept its promise on every scene, shipped or unseen, or it is said why it could not be measured."""
    promises = load_study("promises")
    text = promises.PAGE.read_text(encoding="utf-8")
    assert promises.page(text) == text
    assert "**not kept**" not in text


def test_the_unseen_scenes_are_those_of_the_generator() -> None:
    promises, generator = load_study("promises"), load_study("unseen_scenes")
    read = {file.stem: YAML(typ="safe").load(file) for file in sorted(promises.SCENES.glob("*.yaml"))}
    assert read == generator.unseen_scenes()
    assert len(read) == 10
