# SPDX-License-Identifier: Apache-2.0
"""Moving rails move in a study."""

from __future__ import annotations

from typing import Any

from scenes import base, bottle, contact, scene

from conveyor_sim.accuracy.measure.starts import STROKED, Exercise, find_starts
from conveyor_sim.accuracy.setting import Setting
from conveyor_sim.accuracy.trajectory import variant
from conveyor_sim.scene import Scene


def silent(_done: float, _whole: float) -> None:
    pass


def sliding(x: float, **more: Any) -> dict[str, Any]:
    return {"from": [x, -0.2], "to": [x, 0.2], "material": "steel", "direction": 0.0, "stroke": 0.1, "max_speed": 0.5,
            "acceleration": 5.0, **more}  # fmt: skip


def pushed(**fields: Any) -> Scene:
    """A bottle at rest, which nothing touches but a pusher; far from both a gate, open at the start, and a diverter."""
    return scene(
        duration=6.0,
        base=base(0.3),
        contacts=[contact(2e4, "steel", damping=("normal", 5.0))],
        effects={"peaks": "on"},
        pushers={"arm": sliding(-0.12)},
        gates={"exit": {"kind": "slide", "open": True, **sliding(5.0)}},
        diverters={
            "flap": {"from": [9.0, 0.0], "to": [9.3, 0.0], "material": "steel", "angle": "40 deg", "max_speed": 1.0,
                     "acceleration": 10.0}
        },
        bottles=[bottle(0.0, 0.0)],
        **fields,
    )  # fmt: skip


def test_every_mover_goes_to_both_ends_and_they_take_turns() -> None:
    it = pushed()
    run, exercise = variant(it, Setting("semi_implicit_euler", 100)), Exercise(it)
    names = list(run.process_image.signal_names)
    columns = [names.index(f"{name}/position") for name in ("pushers/arm", "gates/exit", "diverters/flap")]
    seen = [run.signals()[columns]]
    while run.tick < it.duration_ticks:
        exercise.command(run)
        run.advance()
        seen.append(run.signals()[columns])
    assert not [outcome for outcome in run.take_outcomes() if not outcome.accepted]
    assert [min(course) for course in zip(*seen, strict=True)] == [0.0, 0.0, 0.0]
    assert [max(course) for course in zip(*seen, strict=True)] == [1.0, 1.0, 1.0]
    first = [next(tick for tick, now in enumerate(seen) if now[mover] != seen[0][mover]) for mover in range(3)]
    assert len(set(first)) == 3


def test_a_stroke_makes_a_start() -> None:
    """Without commands nothing would ever touch the bottle."""
    found = find_starts(pushed(), silent)
    assert found.moving == STROKED
    still = variant(pushed(), Setting("semi_implicit_euler", 100))
    still.advance(still.scene.duration_ticks)
    assert still.peak_force == 0.0
    column = list(still.process_image.signal_names).index("pushers/arm/position")
    moving = [start.simulation for start in found.starts if 0.0 < start.simulation.signals()[column] < 1.0]
    assert moving
    run = moving[0]
    run.advance(50)
    assert run.peak_force is not None and run.peak_force > 1.0


def test_a_scene_without_moving_rails_has_no_exercise() -> None:
    it = scene(bottles=[bottle(0.0, 0.0)], base=base(0.3))
    assert not Exercise(it)
    run = variant(it, Setting("semi_implicit_euler", 10))
    Exercise(it).command(run)
    assert list(run.line.waiting) == []
