# SPDX-License-Identifier: Apache-2.0
"""`Simulation`: a scene that advances tick by tick, takes commands, is observed and saved."""

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from os import PathLike
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.columns.bottles import BeltColumns, BottleColumns, ContactColumns
from conveyor_sim.columns.counts import Counts
from conveyor_sim.columns.damage import DamageColumns, DamageEvent, RailWearColumns
from conveyor_sim.columns.events import GuardEvent
from conveyor_sim.columns.ledger import Ledger
from conveyor_sim.engine.arrays.bodies import Bottles
from conveyor_sim.engine.observers.contact_list import closed_contacts
from conveyor_sim.line.commands.inputs import (
    ARRIVAL,
    DELETE,
    FAULT,
    INJECT,
    OPERATE,
    SET,
    SPAWN,
    WATCHDOG,
    CommandOutcome,
    Input,
    WriterKind,
)
from conveyor_sim.line.line import Line
from conveyor_sim.line.tag import ProcessImage
from conveyor_sim.physics.accounts.accounts import Accounts
from conveyor_sim.physics.model import build_model
from conveyor_sim.physics.state.checkpoint import Checkpoint, damaged, read_checkpoint, write_checkpoint
from conveyor_sim.physics.state.hashes import COLUMNS, full_state_hash, state_hash
from conveyor_sim.physics.state.snapshot import entries, typed
from conveyor_sim.physics.state.state import FIRST_SLOTS, Held, State
from conveyor_sim.physics.state.world_arrays import changing_arrays
from conveyor_sim.physics.stepping.tick import Integration
from conveyor_sim.scene.geometry import RailShape
from conveyor_sim.scene.schema import Scene

LAST_STAMP_NS = 2**31 * 10**9 - 1
"""Last time of a message header, whose seconds have 32 bits, ns."""


class Events(NamedTuple):
    """Everything reported since the last call of `Simulation.take_events`, each kind in order."""

    outcomes: list[CommandOutcome]
    """Command results."""
    guard: list[GuardEvent]
    """Reports of the guard."""
    damage: list[DamageEvent]
    """Limits of the scene that were passed."""


class Simulation:
    """A scene that advances in whole ticks. Commands are given and observations are made between ticks.

    The same scene and the same commands at the same ticks give the same bits. The number of threads, observations, and
    the division of ticks into calls of `advance` do not matter. `line` has the devices, and the inputs that wait for
    the next tick. `integration` holds statistics of the steps. Raises SceneError for an invalid scene.
    """

    def __init__(self, scene: Scene, threads: int | None = None, shorten: bool = True) -> None:
        """Place the bottles of a scene. threads: number of threads; None: the number that turns out to be fastest.
        shorten: if the guard rejects a tick, repeat the tick in shorter steps before the run is stopped.

        Raises ValueError for less than one thread.
        """
        if threads is not None and threads < 1:
            raise ValueError(f"threads: {threads}, expected 1 or more, or None to have them chosen")
        self.scene = scene
        self.model = build_model(scene)
        self.tick = 0
        bottles = self.model.plant.bottles
        self._state = State(self.model, len(bottles) or FIRST_SLOTS)
        self.integration = Integration(self._state, threads, shorten)
        """Threads, kernel time and guard of the steps."""
        self._every = {output: scene.every(output) for output in scene.TOPICS}
        self._line = Line(scene, self._state)
        for kind, x, y, theta, vx, vy, omega in bottles:
            self._state.add(self.model.bottle_types.index(kind), x, y, theta, vx, vy, omega)
        self._accounts = Accounts(self._state, scene)
        self._line.placement.feeding, self._line.placement.removing = self._accounts.feeding, self._accounts.removing
        self._feed()
        self._line.end(self.tick)
        self._state.make_lists()
        self._line.move_belts()
        self._accounts.open_ledger()

    @classmethod
    def load(
        cls,
        path: str | PathLike[str],
        threads: int | None = None,
        scene: Scene | None = None,
        folder: Path | None = None,
    ) -> "Simulation":
        """Continue from a checkpoint with the same bits as if the run had not stopped, on any number of threads.

        scene: equal to the saved one except in `duration` and `description`; None: the one in the file.
        folder: base of relative paths, which no path may leave; None: no restriction.
        Raises CheckpointError for a file that is missing, no checkpoint, damaged, or of another version or scene.
        """
        checkpoint = read_checkpoint(Path(path), scene, folder)
        simulation = cls(checkpoint.scene, threads)
        simulation._restore(checkpoint)
        return simulation

    def save(
        self, path: str | PathLike[str], folder: Path | None = None, controller: dict[str, Any] | None = None
    ) -> None:
        """Write a checkpoint of the state at this tick, and replace the file. The run is not affected.

        folder: as for `load`. controller: memory of the controller, stored with the state.
        Raises CheckpointError if the file can't be written; its former content stays.
        """
        arrays = changing_arrays(self._state.world)
        write_checkpoint(Path(path), self.scene, self._snapshot(), arrays, folder, controller)

    @property
    def time(self) -> float:
        """Simulated time, s."""
        return self.tick * self.model.tick_ns * 1e-9

    @property
    def stamp_ns(self) -> int:
        """Simulated time for message headers, ns: 1 at tick 0, because ROS reads 0 as unset."""
        return max(1, self.tick * self.model.tick_ns)

    @property
    def line(self) -> Line:
        """Devices, alarms and inputs of the line, for observation. Inputs are queued by `give`."""
        return self._line

    @property
    def process_image(self) -> ProcessImage:
        """Names, units and limits of signals and commands."""
        return self._line.image

    @property
    def counts(self) -> Counts:
        """Bottles fed, removed and present."""
        present, held = int((self._state.world.bottles.id >= 0).sum()), len(self._state.held)
        return Counts(self._line.fed, self._line.removed, present, self._line.blocked_ticks, held)

    def advance(self, ticks: int = 1) -> None:
        """Advance by `ticks` ticks.

        Raises SimulationError, in one sentence, for a tick that the guard rejects. The state is then that before the
        tick.
        """
        for _ in range(ticks):
            self._line.begin(self.tick)
            peaks = self._state.world.peaks
            if peaks is not None and self.due("bottles"):
                peaks.force[:] = 0.0
                peaks.impulse[:] = 0.0
            if self._accounts.damage is not None:
                self._accounts.damage.begin(self.due("damage"))
            self.integration.take_tick(self.tick, self._line.fastest_surface)
            self.tick += 1
            passed = self._accounts.end(self.tick, self._line.removed_by)
            self._line.end(self.tick)
            self._remove()
            self._feed()
            self._line.close(passed, self._accounts.clogged())
            self._state.make_lists()

    def give(self, request: Input) -> None:
        """Queue an input. The next tick applies it, or refuses it with the reason (`take_outcomes`).

        Raises ValueError for the writer kind "line", which is reserved for inputs created by the line.
        """
        if request.by_line:
            raise ValueError(f"writer_kind: line given by {request.source}, expected another: that is the line itself")
        self._line.queue(request)

    def command(
        self,
        names: Sequence[str],
        values: Sequence[float],
        source: str = "commands",
        *,
        writer: str = "",
        writer_kind: WriterKind = "controller",
    ) -> None:
        """Queue setpoints by name (`process_image.command_names`). The next tick applies or refuses them together.

        writer: "" for the name of the source. Raises ValueError for the sources of faults and of the line itself.
        """
        if source in (FAULT, WATCHDOG, ARRIVAL):
            raise ValueError(
                f"source: {source} given, expected another: {FAULT}, {WATCHDOG} and {ARRIVAL} are the line's"
            )
        self.give(Input(source, writer or source, writer_kind, SET, tuple(names), tuple(values)))

    def inject(self, name: str, value: float, *, writer: str = FAULT) -> None:
        """Queue a fault by name (`process_image.fault_names`), with the source "fault"."""
        self.give(Input(FAULT, writer, "test", INJECT, (name,), (value,)))

    def operate(self, operation: str, names: Sequence[str] = (), values: Sequence[float] = (), *, writer: str) -> None:
        """Queue an operation of an operator: `acknowledge`, `reset`, `shelve`, ... of alarms by ID."""
        self.give(Input(OPERATE, writer, "operator", operation, tuple(names), tuple(values)))

    def spawn(
        self,
        bottle_type: str,
        x: float,
        y: float,
        *,
        theta: float = 0.0,
        vx: float = 0.0,
        vy: float = 0.0,
        omega: float = 0.0,
        writer: str = "spawn",
    ) -> None:
        """Queue a bottle of a type of the scene, at (x, y) m and theta rad, moving at m/s and rad/s.

        The next tick puts it on the line and its command result has the ID (`bottles`), or refuses it: for an unknown
        type, an overlap, a place on no belt, or a speed for which the time step is too long.
        """
        values = (x, y, theta, vx, vy, omega)
        self.give(Input(SPAWN, writer, "test", SPAWN, (bottle_type,), values))

    def delete(self, *bottles: int, writer: str = "delete") -> None:
        """Queue the removal of bottles, by ID. The next tick removes all of them, or refuses the input."""
        self.give(Input(DELETE, writer, "test", DELETE, (), tuple(bottles)))

    def take_outcomes(self) -> list[CommandOutcome]:
        """Return the results of commands and other inputs since the last call, in order."""
        return self._line.take_outcomes()

    @property
    def alarms(self) -> frozenset[str]:
        """IDs of the alarms that stand: active or latched, and neither shelved, suppressed nor out of service."""
        return frozenset(alarm.id for alarm in self._line.alarms if alarm.stands)

    def take_events(self) -> Events:
        """Return command results, guard events and passed limits since the last call."""
        return Events(self._line.take_outcomes(), self.integration.take_events(), self._accounts.take_events())

    def restore_from(self, other: "Simulation") -> None:
        """Copy bottles, time, and belt speeds of another Simulation of the same line.

        The scenes may differ in effects and steps. Tangential springs of contacts start unloaded.
        """
        self.tick = other.tick
        self._line.restore_from(other._line)
        self._state.restore_from(other._state)
        self.integration.put_in()
        self._line.move_belts()
        if self._accounts.energy is not None:
            self._accounts.energy.restart()

    @contextmanager
    def editing(self) -> Iterator[tuple[Bottles, NDArray[np.int64]]]:
        """Yield the arrays of the bottles, which may be changed inside, and their slots in the order of the IDs.

        The energy ledger counts the change of energy as fed.
        """
        with self._accounts.feeding():
            yield self._state.world.bottles, self._slots()
            self._state.world.neighbourhood.stale[0] = 1
            self._state.moves += 1
        self._state.make_lists()
        self.integration.put_in()

    def due(self, output: str) -> bool:
        """Return True if an output (`Scene.TOPICS`) is due at this tick."""
        every = self._every[output]
        return every > 0 and self.tick % every == 0

    def bottles(self) -> BottleColumns:
        """Return every bottle present, ordered by ID. Peaks are NaN without the effect `peaks`."""
        slots, peaks = self._slots(), self._state.world.peaks
        unknown = np.full(slots.size, math.nan)
        return BottleColumns(
            **self._motion(slots),
            belt=self._line.carriers()[slots],
            peak_force=peaks.force[slots] if peaks is not None else unknown,
            impulse=peaks.impulse[slots] if peaks is not None else unknown,
        )

    def _motion(self, slots: np.ndarray) -> dict[str, np.ndarray]:
        """Return the columns of `COLUMNS` for the bottles in some slots."""
        bottles, spin = self._state.world.bottles, self._state.world.spin
        rest = np.zeros(slots.size)
        return {
            "id": bottles.id[slots].astype(np.uint64),
            "type": bottles.type[slots].astype(np.uint16),
            "x": bottles.x[slots],
            "y": bottles.y[slots],
            "theta": spin.theta[slots] if spin is not None else rest,
            "vx": bottles.vx[slots],
            "vy": bottles.vy[slots],
            "omega": spin.omega[slots] if spin is not None else rest,
        }

    @property
    def peak_force(self) -> float | None:
        """Largest normal contact force since bottles were last output, N; None without the effect `peaks`."""
        peaks = self._state.world.peaks
        return None if peaks is None else float(peaks.force.max(initial=0.0))

    def contacts(self) -> ContactColumns:
        """Return every closed contact at this tick, with its present forces."""
        kind, ends, values = closed_contacts(self._state.world, self.integration.found)
        ids = self._state.world.bottles.id
        b = np.where(kind == 0, ids[np.where(kind == 0, ends[1], 0)], ends[1])
        return ContactColumns(kind, ids[ends[0]].astype(np.uint64), b.astype(np.uint64), *values)

    def belts(self) -> BeltColumns:
        """Return commanded and actual belt speeds, m/s."""
        return BeltColumns(self._line.now.belt_setpoints.copy(), self._line.now.belt_speeds.copy())

    def moving_rails(self) -> tuple[RailShape, ...]:
        """Return gates, pushers and diverters at their present places; they are the last rails by number."""
        return self._state.moving_rails()

    def ledger(self) -> Ledger | None:
        """Return the energy balance since the start; None without the effect `energy_ledger`."""
        return None if self._accounts.energy is None else self._accounts.energy.ledger()

    def damage(self) -> DamageColumns | None:
        """Return the loads on every bottle present, ordered by ID; None if the scene does not enable them."""
        return None if self._accounts.damage is None else self._accounts.damage.columns(self._slots())

    def rail_wear(self) -> RailWearColumns | None:
        """Return the loads on the rails since the start; None if the scene does not enable them."""
        return None if self._accounts.damage is None else self._accounts.damage.rail_wear()

    def signals(self) -> np.ndarray:
        """Return the process image as controllers read it: float64, in the order of `process_image.signal_names`."""
        return self._line.signals().values

    def values_of(self, names: tuple[str, ...]) -> dict[str, float]:
        """Return some of the signals by name, as controllers read them, in less time than `signals`.

        Raises KeyError for a name that is no signal.
        """
        return self._line.values_of(names)

    def state_hash(self) -> int:
        """Return a 64-bit hash of tick, bottles, stretched springs, belts and moving rails."""
        motion, now = self._motion(self._slots()), self._line.now
        columns = [*(motion[name] for name in COLUMNS), now.setpoints, now.speeds]
        return state_hash(self.tick, columns, self._state)

    def full_state_hash(self) -> int:
        """Return 64 bits over everything that decides how the run continues (`physics/state/hashes.py`)."""
        return full_state_hash(self._snapshot(), changing_arrays(self._state.world), self.scene.limits)

    def _snapshot(self) -> dict[str, Any]:
        """Return the state that changes with time, without the arrays of the World, as plain data."""
        return {
            "tick": self.tick,
            "next_id": self._state.next_id,
            "held": list(self._state.held.items()),
            "line": self._line.snapshot(),
            **self._accounts.snapshot(),
            "integration": self.integration.snapshot(),
        }

    def _restore(self, checkpoint: Checkpoint) -> None:
        memory = checkpoint.memory
        try:
            entries(memory, self._snapshot(), "memory")
            self.tick = typed(int, memory["tick"], "tick")
            if self.tick < 0 or self.stamp_ns > LAST_STAMP_NS:
                raise ValueError(f"tick {self.tick}, which is beyond the times of messages")
            self._line.restore(self.tick, memory["line"])
            self._accounts.restore(memory)
            self.integration.restore(memory["integration"])
            held = typed(list[tuple[int, Held]], memory["held"], "held")
            self._state.restore(checkpoint.arrays, typed(int, memory["next_id"], "next_id"), held)
            if self._line.held != sorted(self._state.held):
                raise ValueError("held has other bottles than the stations")
        except (ValueError, MemoryError) as error:
            raise damaged(checkpoint.path, error) from error

    def _slots(self) -> np.ndarray:
        ids = self._state.world.bottles.id
        slots = np.flatnonzero(ids >= 0)
        return slots[np.argsort(ids[slots], kind="stable")]

    def _remove(self) -> None:
        if self._line.takes:
            with self._accounts.removing():
                self._line.take()

    def _feed(self) -> None:
        if self._line.feeds:
            with self._accounts.feeding():
                self._line.feed()
