# SPDX-License-Identifier: Apache-2.0
"""Effects of contact between bottles, and the elastic laws."""

import math
from collections.abc import Callable, Collection, Iterator

from conveyor_sim.engine.contact.laws import hertz, linear, table
from conveyor_sim.physics.effects.declaration import Cause, Effect
from conveyor_sim.physics.effects.terms import (
    Meeting,
    Terms,
    deepest,
    frequency,
    meetings,
    overlap_at,
    tightest,
)
from conveyor_sim.physics.plant import Plant
from conveyor_sim.physics.timestep.bounds import Bound, lattice_bound, mover_bound, wedge_bound
from conveyor_sim.physics.timestep.methods import Share
from conveyor_sim.scene.bodies import BodyShape
from conveyor_sim.scene.contacts import Contact
from conveyor_sim.scene.geometry import ArcPiece, SegmentPiece


def contacts_in_use(plant: Plant, on: Collection[str]) -> Iterator[tuple[int, Contact]]:
    """Yield the contacts of materials that can meet: bottles if there are several, and bottles with rails."""
    bottles = {kind.material for kind in plant.scene.bottle_types.values()}
    with_rails = "segment_rails" in on or "arc_rails" in on
    rails = {rail.material for rail in plant.rails_at_rest} if with_rails else set()
    if "moving_rails" in on:
        rails |= {shape.material for shape in plant.moving}
    for index, contact in enumerate(plant.scene.contacts):
        a, b = contact.between
        of_bottles = {a, b} <= bottles and "bottle_contact" in on
        if of_bottles or (a in bottles and b in rails) or (b in bottles and a in rails):
            yield index, contact


def _pairs(plant: Plant, on: Collection[str]) -> Cause | None:
    for path, entry in plant.scene.entries():
        if entry.most is None:
            return Cause(path, "endless")
    most = plant.most_bottles or 0
    return Cause(("bottles" if plant.scene.bottles else "infeeds",), f"{most} bottles in all") if most > 1 else None


def _elastic(field: str, unit: str) -> Callable[[Plant, Collection[str]], Cause | None]:
    def called_for(plant: Plant, on: Collection[str]) -> Cause | None:
        for index, contact in contacts_in_use(plant, on):
            value = getattr(contact, field)
            if value is not None:
                what = f"{len(value)} points" if isinstance(value, tuple) else f"{value:g} {unit}"
                return Cause(("contacts", index, field), what)
        return None

    return called_for


def _stable(name: str, stiffness: Callable[[Meeting, Terms], tuple[float, str]]) -> Callable[[Terms], list[Bound]]:
    """Return stability bounds from a function that gives the largest stiffness (N/m, 0: none) and its description."""

    def bounds(terms: Terms) -> list[Bound]:
        if not terms.method.explicit:
            return []
        lattices, wedges, movers = [], [], []
        for meeting in meetings(terms):
            k, said = stiffness(meeting, terms)
            if k > 0.0 and meeting.second is not None:
                lattices.append((lattice_bound(k, 2.0 * meeting.reduced_mass), f"a hexagonal packing at {said}"))
            elif k > 0.0:
                wedges.append((wedge_bound(k, meeting.reduced_mass), f"a bottle between two rails at {said}"))
                movers += _mover_bounds(meeting, k, terms)
        return [
            *tightest(f"{name}lattice stability", lattices, stability=True),
            *tightest(f"{name}rail stability", wedges, stability=True),
            *tightest(f"{name}mover stability", movers, stability=True),
        ]

    return bounds


def _mover_bounds(meeting: Meeting, stiffness: float, terms: Terms) -> list[tuple[float, str]]:
    """Return a bound (s) and its reason for each axis with a limited drive and a body of the meeting's material.

    The bound assumes that bottles stop the axis: as many as fit along the pieces of its bodies. stiffness: N/m.
    """
    materials = terms.plant.rail_materials
    bounds: list[tuple[float, str]] = []
    if "moving_rails" not in terms.on:
        return bounds
    reaches = terms.plant.reach_of_axes.tolist()
    for index, (axis, reach) in enumerate(zip(terms.plant.axes, reaches, strict=True)):
        bodies = [shape for of, shape in zip(terms.plant.axis_of_body, terms.plant.moving, strict=True) if of == index]
        if axis.limit is None or materials[meeting.entry % len(materials)] not in {shape.material for shape in bodies}:
            continue
        most = sum(_most_touching(shape, meeting.first.radius) for shape in bodies)
        # A force at the end of an arm accelerates it like a mass of J / L^2.
        mass = axis.inertia / reach**2
        reason = f"{most} bottles that stop {axis.name}, a body of {mass:.3g} kg, at k = {stiffness:.3g} N/m"
        bounds.append((mover_bound(stiffness, meeting.reduced_mass, mass, most), reason))
    return bounds


def _most_touching(shape: BodyShape, radius: float) -> int:
    """Return the largest number of bottles of a radius (m) that can press on a body.

    They stand along both sides of a single piece, and along the outer side of several ones. A pocket holds one.
    """
    if len(shape.pieces) == 1 and isinstance(shape.pieces[0], SegmentPiece):
        return 2 * (1 + math.floor(shape.pieces[0].length / (2.0 * radius)))
    pockets = [isinstance(piece, ArcPiece) and piece.radius < 2.0 * radius for piece in shape.pieces]
    lengths = [0.0 if pocket else piece.length for pocket, piece in zip(pockets, shape.pieces, strict=True)]
    return sum(1 + math.floor(length / (2.0 * radius)) for length in lengths)


def _linear(meeting: Meeting, terms: Terms) -> tuple[float, str]:
    law, k = meeting.elastic
    return (k, f"k = {k:g} N/m") if law is linear.LINEAR else (0.0, "")


def _hertz(meeting: Meeting, terms: Terms) -> tuple[float, str]:
    """Return the stiffness at the largest overlap in impacts and queues; it grows with the load."""
    law, k = meeting.elastic
    if law is not hertz.HERTZ:
        return 0.0, ""
    pressed = overlap_at(meeting, terms, terms.load.force)
    tangent = law.stiffest(k, max(deepest(meeting, terms, terms.plant.impact_speed)[0], pressed), None)
    return tangent, f"dN/d delta = {tangent:.3g} N/m"


def _table(meeting: Meeting, terms: Terms) -> tuple[float, str]:
    law, c = meeting.elastic
    if law is not table.TABLE:
        return 0.0, ""
    steepest = law.stiffest(c, 0.0, terms.laws.curves)
    return steepest, f"the table's steepest, {steepest:.3g} N/m"


def _peak(stiffness: Callable[[Meeting, Terms], tuple[float, str]]) -> Callable[[Meeting, Terms], list[Share]]:
    """Return a function for the error of an elastic law in an impact: the peak falls between two steps."""

    def shares(meeting: Meeting, terms: Terms) -> list[Share]:
        if stiffness(meeting, terms)[0] == 0.0:
            return []
        return [terms.method.between_steps(frequency(meeting, terms, terms.plant.impact_speed))]

    return shares


BOTTLE_CONTACT = Effect(
    name="bottle_contact",
    law="contact between bottles",
    source="(22)-(23)",
    called_for=_pairs,
    absent="the scene has a single bottle",
    needs="a list of near pairs, with coefficients and forces of each; in the scene, a contact for each pair of "
    "materials",
)
LINEAR = Effect(
    name="linear",
    law="N = k delta",
    source="(22)-(23)",
    called_for=_elastic("stiffness", "N/m"),
    absent="no contact with stiffness",
    needs="k by pair of materials",
    bounds=_stable("", _linear),
    bound="1 / sqrt(6 k / m), half of the stability limit of a hexagonal packing; 1 / sqrt(2 k / m), half of the "
    "stability limit of a bottle between two rails; 1 / sqrt(k (2 / m + n / M)) for n bottles at a moving rail of "
    "mass M",
    shares=_peak(_linear),
    share="(w dt)^2 / 8, with w = sqrt(k / m_r), because the peak falls between two steps",
    can_force_off=False,
)
HERTZ = Effect(
    name="hertz",
    law="N = k delta^1.5",
    source="Hertz 1882, allowed for at (23)",
    called_for=_elastic("hertz_stiffness", "N/m^1.5"),
    absent="no contact with hertz_stiffness",
    needs="k by pair of materials",
    bounds=_stable("Hertz ", _hertz),
    bound="those of linear, with k the tangent stiffness at the larger of two overlaps: in an impact at v, and under "
    "the load N of contact_friction. v is the speed of the fastest belt or infeed, or the largest difference of "
    "initial velocities, plus the speed of the fastest moving rail; 1 m/s if everything rests",
    shares=_peak(_hertz),
    share="(w dt)^2 / 8, with w = sqrt(1.5 k delta^0.5 / m_r) at the largest overlap of an impact at v, because the "
    "peak falls between two steps",
    can_force_off=False,
)
TABLE = Effect(
    name="table",
    law="N from points (delta, N), linear between them, with the last slope continued",
    source="allowed for at (23)",
    called_for=_elastic("table", ""),
    absent="no contact with table",
    needs="points by pair of materials",
    bounds=_stable("table ", _table),
    bound="those of linear, at the steepest slope of the table",
    shares=_peak(_table),
    share="that of linear, at the steepest slope of the table",
    can_force_off=False,
)
