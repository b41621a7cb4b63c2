# SPDX-License-Identifier: Apache-2.0
"""Replay of a recorded line with the recorded commands at their ticks, and comparison of every recorded state."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.bag.compare import ReplayDifference, first_difference, outcome_difference
from conveyor_sim.bag.input_log import START_NAME
from conveyor_sim.bag.messages.encode import Header, Outcome, to_outcome
from conveyor_sim.bag.messages.topics import COMPARED, STATES, Snapshot
from conveyor_sim.bag.messages.typestore import typestore
from conveyor_sim.bag.reader import Bag, open_bag
from conveyor_sim.bag.recorded_scene import recorded_scene
from conveyor_sim.columns.image import NOTHING_FORCED, Image
from conveyor_sim.errors import BagError, SceneError
from conveyor_sim.line.commands.inputs import ARRIVAL
from conveyor_sim.scene import parse_again, parse_overrides
from conveyor_sim.simulation import Simulation
from conveyor_sim.support.printable import printable


@dataclass(frozen=True)
class ReplayReport:
    """Result of a replay."""

    path: Path
    exact: bool
    """True if states were compared bit for bit, and not within tolerances."""
    environment: tuple[str, ...]
    """One sentence for each difference from the recording's machine and versions."""
    first_tick: int
    last_tick: int
    """Ticks of the first and last recorded state."""
    end: float
    """Simulated time up to which states were equal, or of the first difference, s."""
    compared: dict[str, int]
    """Messages compared, by topic."""
    difference: ReplayDifference | None
    """First difference; None: all states are equal."""


class _Messages:
    """The messages of one topic in the order of their ticks, each taken once."""

    def __init__(self, bag: Bag, topic: str, end_ns: int) -> None:
        """end_ns: intended end of the run; the tick of a later message must agree with its stamp."""
        self.topic = topic
        self._end_ns = end_ns
        end = bag.next_run_ns
        raw = bag.raw({topic})
        self._source: Iterator[Any] = (self._decode(bag, data) for _, time, data in raw if end is None or time < end)
        self._next = next(self._source, None)

    @property
    def next_tick(self) -> int | None:
        """Tick of the message to come; None after the last."""
        return None if self._next is None else int(self._next.tick)

    def _decode(self, bag: Bag, data: bytes) -> Any:
        """Decode a message. Raise BagError for a damaged tick, which the simulation might take years to reach."""
        message = bag.decode(self.topic, data)
        stamp = message.header.stamp
        stamp_ns = stamp.sec * 10**9 + stamp.nanosec
        if message.tick * bag.line.tick_ns > max(stamp_ns, self._end_ns):
            raise BagError(
                f"{bag.path}: a message of topic {self.topic} has tick {message.tick} and the time {stamp_ns * 1e-9:g} "
                "s, expected a tick of that time"
            )
        return message

    def take(self, tick: int) -> Iterator[Any]:
        """Yield the messages up to a tick. The caller reports ticks earlier than the expected one as differences."""
        while self._next is not None and self._next.tick <= tick:
            message = self._next
            self._next = next(self._source, None)
            yield message


def replay(path: str | Path, progress: Callable[[float, float], None] | None = None) -> ReplayReport:
    """Replay a bag (recorded by this package or, with the same topics, by stock rosbag2) and compare its states.

    The topics of topics.COMPARED and the results of commands are compared bit for bit if the engine, versions and
    machine are those of the recording. Otherwise topics with tolerances are compared within these, and others not.
    A run that began at a checkpoint is replayed from it, if it is in the bag's folder as `start.npz`.
    The replay stops at the first difference. progress(done, total) is called with simulated times, s.
    Raise BagError, also for a recording that this version can't simulate again (`_simulation`). Raise
    SceneError if the recorded scene is refused, CheckpointError if a checkpoint is damaged or of another version.
    """
    with open_bag(path) as bag, bag.sense():
        start = (bag.path if bag.path.is_dir() else bag.path.parent) / START_NAME
        if start.exists():
            simulation = _from_checkpoint(bag, start)
        elif bag.line.tick > 0:
            raise BagError(
                f"{bag.path}: began from a checkpoint at tick {bag.line.tick}, expected a run from tick 0, or the "
                f"checkpoint as {START_NAME} beside it: the recording does not hold what was before"
            )
        else:
            simulation = _simulation(bag)
        environment = _environment(bag, simulation)
        return _Replay(bag, simulation, environment, progress).run()


class _Replay:
    def __init__(
        self,
        bag: Bag,
        simulation: Simulation,
        environment: tuple[str, ...],
        progress: Callable[[float, float], None] | None,
    ) -> None:
        self._bag = bag
        self._sim = simulation
        self._environment = environment
        self._exact = not environment
        self._progress = progress
        recorded, types = bag.counts, bag.types
        here = [row for row in COMPARED.values() if self._exact or row.compare.within]
        topics = [row.name for row in here if recorded.get(row.name) and types[row.name] == row.type]
        end_ns = simulation.scene.duration_ticks * simulation.model.tick_ns
        self._states = [_Messages(bag, topic, end_ns) for topic in topics]
        self._signals = _signals_by_name(bag, simulation)
        self._outcomes = _Messages(bag, "outcomes", end_ns) if recorded.get("outcomes") else None
        self._compared = dict.fromkeys(topics, 0)
        self._last_tick = -1
        if not self._states:
            raise BagError(f"{bag.path}: holds no message of topics {', '.join(STATES)}; nothing can be compared")

    def run(self) -> ReplayReport:
        first_tick = min(tick for state in self._states if (tick := state.next_tick) is not None)
        total = self._sim.scene.duration
        difference = self._compare_states()
        while difference is None and any(state.next_tick is not None for state in self._states):
            commands = self._recorded_outcomes()
            for outcome in commands:
                if not outcome.input.by_line:  # the simulation makes those of the line itself
                    self._sim.give(outcome.input)
            self._sim.advance(1)
            difference = self._compare_outcomes(commands) or self._compare_states()
            if self._progress is not None:
                self._progress(self._sim.time, total)
        return ReplayReport(
            path=self._bag.path,
            exact=self._exact,
            environment=self._environment,
            first_tick=first_tick,
            last_tick=self._last_tick,
            end=self._bag.time(self._sim.tick) if difference is None else difference.time,
            compared=self._compared,
            difference=difference,
        )

    def _recorded_outcomes(self) -> list[Outcome]:
        if self._outcomes is None:
            return []
        outcomes = map(to_outcome, self._outcomes.take(self._sim.tick))
        return [outcome for outcome in outcomes if outcome.source != ARRIVAL]  # those never reached the line

    def _compare_outcomes(self, recorded: list[Outcome]) -> ReplayDifference | None:
        replayed = [*map(Outcome.of, self._sim.take_outcomes())]
        if self._outcomes is not None:
            self._compared["outcomes"] = self._compared.get("outcomes", 0) + len(recorded)
        else:
            return None
        tick = self._sim.tick - 1
        return outcome_difference(tick, self._bag.time(tick), recorded, replayed, exact=self._exact)

    def _compare_states(self) -> ReplayDifference | None:
        now = Snapshot(self._sim)
        for state in self._states:
            for message in state.take(self._sim.tick):
                self._compared[state.topic] += 1
                self._last_tick = max(self._last_tick, self._sim.tick)
                difference = self._compare(state.topic, message, now)
                if difference is not None:
                    return difference
        return None

    def _compare(self, topic: str, recorded: Any, now: Snapshot) -> ReplayDifference | None:
        header, row = Header(self._sim.tick, self._sim.stamp_ns, recorded.header.frame_id), COMPARED[topic]
        assert row.state is not None
        if (state := row.state(now)) is None:
            tick, time = self._sim.tick, self._bag.time(self._sim.tick)
            return ReplayDifference(tick, time, topic, "the number of messages", "1", "0")
        if topic == "signals":
            state = Image(state.values[self._signals], *NOTHING_FORCED)
        # The present definition, to which messages of earlier formats were converted.
        replayed = typestore().deserialize_cdr(row.pack(state, header), row.type)
        return first_difference(topic, self._bag.line, recorded, replayed, exact=self._exact)


def _simulation(bag: Bag) -> Simulation:
    try:
        simulation = Simulation(recorded_scene(bag.line, f"{bag.path} (recorded scene)"))
    except SceneError as error:
        raise SceneError(f"{bag.path}: the recorded scene is refused by this version:\n{error}") from error
    model = simulation.model
    if bag.format == 4 and model.friction_solver == "implicit" and model.settings.warm is not None:
        raise BagError(
            f"{bag.path}: format 4 with implicit friction and {model.integrator}, expected another format, solver or "
            "integrator: this version evaluates the friction under bottles at another time of the step"
        )
    if bag.format < 8 and model.sweeps:
        raise BagError(
            f"{bag.path}: format {bag.format} with integrator {model.integrator}, expected format 8 or another "
            "integrator: this version solves the contacts of a step in another way or order"
        )
    for axis in model.plant.axes:
        if axis.kind == "position" and f"{axis.name}/blocked" not in bag.line.signal_names:
            raise BagError(
                f"{bag.path}: recorded when {axis.name} pushed with unlimited force, expected a recording with the "
                f"signal {axis.name}/blocked: by this version it would be another run"
            )
    return simulation


def _signals_by_name(bag: Bag, simulation: Simulation) -> NDArray[np.int64]:
    """Return the places of the recorded signals, in their order, among those of this version, which may have more."""
    index = {name: place for place, name in enumerate(simulation.process_image.signal_names)}
    gone = [name for name in bag.line.signal_names if name not in index]
    if gone:
        raise BagError(f"{bag.path}: holds the signal {printable(gone[0])}, expected those that this version has")
    return np.array([index[name] for name in bag.line.signal_names], dtype=np.int64)


def _from_checkpoint(bag: Bag, start: Path) -> Simulation:
    # With the present defaults, unlike `recorded_scene`, because a checkpoint is of this version.
    name, overrides = f"{bag.path} (recorded scene)", parse_overrides(bag.line.overrides)
    simulation = Simulation.load(start, scene=parse_again(bag.line.scene_text, name, overrides))
    if simulation.tick != bag.line.tick:
        raise BagError(
            f"{start}: a checkpoint at tick {simulation.tick}, expected the one at tick {bag.line.tick}, "
            "from which the recording began"
        )
    simulation.line.take_waiting()  # it is among the recorded outcomes
    simulation.take_events()  # of the run before the checkpoint
    return simulation


def _environment(bag: Bag, simulation: Simulation) -> tuple[str, ...]:
    """Return one sentence for each difference between the recording and here that can change bits."""
    line, model = bag.line, simulation.model
    pairs: list[tuple[str, Any, Any]] = [
        ("engine", line.engine_hash, model.engine_hash),
        ("versions", ", ".join(line.versions), ", ".join(model.versions)),
        ("machine", line.machine, model.machine),
        ("effects", ", ".join(line.effects), ", ".join(effect.name for effect in model.effects if effect.on)),
        ("dt", line.dt, model.dt),
        ("seed", line.seed, simulation.scene.seed),
    ]
    return tuple(f"{what}: {then} recorded, {now} here" for what, then, now in pairs if then != now)
