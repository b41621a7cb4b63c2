# SPDX-License-Identifier: Apache-2.0
"""Belts slower than the slip limit: the share of mu m g with which they drag, and the price of a smaller limit."""

import math
from typing import Any

import pytest
from click.testing import CliRunner
from facts import missing
from scenes import (
    COMMON,
    MASS,
    RADIUS,
    SHIPPED,
    base,
    belt,
    bottle,
    contact,
    kind,
    scene,
    segment,
    simulation,
    with_bends,
)
from worlds import callable_part

from conveyor_sim.cli import main
from conveyor_sim.engine.contact import friction
from conveyor_sim.engine.support import ring
from conveyor_sim.physics.effects.slow_belts import drag_share
from conveyor_sim.physics.model import build_model
from conveyor_sim.physics.model.slow_drag import SlowDrag, slow_drag
from conveyor_sim.scene import Scene, load_scene

LIMIT = 0.01
SLOW: dict[str, Any] = {
    "contacts": [contact(1e5, damping=("normal", 100.0)), contact(1e5, "steel", damping=("normal", 100.0))],
    "base": base(0.4),
    "belts": {"slow": belt(0.001)},
    "rails": {"stop": segment((0.0, -0.1), (0.0, 0.1))},
    "bottles": [bottle(-RADIUS, 0.0)],
}
FAST = belt(1.0, (20.0, 20.0))
"""A belt out of the way, which sets the speed of impacts."""
DISC: dict[str, Any] = {
    "kind": "curved", "centre": [0, 0], "inner_radius": 0.2, "width": 0.4, "start_angle": 0, "span": "360 deg",
    "material": "chain", "speed": 0.03,
}  # fmt: skip


def warned(**fields: Any) -> SlowDrag | None:
    return warning_of(scene(**{**SLOW, **fields}))


def warning_of(given: Scene) -> SlowDrag | None:
    model = build_model(given)
    return slow_drag(model.plant, {choice.name for choice in model.effects if choice.on})


@pytest.mark.parametrize("share", [1e-3, 0.1, 0.5, 0.999, 1.0, 3.0])
def test_the_share_is_that_of_the_kernels(share: float) -> None:
    slip = share * LIMIT
    curve = callable_part(friction.friction_share)
    assert drag_share(slip, LIMIT, "polynomial") == pytest.approx(curve(slip, LIMIT, None), rel=1e-12)
    assert drag_share(slip, LIMIT, "atan") == pytest.approx(curve(slip, LIMIT, 1), rel=1e-9)
    means = callable_part(ring.ring_means)(slip, 0.0, LIMIT)
    of_ring = callable_part(ring.ring_share)(slip, 0.0, *means)
    assert drag_share(slip, LIMIT, "ring") == pytest.approx(slip * of_ring, rel=1e-9)


@pytest.mark.parametrize("curve", ["polynomial", "atan"])
def test_a_stop_bears_the_share(curve: str) -> None:
    """The slip of a bottle against a stop is the speed of its belt."""
    run = simulation(**with_bends({**SLOW, "friction_curve": curve, "effects": COMMON}))
    run.advance(200)
    force = float(run.contacts().normal_force.sum())
    slow = warned(friction_curve=curve)
    assert slow is not None
    assert force == pytest.approx(slow.belt.share * 0.4 * MASS * 9.81, rel=1e-3)
    assert slow.belt.share == pytest.approx(0.19 if curve == "polynomial" else 2.0 / math.pi * math.atan(0.1 * math.pi))


@pytest.mark.parametrize(
    ("fields", "speed"),
    [
        ({}, 0.001),
        ({"belts": {"slow": belt(-0.002)}}, 0.002),
        ({"belts": {"slow": belt(0.3, speed_limits=[0.004, 1.0])}}, 0.004),
        ({"belts": {"slow": belt(-0.3, speed_limits=[-1.0, -0.004])}}, 0.004),
        ({"belts": {"disc": DISC}}, 0.015),
        ({"slip_limit": 0.02, "belts": {"disc": DISC}}, 0.015),
    ],
    ids=["slow", "backwards", "least speed", "least speed backwards", "inner radius fast enough", "inner radius"],
)
def test_the_slowest_speed_decides(fields: dict[str, Any], speed: float) -> None:
    slow, limit = warned(**fields), fields.get("slip_limit", LIMIT)
    assert (slow is not None) == (speed < limit)
    if slow is not None:
        assert slow.belt.speed == pytest.approx(speed)
        assert slow.belt.share == pytest.approx(drag_share(speed, limit, "polynomial"))


def test_a_drive_and_a_ratio_count() -> None:
    drives = {"m1": {"speed": 0.02, "speed_limits": [0.001, 0.5]}}
    slow_belt = {key: value for key, value in belt(0.0).items() if key not in ("speed", "speed_limits")}
    slow = warned(drives=drives, belts={"slow": {**slow_belt, "drive": "m1", "ratio": 0.1}})
    assert slow is not None
    assert slow.belt.path == ("drives", "m1", "speed_limits")
    assert slow.belt.speed == pytest.approx(1e-4)


@pytest.mark.parametrize(
    "fields",
    [
        {"belts": {"slow": belt(0.0)}},
        {"belts": {"slow": belt(LIMIT)}},
        {"slip_limit": 0.001},
        {"base": base(0.0)},
        {"bottles": []},
        {"base": [{**base(0.4)[0], "tangential": {"stiffness": 2e4}}]},
    ],
    ids=["at rest", "at the limit", "smaller limit", "no friction", "no bottle", "spring"],
)
def test_no_warning_without_a_loss(fields: dict[str, Any]) -> None:
    assert warned(**fields) is None


def test_shipped_scenes_have_no_such_belt() -> None:
    assert [path.name for path in SHIPPED if warning_of(load_scene(path)) is not None] == []


@pytest.mark.parametrize("accuracy", ["standard", {"per_tick": 5000}])
def test_the_price_is_what_the_smaller_limit_takes(accuracy: Any) -> None:
    belts = {"slow": belt(0.001), "fast": FAST}
    soft = {**SLOW, "contacts": [contact(1e3), contact(1e3, "steel")], "belts": belts}
    slow = warned(**soft, accuracy=accuracy)
    assert slow is not None
    before, after = (build_model(scene(**soft, slip_limit=limit)).steps_per_tick for limit in (LIMIT, 0.001))
    assert after > before
    assert slow.factor == after / before
    assert not missing(slow.sentence, ["belts.slow", "0.001 m/s", "0.01 m/s", "19 %", "slip_limit: 0.001", "100 %"])


def test_a_price_beyond_all_limits_is_no_price() -> None:
    slow = warned(belts={"slow": belt(1e-12), "fast": FAST})
    assert slow is not None
    assert slow.factor is None
    assert not missing(slow.sentence, ["1e-12 m/s", "1000000 steps"])


def test_rings_and_several_belts() -> None:
    two = {"slow": belt(0.002), "slower": belt(0.001)}
    slow = warned(bottle_types={"bottle": kind(base_radius=0.03)}, belts=two)
    assert slow is not None
    assert (slow.belt.belt, slow.others) == ("slower", 1)
    assert slow.belt.share == pytest.approx(drag_share(0.001, LIMIT, "ring"))


def test_commands_print_the_warning(tmp_path: Any) -> None:
    file = tmp_path / "slow.yaml"
    file.write_text(scene(**with_bends({**SLOW, "effects": COMMON, "duration": 0.05})).source_text)
    drawn, bag = ["--out", str(tmp_path)], ["--out", str(tmp_path / "bag")]
    for arguments in (
        ["check", *drawn],
        ["check", "--details", *drawn],
        ["explain"],
        ["run", "--no-pictures", *bag],
    ):
        command, *options = arguments
        result = CliRunner().invoke(main, [command, str(file), *options])
        assert result.exit_code == 0, result.output
        assert not missing(" ".join(result.output.split()), ["warning", "19 %", "slip_limit: 0.001", "belts.slow"])
