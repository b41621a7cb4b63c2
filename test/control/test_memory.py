# SPDX-License-Identifier: Apache-2.0
"""Controllers in checkpoints: a line saved with its controller continues with the same bits."""

from __future__ import annotations

import json
from collections import deque
from collections.abc import Mapping
from pathlib import Path

import pytest
from control.st.test_twins import PROGRAMS, TWINS
from facts import stating

from conveyor_sim.control.memory import restore, snapshot
from conveyor_sim.control.scan import Constant, ControlError, Inputs, together
from conveyor_sim.control.st import StructuredText
from conveyor_sim.testing import Scenario


@pytest.mark.parametrize("name", ["v_curve", "jam", "gap", "reject"])
@pytest.mark.parametrize("language", ["python", "st"])
def test_a_resumed_controller_gives_the_bits_of_one_that_never_stopped(
    name: str, language: str, tmp_path: Path
) -> None:
    twins = TWINS[name]

    def made() -> object:
        return twins.python() if language == "python" else StructuredText(PROGRAMS / f"{name}.st")

    whole = twins.line()
    whole.attach(made())  # type: ignore[arg-type]
    whole.run_for(6.5)
    whole.save(tmp_path / "warm.npz")
    whole.run_for(6.5)
    second = Scenario(whole.scene, start=tmp_path / "warm.npz")
    second.attach(made(), resume=True)  # type: ignore[arg-type]
    second.run_for(6.5)
    assert second.simulation.full_state_hash() == whole.simulation.full_state_hash()
    assert second.alarms == whole.alarms


def test_without_a_controller_in_it_nothing_is_resumed(tmp_path: Path) -> None:
    plant = TWINS["v_curve"].line()
    plant.run_for(0.1)
    plant.save(tmp_path / "warm.npz")
    second = Scenario(plant.scene, start=tmp_path / "warm.npz")
    with pytest.raises(ControlError, match=stating("resume", "no controller")):
        second.attach(TWINS["v_curve"].python(), resume=True)


class Odd:
    """Controller that stores values of many kinds."""

    def __init__(self, thing: object) -> None:
        self.thing = thing

    def scan(self, inputs: Inputs) -> Mapping[str, float]:
        return {}


@pytest.mark.parametrize("thing", [None, 3, -0.0, "x", [1, [2.5]], (1, "a"), deque([1.0, 2.0]), {"a": [True]}])
def test_what_is_remembered_comes_back(thing: object) -> None:
    other = Odd(None)
    restore(other, json.loads(json.dumps(snapshot(Odd(thing)))))
    assert other.thing == thing
    assert type(other.thing) is type(thing)


def test_what_can_not_be_held_is_named() -> None:
    with pytest.raises(ControlError, match=stating("Odd.thing", "set", "checkpoint")):
        snapshot(Odd({1, 2}))
    with pytest.raises(ControlError, match=stating("Odd.thing", "mapping", "texts")):
        snapshot(Odd({1: 2}))


def test_another_controller_is_refused() -> None:
    with pytest.raises(ControlError, match=stating("Odd", "Constant")):
        restore(Constant({}), snapshot(Odd(1)))
    with pytest.raises(ControlError, match=stating("controller", "same way")):
        restore(Odd(1), snapshot(Odd(Constant({}))))
    both = together(Odd(1), Odd(Constant({"a": 1.0})))
    restore(both, snapshot(both))
