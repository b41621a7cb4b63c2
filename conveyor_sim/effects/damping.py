"""Effects of damping in contacts."""

from collections.abc import Callable, Collection

from conveyor_sim.effects.contacts import contacts_in_use
from conveyor_sim.effects.declaration import Cause, Effect
from conveyor_sim.effects.terms import Meeting, Terms, deepest, drag_bound, frequency, impact_speed, meetings, tightest
from conveyor_sim.laws.coefficients import damping_effect
from conveyor_sim.scene.schema import Scene
from conveyor_sim.timestep.bounds import Bound, damping_bound
from conveyor_sim.timestep.methods import Share


def _called_for(effect: str, unit: str) -> Callable[[Scene, Collection[str]], Cause | None]:
    def called_for(scene: Scene, on: Collection[str]) -> Cause | None:
        for index, contact in contacts_in_use(scene, on):
            if damping_effect(contact) == effect:
                damping = contact.damping
                if damping.restitution is None:
                    return Cause(("contacts", index, "damping"), f"{damping.coefficient:g} {unit}")
                return Cause(("contacts", index, "damping", "restitution"), f"{damping.restitution:g}")
        return None

    return called_for


def _bounds(name: str, dashpot: Callable[[Meeting, Terms], tuple[float, str]]) -> Callable[[Terms], list[Bound]]:
    """Bounds from a function that gives a meeting's dashpot, in kg/s, and how it is said."""

    def bounds(terms: Terms) -> list[Bound]:
        if not terms.method.explicit:
            return []
        found = [(*dashpot(meeting, terms), meeting.reduced_mass) for meeting in meetings(terms)]
        return tightest(
            name, [drag_bound(terms, damping_bound(c, reduced), said) for c, said, reduced in found if c > 0.0], True
        )

    return bounds


def _jumping(dashpot: Callable[[Meeting, Terms], tuple[float, str]]) -> Callable[[Meeting, Terms], list[Share]]:
    """The share of a dashpot that sets in with a jump."""

    def shares(meeting: Meeting, terms: Terms) -> list[Share]:
        c = dashpot(meeting, terms)[0]
        if c == 0.0:
            return []
        # How fast the force falls behind its jump is known where the spring is linear from there on.
        return terms.method.first_touch(c / meeting.reduced_mass, meeting.value(meeting.law.stiffness) / c)

    return shares


def _growing(
    name: str, dashpot: Callable[[Meeting, Terms], tuple[float, str]], exponent: float
) -> Callable[[Meeting, Terms], list[Share]]:
    """The share of a dashpot that grows from 0 as the overlap to an exponent."""

    def shares(meeting: Meeting, terms: Terms) -> list[Share]:
        c, method = dashpot(meeting, terms)[0], terms.method
        if c == 0.0:
            return []
        coefficient = method.onset if exponent == 1.0 else method.tsuji
        w = frequency(meeting, terms, impact_speed(terms.scene))
        return [method.growing(name, coefficient, exponent, c / meeting.reduced_mass, w)]

    return shares


def _paper(meeting: Meeting, terms: Terms) -> tuple[float, str]:
    c = meeting.value(meeting.law.damping_paper)
    return c, f"m_r / (2 c) at c = {c:g} kg/s"


def _normal(meeting: Meeting, terms: Terms) -> tuple[float, str]:
    c = meeting.value(meeting.law.damping_normal)
    return c, f"m_r / (2 c) at c = {c:g} kg/s"


def _tsuji(meeting: Meeting, terms: Terms) -> tuple[float, str]:
    speed = impact_speed(terms.scene)
    c = meeting.value(meeting.law.damping_tsuji) * deepest(meeting, terms, speed)[0] ** 0.25
    return c, f"m_r / (2 c delta^0.25), {c:.3g} kg/s at the deepest of an impact at {speed:g} m/s"


def _onset(meeting: Meeting, terms: Terms) -> tuple[float, str]:
    speed = impact_speed(terms.scene)
    c = meeting.value(meeting.law.damping_onset) * deepest(meeting, terms, speed)[1]
    return c, f"m_r / (2 lambda N), {c:.3g} kg/s at the deepest of an impact at {speed:g} m/s"


PAPER_DAMPING = Effect(
    name="paper_damping",
    law="-c v*, v* the relative velocity of the contact points, in all directions",
    source="(22)",
    called_for=_called_for("paper_damping", "kg/s"),
    absent="no contact with damping law paper",
    needs="c by pair of materials",
    bounds=_bounds("paper damping", _paper),
    bound="m_r / (2 c)",
    shares=_jumping(_paper),
    share="c dt / m_r, or k dt / c if that is less: a jump at first touch that is met late",
)
NORMAL_DAMPING = Effect(
    name="normal_damping",
    law="N = max(0, N_elastic + c v_n)",
    source="added",
    called_for=_called_for("normal_damping", "kg/s"),
    absent="no contact with damping law normal",
    needs="c by pair of materials",
    bounds=_bounds("normal damping", _normal),
    bound="m_r / (2 c)",
    shares=_jumping(_normal),
    share="c dt / m_r, or k dt / c if that is less: a jump at first touch that is met late",
)
TSUJI_DAMPING = Effect(
    name="tsuji_damping",
    law="N = max(0, k delta^1.5 + c delta^0.25 v_n), of the same restitution at any speed",
    source="Tsuji, Tanaka and Ishida 1992",
    called_for=_called_for("tsuji_damping", ""),
    absent="no contact with hertz_stiffness and the restitution of law normal",
    needs="c by pair of materials, from the restitution",
    bounds=_bounds("Tsuji damping", _tsuji),
    bound="m_r / (2 c delta^0.25), delta the deepest of an impact at v (as for hertz)",
    shares=_growing("dashpot", _tsuji, 0.25),
    share="c delta^0.25 dt / m_r, times (w dt)^0.25 with a method of second order",
)
ONSET_DAMPING = Effect(
    name="onset_damping",
    law="N = max(0, N_elastic (1 + lambda v_n)), which sets in at zero",
    source="Hunt and Crossley 1975",
    called_for=_called_for("onset_damping", "s/m"),
    absent="no contact with damping law onset",
    needs="lambda by pair of materials",
    bounds=_bounds("onset damping", _onset),
    bound="m_r / (2 lambda N), N the largest of an impact at v (as for hertz)",
    shares=_growing("dashpot", _onset, 1.0),
    share="lambda N dt / m_r, times w dt with a method of second order",
)
