"""Elastic law, damping law and damping coefficient of a contact of a scene."""

from collections.abc import Mapping

from conveyor_sim.engine.contact.laws import DAMPING, ELASTIC, DampingLaw, ElasticLaw
from conveyor_sim.scene.contacts import Contact

DAMPING_BY_NAME: Mapping[str, DampingLaw] = {law.name: law for law in DAMPING}


def elastic_law(contact: Contact) -> ElasticLaw:
    """Return the elastic law whose field the scene sets."""
    return next(law for law in ELASTIC if getattr(contact, law.field) is not None)


def damping_law(contact: Contact) -> DampingLaw | None:
    """Return the damping law; None if none is chosen, the coefficient is 0, or the restitution is 1."""
    damping = contact.damping
    if damping.restitution == 1.0 or (damping.restitution is None and damping.coefficient == 0.0):
        return None
    elastic, by_restitution = elastic_law(contact).name, damping.restitution is not None
    chosen = (law for law in DAMPING if law.chosen_as == damping.law and law.applies(elastic, by_restitution))
    return next(chosen, None)


def damping_coefficient(contact: Contact, law: DampingLaw, reduced_mass: float) -> float:
    """Return the coefficient in the unit of its law: as given, or from the restitution. reduced_mass: kg."""
    damping = contact.damping
    if damping.restitution is None:
        return damping.coefficient
    value = getattr(contact, elastic_law(contact).field)
    stiffness = 0.0 if isinstance(value, tuple) else value
    return law.coefficient(damping.restitution, damping.speed or 1.0, stiffness, reduced_mass)
