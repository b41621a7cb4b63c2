# SPDX-License-Identifier: Apache-2.0
"""Plays a case in every way that must come to the same, under the eyes of the invariants."""

from __future__ import annotations

import math
import re
import tempfile
import traceback
from collections import defaultdict
from dataclasses import dataclass
from hashlib import blake2b
from itertools import cycle
from pathlib import Path

from fuzz.case import Case
from fuzz.invariants import Invariants, Sent
from fuzz.violation import Violation

from conveyor_sim.bag.outputs import OutputWriter
from conveyor_sim.bag.recorder import Recorder
from conveyor_sim.bag.replay import replay
from conveyor_sim.errors import SceneError, SimulationError
from conveyor_sim.line.commands.inputs import CommandOutcome
from conveyor_sim.physics.model import build_model
from conveyor_sim.scene import Scene, parse_scene
from conveyor_sim.simulation import Simulation

MOST_WORK = 6e6
"""Bottles times steps in a run, so that it takes some tenths of a second; what is longer is played for fewer ticks."""


@dataclass(frozen=True)
class Played:
    """What came of a case."""

    how: str
    """`run`, `refused` by SceneError, `stopped` by SimulationError, or `too long`: a tick has too many steps."""
    sentence: str = ""
    ticks: int = 0
    simulated: float = 0.0
    """s, all runs of the case together."""
    bottles: int = 0
    bottle_ticks: int = 0
    contacts: int = 0
    replayed: int = 0
    """Bags."""

    @property
    def kind(self) -> str:
        """The sentence without its names and numbers."""
        return kind_of(self.sentence)


def kind_of(sentence: str) -> str:
    """A sentence without numbers and the names of parts, to count by."""
    first = sentence.splitlines()[0] if sentence else ""
    first = re.sub(r"(rail|belt|type|in|out)_\d+(_inner|_outer)?", r"\1_*", first)
    first = re.sub(r"\[\d+\]", "[*]", first)
    return re.sub(r"[-+]?(\d+\.?\d*|\.\d+)(e[-+]?\d+)?", "#", first)


def play(case: Case) -> Played:
    """Runs a case watched; again unwatched, on one or two threads; again divided differently, by a checkpoint half-way;
    again from its bag.

    Raises Violation where something must never be; any other exception than SceneError and SimulationError is a failure
    as well.
    """
    try:
        scene = parsed(case)
        model = build_model(scene)
        bottles = max(1, len(Simulation(scene, threads=1).bottles().id))
    except SceneError as error:
        check_sentence(str(error))
        return Played("refused", str(error))
    if (bottles + 10) * model.steps_per_tick > MOST_WORK:
        return Played("too long", model.dt_reason)
    ticks = min(case.ticks, math.floor(MOST_WORK / ((bottles + 10) * model.steps_per_tick)))
    with tempfile.TemporaryDirectory() as folder:
        bag = Path(folder) / "bag" if case.recorded and any(map(scene.every, scene.TOPICS)) else None
        first = _watched(scene, case, ticks, bag)
        half = len(first.hashes) // 2, Path(folder) / "half.npz"
        runs = [_Run(scene, case, threads=case.threads), _Run(scene, case, threads=1, calls=case.calls, save=half)]
        for run in runs:
            run.until(len(first.hashes))
            first.compare(run)
        replayed = 0 if bag is None or first.stopped or not first.hashes else _replayed(bag)
    done = len(first.hashes)
    return Played(
        "stopped" if first.stopped else "run",
        first.stopped,
        ticks=done,
        simulated=(1 + len(runs) + replayed) * done * scene.tick,
        bottles=first.bottles,
        bottle_ticks=first.bottle_ticks,
        contacts=first.contacts,
        replayed=replayed,
    )


def parsed(case: Case) -> Scene:
    """The scene of a case. Raises SceneError."""
    return parse_scene(case.scene_text, "scene.yaml")


def check_sentence(text: str) -> None:
    """Each problem is a line that says where, and what is wrong or was expected, in words of ours."""
    foreign = ("Traceback", "Input should", "pydantic", "NoneType", "object at 0x", "Error(")
    for line in text.splitlines():
        if len(line) < 20 or not re.match(r"\S.*[: ]", line) or any(word in line for word in foreign):
            raise Violation("words of a refusal", line)


def failure_kind(error: Exception) -> str:
    """What a failure is called, so that the same is told once: that of a Violation, or where it was raised."""
    if isinstance(error, Violation):
        return error.kind
    place = traceback.extract_tb(error.__traceback__)[-1]
    return f"{type(error).__name__} in {Path(place.filename).name}, {place.name}"


class _Run:
    """One run of a case: nobody looks at it but for its hash at the end of each call."""

    def __init__(
        self,
        scene: Scene,
        case: Case,
        threads: int,
        calls: list[int] | None = None,
        save: tuple[int, Path] | None = None,
    ) -> None:
        """calls: ticks of each call of `advance`, in turn. save: from what tick on it goes on from a checkpoint."""
        self.simulation = Simulation(scene, threads=threads)
        self.name = f"{threads} threads" if calls is None else f"calls of {calls} ticks"
        self.hashes: dict[int, str] = {0: state_of(self.simulation)}
        self.outcomes: list[CommandOutcome] = []
        self.stopped = ""
        self._calls = cycle(calls or [1])
        self._commands = by_tick(case)
        self._save = save

    def until(self, ticks: int) -> None:
        """Runs to so many ticks, and one more where the watched run was stopped in it."""
        while self.simulation.tick < ticks and not self.stopped:
            self.step(min(next(self._calls), ticks - self.simulation.tick))

    def step(self, ticks: int) -> None:
        """One call of `advance`, which ends where a command is sent."""
        if self._save is not None and self.simulation.tick >= self._save[0]:
            self.simulation.save(self._save[1])
            self.simulation = Simulation.load(self._save[1], threads=1)
            self._save = None
        simulation = self.simulation
        send(simulation, self._commands.get(simulation.tick, []))
        ahead = [tick - simulation.tick for tick in self._commands if tick > simulation.tick]
        try:
            simulation.advance(min([ticks, *ahead]))
        except SimulationError as error:
            self.stopped = str(error)
            return
        self.outcomes += simulation.take_outcomes()
        self.hashes[simulation.tick] = state_of(simulation)


@dataclass
class _Watched:
    hashes: list[str]
    """At the end of each tick."""
    outcomes: list[CommandOutcome]
    stopped: str
    bottles: int
    bottle_ticks: int
    contacts: int

    def compare(self, run: _Run) -> None:
        """Raises Violation where another run came to something else."""
        if run.stopped:
            raise Violation("replay differs", f"{run.name}: stopped ({run.stopped}) where the first run was not")
        for tick, found in run.hashes.items():
            if tick > 0 and found != self.hashes[tick - 1]:
                raise Violation("replay differs", f"{run.name}: another state at tick {tick}")
        if repr(run.outcomes) != repr(self.outcomes):
            raise Violation("replay differs", f"{run.name}: other outcomes, {run.outcomes} for {self.outcomes}")


def _watched(scene: Scene, case: Case, ticks: int, bag: Path | None) -> _Watched:
    simulation = Simulation(scene, threads=1)
    recorder = Recorder(bag) if bag is not None else None
    outputs = OutputWriter(simulation, [] if recorder is None else [recorder], run_id="fuzz")
    outputs.start()
    invariants, sent = Invariants(simulation), by_tick(case)
    seen = _Watched([], [], "", simulation.counts.present, 0, 0)
    while simulation.tick < ticks and not seen.stopped:
        now = sent.get(simulation.tick, [])
        send(simulation, now)
        try:
            simulation.advance(1)
        except SimulationError as error:
            seen.stopped = str(error)
            continue
        outcomes = outputs.after_tick()
        invariants.after_tick(now, outcomes)
        seen.outcomes += outcomes
        seen.hashes.append(state_of(simulation))
    if recorder is not None:
        recorder.close()
    seen.bottles += simulation.counts.fed
    seen.bottle_ticks, seen.contacts = invariants.bottle_ticks, invariants.most_contacts
    return seen


def by_tick(case: Case) -> dict[int, Sent]:
    """The inputs of a case by the ticks after which they are sent."""
    sent: dict[int, Sent] = defaultdict(list)
    for command in case.commands:
        sent[command.tick].append((command.names, command.values, command.fault))
    return sent


def state_of(simulation: Simulation) -> str:
    """Bottles, belts and rails, and all that controllers see."""
    return f"{simulation.full_state_hash():016x}{blake2b(simulation.signals().tobytes(), digest_size=8).hexdigest()}"


def send(simulation: Simulation, inputs: Sent) -> None:
    """Queues the inputs of a tick."""
    for names, values, fault in inputs:
        if fault:
            simulation.inject(names[0], values[0])
        else:
            by_hand = any(name.startswith("panel/") for name in names)  # which a controller may not set
            simulation.command(names, values, writer_kind="test" if by_hand else "controller")


def _replayed(bag: Path) -> int:
    report = replay(bag)
    if report.difference is not None:
        raise Violation("bag differs", str(report.difference))
    if not report.exact:
        raise Violation("bag differs", f"not compared bit for bit: {report.environment}")
    return 1
