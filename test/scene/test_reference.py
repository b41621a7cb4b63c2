# SPDX-License-Identifier: Apache-2.0
"""The reference of the scene file is what the schema says, and says all that is needed."""

from collections.abc import Iterator

import pytest
from pydantic import BaseModel

from conveyor_sim.scene.part import Part
from conveyor_sim.scene.reference import sections, tables
from conveyor_sim.scene.words import expectation, field_names, unit_of

MODELS = [model for _, model in sections()]


def parts_below(part: type[Part]) -> Iterator[type[Part]]:
    for model in part.__subclasses__():
        yield model
        yield from parts_below(model)


def test_every_part_of_a_scene_has_its_section() -> None:
    own = (model for model in parts_below(Part) if model.__module__.startswith("conveyor_sim.scene."))
    whole = [model for model in own if model.model_fields and not model.__subclasses__()]
    public = {model for model in whole if not model.__name__.startswith("_")}
    assert public <= set(MODELS)


@pytest.mark.parametrize("model", MODELS, ids=lambda model: model.__name__)
def test_every_field_says_what_it_is_what_it_takes_and_in_which_unit(model: type[BaseModel]) -> None:
    assert model.__doc__
    for name, field in field_names(model).items():
        assert field.description, name
        assert field.description.endswith("."), name
        takes = expectation(field)
        assert takes, name
        words = ("number", "an angle", "angles", "points [", "a point [", "a velocity [", "ranges [", "corners [")
        numeric = any(word in takes for word in words)
        assert bool(unit_of(field)) == numeric, name


def test_every_section_is_on_one_page() -> None:
    headings = [line for page in tables().values() for text in page.values() for line in text.splitlines()]
    assert [title for title, _ in sections() if headings.count(f"### {title}") != 1] == []
