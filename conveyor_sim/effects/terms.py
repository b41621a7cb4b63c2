"""What bounds on the time step and predicted errors are computed from, and what those of several effects share."""

import math
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from conveyor_sim.engine.arrays.contacts import ContactLaw
from conveyor_sim.engine.arrays.types import F8
from conveyor_sim.laws.coefficients import Laws
from conveyor_sim.scene.geometry import initial_bottles
from conveyor_sim.scene.moving import moving_shapes
from conveyor_sim.scene.schema import BottleType, Scene, Single
from conveyor_sim.timestep.bounds import Bound, contact_time, hertz_contact_time, least_steps
from conveyor_sim.timestep.methods import METHODS, STEP_ERROR, Method

SPEED_AT_REST = 1.0
"""m/s, assumed of impacts where nothing in a scene moves at first."""


@dataclass(frozen=True, eq=False)
class Terms:
    """A scene, its coefficients, which effects are on, and how exact it shall be."""

    scene: Scene
    laws: Laws
    on: Collection[str]
    tolerance: float
    """Relative error in contact force to stay below."""

    @property
    def types(self) -> list[BottleType]:
        """The bottle types, T of them, in the scene's order."""
        return list(self.scene.bottle_types.values())

    @property
    def method(self) -> Method:
        """What the integrator misses."""
        return METHODS[self.scene.accuracy.integrator]

    @property
    def step_error(self) -> float:
        """m/s, largest error of a step, of an integrator that divides its steps itself."""
        given = self.scene.accuracy.error
        return STEP_ERROR if given is None else given

    @property
    def steps(self) -> float:
        """Steps that what is sampled should last at least."""
        return least_steps(self.tolerance)


@dataclass(frozen=True)
class Meeting:
    """One entry of a ContactLaw: two bottle types, or a type and a rail material, and their coefficients."""

    what: str
    """`two bottles`, or `a bottle and a rail`."""
    law: ContactLaw
    entry: int
    reduced_mass: float
    """kg"""
    first: BottleType
    second: BottleType | None
    """None: a rail."""

    def value(self, column: F8 | None) -> float:
        """The coefficient of this meeting, 0 if it has none."""
        return 0.0 if column is None else float(column[self.entry])

    @property
    def has_spring(self) -> bool:
        """Whether friction is by a tangential spring in place of the curve."""
        return self.value(self.law.tangential_stiffness) + self.value(self.law.tangential_mindlin) > 0.0


def meetings(terms: Terms) -> Iterator[Meeting]:
    """Every pair of types that can touch, then every type and rail material; types that no bottle has are left out."""
    types = terms.types
    present = [index for index, name in enumerate(terms.scene.bottle_types) if name in supply(terms.scene)]
    if terms.laws.pair is not None:
        for a in present:
            for b in present:
                one, other = types[a], types[b]
                reduced = one.mass * other.mass / (one.mass + other.mass)
                yield Meeting("two bottles", terms.laws.pair, a * len(types) + b, reduced, one, other)
    if terms.laws.rail is not None:
        columns = [column for column in terms.laws.rail if column is not None]
        materials = columns[0].size // len(types) if columns else 0
        for a in present:
            one = types[a]
            for material in range(materials):
                entry = a * materials + material
                yield Meeting("a bottle and a rail", terms.laws.rail, entry, one.mass, one, None)


def tightest(name: str, candidates: Sequence[tuple[float, str]], stability: bool = False) -> list[Bound]:
    """The least of some bounds (s, reason) as a list; empty if there are none."""
    if not candidates:
        return []
    dt, reason = min(candidates)
    return [Bound(name, dt, reason, stability)]


def drag_bound(terms: Terms, dt: float, reason: str) -> tuple[float, str]:
    """Semi-implicit Euler's bound (s) on a drag, a dashpot or friction at rest, as the scene's integrator has it."""
    limit = terms.method.drag_limit
    return limit * dt, reason if limit == 1.0 else f"{limit:g} times {reason}"


def supply(scene: Scene) -> dict[str, float]:
    """How many bottles of each type a run can hold at most, by name; infinite from an infeed without end.

    Types that no bottle has are not in it.
    """
    found: dict[str, float] = {}
    for name, *_ in initial_bottles(scene):
        found[name] = found.get(name, 0.0) + 1.0
    for _, entry in scene.entries():
        found[entry.bottle] = found.get(entry.bottle, 0.0) + (math.inf if entry.most is None else entry.most)
    return found


def most_bottles(scene: Scene) -> int | None:
    """Bottles that a run can hold at most, None if an infeed has no end."""
    most = sum(supply(scene).values())
    return int(most) if math.isfinite(most) else None


def impact_speed(scene: Scene) -> float:
    """The speed of the hardest impact expected, m/s; SPEED_AT_REST if all rest.

    The fastest belt or bottle that enters against something at rest, or the most by which bottles differ at the start;
    and a rail that comes against that.
    """
    speeds = [abs(belt.speed) for belt in scene.belts.values()]
    speeds += [entry.heading[1] for _, entry in scene.entries()]
    given = np.array([(0.0, 0.0), *(entry.velocity for entry in scene.bottles if isinstance(entry, Single))])
    speeds.append(math.hypot(*np.ptp(given, axis=0)))
    rails = [shape.max_speed * shape.fastest_point for shape in moving_shapes(scene)]
    return max(speeds) + max(rails, default=0.0) or SPEED_AT_REST


def deepest(meeting: Meeting, terms: Terms, speed: float) -> tuple[float, float]:
    """Overlap (m) and force (N) at the turning point of an undamped head-on impact at a speed in m/s."""
    energy = 0.5 * meeting.reduced_mass * speed * speed
    law = meeting.law
    if (k := meeting.value(law.stiffness)) > 0.0:
        overlap = math.sqrt(2.0 * energy / k)
        return overlap, k * overlap
    if (k := meeting.value(law.hertz)) > 0.0:
        overlap = (2.5 * energy / k) ** 0.4
        return overlap, k * overlap**1.5
    points = table_of(meeting, terms)
    return _deepest_in_table(points[0], points[1], energy) if points is not None else (0.0, 0.0)


def overlap_at(meeting: Meeting, terms: Terms, force: float) -> float:
    """Overlap (m) at which the elastic law gives a force (N)."""
    law = meeting.law
    if (k := meeting.value(law.stiffness)) > 0.0:
        return force / k
    if (k := meeting.value(law.hertz)) > 0.0:
        return math.pow(force / k, 2.0 / 3.0)
    points = table_of(meeting, terms)
    if points is None:
        return 0.0
    overlap, known = points
    if force > known[-1]:
        slope = float((known[-1] - known[-2]) / (overlap[-1] - overlap[-2]))
        return float(overlap[-1]) + (force - float(known[-1])) / slope if slope > 0.0 else math.inf
    return float(np.interp(force, known, overlap))


def steepest(points: tuple[F8, F8]) -> float:
    """The largest slope of a table, N/m."""
    overlap, force = points
    return float(((force[1:] - force[:-1]) / (overlap[1:] - overlap[:-1])).max())


def duration(meeting: Meeting, terms: Terms, speed: float) -> float:
    """How long an undamped head-on impact at a speed in m/s lasts, s; on a table: at least."""
    law = meeting.law
    if (k := meeting.value(law.hertz)) > 0.0:
        return hertz_contact_time(k, meeting.reduced_mass, speed)
    points = table_of(meeting, terms)
    k = meeting.value(law.stiffness) if points is None else steepest(points)
    return contact_time(k, meeting.reduced_mass)


def frequency(meeting: Meeting, terms: Terms, speed: float) -> float:
    """sqrt(-N'' / N) at the peak of the force N of an undamped head-on impact at a speed in m/s, rad/s."""
    if (k := meeting.value(meeting.law.hertz)) > 0.0:
        return math.sqrt(1.5 * k * math.sqrt(deepest(meeting, terms, speed)[0]) / meeting.reduced_mass)
    return math.pi / duration(meeting, terms, speed)


def table_of(meeting: Meeting, terms: Terms) -> tuple[F8, F8] | None:
    """Overlaps (m) and forces (N) of a meeting's table; None if it has none."""
    curve, curves = meeting.law.curve, terms.laws.curves
    if curve is None or curves is None or curve[meeting.entry] < 0:
        return None
    index = int(curve[meeting.entry])
    points = slice(int(curves.start[index]), int(curves.start[index + 1]))
    return curves.overlap[points], curves.force[points]


def _deepest_in_table(overlap: F8, force: F8, energy: float) -> tuple[float, float]:
    steps = np.diff(overlap)
    stored = np.concatenate([[0.0], np.cumsum(0.5 * (force[1:] + force[:-1]) * steps)])
    piece = min(int(np.searchsorted(stored, energy, side="right")) - 1, len(steps) - 1)
    slope = float((force[piece + 1] - force[piece]) / steps[piece])
    left, start = energy - float(stored[piece]), float(force[piece])
    # start d + slope d^2 / 2 = left, in the form that does not divide by a slope of 0.
    deeper = 2.0 * left / (start + math.sqrt(start * start + 2.0 * slope * left))
    return float(overlap[piece]) + deeper, start + slope * deeper
