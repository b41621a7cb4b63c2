# SPDX-License-Identifier: Apache-2.0
"""Impacts head on, and on a rail along which the bottle slides: errors of rebound, peak force and tangential speed."""

import cmath
import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from conveyor_sim.accuracy.cases.aside import PHASES, RAIL, corner, phases, pitch, rms, simulation_aside
from conveyor_sim.accuracy.cases.collision import Collision, damping_ratio, duration, peak_force, rebound
from conveyor_sim.accuracy.trajectory import displace
from conveyor_sim.engine.arrays.types import F8
from conveyor_sim.engine.contact.laws.hertz import HERTZ
from conveyor_sim.engine.contact.laws.table import TABLE
from conveyor_sim.simulation import Simulation

STRONG = 3.0
"""Value of zeta n above which the dashpot's jump at first touch, 0.3 x 2 pi zeta / n, is well above the error of the
spring alone, 0.7 / n^2.
"""

WEAK = 0.07
"""Value of zeta n up to which that jump is well below."""

COARSE, FITTED = (10, 20, 40), 80
"""Steps in a contact, and the fewest that an order is taken from."""

MOST_STEPS = 3000
"""The most of those: eight times as many are run."""


@dataclass(frozen=True, eq=False)
class HeadOn:
    """Pairs of bottles, or bottles and a rail, that meet at a speed."""

    collision: Collision
    speed: float
    """m/s, of approach."""
    restitution: float
    types: tuple[str, ...]
    """Types of the two bottles, or of the bottle that hits the rail."""
    material: str
    """Material of the rail; empty for two bottles."""
    slip: float = 0.0
    """m/s, along the rail."""

    @property
    def name(self) -> str:
        """Return the name of the case."""
        return f"{'head on' if self.slip == 0.0 else 'sliding impact'}, {self.collision.name}"

    @cached_property
    def duration(self) -> float:
        """Return the duration of the contact, s."""
        return duration(self.collision, self.speed)

    @property
    def _speeds(self) -> F8:
        """m/s, (PHASES,). On a table they differ by a third, that its points are passed at all phases, too."""
        spread = 0.3 if self.collision.elastic is TABLE else 0.0
        return np.asarray(self.speed * (1.0 + spread * (phases(2.0) - 0.5)))

    @property
    def strength(self) -> float:
        """Return zeta of a dashpot whose order differs from that of the spring, else 0."""
        return damping_ratio(self.collision, self.speed)

    @property
    def steps(self) -> tuple[int, ...]:
        """Return the numbers of steps per contact: as in practice, then enough for the order of the law."""
        first = FITTED
        if self.strength > 0.0 and STRONG / self.strength <= MOST_STEPS:
            first = max(FITTED, math.ceil(STRONG / self.strength))
        return (*COARSE, *(first * 2**power for power in range(4)))

    def run(self, integrator: str, steps: int) -> Simulation:
        """Run all impacts at `steps` + 1/2 steps per contact: at a whole number, end errors would cancel."""
        scene, meeting = self.collision.terms.scene, self.collision.meeting
        tick = round(self.duration * steps / (steps + 0.5), 9)
        fields = {}
        x, y = corner(scene)
        if self.material:
            # Beyond what bottles slide along it until two ticks are over.
            room = pitch(scene) + 3.0 * self.slip * tick
            at = x + pitch(scene)
            ends = {"from": [at, y - room], "to": [at, y + PHASES * pitch(scene) + room]}
            fields["rails"] = {RAIL: {"kind": "segment", **ends, "material": self.material}}
        simulation = simulation_aside(scene, self.types, integrator, tick, steps, **fields)
        touching = meeting.first.radius + (meeting.second.radius if meeting.second is not None else 0.0)
        entries = (1.0 + phases()) * self.duration / self.steps[0]
        nearer = np.zeros((4, PHASES * len(self.types)))
        nearer[0, :PHASES] = pitch(scene) - touching - self._speeds * entries
        nearer[2, :PHASES] = self._speeds
        nearer[3, :PHASES] = self.slip
        displace(simulation, *nearer)
        simulation.advance(2)
        return simulation

    def errors(self, simulation: Simulation) -> dict[str, float]:
        """By quantity, relative, RMS over the phases."""
        bottles = simulation.bottles()
        apart = -bottles.vx[:PHASES]
        if not self.material:
            apart = apart + bottles.vx[PHASES:]
        if self.slip > 0.0:
            turns = simulation.model.has("rotation")
            lost = sliding_loss(self.collision, self.speed, self.slip, self.restitution, turns)
            return {"tangential speed lost": rms((self.slip - bottles.vy[:PHASES]) / lost - 1.0)}
        found = {"speed of rebound": rms(apart / self._speeds - self.restitution)}
        peak = peak_force(self.collision, self.speed)
        if peak is not None:
            found["peak force"] = rms(bottles.peak_force[:PHASES] / peak - 1.0)
        return found

    def expected(self, smooth_order: int) -> float | None:
        """Order in dt; None where a weak dashpot lets it change with dt."""
        damping, steps = self.collision.damping, self.steps[-4:]
        spring = 2.5 if self.collision.elastic is HERTZ else 2.0
        if damping is None:
            return spring
        if 0.0 < self.strength * steps[0] < STRONG:
            # A dashpot that hardly matters: not at all, or in short steps only.
            return spring if self.strength * steps[-1] < WEAK else None
        return min(damping.order(float(smooth_order)), spring)


def sliding_loss(collision: Collision, speed: float, slip: float, restitution: float, turns: bool) -> float:
    """Tangential speed (m/s) that a bottle loses at a rail along which it slides throughout: mu (1 + e) v_n.

    The paper's dashpot drags besides, and presses no more once it pulls: m_t s' = -c s - mu max(0, N), with 1/m_t =
    1/m + R^2/J and N = m v w^2 / wd exp(-zeta w t) sin(2 acos zeta - wd t) until wd t = pi. turns: whether bottles do.
    """
    meeting, law = collision.meeting, collision.meeting.law
    mu, m = meeting.value(law.friction), meeting.first.mass
    if collision.damping is None or not collision.damping.isotropic:
        return mu * (1.0 + restitution) * speed
    share = _share(collision, turns)
    rate = collision.coefficient / (share * m)
    end, pressed = _pressed(collision, speed, rate)
    after = math.exp(-rate * end) * (slip - mu / (share * m) * pressed)
    return (slip - after) * share


def slip_for_sliding(collision: Collision, speed: float, restitution: float, turns: bool) -> float:
    """Return a slip (m/s) of which at least v_lim remains after the collision."""
    meeting, law = collision.meeting, collision.meeting.law
    mu, left = meeting.value(law.friction), 2.0 * collision.terms.scene.slip_limit
    share = _share(collision, turns)
    if collision.damping is None or not collision.damping.isotropic:
        return 1.25 * mu * (1.0 + restitution) * speed / share + left
    rate = collision.coefficient / (share * meeting.first.mass)
    end, pressed = _pressed(collision, speed, rate)
    return 1.25 * mu / (share * meeting.first.mass) * pressed + left * math.exp(rate * end)


def _share(collision: Collision, turns: bool) -> float:
    """m_t / m: the share of a change of slip that is the bottle's speed, the rest is its rim's."""
    kind = collision.meeting.first
    return 1.0 / (1.0 + kind.mass * kind.radius**2 / kind.moment_of_inertia) if turns else 1.0


def _pressed(collision: Collision, speed: float, rate: float) -> tuple[float, float]:
    """End of a contact (s) with the paper's dashpot, and the integral of exp(rate t) max(0, N) over it, N s."""
    m, zeta = collision.meeting.reduced_mass, damping_ratio(collision, speed)
    w = math.sqrt(collision.stiffness / m)
    wd, angle = w * math.sqrt(1.0 - zeta * zeta), 2.0 * math.acos(zeta)
    power = complex(rate - zeta * w, -wd)
    whole = cmath.exp(1j * angle) * (cmath.exp(power * angle / wd) - 1.0) / power
    return math.pi / wd, m * speed * w * w / wd * whole.imag


def restitution_of(collision: Collision, speed: float) -> float | str:
    """e, or why an impact has no closed form here."""
    e = rebound(collision, speed)
    if isinstance(e, float) and not math.isfinite(duration(collision, speed)):
        return "the contact does not end"
    return e
