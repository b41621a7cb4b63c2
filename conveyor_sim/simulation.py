"""`Simulation`: the one class that the node, the command line and the tests drive."""

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, nullcontext
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.columns.bottles import BeltColumns, BottleColumns, ContactColumns
from conveyor_sim.columns.counts import Counts
from conveyor_sim.columns.damage import DamageColumns, DamageEvent, RailWearColumns
from conveyor_sim.columns.events import Event, GuardEvent
from conveyor_sim.columns.ledger import Ledger
from conveyor_sim.engine.arrays.bodies import Bottles
from conveyor_sim.engine.observers.contact_list import closed_contacts
from conveyor_sim.line.commands.inputs import (
    ARRIVAL,
    FAULT,
    INJECT,
    OPERATE,
    SET,
    WATCHDOG,
    CommandOutcome,
    Input,
    WriterKind,
)
from conveyor_sim.line.line import Line
from conveyor_sim.line.process_image import ProcessImage
from conveyor_sim.physics.accounts.clogging import clogging_of
from conveyor_sim.physics.accounts.damage import DamageAccount
from conveyor_sim.physics.accounts.energy import EnergyAccount
from conveyor_sim.physics.model import build_model
from conveyor_sim.physics.state.checkpoint import Checkpoint, damaged, read_checkpoint, write_checkpoint
from conveyor_sim.physics.state.full_state_hash import full_state_hash
from conveyor_sim.physics.state.snapshot import entries, restore, snapshot, typed
from conveyor_sim.physics.state.state import FIRST_SLOTS, Held, State
from conveyor_sim.physics.state.state_hash import COLUMNS, state_hash
from conveyor_sim.physics.state.world_arrays import changing_arrays
from conveyor_sim.physics.stepping.tick import Integration
from conveyor_sim.scene.geometry import RailShape
from conveyor_sim.scene.schema import Scene

LAST_STAMP_NS = 2**31 * 10**9 - 1
"""The seconds of a message header are 32 bits."""


class Simulation:
    """A scene in motion. Time passes in whole ticks only; commands act and observations are made between them.

    The same scene and the same commands at the same ticks give the same bits, however the ticks are divided into calls
    of `advance`, whoever observes and on however many threads. Raises SceneError for a scene that can't be.
    """

    def __init__(self, scene: Scene, threads: int | None = None, shorten: bool = True) -> None:
        """Put the bottles of a scene in place. threads: to step with; None: as many as turn out to be fastest.
        shorten: have a tick that the guard objects to done again in shorter steps, before the run is stopped.

        Raises ValueError for less than one thread.
        """
        if threads is not None and threads < 1:
            raise ValueError(f"threads: {threads}, expected 1 or more, or None to have them chosen")
        self.scene = scene
        self.model = build_model(scene)
        self.tick = 0
        bottles = self.model.plant.bottles
        self._state = State(self.model, len(bottles) or FIRST_SLOTS)
        self._integration = Integration(self._state, threads, shorten)
        self._every = {output: scene.every(output) for output in scene.TOPICS}
        self._line = Line(scene, self._state)
        for kind, x, y, theta, vx, vy, omega in bottles:
            self._state.add(self.model.bottle_types.index(kind), x, y, theta, vx, vy, omega)
        self._damage = None if self._state.world.damage is None else DamageAccount(self._state, scene.limits)
        self._clogging = clogging_of(self._state, scene)
        self._account: EnergyAccount | None = None
        self._feed()
        self._line.end(self.tick)
        self._state.make_lists()
        self._line.move_belts()
        if self.model.has("energy_ledger"):
            self._account = EnergyAccount(self._state)

    @classmethod
    def load(
        cls,
        path: str | PathLike[str],
        threads: int | None = None,
        scene: Scene | None = None,
        folder: Path | None = None,
    ) -> "Simulation":
        """Go on from a checkpoint as if the run had never stopped: the same bits, on any number of threads.

        scene: must be the one that was saved, but for `duration` and `description`; None: the one in the file.
        folder: where relative paths start, and which no path may leave; None: anywhere.
        Raises CheckpointError for a file that is missing, no checkpoint, damaged, of another version or scene.
        """
        checkpoint = read_checkpoint(Path(path), scene, folder)
        simulation = cls(checkpoint.scene, threads)
        simulation._restore(checkpoint)
        return simulation

    def save(
        self, path: str | PathLike[str], folder: Path | None = None, controller: dict[str, Any] | None = None
    ) -> None:
        """Write a checkpoint: the whole state at this tick, in place of what the file held. The run does not notice.

        folder: as for `load`. controller: what that remembers, to be kept with it.
        Raises CheckpointError if the file can't be written, which leaves what it held.
        """
        arrays = changing_arrays(self._state.world)
        write_checkpoint(Path(path), self.scene, self._snapshot(), arrays, folder, controller)

    @property
    def time(self) -> float:
        """Simulated time, s."""
        return self.tick * self.model.tick_ns * 1e-9

    @property
    def kernel_seconds(self) -> float:
        """Wall time that steps have taken, s."""
        return self._integration.kernel_seconds

    @property
    def stamp_ns(self) -> int:
        """Simulated time for message headers, ns: 1 at tick 0, for ROS reads 0 as unset."""
        return max(1, self.tick * self.model.tick_ns)

    @property
    def line(self) -> Line:
        """All but the bottles' motion: to be looked at; what acts on it is given by `give`."""
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
        """Let `ticks` ticks pass. Raises SimulationError, in one sentence, for a tick that the guard can't let pass;
        the state is that at its beginning then.
        """
        for _ in range(ticks):
            self._line.begin(self.tick)
            peaks = self._state.world.peaks
            if peaks is not None and self.due("bottles"):
                peaks.force[:] = 0.0
                peaks.impulse[:] = 0.0
            if self._damage is not None:
                self._damage.begin(self.due("damage"))
            self._integration.take_tick(self.tick, self._line.fastest_surface)
            self.tick += 1
            passed = [] if self._damage is None else self._damage.end(self.tick)
            if self._clogging is not None:
                passed += self._clogging.end(self.tick, self._line.removed_by())
            self._line.end(self.tick)
            self._remove()
            self._feed()
            self._line.close(passed, {} if self._clogging is None else self._clogging.clogged())
            self._state.make_lists()

    def give(self, given: Input) -> None:
        """Queue an input; the next tick applies it, or refuses it with the reason (`take_outcomes`).

        Raises ValueError for one of the kind "line": what the line does, it does by itself.
        """
        if given.by_line:
            raise ValueError(f"writer_kind: line given by {given.source}, expected another: that is the line itself")
        self._line.queue(given)

    def command(
        self,
        names: Sequence[str],
        values: Sequence[float],
        source: str = "commands",
        *,
        writer: str = "",
        writer_kind: WriterKind = "controller",
    ) -> None:
        """Queue setpoints by name (`process_image.command_names`); the next tick applies or refuses them together.

        writer: "" for the name of the source. Raises ValueError for the sources that faults and the line itself have.
        """
        if source in (FAULT, WATCHDOG, ARRIVAL):
            raise ValueError(
                f"source: {source} given, expected another: {FAULT}, {WATCHDOG} and {ARRIVAL} are the line's"
            )
        self.give(Input(source, writer or source, writer_kind, SET, tuple(names), tuple(values)))

    def inject(self, name: str, value: float, *, writer: str = FAULT) -> None:
        """Queue a fault by name (`process_image.fault_names`), as `command` does; its source is "fault"."""
        self.give(Input(FAULT, writer, "test", INJECT, (name,), (value,)))

    def operate(self, operation: str, names: Sequence[str] = (), values: Sequence[float] = (), *, writer: str) -> None:
        """Queue what an operator does: `acknowledge`, `reset`, `shelve`, ... of alarms by their ids."""
        self.give(Input(OPERATE, writer, "operator", operation, tuple(names), tuple(values)))

    def refusal(self, given: Input) -> str:
        """Why the next tick would refuse an input if nothing came before it, "" if it would not."""
        return self._line.refusal(given)

    @property
    def waiting(self) -> Sequence[Input]:
        """Inputs that wait for the next tick."""
        return self._line.waiting

    def take_waiting(self) -> list[Input]:
        """The same, given up: they will not be applied."""
        return self._line.take_waiting()

    def take_outcomes(self) -> list[CommandOutcome]:
        """What became of inputs since the last call, in order."""
        return self._line.take_outcomes()

    @property
    def happened(self) -> Sequence[Event]:
        """What has happened on the line since the tick before, in order."""
        return self._line.happened

    @property
    def alarms(self) -> frozenset[str]:
        """Ids of the alarms that stand: active or latched, and neither shelved, suppressed nor out of service."""
        return frozenset(alarm.id for alarm in self._line.alarms if alarm.stands)

    def take_guard_events(self) -> list[GuardEvent]:
        """What the guard has reported since the last call, in order."""
        return self._integration.take_events()

    def take_damage_events(self) -> list[DamageEvent]:
        """What went beyond a limit of the scene since the last call, in order."""
        watches = (self._damage, self._clogging)
        events = [event for watch in watches if watch is not None for event in watch.take_events()]
        return sorted(events, key=lambda event: event.tick)

    @property
    def shortened_ticks(self) -> int:
        """Ticks so far that were done again in shorter steps."""
        return self._integration.shortened_ticks

    @property
    def deepest_overlap(self) -> float:
        """The largest overlap over a radius so far that the guard has seen."""
        return self._integration.deepest_overlap

    @property
    def threads(self) -> int:
        """Threads that the next tick is to be stepped with."""
        return self._integration.threads

    def restore_from(self, other: "Simulation") -> None:
        """Take over the bottles, the time and the belts' speeds of another Simulation of the same line.

        The scenes may differ in their effects and steps. Tangential springs of contacts start anew.
        """
        self.tick = other.tick
        self._line.restore_from(other._line)
        self._state.restore_from(other._state)
        self._integration.put_in()
        self._line.move_belts()
        if self._account is not None:
            self._account.restart()

    @contextmanager
    def editing(self) -> Iterator[tuple[Bottles, NDArray[np.int64]]]:
        """The bottles' arrays, to be changed from outside between two ticks, and the slots in them by order of the ids.

        The ledger books what that does to the energy as fed.
        """
        with nullcontext() if self._account is None else self._account.feeding():
            yield self._state.world.bottles, self._slots()
            self._state.world.neighbourhood.stale[0] = 1
        self._state.make_lists()
        self._integration.put_in()

    def due(self, output: str) -> bool:
        """Whether this tick is one at which an output (`Scene.TOPICS`) is made."""
        every = self._every[output]
        return every > 0 and self.tick % every == 0

    def bottles(self) -> BottleColumns:
        """Every bottle present, ordered by id; peaks are NaN where the scene has no such output (effect `peaks`)."""
        world = self._state.world
        slots = self._slots()
        rest, unknown = np.zeros(slots.size), np.full(slots.size, math.nan)
        spin = world.spin
        return BottleColumns(
            id=world.bottles.id[slots].astype(np.uint64),
            type=world.bottles.type[slots].astype(np.uint16),
            x=world.bottles.x[slots],
            y=world.bottles.y[slots],
            theta=spin.theta[slots] if spin is not None else rest,
            vx=world.bottles.vx[slots],
            vy=world.bottles.vy[slots],
            omega=spin.omega[slots] if spin is not None else rest,
            belt=self._line.carriers()[slots],
            peak_force=world.peaks.force[slots] if world.peaks is not None else unknown,
            impulse=world.peaks.impulse[slots] if world.peaks is not None else unknown,
        )

    @property
    def peak_force(self) -> float | None:
        """Largest normal contact force since bottles were last output, N; None without the effect `peaks`."""
        peaks = self._state.world.peaks
        return None if peaks is None else float(peaks.force.max(initial=0.0))

    def contacts(self) -> ContactColumns:
        """Every closed contact at this tick, with the forces that act now."""
        kind, ends, values = closed_contacts(self._state.world, self._integration.found)
        ids = self._state.world.bottles.id
        b = np.where(kind == 0, ids[np.where(kind == 0, ends[1], 0)], ends[1])
        return ContactColumns(kind, ids[ends[0]].astype(np.uint64), b.astype(np.uint64), *values)

    def belts(self) -> BeltColumns:
        """Commanded and actual speeds, m/s."""
        return BeltColumns(self._line.now.setpoints.copy(), self._line.now.speeds.copy())

    def moving_rails(self) -> tuple[RailShape, ...]:
        """Gates, pushers and diverters where they are now, the last ones of all rails by number."""
        return self._state.moving_rails()

    def ledger(self) -> Ledger | None:
        """Where energy came from and went since the start; None without the effect `energy_ledger`."""
        return None if self._account is None else self._account.ledger()

    def damage(self) -> DamageColumns | None:
        """Loads on every bottle present, ordered by id; None where the scene does not ask."""
        return None if self._damage is None else self._damage.columns(self._slots())

    def rail_wear(self) -> RailWearColumns | None:
        """Loads on the rails since the start; None where the scene does not ask."""
        return None if self._damage is None else self._damage.rail_wear()

    def signals(self) -> np.ndarray:
        """The process image as controllers read it, in the order of `process_image.signal_names`; float64."""
        return self._line.signals().values

    def state_hash(self) -> int:
        """Return a 64-bit hash of tick, bottles, stretched springs, belts and moving rails."""
        bottles, now = self.bottles(), self._line.now
        columns = [*(getattr(bottles, name) for name in COLUMNS), now.setpoints, now.speeds]
        return state_hash(self.tick, columns, self._state)

    def full_state_hash(self) -> int:
        """Return 64 bits over everything that decides how the run continues (`physics/state/full_state_hash.py`)."""
        return full_state_hash(self._snapshot(), changing_arrays(self._state.world), self.scene.limits)

    def rehearse(self) -> None:
        """Call what the line may call of the engine in a later tick, so that it is compiled before a run begins."""
        self._line.rehearse()

    def _snapshot(self) -> dict[str, Any]:
        """All that changes as it runs but the arrays of the World, as plain data."""
        return {
            "tick": self.tick,
            "next_id": self._state.next_id,
            "held": list(self._state.held.items()),
            "line": self._line.snapshot(),
            "account": None if self._account is None else snapshot(self._account),
            "damage": None if self._damage is None else snapshot(self._damage),
            "clogging": None if self._clogging is None else snapshot(self._clogging),
            "integration": self._integration.snapshot(),
        }

    def _restore(self, checkpoint: Checkpoint) -> None:
        memory = checkpoint.memory
        try:
            entries(memory, self._snapshot(), "memory")
            self.tick = typed(int, memory["tick"], "tick")
            if self.tick < 0 or self.stamp_ns > LAST_STAMP_NS:
                raise ValueError(f"tick {self.tick}, which no message can say")
            self._line.restore(self.tick, memory["line"])
            accounts = (("account", self._account), ("damage", self._damage), ("clogging", self._clogging))
            for name, account in accounts:
                if account is None:
                    typed(type(None), memory[name], name)
                else:
                    restore(account, memory[name], name)
            self._integration.restore(memory["integration"])
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
            with nullcontext() if self._account is None else self._account.removing():
                self._line.take()

    def _feed(self) -> None:
        if self._line.feeds:
            with nullcontext() if self._account is None else self._account.feeding():
                self._line.feed()
