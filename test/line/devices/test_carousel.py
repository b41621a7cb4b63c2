# SPDX-License-Identifier: Apache-2.0
"""Carousels: tools at the pockets of a star wheel change, set and test the bottles that pass two angles."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from line.machines.machine_line import signals
from scenes import MASS, RADIUS, bottle, contact, kind, scene, simulation

from conveyor_sim.bag.outputs import OutputWriter
from conveyor_sim.bag.recorder import Recorder
from conveyor_sim.bag.replay import replay
from conveyor_sim.errors import SceneError
from conveyor_sim.simulation import Simulation

POCKETS, PITCH_RADIUS, RATE = 12, 0.3, 0.25
"""Pockets; radius (m) of the circle of carried bottles; turns of the wheel per second."""
PITCH = 2.0 * math.pi / POCKETS
PLAY = 5e-4
TYPES = {"bottle": kind(), "full": kind(RADIUS, 2.0 * MASS)}
WORK: dict[str, Any] = {"star": "wheel", "from": "40 deg", "to": "200 deg", "changes": {"bottle": "full"},
                        "sets": {"cap": {"to": 1.0}}, "tests": {"cap": {"low": 1.0}}}  # fmt: skip


def fields(filled: tuple[int, ...] = (0, 1, 2, 4), work: dict[str, Any] | None = None, **more: Any) -> dict[str, Any]:
    """Return a wheel with a carousel, and bottles in some of its pockets; pocket 0 begins 15 degrees after the entry.

    Pockets turn counter-clockwise. Bottles that are handed over at 300 degrees go out of the picture.
    """
    wheel = {
        "centre": [0.0, 0.0], "turn": "left", "entry": "-90 deg", "carry": "300 deg", "pockets": POCKETS,
        "pitch_radius": PITCH_RADIUS, "pocket_radius": RADIUS + PLAY, "axis": "block", "material": "steel",
        "guide": {"material": "steel", "from": "-170 deg", "clearance": PLAY},
    }  # fmt: skip
    start = math.radians(15.0)

    def at(pocket: int) -> list[float]:
        angle = -0.5 * math.pi + start - pocket * PITCH
        return [PITCH_RADIUS * math.cos(angle), PITCH_RADIUS * math.sin(angle)]

    return {
        "accuracy": {"per_tick": 100},
        "floor": {"friction": 0.1},
        "contacts": [contact(5e4, other, damping=("normal", 60.0)) for other in ("glass", "steel")],
        "bottle_types": TYPES,
        "axes": {"block": {"rate": RATE}},
        "stars": {"wheel": {**wheel, "phase": -start}},
        "carousels": {"filler": WORK if work is None else work},
        "bottles": [bottle(*at(pocket)) for pocket in filled],
        "outputs": {"ledger": 1.0, "bottles": 100.0},
        **more,
    }


def of(sim: Simulation, what: str) -> float:
    return signals(sim)[f"carousels/filler/{what}"]


def energy_fed(sim: Simulation) -> float:
    ledger = sim.ledger()
    assert ledger is not None
    return ledger.fed


def angle_of(sim: Simulation, number: int) -> float:
    """Return the angle of a bottle after the entry of the wheel, rad."""
    bottles = sim.bottles()
    (index,) = np.flatnonzero(bottles.id == number)
    return (math.atan2(bottles.y[index], bottles.x[index]) + 0.5 * math.pi) % (2.0 * math.pi)


def test_a_bottle_changes_where_the_work_ends() -> None:
    """Within the way of a tick and the play in the pocket; mass, attribute and energy follow."""
    sim = simulation(**fields())
    before, changed = sim.bottles().type.copy(), {}
    gained = []
    for _ in range(360):
        fed = energy_fed(sim)
        sim.advance()
        now = sim.bottles().type
        for number in np.flatnonzero(now != before).tolist():
            changed[number] = angle_of(sim, number)
            speed2 = sim.bottles().vx[number] ** 2 + sim.bottles().vy[number] ** 2
            gained.append((energy_fed(sim) - fed) / (0.5 * MASS * speed2))
        before = now.copy()
        if len(changed) == 4:
            break
    assert sorted(changed) == [0, 1, 2, 3]
    step = 2.0 * math.pi * RATE * 0.01
    for angle in changed.values():
        assert -0.01 <= angle - math.radians(200.0) <= step + 0.01
    assert gained == pytest.approx([1.0] * 4, rel=1e-6)
    world = sim._state.world
    assert (1.0 / world.bottles.inverse_mass[:4]).tolist() == pytest.approx([2.0 * MASS] * 4)
    assert (of(sim, "processed"), of(sim, "good"), of(sim, "lost"), of(sim, "skipped")) == (4.0, 4.0, 0.0, 0.0)
    assert sim._line.now.attributes["cap"] == {0: 1.0, 1: 1.0, 2: 1.0, 3: 1.0}


def test_empty_pockets_are_counted() -> None:
    """Pocket 3 is empty between full ones, and all pockets after pocket 4 are."""
    sim = simulation(**fields())
    # Pocket k passes 40 degrees after 25 + 30 k degrees.
    sim.advance(math.ceil((25.0 + 30.0 * 4.5) / (360.0 * RATE) * 100.0))
    assert (of(sim, "missing"), of(sim, "held")) == (1.0, 4.0)
    sim.advance(round(90.0 / (360.0 * RATE) * 100.0))
    assert of(sim, "missing") == 4.0
    assert of(sim, "held") + of(sim, "processed") == 4.0


def test_a_dead_tool_and_a_filler_that_is_off_skip_bottles_and_make_them_bad() -> None:
    sim = simulation(**fields(filled=(0, 1, 2)))
    sim.inject("carousels/filler/dead_tool", 2.0)
    sim.advance(280)
    assert (of(sim, "processed"), of(sim, "skipped"), sim.bottles().type.tolist()) == (2.0, 1.0, [1, 0, 1])
    assert sim._line.now.bad == {1}
    sim = simulation(**fields(filled=(0, 1, 2)))
    sim.advance(40)  # pocket 0 has begun, pocket 1 not yet
    sim.command(["carousels/filler/on"], [0.0])
    sim.advance(240)
    assert sim.bottles().type.tolist() == [1, 0, 0]
    assert sim._line.now.bad == {1, 2}


def test_a_bottle_that_falls_out_is_lost() -> None:
    """It is taken by hand between the two angles."""
    sim = simulation(**fields(filled=(0, 1)))
    sim.advance(100)
    assert of(sim, "held") == 2.0
    sim.delete(0)
    sim.advance(170)
    assert (of(sim, "processed"), of(sim, "lost"), of(sim, "skipped")) == (1.0, 1.0, 0.0)


def test_a_wheel_that_stands_or_turns_backward_does_no_work_twice() -> None:
    """One bottle is past the end of the work, one in it; both go back, and pass again."""
    sim = simulation(**fields(filled=(0, 1)))
    sim.advance(220)
    assert (of(sim, "processed"), of(sim, "held")) == (1.0, 1.0)
    sim.command(["axes/block/enable"], [0.0])
    sim.advance(100)
    assert (of(sim, "processed"), of(sim, "held")) == (1.0, 1.0)
    stood = angle_of(sim, 0)
    sim.command(["axes/block/enable", "axes/block/rate"], [1.0, 0.0])
    sim.advance()
    sim.command(["axes/block/jog_backward"], [1.0])
    while angle_of(sim, 0) > stood - math.radians(30.0):
        sim.advance()
    sim.command(["axes/block/jog_backward", "axes/block/rate"], [0.0, RATE])
    sim.advance(180)
    assert (of(sim, "processed"), of(sim, "skipped"), of(sim, "lost")) == (2.0, 0.0, 0.0)
    assert sim._line.now.bad == set()


def test_a_skipped_bottle_that_passes_again_counts_once() -> None:
    """The wheel carries a bottle past the end of the work, back by 30 degrees, and past it again."""
    sim = simulation(**fields(filled=(0,)))
    sim.inject("carousels/filler/dead_tool", 1.0)
    sim.advance(220)
    assert of(sim, "skipped") == 1.0
    passed = angle_of(sim, 0)
    sim.command(["axes/block/rate"], [0.0])
    sim.advance(100)
    sim.command(["axes/block/jog_backward"], [1.0])
    while angle_of(sim, 0) > math.radians(170.0):
        sim.advance()
    sim.command(["axes/block/jog_backward", "axes/block/rate"], [0.0, RATE])
    while angle_of(sim, 0) < passed:
        sim.advance()
    assert (of(sim, "skipped"), of(sim, "processed"), sim._line.now.bad) == (1.0, 0.0, {0})


@pytest.mark.parametrize("pockets", [1, 2, 3])
def test_wheels_of_few_pockets_work_on_their_bottles(pockets: int) -> None:
    """The work of 160 degrees is done once per turn in each pocket; without bottles, pockets are missing."""
    given = fields(filled=(0,))
    given["stars"]["wheel"]["pockets"] = pockets
    sim = simulation(**given)
    sim.advance(math.ceil(200.0 / (360.0 * RATE) * 100.0))
    assert (of(sim, "processed"), sim.bottles().type.tolist()) == (1.0, [1])
    empty = simulation(**{**given, "bottles": []})
    empty.advance(round(2.0 / RATE * 100.0))
    assert of(empty, "missing") == 2.0 * pockets


@pytest.mark.parametrize("threads", [1, 2])
def test_a_run_goes_on_from_a_checkpoint_with_the_same_bits(threads: int, tmp_path: Path) -> None:
    sim = simulation(**fields())
    for ticks in (70, 60, 50):
        sim.advance(ticks)
        sim.save(tmp_path / "there")
        loaded = Simulation.load(tmp_path / "there", threads)
        for each in (sim, loaded):
            each.advance(40)
        assert loaded.full_state_hash() == sim.full_state_hash()
        assert loaded.signals().tolist() == sim.signals().tolist()
    assert of(sim, "processed") > 0.0


@pytest.mark.parametrize("seed", range(4))
def test_any_sequence_of_commands_and_faults_keeps_the_ledger_of_bottles(seed: int, tmp_path: Path) -> None:
    """Faults, an emergency stop and wrong values at random: signals stay in range, a checkpoint goes on alike."""
    rng = np.random.default_rng(seed)
    filled = (0, 1, 2, 4, 6, 8, 9, 11)
    stop = {"kind": "emergency_stop", "cuts": ["drives", "machines"], "deceleration": 1.0}
    both = [simulation(**fields(filled=filled, panel={"estop": stop}))]
    names = both[0].process_image.signal_names
    limits = {tag.name: (tag.low, tag.high) for tag in both[0].process_image.tags}
    faults = ("carousels/filler/dead_tool", "stars/wheel/slip", "stars/wheel/jammed", "axes/block/jammed")
    commands = ("carousels/filler/on", "axes/block/enable", "axes/block/jog_backward", "axes/block/reset",
                "axes/block/rate", "panel/estop/press", "panel/estop/reset")  # fmt: skip
    values = (0.0, 1.0, -1.0, 0.3, 2.0, 12.0, 13.0, math.nan, math.inf, 1e308)
    for tick in range(400):
        if rng.random() < 0.1:
            name, value = str(rng.choice([*faults, *commands])), float(rng.choice(values))
            for sim in both:
                if name in faults:
                    sim.inject(name, value)
                else:
                    sim.command([name], [value])
        if tick == 200:
            both[0].save(tmp_path / "there")
            both.append(Simulation.load(tmp_path / "there", 2))
        for sim in both:
            sim.advance()
        for name, value in zip(names, both[0].signals().tolist(), strict=True):
            assert limits[name][0] <= value <= limits[name][1], name
    assert both[0].full_state_hash() == both[1].full_state_hash()
    assert both[0].signals().tolist() == both[1].signals().tolist()
    assert of(both[0], "skipped") <= len(filled) and of(both[0], "processed") <= len(filled)


def test_a_recording_replays(tmp_path: Path) -> None:
    sim = simulation(**fields())
    with Recorder(tmp_path / "bag") as recorder:
        outputs = OutputWriter(sim, [recorder], run_id="run")
        outputs.start()
        for _ in range(345):
            sim.advance()
            outputs.after_tick()
    assert of(sim, "processed") == 4.0
    report = replay(tmp_path / "bag")
    assert (report.difference, report.exact, report.last_tick) == (None, True, 345)


@pytest.mark.parametrize(
    ("work", "says"),
    [
        ({"star": "none"}, 'carousels.filler.star: "none" given, expected a name from stars: wheel'),
        (
            {"to": "30 deg"},
            "carousels.filler.to: 0.5235987755982988 given, expected more than 0.698132 (rad), as from is",
        ),
        ({"to": "310 deg"}, "expected at most 5.23599 (rad): bottles leave stars.wheel there"),
        ({"from": "-10 deg"}, "expected 0 or more (rad), from the entry on"),
        (
            {"changes": {"bottle": "wide"}},
            'carousels.filler.changes.bottle: "wide" given, expected a type of the same radius, 0.065 m: the bottle '
            "stays in its pocket",
        ),
        (
            {"tests": {"label": {"low": 1.0}}},
            'carousels.filler.tests.label: no station sets "label", expected bad, cap',
        ),
    ],
)
def test_what_is_refused_and_why(work: dict[str, Any], says: str) -> None:
    types = {**TYPES, "wide": kind(1.1 * RADIUS)}
    with pytest.raises(SceneError) as refused:
        scene(**fields(work={**WORK, **work}, bottle_types=types))
    assert says in str(refused.value)
