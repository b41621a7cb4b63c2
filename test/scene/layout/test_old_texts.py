# SPDX-License-Identifier: Apache-2.0
"""Shipped scenes that were written with coordinates before, in old/: the new texts give the same lines."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scenes import SHARED_KERNELS, SHIPPED

from conveyor_sim.scene import Scene, load_scene
from conveyor_sim.scene.geometry import ArcPiece, RailShape, SegmentPiece, belt_shapes, rail_shapes
from conveyor_sim.simulation import Simulation

OLD = sorted((Path(__file__).parent / "old").glob("*.yaml"))
NEW = {path.stem: path for path in SHIPPED}
ROUNDED = {
    "funnel": "the left rail slants and is written along travel now",
    "funnel_mouth": "the left rail slants and is written along travel now; stations from -0.4 m",
    "paper_plant": "the loop adds up station by station; the bends' rails come in the order of travel",
    "pressure_combiner": "offsets from the middle of the lanes, which is at 0.1 m",
    "pressureless_combiner": "offsets from the middle of the lanes, which is at 0.1 m",
    "turntable": "conveyors are placed by their middle, 0.585 m from that of the disc",
}
"""Scenes that differ by rounding, with the reason."""
SECONDS = {"accumulation_table": 0.3, "glass_line": 0.3}
"""Simulated times of the exact comparison (s). Others: 3 s."""
ROUNDING = 1e-12  # m


def both(old: Path) -> tuple[Scene, Scene]:
    more = SHARED_KERNELS.get(old.stem, {})
    return load_scene(old, more), load_scene(NEW[old.stem], more)


@pytest.mark.parametrize("path", OLD, ids=lambda path: path.stem)
def test_belts_are_the_same(path: Path) -> None:
    old, new = both(path)
    assert list(new.belts) == list(old.belts)
    for name, belt in old.belts.items():
        for field in ("speed", "speed_limits", "material", "watchdog", "drive"):
            assert getattr(new.belts[name], field) == getattr(belt, field)
    for before, after in zip(belt_shapes(old), belt_shapes(new), strict=True):
        assert np.allclose(before.outline(), after.outline(), rtol=0.0, atol=ROUNDING)


@pytest.mark.parametrize("path", OLD, ids=lambda path: path.stem)
def test_rails_are_the_same_surfaces(path: Path) -> None:
    old, new = map(rail_shapes, both(path))
    assert {rail.material for rail in new} == {rail.material for rail in old}
    for rails, others in ((old, new), (new, old)):
        for point in points_of(rails):
            assert min(distance(point, piece) for other in others for piece in other.pieces) < ROUNDING


@pytest.mark.parametrize("path", OLD, ids=lambda path: path.stem)
def test_devices_and_all_other_fields_are_the_same(path: Path) -> None:
    before, after = (dict(values_of(scene.model_dump(exclude={"belts", "rails"}))) for scene in both(path))
    assert after.keys() == before.keys()
    for field, value in before.items():
        expected = pytest.approx(value, rel=0.0, abs=ROUNDING) if isinstance(value, float) else value
        assert after[field] == expected, field


@pytest.mark.parametrize("path", [path for path in OLD if path.stem not in ROUNDED], ids=lambda path: path.stem)
def test_states_are_the_same_bits(path: Path) -> None:
    old, new = (Simulation(scene, threads=1) for scene in both(path))
    for _ in range(10):
        for simulation in (old, new):
            simulation.advance(round(0.1 * SECONDS.get(path.stem, 3.0) / simulation.scene.tick))
        assert new.state_hash() == old.state_hash()


@pytest.mark.parametrize("path", [path for path in OLD if path.stem in ROUNDED], ids=lambda path: path.stem)
def test_other_states_differ_by_rounding(path: Path) -> None:
    old, new = (Simulation(scene, threads=1) for scene in both(path))
    for simulation in (old, new):
        simulation.advance(round(1.0 / simulation.scene.tick))
    before, after = old.bottles(), new.bottles()
    assert before.id.size > 0
    assert after.id.tolist() == before.id.tolist()
    assert np.allclose(after.x, before.x, rtol=0.0, atol=1e-9)
    assert np.allclose(after.y, before.y, rtol=0.0, atol=1e-9)


def values_of(data: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    """Yield each value of nested data with its path."""
    if isinstance(data, dict):
        for name, value in data.items():
            yield from values_of(value, f"{path}.{name}")
    elif isinstance(data, (list, tuple)):
        for index, value in enumerate(data):
            yield from values_of(value, f"{path}[{index}]")
    else:
        yield path, data


def points_of(rails: list[RailShape]) -> Iterator[tuple[float, float]]:
    """Yield points on rails, their ends included."""
    for rail in rails:
        for piece in rail.pieces:
            for share in np.linspace(0.0, 1.0, 21).tolist():
                if isinstance(piece, ArcPiece):
                    angle = piece.start_angle + share * piece.span
                    (x, y), r = piece.centre, piece.radius
                    yield x + r * math.cos(angle), y + r * math.sin(angle)
                elif isinstance(piece, SegmentPiece):
                    (x, y), (x2, y2) = piece.p1, piece.p2
                    yield x + share * (x2 - x), y + share * (y2 - y)


def distance(point: tuple[float, float], piece: ArcPiece | SegmentPiece) -> float:
    """Distance from a point to a piece (m)."""
    x, y = point
    if isinstance(piece, ArcPiece):
        dx, dy = x - piece.centre[0], y - piece.centre[1]
        turn = (math.atan2(dy, dx) - piece.start_angle + 1e-9) % (2.0 * math.pi)
        inside = turn <= piece.span + 2e-9
        return abs(math.hypot(dx, dy) - piece.radius) if inside else math.inf
    (x1, y1), (x2, y2) = piece.p1, piece.p2
    length = math.hypot(x2 - x1, y2 - y1)
    ux, uy = (x2 - x1) / length, (y2 - y1) / length
    along = min(max((x - x1) * ux + (y - y1) * uy, 0.0), length)
    return math.hypot(x - x1 - along * ux, y - y1 - along * uy)
