# SPDX-License-Identifier: Apache-2.0
"""Star wheels: hand-over in phase without knocks, the blow out of phase, faults, and equal bits."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from study_page import load_study
from wheel_lines import (
    MASS,
    MU,
    PITCH_RADIUS,
    POCKET_RADIUS,
    POCKETS,
    RADIUS,
    RATE,
    SPEED,
    STIFFNESS,
    line,
    star_line,
)

from conveyor_sim.engine.threads.workers import UNIT
from conveyor_sim.scene import parse_scene
from conveyor_sim.scene.geometry import ArcPiece
from conveyor_sim.scene.moving import bodies_by_signals
from conveyor_sim.simulation import Simulation

PAGE = Path(__file__).parents[2] / "docs" / "parts" / "stars.md"
OMEGA = SPEED / PITCH_RADIUS
CENTRIPETAL = MASS * OMEGA**2 * PITCH_RADIUS
DRAG = MU * MASS * 9.81
HALF_TURN = 0.5 * POCKETS / RATE
"""s."""


def peak(sim: Simulation, seconds: float) -> float:
    """Return the largest contact force of any bottle over some time, N."""
    largest = 0.0
    for _ in range(round(seconds / sim.scene.tick)):
        sim.advance()
        largest = max(largest, float(sim.bottles().peak_force.max()))
    return largest


def blow(speed: float) -> float:
    """Return the force of an undamped impact at a speed (m/s), N."""
    return speed * math.sqrt(STIFFNESS * MASS)


def test_bottle_in_phase_is_carried_without_knocks() -> None:
    """No force exceeds m omega^2 r, the drag of the belt, and the blow by the bottle's play."""
    sim = star_line()
    play = POCKET_RADIUS - RADIUS
    largest = peak(sim, 0.5 / SPEED + HALF_TURN + 0.5 / SPEED)
    assert 0.5 * CENTRIPETAL < largest < CENTRIPETAL + DRAG + blow(SPEED * math.sqrt(2.0 * play / PITCH_RADIUS))
    bottles = sim.bottles()
    assert bottles.y[0] == pytest.approx(2.0 * PITCH_RADIUS, abs=0.003) and bottles.x[0] < 0.6
    assert bottles.vx[0] == pytest.approx(-SPEED, rel=0.01)


def test_carried_bottle_moves_on_the_pitch_circle() -> None:
    """Its axis stays within its play of the circle and of the middle of its pocket."""
    sim = star_line()
    play = POCKET_RADIUS - RADIUS
    sim.advance(round((0.5 / SPEED + 0.3 * HALF_TURN) / sim.scene.tick))
    for _ in range(20):
        sim.advance()
        x, y = sim.bottles().x[0], sim.bottles().y[0]
        assert math.hypot(x - 1.0, y - PITCH_RADIUS) == pytest.approx(PITCH_RADIUS, abs=2.5 * play)
        turned = OMEGA * (sim.time - 0.5 / SPEED)
        assert math.atan2(x - 1.0, PITCH_RADIUS - y) == pytest.approx(turned, abs=2.5 * play / PITCH_RADIUS)


def test_bottle_out_of_phase_is_hit_by_the_rim() -> None:
    """Half a pitch out of phase, its first blow is that of its approach to the rim."""
    sim = star_line(late=0.5, guided=False, damped=False, friction=0.0)
    star = sim.scene.stars["in"]
    reach = star.tip_radius + RADIUS
    before = math.sqrt(reach**2 - PITCH_RADIUS**2)
    approach = SPEED * before / reach
    largest = peak(sim, (0.5 - before) / SPEED + 0.05)
    assert largest == pytest.approx(blow(approach), rel=0.03)


def test_slip_makes_a_wrong_phase() -> None:
    """A wheel that slips by an angle lags its axis by it, and a bottle that met its pocket is hit."""
    sim = star_line()
    names = sim.process_image.signal_names
    before = dict(zip(names, sim.signals(), strict=True))
    assert before["stars/in/angle"] == pytest.approx((-sim.scene.stars["in"].phase) % (2.0 * math.pi))
    sim.inject("stars/in/slip", 0.002)
    sim.advance(10)
    now = dict(zip(names, sim.signals(), strict=True))
    turned = (now["axes/star/position"] - now["stars/in/angle"] - sim.scene.stars["in"].phase) % (2.0 * math.pi)
    assert turned == pytest.approx(0.002, abs=1e-9)
    (wheel,) = [shape for shape in sim.moving_rails() if shape.name == "stars/in"]
    pocket = wheel.pieces[0]
    assert isinstance(pocket, ArcPiece)
    angle = math.atan2(pocket.centre[0] - 1.0, PITCH_RADIUS - pocket.centre[1])
    assert math.remainder(angle - now["stars/in/angle"], 2.0 * math.pi) == pytest.approx(0.0, abs=1e-9)


def test_jammed_wheel_blocks_its_axis() -> None:
    """Wheel and axis stand, and the axis falls behind its master."""
    sim = star_line()
    sim.advance(10)
    sim.inject("stars/in/jammed", 1.0)
    sim.advance(2)
    names = sim.process_image.signal_names
    first = dict(zip(names, sim.signals(), strict=True))
    sim.advance(3)
    now = dict(zip(names, sim.signals(), strict=True))
    assert now["stars/in/angle"] == first["stars/in/angle"]
    assert now["axes/star/speed"] == 0.0
    assert now["axes/star/following_error"] > first["axes/star/following_error"] > 0.0


def test_worn_pocket_leaves_more_play() -> None:
    """A bottle in a pocket of a radius larger by 5 mm lags behind the middle of the pocket by more."""
    lags = []
    for worn in (0.0, 0.005):
        sim = star_line(worn=worn)
        sim.advance(round((0.5 / SPEED + 0.5 * HALF_TURN) / sim.scene.tick))
        x, y = sim.bottles().x[0], sim.bottles().y[0]
        angle = math.atan2(x - 1.0, PITCH_RADIUS - y)
        lags.append(PITCH_RADIUS * (OMEGA * (sim.time - 0.5 / SPEED) - angle))
    assert lags[1] > lags[0] + 0.002


def test_results_have_equal_bits_with_threads_and_after_checkpoints(tmp_path: Path) -> None:
    """The state after the hand-over is that of one uninterrupted run on one thread, faults included."""
    runs = [star_line(threads=threads) for threads in (1, 2)]
    for sim in runs:
        sim.inject("stars/in/slip", 0.001)
        sim.advance(60)
    runs[1].save(tmp_path / "half_way.checkpoint")
    runs.append(Simulation.load(tmp_path / "half_way.checkpoint"))
    for sim in runs:
        sim.advance(60)
    assert len({sim.state_hash() for sim in runs}) == 1
    assert np.hypot(*(getattr(runs[0].bottles(), name)[0] for name in ("vx", "vy"))) > 0.5 * SPEED


def large_wheel(threads: int) -> Simulation:
    """Return a wheel with a bottle in each of 96 pockets, whose drive is too weak for their friction on the floor."""
    pockets, radius = 96, 8.0 * PITCH_RADIUS
    angles = 2.0 * math.pi / pockets * np.arange(pockets)
    drag = MU * MASS * 9.81 * radius * pockets
    wheel = {
        "centre": [0.0, 0.0], "turn": "left", "entry": 0.0, "phase": 0.0, "pockets": pockets, "pitch_radius": radius,
        "pocket_radius": POCKET_RADIUS, "axis": "star", "material": "steel",
        "guide": {"material": "steel", "to": "360 deg"},
    }  # fmt: skip
    return line(
        threads=threads,
        floor={"friction": MU},
        # A lane far away, so that the wheel shares the kernels of the others.
        conveyors={
            "spare": {"start": [20.0, 20.0], "path": [{"straight": 1.0}], "width": 0.1, "speed": SPEED,
                      "material": "chain", "guides": {"clearance": 0.07, "material": "steel"}},
        },
        stars={"in": wheel},
        axes={"star": {"rate": RATE / pockets, "torque_limit": 0.5 * drag, "inertia": 5.0, "following_limit": "none"}},
        bottles=[
            {"type": "bottle", "position": [radius * math.cos(angle), radius * math.sin(angle)],
             "velocity": [-SPEED * math.sin(angle), SPEED * math.cos(angle)]}
            for angle in angles
        ],
    )  # fmt: skip


def test_bottles_of_several_threads_load_one_axis_with_equal_bits() -> None:
    """More bottles than a thread takes at a time press on the wheel, and their forces slow it down."""
    one, two = (large_wheel(threads) for threads in (1, 2))
    assert one.bottles().x.size > UNIT
    for sim in (one, two):
        sim.advance(50)
    signals = dict(zip(one.process_image.signal_names, one.signals().tolist(), strict=True))
    assert signals["axes/star/torque_limited"] == 1.0 and signals["axes/star/following_error"] > 1e-3
    assert 0.0 < signals["axes/star/speed"] < 0.9 * SPEED / (8.0 * PITCH_RADIUS)
    assert two.signals().tolist() == one.signals().tolist()
    assert two.full_state_hash() == one.full_state_hash()


def test_queue_is_handed_over_without_knocks() -> None:
    """Bottles from a queue pass screw, wheel and discharge at the rate of the axis; the wheel exerts small forces."""
    sim = Simulation(parse_scene(load_study("part_pictures").scene_text(PAGE)), threads=1)
    sim.advance(500)
    names = sim.process_image.signal_names
    before, largest = float(sim.signals()[names.index("outfeeds/packer/removed")]), 0.0
    for _ in range(1500):
        sim.advance()
        contacts = sim.contacts()
        at_wheel = (contacts.x > 1.75) | (contacts.y > 0.1)
        largest = max(largest, float(contacts.normal_force[at_wheel].max(initial=0.0)))
    passed = float(sim.signals()[names.index("outfeeds/packer/removed")]) - before
    assert passed == pytest.approx(15.0 * RATE, abs=1.0)
    play = POCKET_RADIUS - RADIUS
    assert largest < CENTRIPETAL + DRAG + blow(SPEED * math.sqrt(2.0 * play / PITCH_RADIUS))


@pytest.mark.parametrize("cam", [None, [["0 deg", "0 deg"], ["120 deg", "30 deg"], ["360 deg", "360 deg"]]])
def test_signals_state_the_places_of_slipped_wheels(cam: list[list[str]] | None) -> None:
    """Figures, viewers and carousels use the angle: the outline by it is that in the engine, with slip and cam."""
    axes: dict[str, Any] = {"block": {"rate": RATE}, "star": {"master": "block", "ratio": 1.0 / POCKETS}}
    if cam is not None:
        axes["star"]["cam"] = cam
    sim = star_line(axes=axes)
    sim.inject("stars/in/slip", 0.1)
    for _ in range(5):
        sim.advance(50)
        signals = dict(zip(sim.process_image.signal_names, sim.signals().tolist(), strict=True))
        stated = bodies_by_signals(sim.scene, signals.__getitem__)
        actual = sim._state.moving_rails()
        assert len(stated) == len(actual) == 1
        for one, other in zip(stated[0].pieces, actual[0].pieces, strict=True):
            np.testing.assert_allclose(one.ends, other.ends, atol=1e-9)
