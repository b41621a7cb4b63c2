# SPDX-License-Identifier: Apache-2.0
"""Violations in words: bottle, place, time, cause, and remedy."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from conveyor_sim.engine.arrays.contacts import ContactLaw
from conveyor_sim.engine.arrays.world import World
from conveyor_sim.engine.impulses.constants import RESOLVED
from conveyor_sim.engine.integrators.dormand_prince import MOST
from conveyor_sim.physics.accounts.elastic import elastic_energy, rail_entries
from conveyor_sim.physics.model import Model
from conveyor_sim.physics.stepping.guard.squeeze import Squeeze

CAME_FAST = 0.5
"""Ratio of speed to the largest speed that a contact can stop. Above it, an impact is the cause, else a steady force.
"""

REMEDY_DEPTH = 0.1
"""Overlap at the proposed stiffness, in radii."""


@dataclass(frozen=True)
class Violation:
    """A physically impossible state of one bottle."""

    bottle: int
    """Id."""
    x: float
    """m, at the beginning of the tick."""
    y: float
    what: str
    """The violation, as a clause."""
    why: str
    """The cause, and after a semicolon the remedy."""
    kind: Literal["unstable", "tunnelling"]
    curable: bool = True
    """True if shorter steps may help."""

    def sentence(self, time: float, tried: int) -> str:
        """Return one sentence. time: s, at the beginning of the tick. tried: factor by which steps were shortened."""
        even = "" if tried == 1 else f", even in steps {tried} times shorter"
        return f"{self.what} in the tick that began at {time:g} s at ({self.x:.4g}, {self.y:.4g}) m{even}: {self.why}"


def unresolved(model: Model) -> bool:
    """Return True if steps of integrator impulses are longer than its stiffest contact lasts: overlaps are errors."""
    laws = [law.stiffness for law in (model.pair_law, model.rail_law) if law is not None and law.stiffness is not None]
    stiffest = max((float(stiffness.max(initial=0.0)) for stiffness in laws), default=0.0)
    return bool(model.sweeps) and model.dt**2 * stiffest / float(model.type_mass.min()) >= RESOLVED


class Words:
    """Builder of violation messages for the state at the beginning of a tick."""

    def __init__(self, model: Model, world: World, squeeze: Squeeze | None = None) -> None:
        """Describe a state. squeeze: moving rail that presses on the violating bottle at the end of the tick."""
        self._model = model
        self._world = world
        self._squeeze = squeeze
        self._bottles = world.bottles

    def put_in(self, slot: int) -> Violation:
        """Return the violation of a bottle that was not finite before the first step."""
        what = f"bottle {self._id(slot)} has no finite position or velocity before the first step"
        return self._unstable(
            slot, what, "a value written into the state is not finite; set a finite one", curable=False
        )

    def not_finite(self, slot: int) -> Violation:
        """Return the violation of a bottle that is no longer finite."""
        what = f"bottle {self._id(slot)} has no finite position or velocity"
        if self._model.integrator != "dormand_prince":
            return self._unstable(slot, what, self._too_long())
        why = (
            f"dormand_prince needs more than {MOST:,} substeps per tick for an error of {self._model.settings.error:g} "
            "m/s; allow a larger error or choose another integrator"
        )
        return self._unstable(slot, what, why, curable=False)

    def far(self, slot: int, speed: float, dt: float, longest: float) -> Violation:
        """Return the violation of a bottle that moves too far in one step. speed: m/s. longest: allowed way, m."""
        what = f"bottle {self._id(slot)} moves {1e3 * speed * dt:.3g} mm in one step of {dt:g} s"
        limit = f"contacts may be missed beyond {1e3 * longest:.3g} mm"
        why = f"its speed is {speed:.3g} m/s, and {limit}; choose a finer accuracy"
        return self._tunnelling(slot, what, self._forced() or why)

    def energy(self, slot: int, before: float, after: float, explained: float) -> Violation:
        """Return the violation of unexplained energy (J). slot: of the fastest bottle."""
        rise = f"from {before:.3g} to {after:.3g} J"
        what = f"the energy of all bottles, of which bottle {self._id(slot)} is the fastest, rises {rise}"
        workers = "belts and rails" if self._model.plant.moving else "belts"
        why = f"{workers} add at most {explained:.3g} J, so the time step is the cause: {self._too_long()}"
        return self._unstable(slot, what, self._forced() or why)

    def pair(self, slot: int, other: int, depth: float) -> Violation:
        """Return the violation of two bottles that overlap too much. depth: overlap in smaller radii."""
        a, b = self._bottles, slot
        kinds = a.type[[b, other]].astype(np.int64)
        relative = float(np.hypot(a.vx[b] - a.vx[other], a.vy[b] - a.vy[other]))
        masses = self._model.type_mass[kinds]
        reduced = float(masses.prod() / masses.sum())
        what = f"bottle {self._id(slot)} overlaps bottle {self._id(other)} by {depth:.2g} of a radius"
        radius = float(self._model.type_radius[kinds].min())
        entry = int(kinds[0]) * len(self._model.bottle_types) + int(kinds[1])
        why = self._too_soft(self._model.pair_law, entry, radius, reduced, relative, depth, "bottles")
        return self._tunnelling(slot, what, why)

    def rail(self, slot: int, rail: int, depth: float) -> Violation:
        """Return the violation of a bottle that overlaps a rail too much. depth: overlap in radii."""
        model, bottles, kind = self._model, self._bottles, int(self._bottles.type[slot])
        shape = model.plant.rails[rail]
        entry = int(rail_entries(model, np.array([kind]), np.array([rail]))[0])
        ux, uy = self._velocity_of_rail(rail, slot)
        speed = float(np.hypot(bottles.vx[slot] - ux, bottles.vy[slot] - uy))
        what = f"bottle {self._id(slot)} sinks {depth:.2g} of its radius into rail {shape.name}"
        radius, mass = float(model.type_radius[kind]), float(model.type_mass[kind])
        why = self._too_soft(model.rail_law, entry, radius, mass, speed, depth, f"rail {shape.name}")
        return self._tunnelling(slot, what, why)

    def place(self, slot: int) -> tuple[int, float, float]:
        """Return id, x and y (m) of a bottle."""
        return self._id(slot), float(self._bottles.x[slot]), float(self._bottles.y[slot])

    def _velocity_of_rail(self, rail: int, slot: int) -> tuple[float, float]:
        """Return the velocity of a rail, or of the nearest body of a machine, at a bottle's axis, m/s."""
        moving, machine, plant = self._world.moving, rail - len(self._model.plant.rails_at_rest), self._model.plant
        if moving is None or machine < 0:
            return 0.0, 0.0
        place = np.array([[self._bottles.x[slot], self._bottles.y[slot]]])
        apart = {}
        for body in np.flatnonzero(moving.account == machine).tolist():
            axis = plant.axis_of_body[body]
            pieces = plant.moving[body].at(0.0 if axis < 0 else float(moving.position[axis]))
            apart[body] = min((float(piece.distance(place)[0]) for piece in pieces), default=np.inf)
        body, pose = min(apart, key=lambda b: (apart[b], b)), moving.pose
        dx, dy = place[0, 0] - pose.x[body], place[0, 1] - pose.y[body]
        return float(pose.vx[body] - pose.turn[body] * dy), float(pose.vy[body] + pose.turn[body] * dx)

    def _forced(self, pressed: bool = False) -> str:
        """Return a clause on a moving rail that presses without force limit, else "". pressed: by a steady force."""
        squeeze = self._squeeze
        if squeeze is None or squeeze.force is not None or not (squeeze.held or pressed):
            return ""
        return f"{squeeze.what} with unlimited force; give it a {squeeze.field}"

    def _too_soft(
        self,
        law: ContactLaw | None,
        entry: int,
        radius: float,
        mass: float,
        speed: float,
        depth: float,
        what: str,
    ) -> str:
        entries = np.array([entry])
        most = float(elastic_energy(self._model, law, entries, np.array([radius]))[0])
        stopped = float(np.sqrt(2.0 * most / mass))
        if forced := self._forced(speed <= CAME_FAST * stopped):
            return forced
        if unresolved(self._model):
            sweeps = f"{self._model.sweeps} sweep{'s' * (self._model.sweeps != 1)}"
            return (
                f"{self._model.steps_per_tick} steps a tick with {sweeps} do not resolve the contact with {what}, so "
                "throughput, jams and forces may be wrong; choose more steps or sweeps"
            )
        if speed > CAME_FAST * stopped:
            needed = mass * (speed / (REMEDY_DEPTH * radius)) ** 2
            return (
                f"it arrived at {speed:.3g} m/s, and the contact with {what} can stop at most {stopped:.3g} m/s within "
                f"a radius; give this contact a stiffness of about {needed:.2g} N/m"
            )
        here = float(elastic_energy(self._model, law, entries, np.array([depth * radius]))[0])
        force, cause = 2.0 * here / (depth * radius), "it is pressed"
        if self._squeeze is not None and self._squeeze.force is not None:
            force, cause = max(force, self._squeeze.force), self._squeeze.what
        needed = force / (REMEDY_DEPTH * radius)
        return (
            f"{cause} with about {force:.3g} N, too much for the contact with {what}; "
            f"give this contact a stiffness of about {needed:.2g} N/m"
        )

    def _too_long(self) -> str:
        model = self._model
        return f"dt = {model.dt:g} s is too long for this scene ({model.dt_reason}); choose a finer accuracy"

    def _unstable(self, slot: int, what: str, why: str, curable: bool = True) -> Violation:
        return Violation(*self.place(slot), what, why, "unstable", curable)

    def _tunnelling(self, slot: int, what: str, why: str) -> Violation:
        return Violation(*self.place(slot), what, why, "tunnelling")

    def _id(self, slot: int) -> int:
        return int(self._bottles.id[slot])
