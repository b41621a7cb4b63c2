"""Effects of contact: that bottles touch bottles, and the elastic laws."""

from collections.abc import Callable, Collection, Iterator

from conveyor_sim.effects.declaration import Cause, Effect
from conveyor_sim.effects.terms import (
    Terms,
    deepest,
    impact_speed,
    meetings,
    most_bottles,
    queue_force,
    table_of,
    tightest,
)
from conveyor_sim.scene.contacts import Contact
from conveyor_sim.scene.geometry import rail_shapes
from conveyor_sim.scene.schema import Scene
from conveyor_sim.timestep import STEPS_PER_CONTACT, Bound, contact_bound, hertz_contact_time, lattice_bound


def contacts_in_use(scene: Scene, on: Collection[str]) -> Iterator[tuple[int, Contact]]:
    """The contacts between materials that can meet here: bottles if there are several, bottles and rails."""
    bottles = {kind.material for kind in scene.bottle_types.values()}
    with_rails = "segment_rails" in on or "arc_rails" in on
    rails = {rail.material for rail in rail_shapes(scene)} if with_rails else set()
    for index, contact in enumerate(scene.contacts):
        a, b = contact.between
        of_bottles = {a, b} <= bottles and "bottle_contact" in on
        if of_bottles or (a in bottles and b in rails) or (b in bottles and a in rails):
            yield index, contact


def _pairs(scene: Scene, on: Collection[str]) -> Cause | None:
    for name, infeed in scene.infeeds.items():
        if infeed.count is None:
            return Cause(("infeeds", name), "without end")
    most = most_bottles(scene) or 0
    return Cause(("bottles" if scene.bottles else "infeeds",), f"{most} bottles in all") if most > 1 else None


def _elastic(field: str, unit: str) -> Callable[[Scene, Collection[str]], Cause | None]:
    def called_for(scene: Scene, on: Collection[str]) -> Cause | None:
        for index, contact in contacts_in_use(scene, on):
            value = getattr(contact, field)
            if value is not None:
                what = f"{len(value)} points" if isinstance(value, tuple) else f"{value:g} {unit}"
                return Cause(("contacts", index, field), what)
        return None

    return called_for


def _linear_bounds(terms: Terms) -> list[Bound]:
    contacts, lattices = [], []
    for meeting in meetings(terms):
        k, reduced = meeting.value(meeting.law.stiffness), meeting.reduced_mass
        if k > 0.0:
            reason = f"{STEPS_PER_CONTACT} steps a contact of {meeting.what} at k = {k:g} N/m"
            contacts.append((contact_bound(k, reduced), reason))
            if meeting.second is not None:
                lattices.append((lattice_bound(k, 2.0 * reduced), f"a hexagonal packing at k = {k:g} N/m"))
    return [*tightest("contact time", contacts), *tightest("lattice stability", lattices)]


def _hertz_bounds(terms: Terms) -> list[Bound]:
    """A contact is the shorter the faster the impact; a packing is the stiffer the harder it is pressed."""
    speed, force = impact_speed(terms.scene), queue_force(terms)
    contacts, lattices = [], []
    for meeting in meetings(terms):
        k, reduced = meeting.value(meeting.law.hertz), meeting.reduced_mass
        if k > 0.0:
            time = hertz_contact_time(k, reduced, speed) / STEPS_PER_CONTACT
            at = f"at k = {k:g} N/m^1.5 and {speed:g} m/s"
            contacts.append((time, f"{STEPS_PER_CONTACT} steps a Hertz contact of {meeting.what} {at}"))
            if meeting.second is not None:
                overlap = max(deepest(meeting, terms, speed)[0], (force / k) ** (2.0 / 3.0))
                tangent = 1.5 * k * overlap**0.5
                lattices.append(
                    (lattice_bound(tangent, 2.0 * reduced), f"a hexagonal packing at dN/d delta = {tangent:.3g} N/m")
                )
    return [*tightest("Hertz contact time", contacts), *tightest("Hertz lattice stability", lattices)]


def _table_bounds(terms: Terms) -> list[Bound]:
    contacts, lattices = [], []
    for meeting in meetings(terms):
        points = table_of(meeting, terms)
        if points is not None:
            overlap, force = points
            k = float(((force[1:] - force[:-1]) / (overlap[1:] - overlap[:-1])).max())
            reason = f"{STEPS_PER_CONTACT} steps a contact of {meeting.what} at the table's steepest, {k:.3g} N/m"
            contacts.append((contact_bound(k, meeting.reduced_mass), reason))
            if meeting.second is not None:
                bound = lattice_bound(k, 2.0 * meeting.reduced_mass)
                lattices.append((bound, f"a hexagonal packing at the table's steepest, {k:.3g} N/m"))
    return [*tightest("table contact time", contacts), *tightest("table lattice stability", lattices)]


BOTTLE_CONTACT = Effect(
    name="bottle_contact",
    law="contact between bottles",
    source="(22)-(23)",
    called_for=_pairs,
    absent="a single bottle",
    needs="a list of the pairs that are near, with coefficients and forces by pair; a contact for each pair of "
    "materials",
)
LINEAR = Effect(
    name="linear",
    law="N = k delta",
    source="(22)-(23)",
    called_for=_elastic("stiffness", "N/m"),
    absent="no contact with stiffness",
    needs="k by pair of materials",
    bounds=_linear_bounds,
    bound="20 steps a contact, pi sqrt(m_r / k) long; 2 / sqrt(6 k / m), at which a hexagonal packing is unstable",
    can_force_off=False,
)
HERTZ = Effect(
    name="hertz",
    law="N = k delta^1.5",
    source="Hertz 1882, allowed for at (23)",
    called_for=_elastic("hertz_stiffness", "N/m^1.5"),
    absent="no contact with hertz_stiffness",
    needs="k by pair of materials",
    bounds=_hertz_bounds,
    bound="20 steps a contact, 3.218 (m_r^2 / (k^2 v))^(1/5) long, v the fastest of belts, infeeds and bottles "
    "at the start, 1 m/s if all rest; that of a hexagonal packing at the tangent stiffness, pressed by an "
    "impact at v or by a queue",
    can_force_off=False,
)
TABLE = Effect(
    name="table",
    law="N from points (delta, N), straight between them and on beyond the last",
    source="allowed for at (23)",
    called_for=_elastic("table", ""),
    absent="no contact with table",
    needs="points by pair of materials",
    bounds=_table_bounds,
    bound="those of linear, at the steepest slope of the table",
    can_force_off=False,
)
