"""What a run amounts to, from its bag: the same for the node and for a run without ROS."""

from __future__ import annotations

import json
from collections import Counter
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rich.box import SIMPLE
from rich.console import Group
from rich.table import Table

from conveyor_sim.bag.reader import Bag, open_bag
from conveyor_sim.bag.recorded_scene import recorded_scene
from conveyor_sim.bag.topics import TOPICS
from conveyor_sim.errors import ConveyorError, SceneError
from conveyor_sim.line.devices import build_devices
from conveyor_sim.line.process_image import Role
from conveyor_sim.model import Model, build_model
from conveyor_sim.model.remedies import step_limit
from conveyor_sim.model.step_choice import choose_steps
from conveyor_sim.observe.columns import BottleColumns
from conveyor_sim.observe.itinerary import Itinerary
from conveyor_sim.observe.ledger import Ledger
from conveyor_sim.observe.load_history import LoadHistory
from conveyor_sim.runs.force_check import ForceCheck, Pressed, PressWatch, achieved, pressed
from conveyor_sim.scene import parse_overrides, parse_scene
from conveyor_sim.support.printable import SENTENCE, printable

FILE_NAME = "summary.json"
GUARD_TEXTS = 3
TAKEN = {
    TOPICS[name].type: TOPICS[name]
    for name in ("bottles", "signals", "ledger", "damage", "damage_events", "outcomes", "guard")
}
"""What is summed up, by message type: the topics may have been renamed."""


@dataclass(frozen=True)
class BeltFlow:
    """One belt: what is on it, and how often a bottle came onto it (seen from one recorded Bottles to the next)."""

    bottles: int
    """On it at the end."""
    per_minute: float
    """Bottles that came onto it, per simulated minute, over the whole run."""
    per_minute_second_half: float
    """The same over the second half, when the line has filled."""


@dataclass(frozen=True)
class Loop:
    """A closed loop, seen from the belt to which bottles return most often.

    A bottle has returned when it comes onto a belt that it had left, with at least two other belts in between.
    """

    belt: str
    returns: int
    per_minute: float
    per_minute_second_half: float


@dataclass(frozen=True)
class Energy:
    """The energy ledger at the end (`conveyor_sim.observe.ledger`), J."""

    belts: dict[str, float]
    """Work done by each belt."""
    fed: float
    removed: float
    stored: float
    """In motion, contacts and tangential springs."""
    base_friction: float
    contact_friction: float
    damping: float
    residual: float
    turnover: float
    rails: dict[str, float]
    """Work done by each rail that moves."""

    @property
    def sentence(self) -> str:
        """The same in words."""
        share = self.residual / self.turnover if self.turnover else 0.0
        rails = f", {sum(self.rails.values()):.4g} J from rails that move" if self.rails else ""
        return (
            f"{sum(self.belts.values()):.4g} J from belts{rails}; {self.base_friction:.4g} J lost under bottles, "
            f"{self.contact_friction:.4g} J in friction at contacts, {self.damping:.4g} J in damping; "
            f"residual {100.0 * share:.2g} % of a turnover of {self.turnover:.4g} J"
        )


@dataclass(frozen=True)
class TopicCount:
    """What was recorded of one topic."""

    messages: int
    bytes: int
    """Serialized, before compression."""


@dataclass(frozen=True)
class Summary:
    """The end-of-run account. Quantities that were not recorded are None."""

    scene: str
    bag: str
    simulated: float
    """s"""
    wall: float | None
    """s"""
    fed: int | None
    """By infeeds, sources and spills; None if this version refuses the recorded scene, or no signals were recorded."""
    removed: int | None
    """By outfeeds, sinks and rejects."""
    rejected: int | None
    """By rejects."""
    present: int
    """Bottles on the line at the end."""
    on_floor: int
    """Of them, on no belt."""
    belts: dict[str, BeltFlow]
    loop: Loop | None
    """None if no bottle came back."""
    peak_force: float | None
    """N, the largest normal contact force of the run (accumulated every step); None if the scene has no peaks."""
    peak_force_99: float | None
    """N, 99th percentile over bottles and output intervals with a contact of the peak force in the interval."""
    setting: str
    """Integrator and time step, and why."""
    predicted: str | None
    """The errors to expect; None if this version refuses the recorded scene."""
    steps: list[str]
    """What sets the number of steps, and what would lower it; empty if this version would choose another number."""
    achieved: ForceCheck | None
    """What the peak force says; None if it or the prediction is not known."""
    pressed: Pressed | None
    """What pressed for long; None if it is not known, or no bound on the time step rests on it."""
    guard: dict[str, int]
    """How often the guard said something, by kind (`GuardEvent.kind`)."""
    guard_texts: list[str]
    """What it said, the first times."""
    energy: Energy | None
    """None if no energy ledger was recorded."""
    borne: LoadHistory | None
    """Loads on the bottles; None if it was not recorded."""
    damage_events: dict[str, int]
    """How often a limit was passed, by limit."""
    damage_texts: list[str]
    """What was said of it, the first times."""
    commands: int
    refused: int
    """Of the commands."""
    topics: dict[str, TopicCount]

    @property
    def real_time_factor(self) -> float | None:
        """Simulated over wall time."""
        return self.simulated / self.wall if self.wall else None


def summarize(path: str | Path, wall: float | None = None) -> Summary:
    """Sums a bag up in one pass; wall: how long the run took, s, if known. Raises BagError if it can't be read."""
    with open_bag(path) as bag, bag.sense():
        return _Tally(bag).summary(wall)


def write_summary(summary: Summary, folder: Path) -> Path:
    """Writes summary.json into the folder; returns its path. Raises ConveyorError if it can't be written."""
    file = folder / FILE_NAME
    content = {**asdict(summary), "real_time_factor": summary.real_time_factor}
    try:
        file.write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")
    except OSError as error:
        raise ConveyorError(f"{file}: can't be written ({error.strerror})") from error
    return file


class _Tally:
    """Counts while a bag goes by."""

    def __init__(self, bag: Bag) -> None:
        self._bag = bag
        self._topics: dict[str, list[int]] = {topic: [0, 0] for topic in bag.counts}
        self._last_tick = 0
        self._itinerary = Itinerary(len(bag.line.belts))
        self._forces: list[NDArray[np.float64]] = []
        self._unknown = False
        self._bottles: BottleColumns | None = None
        self._signals: NDArray[np.float64] | None = None
        self._ledger: Ledger | None = None
        self._outcomes: Counter[bool] = Counter()
        self._guard: list[tuple[str, str]] = []
        self._borne: LoadHistory | None = None
        self._passed: list[tuple[str, str]] = []
        self._pressing = PressWatch()
        for topic, _, data in bag.raw():
            self._topics[topic][0] += 1
            self._topics[topic][1] += len(data)
            if (row := TAKEN.get(bag.types[topic])) is not None:
                self._take(row.name, bag.decode(topic, data))

    def _take(self, topic: str, message: Any) -> None:
        self._last_tick, read = max(self._last_tick, int(message.tick)), TOPICS[topic].unpack(message)
        if topic == "bottles":
            self._bottles = read
            time = self._bag.time(message.tick)
            self._itinerary.take(time, read)
            self._pressing.take(time, read.id, read.impulse)
            self._forces.append(read.peak_force[read.peak_force > 0.0])
            self._unknown = self._unknown or bool(np.isnan(read.peak_force).any())
        elif topic == "signals":
            self._signals = read
        elif topic == "guard":
            self._guard.append((printable(message.kind), printable(message.text, SENTENCE)))
        elif topic == "damage":
            self._borne = (self._borne or LoadHistory()).with_more(read)
        elif topic == "damage_events":
            self._passed.append((printable(message.kind), printable(message.text, SENTENCE)))
        elif topic == "ledger":
            self._ledger = read
        else:
            self._outcomes[bool(message.accepted)] += 1

    def summary(self, wall: float | None) -> Summary:
        forces = np.concatenate(self._forces) if self._forces else np.zeros(0)
        belt = np.zeros(0, dtype=np.int32) if self._bottles is None else self._bottles.belt
        peak = None if self._unknown else float(forces.max(initial=0.0))
        line, model = self._bag.line, _model(self._bag.line)
        roles = None if model is None else _roles(line, model)
        return Summary(
            scene=printable(line.scene_name),
            bag=printable(self._bag.path, SENTENCE),
            simulated=self._bag.time(max(0, self._last_tick - int(line.tick))),
            wall=wall,
            fed=self._counted(roles, "fed"),
            removed=self._counted(roles, "removed", "rejected"),
            rejected=self._counted(roles, "rejected"),
            present=len(belt),
            on_floor=int(np.count_nonzero(belt < 0)),
            belts=self._belts(belt),
            loop=self._loop(),
            peak_force=peak,
            peak_force_99=None if self._unknown else float(np.percentile(forces, 99.0)) if len(forces) else 0.0,
            setting=printable(f"{line.integrator}, dt = {line.dt * 1e6:.4g} us: {line.dt_reason}", SENTENCE),
            predicted=None if model is None else model.prediction.sentence,
            steps=_steps(line),
            achieved=None if model is None else achieved(model, peak),
            pressed=None if model is None else pressed(model, self._pressing.load),
            guard=dict(Counter(kind for kind, _ in self._guard)),
            guard_texts=[text for _, text in self._guard[:GUARD_TEXTS]],
            energy=None if self._ledger is None else _energy(self._ledger, line.belts, line.rails),
            borne=self._borne,
            damage_events=dict(Counter(kind for kind, _ in self._passed)),
            damage_texts=[text for _, text in self._passed[:GUARD_TEXTS]],
            commands=self._outcomes.total(),
            refused=self._outcomes[False],
            topics={printable(topic): TopicCount(*counts) for topic, counts in self._topics.items()},
        )

    def _counted(self, roles: dict[str, Role] | None, *wanted: Role) -> int | None:
        """The sum of the signals of some roles at the end."""
        if roles is None:
            return None
        names = self._bag.line.signal_names
        chosen = [index for index, name in enumerate(names) if roles.get(name) in wanted]
        if not chosen:
            return 0
        return None if self._signals is None else int(self._signals[chosen].sum())

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


def _roles(line: Any, model: Model) -> dict[str, Role]:
    """What the signals of a recorded scene count, by name."""
    devices = build_devices(recorded_scene(line, line.scene_name), model)
    return {signal.name: signal.role for device in devices for signal in device.signals}


def _model(line: Any) -> Model | None:
    """The model of a recorded scene in the steps that it ran with; None if this version refuses the scene."""
    try:
        return build_model(recorded_scene(line, line.scene_name))
    except SceneError:
        return None


def _steps(line: Any) -> list[str]:
    """What sets the steps of a recorded scene; nothing if this version would choose others than were recorded."""
    try:
        scene = parse_scene(line.scene_text, line.scene_name, parse_overrides(line.overrides))
        choice = choose_steps(scene)
    except SceneError:
        return []
    same = (scene.accuracy.integrator, choice.steps) == (line.integrator, line.steps_per_tick)
    return step_limit(scene, choice).lines if same else []


def render(summary: Summary) -> Group:
    """The summary for a terminal."""
    account = Table.grid(padding=(0, 2))
    for name, text in _account(summary):
        account.add_row(name, text)
    energy = summary.energy
    work = [] if energy is None else ["work, J"]
    belts = _table("belt", "bottles now", "came on, per min", "second half, per min", *work)
    for name, flow in summary.belts.items():
        done = [] if energy is None else [f"{energy.belts[name]:.4g}"]
        belts.add_row(name, str(flow.bottles), f"{flow.per_minute:.1f}", f"{flow.per_minute_second_half:.1f}", *done)
    topics = _table("topic", "messages", "bytes")
    for name, count in sorted(summary.topics.items()):
        topics.add_row(name, f"{count.messages}", f"{count.bytes}")
    return Group(account, belts, topics) if summary.belts else Group(account, topics)


def _account(summary: Summary) -> list[tuple[str, str]]:
    wall, factor = summary.wall, summary.real_time_factor
    # Which signals count bottles is known from the scene alone.
    uncounted = "not known" if summary.predicted is None else "not recorded"
    fed = uncounted if summary.fed is None else str(summary.fed)
    removed = uncounted if summary.removed is None else str(summary.removed)
    out = f" ({summary.rejected} rejected)" if summary.rejected else ""
    force = "not recorded"
    if summary.peak_force is not None:
        force = f"peak {summary.peak_force:.2f} N, 99th percentile of peaks {summary.peak_force_99:.2f} N"
    loop = "no bottle has come round"
    if summary.loop is not None:
        loop = (
            f"{summary.loop.returns} bottles came back to {summary.loop.belt}, {summary.loop.per_minute:.1f} per min "
            f"({summary.loop.per_minute_second_half:.1f} in the second half)"
        )
    return [
        ("scene", summary.scene),
        ("recording", summary.bag),
        ("simulated", f"{summary.simulated:.2f} s"),
        ("wall time", "not known" if wall is None else f"{wall:.2f} s"),
        ("real-time factor", "not known" if factor is None else f"{factor:.2f}"),
        ("bottles", f"{fed} fed, {removed} removed{out}, {summary.present} present ({summary.on_floor} on no belt)"),
        ("loop", loop),
        ("contact force", force),
        ("setting", summary.setting),
        ("predicted error", "not known" if summary.predicted is None else summary.predicted),
        ("achieved", "not known" if summary.achieved is None else summary.achieved.sentence),
        *([] if summary.pressed is None else [("load", summary.pressed.sentence)]),
        *([("steps", "\n".join(summary.steps))] if summary.steps else []),
        ("guard", _told(summary.guard, summary.guard_texts)),
        *([] if summary.borne is None else [("damage", summary.borne.sentence)]),
        *([("limits passed", _told(summary.damage_events, summary.damage_texts))] if summary.damage_events else []),
        *([] if summary.energy is None else [("energy", summary.energy.sentence)]),
        ("commands", f"{summary.commands} recorded, {summary.refused} refused"),
    ]


def _told(kinds: dict[str, int], texts: list[str]) -> str:
    if not kinds:
        return "nothing to report"
    counts = ", ".join(f"{count} x {kind.replace('_', ' ')}" for kind, count in kinds.items())
    return "\n".join([counts, *texts])


def _table(*headings: str) -> Table:
    table = Table(box=SIMPLE)
    for index, heading in enumerate(headings):
        table.add_column(heading, justify="left" if index == 0 else "right")
    return table
