# SPDX-License-Identifier: Apache-2.0
"""The list of what is not modelled: complete, printed and documented from one place, and true of the scene's fields."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner
from facts import missing

from conveyor_sim.cli import main
from conveyor_sim.physics.effects.choice import EFFECTS
from conveyor_sim.physics.effects.limits import LEAST_WIDTH, LIMITS, limits_page, limits_text
from conveyor_sim.scene import Scene

ROOT = Path(__file__).parents[3]
ALL = [one for limits in LIMITS.values() for one in limits]

ABSENT = {
    "slopes, lifts and heights": ["slope", "incline", "tilt", "elevation"],
    "liquid in bottles": ["liquid", "fill_level", "slosh"],
    "shapes other than circles": ["vertices", "diagonal", "corner_radius", "outline"],
    "tolerances of bottles": ["radius_deviation", "mass_deviation", "tolerances"],
    "breakage": ["strength", "breaks", "breakage"],
    "cases, packs, trays and pallets": ["case", "cases", "pack", "tray", "pallet"],
    "static friction above kinetic friction, dependence on speed": ["static_friction", "kinetic_friction", "stribeck"],
    "lubrication and its history": ["lubricant", "lubrication", "wetness"],
    "wear and dirt": ["wear_rate", "wear", "dirt"],
    "temperature and humidity": ["temperature", "humidity"],
    "static electricity and adhesion": ["adhesion", "charge", "cohesion"],
    "rolling resistance": ["rolling", "rolling_friction", "rolling_resistance"],
    "air drag and air conveyors": ["drag", "air", "wind"],
    "links of the chain": ["links", "pitch_of_links", "sprocket"],
    "stretch and slack of belts": ["stretch", "slack", "elasticity"],
    "dynamics of drives below the ramp": ["torque", "motor", "power"],
    "optics of sensors": ["transparency", "reflection", "beam_width", "sensitivity"],
    "people": ["operator", "operators", "person"],
}
"""Names of fields that a scene would have if it modelled the effect."""


def fields(schema: Any) -> set[str]:
    """Names of all fields below a JSON schema."""
    if isinstance(schema, list):
        return set().union(*map(fields, schema))
    if not isinstance(schema, dict):
        return set()
    return set(schema.get("properties", {})).union(*map(fields, schema.values()))


def test_every_entry_has_an_effect_a_model_a_consequence_and_an_alternative() -> None:
    assert len({one.effect for one in ALL}) == len(ALL) >= 20
    for one in ALL:
        for text in (one.model, one.consequence, one.instead):
            assert text.endswith("."), one.effect
            assert max(len(sentence.split()) for sentence in text.split(". ")) <= 25, one.effect


def test_what_the_project_says_of_its_limits_is_in_the_list() -> None:
    subjects = "; ".join(one.effect for one in ALL)
    stated = ["three-dimensional", "liquid", "wear", "temperature", "deformation beyond the contact law"]
    assert missing(subjects, *stated) == []


@pytest.mark.parametrize("effect", ABSENT)
def test_no_field_of_a_scene_models_it(effect: str) -> None:
    """An entry goes, or is reworded, when the scene gets a field for it."""
    assert effect in {one.effect for one in ALL}
    names = fields(Scene.model_json_schema())
    assert {"friction", "radius", "debounce"} <= names
    assert names.isdisjoint(ABSENT[effect])


def test_named_fields_faults_pages_and_effects_exist() -> None:
    """Names in code style in an alternative can be found."""
    names = fields(Scene.model_json_schema()) | {effect.name for effect in EFFECTS}
    documents = "\n".join(page.read_text(encoding="utf-8") for page in (ROOT / "docs" / "parts").glob("*.md"))
    for one in ALL:
        text = f"{one.model} {one.instead}"
        for name in re.findall(r"`([a-z_]+)`", text):
            known = name in names or f"/{name}`" in documents or name in {"check", "paper"}
            assert known, (one.effect, name)
        for page in re.findall(r"docs/\w+\.md", text):
            assert (ROOT / page).exists(), page


def test_the_page_and_the_command_have_all_entries() -> None:
    page = (ROOT / "docs" / "limits.md").read_text(encoding="utf-8")
    assert page == limits_page()
    printed = CliRunner().invoke(main, ["explain", "--limits"])
    assert printed.exit_code == 0, printed.output
    spoken = " ".join(printed.output.split())
    for one in ALL:
        for text in (one.effect, one.model, one.consequence, one.instead):
            assert text in page
            assert text in spoken
    for place in (ROOT / "README.md", ROOT / "docs" / "index.md"):
        assert "limits.md)" in place.read_text(encoding="utf-8")


@pytest.mark.parametrize("width", [1, LEAST_WIDTH, 80, 120])
def test_lines_fit_the_terminal_unless_it_is_too_narrow_to_read(width: int) -> None:
    assert max(map(len, limits_text(width))) <= max(width, LEAST_WIDTH)


def test_without_a_scene_only_the_limits_can_be_explained() -> None:
    for arguments in (["explain"], ["explain", "--limits", "--price"]):
        refused = CliRunner().invoke(main, arguments)
        assert refused.exit_code != 0
        assert missing(refused.output, "SCENE", "--limits") == []


def test_a_scene_that_is_missing_is_refused_before_anything_is_printed() -> None:
    refused = CliRunner().invoke(main, ["explain", "nosuch.yaml", "--limits"])
    assert refused.exit_code != 0
    assert "nosuch.yaml" in refused.output
    assert "instead" not in refused.output


def test_with_a_scene_both_are_printed() -> None:
    printed = CliRunner().invoke(main, ["explain", "examples/push.yaml", "--limits"])
    assert printed.exit_code == 0, printed.output
    assert missing(printed.output, "instead", "time step", "base_friction") == []
