# SPDX-License-Identifier: Apache-2.0
"""Programs of examples/st act bit for bit like the controllers in Python; their mutants do not."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from control.test_gap_on_a_line import DIAMETER, GAP, metered

from conveyor_sim.control.cascade import Cascade, CascadeZone
from conveyor_sim.control.filler_block import filler_block
from conveyor_sim.control.gap import GapControl
from conveyor_sim.control.jam import JamAlarm, JamClearing
from conveyor_sim.control.level import Count, table_level
from conveyor_sim.control.reject import TrackedReject
from conveyor_sim.control.scan import Constant, Controller, priority
from conveyor_sim.control.st.controller import StructuredText
from conveyor_sim.control.start_stop import panel_line
from conveyor_sim.control.v_curve import Neighbour, VCurve
from conveyor_sim.testing import Scenario

PROGRAMS = Path(__file__).parent.parent.parent.parent / "examples" / "st"


def cascade() -> Controller:
    return Cascade(
        tuple(CascadeZone(f"zone{n}", f"full{n}", 0.5) for n in range(1, 7)), takes="machines/packer/running"
    )


def v_curve() -> Controller:
    filler = Neighbour("machines/filler/rate", Count("zones/buffer/bottles"), 55.0, 60.0, 65.0)
    return VCurve("machines/packer/rate", 2.0, 0.25, upstream=(filler,))


def gap() -> Controller:
    return GapControl("metering", "discharge", "behind", GAP, DIAMETER, lowest=0.05, highest=0.6)


def jam() -> Controller:
    alarm = JamAlarm(
        "mouth", "mouth", ("counters/exit/forward",), "zones/mouth/bottles", takes="machines/packer/running"
    )
    hold = {"belts/feeder/cmd_speed": 0.0}
    clears = JamClearing(alarm, back_speed=-0.1, back_time=1.3, jog_time=3.0, hold=hold)
    return priority(clears, Constant({"belts/feeder/cmd_speed": 0.1, "belts/mouth/cmd_speed": 0.1}))


def reject() -> Controller:
    return TrackedReject(
        belt="line",
        inspection="machines/camera/bad",
        seen="machines/camera/bad_time",
        fire="machines/rejecter/fire",
        distance=1.2,
        stroke=0.03,
        pulses_per_metre=2000.0,
    )


def nothing(plant: Scenario) -> None:
    pass


def level_holds(plant: Scenario) -> None:
    """Check that the feeder is held from 45 bottles on, and restarts at 35."""
    held = plant.history["belts/feeder/cmd_speed"] == 0.0
    bottles = plant.history["belts/table/bottles"]
    begins, ends = np.flatnonzero(np.diff(held.astype(int)) == 1), np.flatnonzero(np.diff(held.astype(int)) == -1)
    assert len(begins) > 0 and (bottles[begins + 1] == 45).all()
    assert len(ends) > 0 and (bottles[ends + 1] == 35).all()


def gap_holds(plant: Scenario) -> None:
    """Check the gaps as `test_the_gaps_are_as_asked_for` does for the twin in Python."""
    assert abs(plant.signals["plc/gap/measured"] - GAP) < 0.05 * GAP


def stop_packer(plant: Scenario) -> None:
    plant.run_for(26.0)
    plant.inject("machines/packer/stop")
    plant.run_for(20.0)
    plant.inject("machines/packer/stop", 0.0)


def stop_filler(plant: Scenario) -> None:
    plant.run_for(10.0)
    plant.inject("machines/filler/stop")
    plant.run_for(6.0)
    plant.inject("machines/filler/stop", 0.0)


def restart(plant: Scenario) -> None:
    """Start the line, press and reset the emergency stop, and start it again after the reset button and before it."""
    for seconds, act in (
        (1.0, lambda: plant.panel.press("start")),
        (8.0, lambda: plant.panel.release("start")),
        (0.5, lambda: plant.panel.press("estop")),
        (2.0, lambda: plant.panel.reset("estop")),
        (0.5, lambda: plant.panel.press("start")),
        (3.0, lambda: plant.panel.release("start")),
        (0.5, lambda: plant.panel.press("reset")),
        (0.5, lambda: plant.panel.press("start")),
    ):
        plant.run_for(seconds)
        act()


def wedged() -> Scenario:
    wedge = [(0.3384, 0.026), (0.3104, -0.034)]
    return Scenario("scenarios/funnel_mouth", {"bottles": [{"type": "bottle", "position": list(at)} for at in wedge]})


@dataclass(frozen=True)
class Twins:
    line: Callable[[], Scenario]
    python: Callable[[], Controller]
    happens: Callable[[Scenario], None]
    seconds: float
    right: str
    wrong: str
    """Replacement text in the mutant."""
    holds: Callable[[Scenario], None] = nothing
    """Final check that the program passes and its mutant fails; other pairs are in `test_scenarios.py`."""


TWINS = {
    "level": Twins(
        lambda: Scenario("paper_plant"), table_level, nothing, 36, "bottles > LOW", "bottles > HIGH", level_holds
    ),
    "cascade": Twins(lambda: Scenario("scenarios/zoned_line"), cascade, stop_packer, 20, "(NOT room OR", "(room OR"),
    "v_curve": Twins(lambda: Scenario("scenarios/buffer_lane"), v_curve, stop_filler, 15, "1.0 + MARGIN", "1.0"),
    "gap": Twins(metered, gap, nothing, 20, "measured - GAP", "GAP - measured", gap_holds),
    "jam": Twins(wedged, jam, nothing, 25, "BACK_TIME : TIME := T#1.3s", "BACK_TIME : TIME := T#0.5s"),
    "reject": Twins(lambda: Scenario("scenarios/reject_line"), reject, nothing, 40, "LREAL := 1.2", "LREAL := 1.1"),
    "panel": Twins(
        lambda: Scenario("scenarios/panel_line"), panel_line, restart, 6, "powered AND (ready OR resets)", "powered"
    ),
    "filler_block": Twins(
        lambda: Scenario("filler_block"),
        filler_block,
        restart,
        2,
        "NOT failed AND (ready OR reset_button)",
        "NOT failed",
    ),
}


def hashes(name: str, controller: Controller, unlike: Sequence[int] = ()) -> tuple[list[int], Scenario]:
    """Return the state hashes, twice per second, and the line at the end.

    The run ends early with the first hash that differs from that in `unlike`.
    """
    twins = TWINS[name]
    plant = twins.line()
    plant.attach(controller)
    twins.happens(plant)
    found = []
    for _ in range(int(2 * twins.seconds)):
        plant.run_for(0.5)
        found.append(plant.simulation.state_hash())
        if unlike and found != unlike[: len(found)]:
            break
    return found, plant


@pytest.mark.parametrize("name", TWINS)
def test_a_program_is_its_twin_to_the_bit(name: str, tmp_path: Path) -> None:
    twins = TWINS[name]
    expected, _ = hashes(name, twins.python())
    found, plant = hashes(name, StructuredText(PROGRAMS / f"{name}.st"))
    assert found == expected
    twins.holds(plant)
    text = (PROGRAMS / f"{name}.st").read_text()
    assert text.count(twins.right) == 1
    mutant = tmp_path / "mutant.st"
    mutant.write_text(text.replace(twins.right, twins.wrong))
    # Only a final check needs the whole run.
    found, plant = hashes(name, StructuredText(mutant), expected if twins.holds is nothing else ())
    assert found != expected
    if twins.holds is not nothing:
        with pytest.raises(AssertionError):
            twins.holds(plant)


def test_every_program_is_here() -> None:
    assert {path.stem for path in PROGRAMS.glob("*.st")} == {*TWINS, "table"}
