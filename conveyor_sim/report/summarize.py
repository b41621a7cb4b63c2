# SPDX-License-Identifier: Apache-2.0
"""A run summed up while its bag goes by."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.bag.messages.cdr import behind_tick
from conveyor_sim.bag.messages.topics import TOPICS
from conveyor_sim.bag.reader import Bag, open_bag
from conveyor_sim.bag.recorded_scene import recorded_scene
from conveyor_sim.columns.itinerary import Itinerary
from conveyor_sim.columns.ledger import Ledger
from conveyor_sim.errors import SceneError
from conveyor_sim.line.commands.inputs import ARRIVAL
from conveyor_sim.physics.model import Model, build_model
from conveyor_sim.physics.model.remedies import StepLimit, step_limit
from conveyor_sim.physics.model.step_choice import choose_steps
from conveyor_sim.physics.plant import Plant
from conveyor_sim.report.alarm_figures import AlarmTally
from conveyor_sim.report.bottle_counts import BottleCounter, BottleCounts
from conveyor_sim.report.explain.choices import scene_warnings
from conveyor_sim.report.summary import BeltFlow, Energy, LoadHistory, Loop, Summary
from conveyor_sim.run.force_check import PressWatch, achieved, pressed
from conveyor_sim.run.queue_check import QueueWatch
from conveyor_sim.run.speed import TopicCount
from conveyor_sim.scene import parse_again, parse_overrides
from conveyor_sim.support.printable import SENTENCE, printable

GUARD_TEXTS = 3
SUMMED = ("bottles", "ledger", "damage", "damage_events", "outcomes", "guard", "events", "alarm_states", "run_state")
TAKEN = {TOPICS[name].type: TOPICS[name] for name in SUMMED}
"""Summarised topics by message type, because topics may have been renamed."""


def summarize(path: str | Path, wall: float | None = None) -> Summary:
    """Summarise a bag in one pass. wall: wall time of the run, s, if known. Raise BagError if it can't be read."""
    with open_bag(path) as bag, bag.sense():
        return _Tally(bag).summary(wall)


class _Tally:
    """Counts while a bag goes by."""

    def __init__(self, bag: Bag) -> None:
        self._bag = bag
        self._model = _model(bag.line)
        self._counter = BottleCounter("events" in bag.counts)
        self._topics: dict[str, list[int]] = {topic: [0, 0] for topic in bag.counts}
        self._last_tick = 0
        self._itinerary = Itinerary(
            len(bag.line.belts), None if self._model is None else len(self._model.plant.bottles)
        )
        self._forces: list[NDArray[np.float64]] = []
        self._unknown = False
        self._bottles: tuple[int, NDArray[np.int32]] | None = None
        """Tick of the last bottles, and the belts under them."""
        self._moments = 0
        """Number of messages of bottles."""
        self._ledger: Ledger | None = None
        self._outcomes: Counter[bool] = Counter()
        self._repeated, self._result = b"", (False, False)
        """Content of the last command result; whether it was accepted, and whether it tells of an arrival."""
        self._occasions = 0
        self._guard: list[tuple[str, str]] = []
        self._borne: LoadHistory | None = None
        self._passed: list[tuple[str, str]] = []
        self._alarms = AlarmTally()
        self._pressing = PressWatch()
        self._queues = QueueWatch(self._model)
        for topic, _, data in bag.raw():
            self._topics[topic][0] += 1
            self._topics[topic][1] += len(data)
            if (row := TAKEN.get(bag.types[topic])) is None:
                continue
            if row.name == "outcomes":
                self._take_outcome(topic, data)
            else:
                self._take(row.name, bag.decode(topic, data))

    def _take(self, topic: str, message: Any) -> None:
        self._last_tick, read = max(self._last_tick, int(message.tick)), TOPICS[topic].unpack(message)
        if topic == "bottles":
            self._bottles = message.tick, read.belt
            self._moments += 1
            self._counter.take_bottles(read.id)
            time = self._bag.time(message.tick)
            self._itinerary.take(time, read)
            self._pressing.take(time, read.id, read.impulse)
            self._queues.take(time, read)
            self._forces.append(read.peak_force[read.peak_force > 0.0])
            self._unknown = self._unknown or bool(np.isnan(read.peak_force).any())
        elif topic == "guard":
            self._guard.append((printable(message.kind), printable(message.text, SENTENCE)))
        elif topic == "damage":
            self._borne = (self._borne or LoadHistory()).with_more(read)
        elif topic == "damage_events":
            self._passed.append((printable(message.kind), printable(message.text, SENTENCE)))
        elif topic == "ledger":
            self._ledger = read
        elif topic == "events":
            self._counter.take_events(read)
            for at, kind, name in zip(read.at, read.kind, read.name, strict=True):
                self._occasions += kind == "command_refused"
                self._alarms.event(self._bag.time(int(at)), kind, printable(name))
        elif topic == "alarm_states":
            self._alarms.states = read

    def _take_outcome(self, topic: str, data: bytes) -> None:
        """Count a command result. A controller repeats its commands, and equal messages are decoded once."""
        self._last_tick = max(self._last_tick, self._bag.tick(topic, data))
        content = behind_tick(data)
        if content != self._repeated:
            outcome = self._bag.decode(topic, data)
            self._repeated, self._result = content, (bool(outcome.accepted), outcome.source == ARRIVAL)
        accepted, is_arrival = self._result
        self._outcomes[accepted] += 1
        self._occasions += is_arrival  # which the line knows nothing of

    def summary(self, wall: float | None) -> Summary:
        forces = np.concatenate(self._forces) if self._forces else np.zeros(0)
        belt = np.zeros(0, dtype=np.int32) if self._bottles is None else self._bottles[1]
        peak = None if self._unknown else float(forces.max(initial=0.0))
        line, model = self._bag.line, self._model
        seconds = self._bag.time(max(0, self._last_tick - int(line.tick)))
        return Summary(
            scene=printable(line.scene_name),
            bag=printable(self._bag.path, SENTENCE),
            simulated=seconds,
            wall=wall,
            bottles=self._counts(),
            on_floor=int(np.count_nonzero(belt < 0)),
            belts=self._belts(belt),
            loop=self._loop(),
            peak_force=peak,
            peak_force_99=None if self._unknown else float(np.percentile(forces, 99.0)) if len(forces) else 0.0,
            setting=printable(f"{line.integrator}, dt = {line.dt * 1e6:.4g} us: {line.dt_reason}", SENTENCE),
            predicted=None if model is None else model.prediction.sentence,
            limit=_step_limit(line, len(belt)),
            achieved=None if model is None else achieved(model, peak),
            pressed=None if model is None else pressed(model, self._pressing.load),
            queue=self._queues.check,
            warnings=[] if model is None else [printable(text, SENTENCE) for text in scene_warnings(model)],
            guard=dict(Counter(kind for kind, _ in self._guard)),
            guard_texts=[text for _, text in self._guard[:GUARD_TEXTS]],
            energy=None if self._ledger is None else _energy(self._ledger, line.belts, line.rails),
            borne=self._borne,
            from_impulses=line.integrator == "impulses",
            damage_events=dict(Counter(kind for kind, _ in self._passed)),
            damage_texts=[text for _, text in self._passed[:GUARD_TEXTS]],
            alarms=self._alarms.figures(seconds, int(line.tick_ns) * 1e-9) if "events" in self._bag.counts else None,
            commands=self._outcomes.total(),
            refused=self._outcomes[False],
            occasions=self._occasions if "events" in self._bag.counts else None,
            topics={printable(topic): TopicCount(*counts) for topic, counts in self._topics.items()},
        )

    def _counts(self) -> BottleCounts:
        """Return the counts at the last recorded bottles. With bottles of the start alone: counts at the end."""
        tick, belt = (-1, ()) if self._bottles is None else self._bottles
        if self._moments > 1 or tick == self._last_tick:
            return self._counter.at(tick, len(belt))
        return self._counter.at(self._last_tick, None)

    def _belts(self, belt: NDArray[np.int32]) -> dict[str, BeltFlow]:
        flows = {}
        for index, name in enumerate(self._bag.line.belts):
            rates = self._itinerary.per_minute(self._itinerary.entries[index])
            flows[name] = BeltFlow(int(np.count_nonzero(belt == index)), *rates)
        return flows

    def _loop(self) -> Loop | None:
        returns = self._itinerary.returns
        index = max(range(len(returns)), key=lambda belt: len(returns[belt]), default=None)
        if index is None or not returns[index]:
            return None
        rates = self._itinerary.per_minute(returns[index])
        return Loop(self._bag.line.belts[index], len(returns[index]), *rates)


def _energy(ledger: Ledger, belts: list[str], rails: list[str]) -> Energy:
    moving = rails[len(rails) - ledger.rail_work.size :]
    return Energy(
        # The last entry is the floor's.
        belts=dict(zip(belts, ledger.belt_work[:-1].tolist(), strict=True)),
        fed=ledger.fed,
        removed=ledger.removed,
        stored=ledger.kinetic + ledger.elastic + ledger.springs,
        base_friction=ledger.base_friction,
        contact_friction=ledger.contact_friction,
        damping=ledger.damping,
        residual=ledger.residual,
        turnover=ledger.turnover,
        rails=dict(zip(moving, ledger.rail_work.tolist(), strict=True)),
    )


def _model(line: Any) -> Model | None:
    """Return the model of a recorded scene at its recorded number of steps; None if this version refuses the scene."""
    try:
        return build_model(recorded_scene(line, line.scene_name))
    except SceneError:
        return None


def _step_limit(line: Any, bottles: int) -> StepLimit | None:
    """Return the step limit of a recorded scene; None if this version would choose another number of steps.

    bottles: on the line at the end.
    """
    try:
        scene = parse_again(line.scene_text, line.scene_name, parse_overrides(line.overrides))
        choice = choose_steps(Plant.of(scene))
    except SceneError:
        return None
    chosen = scene.accuracy.integrator, choice.steps, scene.accuracy.sweeps or 0
    same = chosen == (line.integrator, line.steps_per_tick, line.sweeps)
    return step_limit(scene, choice, bottles) if same else None
