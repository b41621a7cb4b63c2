"""Expected impacts of a scene, with the contribution of each effect to the error in their peak force."""

from collections.abc import Sequence
from functools import partial

from conveyor_sim.physics.effects.declaration import Effect
from conveyor_sim.physics.effects.terms import Meeting, Terms, deepest, duration, meetings, overlap_at
from conveyor_sim.physics.timestep.bounds import Bound
from conveyor_sim.physics.timestep.prediction import Impact


def impacts(terms: Terms, effects: Sequence[Effect]) -> tuple[Impact, ...]:
    """Return one impact per pair of bottle types that can touch, and per bottle type and rail material."""
    adding = [effect.shares for effect in effects if effect.shares is not None and effect.name in terms.on]
    speed = terms.plant.impact_speed
    return tuple(
        Impact(
            what=meeting.what,
            at=_at(meeting, terms, speed),
            duration=duration(meeting, terms, speed),
            shares=tuple(share for shares in adding for share in shares(meeting, terms)),
            left=terms.method.own_error * terms.step_error / speed,
            force=deepest(meeting, terms, speed)[1],
            diameter=2.0 * min(kind.radius for kind in (meeting.first, meeting.second) if kind is not None),
            overlap=partial(overlap_at, meeting, terms),
        )
        for meeting in meetings(terms)
    )


def impact_bounds(expected: Sequence[Impact], tolerance: float) -> list[Bound]:
    """Return the tightest bound of impacts between bottles, and that of impacts on rails."""
    tightest: dict[str, Bound] = {}
    for impact in expected:
        bound = impact.bound(tolerance)
        if impact.what not in tightest or bound.dt < tightest[impact.what].dt:
            tightest[impact.what] = bound
    return list(tightest.values())


def _at(meeting: Meeting, terms: Terms, speed: float) -> str:
    law, k = meeting.elastic
    return f"{law.coefficient_text(k, terms.laws.curves)} {speed:g} m/s"
