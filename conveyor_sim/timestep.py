"""What bounds the time step, and the choice of steps a tick. All bounds in s; references are to docs/paper.md."""

import math
from dataclasses import dataclass

STEPS_PER_CONTACT = 20
"""Steps that a contact should last: at most 0.1 % error in the rebound."""

STEPS_PER_SLIP = 20
"""Steps in v_lim / (mu g). Chatter starts at 1, but semi-implicit Euler loses one part in as many of a bottle's creep
on a turn-table (test/physics/test_turntable.py): here 5 %."""


HERTZ_TIME = 2.0 * math.sqrt(math.pi) * math.gamma(1.4) / math.gamma(0.9)
"""2.943, duration of a Hertz contact in units of the deepest overlap over the speed of impact."""


@dataclass(frozen=True)
class Bound:
    """One upper bound on the time step."""

    name: str
    dt: float
    """s"""
    reason: str


def contact_time(stiffness: float, reduced_mass: float) -> float:
    """Duration of an undamped linear contact, pi sqrt(m_r / k), in s. N/m, kg."""
    return math.pi * math.sqrt(reduced_mass / stiffness)


def hertz_contact_time(stiffness: float, reduced_mass: float, speed: float) -> float:
    """Duration of an undamped Hertz contact N = k delta^1.5, 3.218 (m_r^2 / (k^2 v))^(1/5), in s. N/m^1.5, kg, m/s.

    It is 2.943 times the deepest overlap over v (Landau and Lifshitz, Theory of Elasticity, section 9).
    """
    deepest = math.pow(1.25 * reduced_mass * speed**2 / stiffness, 0.4)
    return HERTZ_TIME * deepest / speed


def contact_bound(stiffness: float, reduced_mass: float) -> float:
    """Step that gives a contact STEPS_PER_CONTACT steps, s."""
    return contact_time(stiffness, reduced_mass) / STEPS_PER_CONTACT


def lattice_bound(stiffness: float, mass: float) -> float:
    """Stability limit of a hexagonal packing, 2 / sqrt(6 k / m), in s."""
    return 2.0 / math.sqrt(6.0 * stiffness / mass)


def damping_bound(coefficient: float, reduced_mass: float) -> float:
    """Half of m_r / c, the time in which a dashpot alone stops two bottles, s; explicit steps of 2 m_r / c diverge."""
    return 0.5 * reduced_mass / coefficient


def base_friction_bound(friction: float, gravity: float, slip_limit: float) -> float:
    """Step that takes STEPS_PER_SLIP to v_lim / (mu g), s; beyond that time explicit friction chatters."""
    return slip_limit / (friction * gravity) / STEPS_PER_SLIP


def contact_friction_bound(
    friction: float, normal_force: float, mass: float, inertia: float, radius: float, slip_limit: float
) -> float:
    """Explicit regularised friction in a contact chatters beyond v_lim / [2 mu (1/m + R^2/J) N], in s."""
    return slip_limit / (2.0 * friction * (1.0 / mass + radius**2 / inertia) * normal_force)


def steps_per_tick(tick: float, bounds: list[Bound], given: int | None) -> tuple[int, str]:
    """Steps in a tick of `tick` s, and why: as given, or the fewest that keep every bound."""
    if not bounds:
        if given is not None:
            return given, f"{given} steps a tick, given in the scene; nothing in it bounds the time step"
        return 1, "1 step a tick: nothing in the scene bounds the time step"
    tightest = min(bounds, key=lambda bound: bound.dt)
    ruling = f"{tightest.name}: {tightest.dt * 1e6:.4g} us, {tightest.reason}"
    if given is None:
        steps = max(1, math.ceil(tick / tightest.dt * (1.0 - 1e-12)))
        return steps, f"{steps} steps a tick, the fewest within the tightest bound ({ruling})"
    dt = tick / given
    verdict = "within" if dt <= tightest.dt else f"{dt / tightest.dt:.2g} x beyond"
    return given, f"{given} steps a tick, given in the scene; {verdict} the tightest bound ({ruling})"
