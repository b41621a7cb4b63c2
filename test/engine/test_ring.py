# SPDX-License-Identifier: Apache-2.0
"""Friction of a base that is a ring, against quadrature over its points."""

import math
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from worlds import callable_part

from conveyor_sim.engine.arrays.bodies import Bottles
from conveyor_sim.engine.arrays.lists import BottleList
from conveyor_sim.engine.arrays.support import Belts, Ring, Sectors, Surface
from conveyor_sim.engine.arrays.world import EngineSettings, World
from conveyor_sim.engine.compiler.compile import kernel
from conveyor_sim.engine.support.ring import POINTS, straddling_ring
from conveyor_sim.engine.support.ring import ring_means as ring_means_part
from conveyor_sim.engine.support.ring import ring_share as ring_share_part

ring_means = callable_part(ring_means_part)
ring_share = callable_part(ring_share_part)

LIMIT = 0.01
FINE = 1 << 16
"""Points of the reference. Its mean over a smooth periodic function is exact to rounding, about 1e-11 of the sums."""

RADIUS, WEIGHT, MU = 0.03, 2.0, 0.4
STRAIGHT = {"x": 0.0, "y": 0.0, "ax": 1.0, "ay": 0.0, "length": 2.0, "width": 1.0}


@kernel
def straddled(world: Any, vx: float, vy: float, omega: float, lag: float) -> Any:
    return straddling_ring(0, world, vx, vy, omega, lag, None)


def shares(slide: float, spin: float) -> tuple[float, float]:
    """Return F/(mu m g s_v) and M/(mu m g R_b s_w), s/m."""
    means = ring_means(slide, spin, LIMIT)
    return ring_share(slide, spin, *means), ring_share(spin, slide, *means)


def mean_drag(slip_x: Any, slip_y: Any, angle: Any, friction: Any = 1.0) -> NDArray[np.float64]:
    """Return the mean force, x and y, and moment over the arm, of slipping points, over mu m g."""
    pull = friction / np.sqrt(slip_x**2 + slip_y**2 + 0.25 * LIMIT**2)
    x, y = -pull * slip_x, -pull * slip_y
    return np.array([x.mean(), y.mean(), (np.cos(angle) * y - np.sin(angle) * x).mean()])


def angles(count: int = FINE) -> NDArray[np.float64]:
    return np.asarray(2.0 * np.pi * (np.arange(count) + 0.5) / count)


SPEEDS = [1e-7, 1e-4, 0.005, 0.01, 0.3, 0.2999, 3.0]


@pytest.mark.parametrize("slide", SPEEDS)
def test_it_is_the_mean_over_the_ring(slide: float) -> None:
    """Force and moment by the arithmetic-geometric mean, with one speed small, both equal, and nearly equal."""
    angle = angles()
    for spin in SPEEDS:
        force, _, moment = mean_drag(slide - spin * np.sin(angle), spin * np.cos(angle), angle)
        by_slide, by_spin = shares(slide, spin)
        # Rounding of the reference, 1e-16 per term with terms up to 1, relative to means down to 1e-8.
        assert slide * by_slide == pytest.approx(-force, rel=1e-11, abs=1e-16)
        assert spin * by_spin == pytest.approx(-moment, rel=1e-11, abs=1e-16)


def test_alone_each_is_the_smoothed_point() -> None:
    """s/sqrt(s^2 + eps^2), eps = v_lim/2, of a ring that only slides or only spins."""
    for speed in (1e-9, 0.004, 0.2, 10.0):
        alone = 1.0 / math.hypot(speed, 0.5 * LIMIT)
        assert shares(speed, 0.0)[0] == pytest.approx(alone, rel=1e-14)
        assert shares(0.0, speed)[1] == pytest.approx(alone, rel=1e-14)


def test_at_rest_it_has_the_slope_of_the_point() -> None:
    """The slope is 2/v_lim for both; sliding slowly while spinning fast meets half the resistance of the spin."""
    assert shares(0.0, 0.0) == (pytest.approx(2.0 / LIMIT), pytest.approx(2.0 / LIMIT))
    spinning = 50.0
    for slide in (0.0, 1e-200, 1e-12, 1e-7):
        assert shares(slide, spinning)[0] == pytest.approx(0.5 / spinning, rel=1e-7)
        assert shares(slide, spinning)[1] == pytest.approx(1.0 / spinning, rel=1e-7)


def test_force_and_moment_are_one_function() -> None:
    """They are exchanged with slide and spin."""
    for slide, spin in ((0.2, 0.03), (1e-5, 0.4), (0.02, 0.02)):
        assert shares(slide, spin) == shares(spin, slide)[::-1]


def test_what_is_not_a_number_stays_visible() -> None:
    """NaN stays NaN."""
    assert np.isnan(shares(math.nan, 0.1)).all()
    assert np.isnan(shares(0.1, math.nan)).all()


def table(*belts: dict[str, float], certain: int = -1) -> Belts:
    """Return straight belts as candidates of bottle 0, the last listed first."""
    columns = {name: np.array([belt[name] for belt in belts]) for name in STRAIGHT}
    order = np.arange(len(belts), dtype=np.uint32)[::-1].copy()
    listed = BottleList(np.zeros(1, np.uint32), np.array([0, 1], np.uint32))
    start = np.array([0, len(belts)], np.uint32)
    sectors: Sectors | None = None
    return Belts(**columns, sectors=sectors, certain=np.array([certain], np.int32), start=start, candidate=order,
                 uncertain=listed)  # fmt: skip


def field(speeds: list[float], friction: list[float], turn: Any = None) -> Surface:
    """Return surfaces that move along x, with the floor last."""
    ux = np.array([*speeds, 0.0])
    return Surface(ux, np.zeros(len(ux)), turn, np.array([*friction, 0.1])[:, None].copy())


def drag(
    belts: Belts, surface: Surface, x: float, y: float, vx: float, vy: float, omega: float, lag: float = 0.0
) -> NDArray[np.float64]:
    """Return force over mu m g, and moment over mu m g R_b; lag: s by which velocities are older than positions."""
    absent: Any = dict.fromkeys(World._fields)
    settings = EngineSettings(**{**dict.fromkeys(EngineSettings._fields), "slip_limit": LIMIT})  # type: ignore[arg-type]
    columns: Any = dict.fromkeys(Bottles._fields)
    columns |= {"x": np.array([x]), "y": np.array([y]), "weight": np.array([WEIGHT]), "type": np.zeros(1, np.uint32)}
    absent |= {"settings": settings, "bottles": Bottles(**columns), "belts": belts, "surface": surface}
    world = World(**absent | {"ring": Ring(np.array([RADIUS]))})
    force = straddled(world, vx, vy, omega, lag)
    return np.array(force) / (MU * WEIGHT) / [1.0, 1.0, RADIUS]


def test_on_one_belt_it_is_the_closed_form() -> None:
    """With all points on one belt, the quadrature of 32 points is accurate to 2 % of mu m g, 0.12 % rms."""
    surface, belts = field([0.3], [MU]), table(STRAIGHT)
    generator = np.random.default_rng(5)
    errors = []
    for vx, vy, spin in generator.normal(0.0, [0.3, 0.2, 0.3], (300, 3)):
        slide = math.hypot(vx - 0.3, vy)
        by_slide, by_spin = shares(slide, abs(spin))
        expected = [-by_slide * (vx - 0.3), -by_slide * vy, -by_spin * spin]
        errors.append(drag(belts, surface, 1.0, 0.5, vx, vy, spin / RADIUS) - expected)
    assert np.abs(errors).max() < 0.02
    assert np.sqrt(np.mean(np.square(errors))) < 0.003


def test_without_spin_a_ring_on_one_belt_is_exact() -> None:
    """Every point slips alike, for any number of points."""
    result = drag(table(STRAIGHT), field([0.3], [MU]), 1.0, 0.5, 0.1, 0.0, 0.0)
    assert result == pytest.approx([0.2 / math.hypot(0.2, 0.5 * LIMIT), 0.0, 0.0], abs=1e-14)


BESIDE = [{**STRAIGHT, "y": 0.0}, {**STRAIGHT, "y": 1.0}]


def test_two_belts_side_by_side() -> None:
    """Each point has its own belt's speed and coefficient; the edge between points is accurate to 2.5 %, 0.2 % rms."""
    speeds, friction = [0.4, -0.1], [MU, 0.5 * MU]
    surface, belts = field(speeds, friction), table(*BESIDE)
    generator = np.random.default_rng(6)
    angle, errors = angles(), []
    for offset, vx, vy, spin in generator.uniform([-1.0, -0.5, -0.3, -0.5], [1.0, 0.5, 0.3, 0.5], (200, 4)):
        upper = offset + np.sin(angle) >= 0.0
        slip_x = vx - spin * np.sin(angle) - np.where(upper, speeds[1], speeds[0])
        expected = mean_drag(slip_x, vy + spin * np.cos(angle), angle, np.where(upper, 0.5, 1.0))
        errors.append(drag(belts, surface, 1.0, 1.0 + offset * RADIUS, vx, vy, spin / RADIUS) - expected)
    assert np.abs(errors).max() < 0.025
    assert np.sqrt(np.mean(np.square(errors))) < 0.004


def test_opposite_belts_spin_a_ring_that_stands_across() -> None:
    """Halves are dragged in opposite directions: no force and M = (2/pi) mu m g R_b at rest, clockwise here."""
    result = drag(table(*BESIDE), field([-0.5, 0.5], [MU, MU]), 1.0, 1.0, 0.0, 0.0, 0.0)
    assert result == pytest.approx([0.0, 0.0, -2.0 / math.pi], abs=0.01)


def test_over_the_edge_it_stands_on_the_floor_as_well() -> None:
    """Half on a running belt, half on a floor at rest with another friction coefficient."""
    surface, belts = field([0.5], [MU]), table(STRAIGHT)
    result = drag(belts, surface, 1.0, 0.0, 0.0, 0.0, 0.0)
    assert result[:2] == pytest.approx([0.5, 0.0], abs=0.01)
    moving = drag(belts, surface, 1.0, 0.0, 0.25, 0.0, 0.0)
    assert moving[0] == pytest.approx(0.5 - 0.5 * 0.1 / MU, abs=0.01)


def test_the_force_hardly_jumps_as_the_ring_passes_an_edge() -> None:
    """In steps of 1/500 of the radius over two belts, far below the 1/32 of a point that changes sides at once."""
    surface, belts = field([-0.5, 0.5], [MU, MU]), table(*BESIDE)
    force = [drag(belts, surface, 1.0, 1.0 + y * RADIUS, 0.0, 0.0, 0.0)[0] for y in np.linspace(-0.9, 0.9, 901)]
    assert np.abs(np.diff(force)).max() < 0.3 * 2.0 / POINTS


def test_a_certain_belt_is_not_searched_for() -> None:
    """`certain` has precedence over the candidates, as for a point."""
    surface = field([0.5, -0.5], [MU, MU])
    result = drag(table(*BESIDE, certain=0), surface, 1.0, 1.5, 0.0, 0.0, 0.0)
    assert result[0] > 0.9


def test_on_a_belt_that_turns_a_ring_turns_with_it() -> None:
    """In a rotation about the origin a ring that moves along has no friction, and one at rest is turned."""
    belts, turn = table(STRAIGHT), np.array([2.0, 0.0])
    surface = field([0.0], [MU], turn)
    with_it = drag(belts, surface, 1.0, 0.5, -2.0 * 0.5, 2.0 * 1.0, 2.0)
    assert with_it == pytest.approx([0.0, 0.0, 0.0], abs=1e-12)
    assert drag(belts, surface, 1.0, 0.5, -2.0 * 0.5, 2.0 * 1.0, 0.0)[2] > 0.5
    # It has moved on for 10 ms since its velocity was that of the belt.
    moved = drag(belts, surface, 1.0 - 0.01, 0.5 + 0.02, -2.0 * 0.5, 2.0 * 1.0, 2.0, lag=0.01)
    assert moved == pytest.approx([0.0, 0.0, 0.0], abs=1e-12)
