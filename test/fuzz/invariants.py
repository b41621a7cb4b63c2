# SPDX-License-Identifier: Apache-2.0
"""What holds at every tick of every run, whatever the scene: checked from outside, by what a Simulation tells."""

from __future__ import annotations

import math
from dataclasses import fields
from typing import Any

import numpy as np
from fuzz.crossing import crossed
from fuzz.device_invariants import DeviceWatch
from fuzz.drive_invariants import ExpectedBelts
from fuzz.violation import Violation
from numpy.typing import NDArray

from conveyor_sim.columns.bottles import BottleColumns
from conveyor_sim.line.commands.inputs import CommandOutcome
from conveyor_sim.scene.contacts import Contact
from conveyor_sim.simulation import Simulation

__all__ = ["Invariants", "Sent", "Violation", "work"]

F8 = NDArray[np.float64]

TOUCH = 1e-7
"""Of the radius: what rounding may make of a distance at which two things touch."""


Sent = list[tuple[tuple[str, ...], tuple[float, ...], bool]]
"""Names and values of the inputs of a tick, and whether they are faults."""


class Invariants:
    """Looks at a Simulation after every single tick. Raises Violation."""

    def __init__(self, simulation: Simulation) -> None:
        model = simulation.model
        self._sim = simulation
        self._radius, self._mass = model.type_radius, model.type_mass
        on = {"SegmentPiece": model.segments is not None, "ArcPiece": model.arcs is not None}
        self._pieces = [
            (rail.name, piece)
            for rail in model.plant.rails_at_rest
            for piece in rail.pieces
            if on[type(piece).__name__]
        ]
        self._regions = {name: np.array(feed.region) for name, feed in simulation.scene.outfeeds.items()}
        self._changes = {
            (model.bottle_types.index(one), model.bottle_types.index(other))
            for carousel in simulation.scene.carousels.values()
            for one, other in carousel.changes.items()
        }
        self._belts = ExpectedBelts(simulation)
        self._devices = DeviceWatch(simulation, self._belts.panel)
        self._stable = model.dt <= min((bound.dt for bound in model.bounds if bound.stability), default=math.inf)
        self._before = simulation.bottles()
        self._first = len(self._before.id) - simulation.counts.fed
        self._next_id = _after(self._before)
        self._removed = 0
        self._held: set[int] = set()
        """Ids of the bottles in stations."""
        self.bottle_ticks = 0
        self.most_contacts = 0
        self._finite()

    def after_tick(self, sent: Sent, outcomes: list[CommandOutcome]) -> None:
        """The checks; sent: the inputs of this tick, and what was told of them."""
        self._belts.check(sent, outcomes)
        now = self._finite()
        self._devices.check(self._before, now, outcomes)
        self.bottle_ticks += len(now.id)
        fresh = self._identities(now)
        self._births(now, fresh)
        self._outfeeds(now, fresh)
        self._rails(now)
        self._contacts()
        self._before = now

    def _finite(self) -> BottleColumns:
        bottles, signals = self._sim.bottles(), self._sim.signals()
        peaks = self._sim.model.has("peaks")
        for field in fields(bottles):
            if field.name in ("peak_force", "impulse") and not peaks:
                continue
            column = getattr(bottles, field.name)
            if not np.isfinite(column).all():
                bad = bottles.id[~np.isfinite(column)][0]
                raise Violation("not finite", f"{field.name} of bottle {bad} at tick {self._sim.tick}")
        if not np.isfinite(signals).all():
            raise Violation("not finite", f"a signal at tick {self._sim.tick}")
        return bottles

    def _identities(self, now: BottleColumns) -> NDArray[np.bool_]:
        """Every bottle that was there is there or was removed, once; new ones have new ids. Which ones are new."""
        ids, before, counts = now.id, self._before.id, self._sim.counts
        if (np.diff(ids.astype(np.int64)) <= 0).any():
            raise Violation("doubled bottle", f"ids {ids.tolist()} at tick {self._sim.tick}")
        fresh = ids >= self._next_id
        lost = np.setdiff1d(before, ids)
        back = set(np.setdiff1d(ids[~fresh], before).tolist())
        if not back <= self._held:
            raise Violation("doubled bottle", f"a bottle came back at tick {self._sim.tick}")
        held, self._held = self._held, set(self._sim._state.held)
        self._removed += lost.size - len(self._held - held)
        # A bottle may be fed into an outfeed, but is removed at the next tick at the earliest.
        if self._removed != counts.removed or counts.present != ids.size:
            raise Violation(
                "lost bottle", f"{self._removed} gone, {ids.size} seen, {counts} told at tick {self._sim.tick}"
            )
        if self._first + counts.fed - counts.removed != counts.present + counts.held:
            raise Violation("lost bottle", f"{self._first} at first, {counts} at tick {self._sim.tick}")
        types = zip(
            self._before.type[np.isin(before, ids)].tolist(), now.type[np.isin(ids, before)].tolist(), strict=True
        )
        if not {(was, kind) for was, kind in types if was != kind} <= self._changes:
            raise Violation("doubled bottle", f"a bottle changed its type at tick {self._sim.tick}")
        self._next_id = max(self._next_id, _after(now))
        return fresh | np.isin(ids, list(back))

    def _births(self, now: BottleColumns, fresh: NDArray[np.bool_]) -> None:
        """A bottle enters beside others and beside rails, never in them."""
        radius, at = self._radius[now.type], np.column_stack([now.x, now.y])
        paired = self._sim.model.pair_law is not None
        pieces = [*self._pieces, *((rail.name, rail.pieces[0]) for rail in self._sim.moving_rails())]
        for index in np.flatnonzero(fresh):
            reach = radius[index] * (1.0 - TOUCH) - 2e-9
            gap = np.hypot(*(at - at[index]).T) - radius
            gap[index] = math.inf
            if paired and (gap < reach).any():
                raise Violation(
                    "born in a bottle", f"bottle {now.id[index]} in bottle {now.id[gap.argmin()]} "
                    f"by {radius[index] - gap.min():.3g} m at tick {self._sim.tick}"
                )  # fmt: skip
            for name, piece in pieces:
                apart = float(piece.distance(at[index : index + 1])[0])
                if apart < reach:
                    raise Violation(
                        "born in a rail", f"bottle {now.id[index]} of radius {radius[index]:.6g} m "
                        f"{apart:.6g} m from rail {name} at tick {self._sim.tick}"
                    )  # fmt: skip

    def _outfeeds(self, now: BottleColumns, fresh: NDArray[np.bool_]) -> None:
        if not self._sim.model.has("outfeed"):
            return
        for name, corners in self._regions.items():
            stays = _inside(corners, now.x, now.y) & ~fresh
            if stays.any():
                raise Violation(
                    "not removed", f"bottle {now.id[stays][0]} is in outfeed {name} at tick {self._sim.tick}"
                )

    def _rails(self, now: BottleColumns) -> None:
        """No axis is on the other side of a rail than a tick before."""
        kept, was = np.isin(now.id, self._before.id), np.isin(self._before.id, now.id)
        before = np.column_stack([self._before.x, self._before.y])[was]
        after = np.column_stack([now.x, now.y])[kept]
        radius, mass = self._radius[now.type[kept]], self._mass[now.type[kept]]
        way = np.hypot(*(after - before).T)
        speed = np.maximum(np.hypot(self._before.vx, self._before.vy)[was], np.hypot(now.vx, now.vy)[kept])
        # A long way may lead round a free end: it counts where both ends are farther than the bottle can have come.
        come = 2.0 * speed * self._sim.scene.tick + way
        seen = [(name, piece, before, after) for name, piece in self._pieces]
        for name, piece, come_from, gone_to in [*seen, *self._devices.in_frames(before, after)]:
            through = crossed(piece, come_from, gone_to)
            for index in np.flatnonzero(through):
                ends = [math.dist(come_from[index], end) + math.dist(gone_to[index], end) for end in piece.ends]
                if way[index] < 0.5 * radius[index] or min(ends) > come[index]:
                    energy = 0.5 * mass[index] * speed[index] ** 2
                    raise Violation(
                        self._why_through(name, int(now.type[kept][index]), energy),
                        f"bottle {now.id[kept][index]} (R = {radius[index]:.4g} m, {speed[index]:.4g} m/s, "
                        f"{energy:.3g} J) went {way[index]:.4g} m through rail {name} at tick {self._sim.tick}",
                    )

    def _why_through(self, rail: str, kind: int, energy: float) -> str:
        """The kind of a bottle's way through a rail: what it lacks of the work that stops it, or the steps."""
        if not self._stable:
            return "through a rail, in steps beyond the bound of stability"
        scene = self._sim.scene
        material = next(shape.material for shape in self._sim.model.plant.rails if shape.name == rail)
        pair = {list(scene.bottle_types.values())[kind].material, material}
        contact = next(contact for contact in scene.contacts if set(contact.between) == pair)
        enough = energy < work(contact, float(self._radius[kind]))
        return "through a rail" if enough else "through a rail, at a speed that no contact stops"

    def _contacts(self) -> None:
        contacts = self._sim.contacts()
        self.most_contacts = max(self.most_contacts, contacts.kind.size)
        for field in fields(contacts):
            if not np.isfinite(getattr(contacts, field.name)).all():
                raise Violation("not finite", f"{field.name} of a contact at tick {self._sim.tick}")


def work(contact: Contact, overlap: float) -> float:
    """Work of the elastic law of a contact down to an overlap (m), J."""
    if contact.stiffness is not None:
        return 0.5 * contact.stiffness * overlap**2
    if contact.hertz_stiffness is not None:
        return 0.4 * contact.hertz_stiffness * overlap**2.5
    points = [(0.0, 0.0), *(contact.table or ())]
    slope = (points[-1][1] - points[-2][1]) / (points[-1][0] - points[-2][0])
    deep, force = points[-1]
    points.append((max(2.0 * deep, overlap), force + slope * (max(2.0 * deep, overlap) - deep)))
    at = np.linspace(0.0, overlap, 1000)
    forces = np.interp(at, *np.transpose(points))
    return float(((forces[1:] + forces[:-1]) / 2.0 * np.diff(at)).sum())


def _after(bottles: BottleColumns) -> int:
    """The id after the greatest."""
    return int(bottles.id[-1]) + 1 if bottles.id.size else 0


def _inside(corners: F8, x: Any, y: Any) -> NDArray[np.bool_]:
    """Whether points lie well within a simple polygon: by the winding of its corners, edges excluded."""
    at = np.column_stack([x, y])
    turned = np.zeros(len(at))
    near = np.zeros(len(at), bool)
    size = float(np.ptp(corners, axis=0).max())
    for one, other in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        a, b = one - at, other - at
        cross = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
        near |= np.abs(cross) < 1e-9 * size * size
        turned += np.arctan2(cross, (a * b).sum(axis=1))
    return np.asarray((np.abs(turned) > math.pi) & ~near)
