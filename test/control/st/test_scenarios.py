# SPDX-License-Identifier: Apache-2.0
"""Programs of examples/st in the scenarios of their twins: they pass, and their mutants fail."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from conveyor_sim.control.st import StructuredText
from conveyor_sim.testing import Scenario

EXAMPLES = Path(__file__).parent.parent.parent.parent / "examples"


def scenario(name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(f"shipped_{name}", EXAMPLES / "scenarios" / f"test_{name}.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def downstream_stop(controller: StructuredText) -> None:
    plant = Scenario("scenarios/zoned_line")
    plant.attach(controller)
    scenario("downstream_stop").check(plant)


def v_curve(controller: StructuredText) -> None:
    plant = Scenario("scenarios/buffer_lane")
    plant.attach(controller)
    scenario("v_curve").check(plant)


def jam(controller: StructuredText) -> None:
    module = scenario("jam")
    module.check_clearing(module.wedged(Scenario, "one ahead"), controller)


def reject(controller: StructuredText) -> None:
    module: Any = scenario("tracked_reject")
    signals = module.rejects(Scenario("scenarios/reject_line"), controller, 40)
    assert signals["machines/rejecter/rejected_bad"] == 40
    assert signals["machines/rejecter/rejected_good"] == signals["machines/after/bad"] == 0


def emergency_stop(controller: StructuredText) -> None:
    scenario("emergency_stop").check_emergency_stop(Scenario("scenarios/panel_line"), controller)


def filler_block(controller: StructuredText) -> None:
    scenario("filler_block").check_start_without_bottles(Scenario("filler_block"), controller)


@pytest.mark.parametrize(
    ("program", "check", "right", "wrong"),
    [
        ("cascade", downstream_stop, "full AND (NOT room", "FALSE AND (NOT room"),
        ("v_curve", v_curve, "1.0 + MARGIN", "1.0"),
        ("jam", jam, "BACK_TIME : TIME := T#1.3s", "BACK_TIME : TIME := T#0.5s"),
        ("reject", reject, "LREAL := 1.2", "LREAL := 1.1"),
        ("panel", emergency_stop, "powered AND (ready OR resets)", "powered"),
        ("filler_block", filler_block, "NOT backed_up AND queued", "NOT backed_up"),
    ],
)
def test_a_program_passes_the_scenario_of_its_twin(
    program: str, check: Callable[[StructuredText], None], right: str, wrong: str, tmp_path: Path
) -> None:
    path = EXAMPLES / "st" / f"{program}.st"
    check(StructuredText(path))
    text = path.read_text()
    assert text.count(right) == 1
    mutant = tmp_path / f"{program}.st"
    mutant.write_text(text.replace(right, wrong))
    with pytest.raises(AssertionError):
        check(StructuredText(mutant))
