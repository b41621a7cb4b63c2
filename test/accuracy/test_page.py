# SPDX-License-Identifier: Apache-2.0
"""The programs that make docs/accuracy.md; that it is up to date is checked by `make docs-check`."""

from __future__ import annotations

from pathlib import Path
from types import ModuleType

import pytest
from ruamel.yaml import YAML
from study_page import load_study

from conveyor_sim.scene import load_scene


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


@pytest.fixture(scope="module")
def defaults() -> ModuleType:
    return load_study("defaults")


def test_the_first_variant_of_the_comparison_is_the_default(defaults: ModuleType) -> None:
    law, solver = defaults.VARIANTS[0]
    for name in defaults.SCENES:
        shipped = load_scene(defaults.scene_files()[name])
        compared = defaults.variant(name, law, solver)
        assert compared.contacts == shipped.contacts
        assert compared.friction_solver == shipped.friction_solver
        assert shipped.friction_solver == "explicit"


def test_each_variant_changes_the_law_or_the_solver_alone(defaults: ModuleType) -> None:
    for name in defaults.SCENES:
        for law, solver in defaults.VARIANTS:
            scene = defaults.variant(name, law, solver)
            shipped = load_scene(defaults.scene_files()[name])
            assert scene.friction_solver == solver
            for contact, before in zip(scene.contacts, shipped.contacts, strict=True):
                assert (contact.tangential is not None) == (law == "springs")
                assert contact.model_copy(update={"tangential": before.tangential}) == before


def test_the_page_of_the_comparison_states_costs_over_the_default(
    defaults: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(defaults, "TABLE", tmp_path / "defaults.csv")
    assert "Not measured yet" in defaults.page()
    common = {**dict.fromkeys(defaults.COLUMNS, ""), "scene": "push", "steps": "10"}
    curve = {**common, "law": "curve", "solver": "explicit"}
    defaults.keep(
        [
            {**common, "law": "springs", "solver": "explicit", "failure": "unstable: bottle 3"},
            {**curve, "integrator": "leapfrog", "cost": "0.2", "impacts": "0.004", "resting": "7e-17", "load": "16.4"},
            {**curve, "integrator": "rk4", "cost": "0.5", "impacts": "0.02"},
        ]
    )
    rows = [line for line in defaults.page().splitlines() if line.startswith("| ")][2:]
    assert rows[0] == "| curve | explicit | leapfrog | 10 | 1 | 0.4 % | 0 % | 16.4 | kept |"
    assert "| 2.5 | 2 % | - | - | **not kept** |" in rows[1]
    assert "unstable: bottle 3" in rows[2]
