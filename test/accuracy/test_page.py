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
    """On every scene, shipped or unseen, or it is said why it could not be measured."""
    text = load_study("promises").PAGE.read_text(encoding="utf-8")
    assert text.count("| kept |") > 50
    assert "**not kept**" not in text


def test_the_unseen_scenes_are_those_of_the_generator() -> None:
    promises, generator = load_study("promises"), load_study("unseen_scenes")
    read = {file.stem: YAML(typ="safe").load(file) for file in sorted(promises.SCENES.glob("*.yaml"))}
    assert read == generator.unseen_scenes()
    assert len(read) == 10
