# SPDX-License-Identifier: Apache-2.0
"""The topics, one row each, for publishing, recording, reading, replaying, comparing and listing them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

from conveyor_sim.bag.messages import encode
from conveyor_sim.bag.messages.encode import Header, Outcome
from conveyor_sim.bag.messages.markers import bottles_markers, plant_markers
from conveyor_sim.bag.messages.qos import ALARMS, CLOCK, DATA, EVENTS, LATCHED, OUTCOMES, Qos
from conveyor_sim.columns.alarms import AlarmColumns
from conveyor_sim.columns.bottles import BeltColumns, BottleColumns, ContactColumns
from conveyor_sim.columns.counters import CounterColumns
from conveyor_sim.columns.damage import DamageColumns, DamageEvent, RailWearColumns
from conveyor_sim.columns.events import EventColumns, event_columns
from conveyor_sim.columns.ledger import Ledger
from conveyor_sim.columns.read_back import ReadBackColumns
from conveyor_sim.columns.variables import VariableColumns
from conveyor_sim.line.run_state import RunState
from conveyor_sim.scene.marks import marks_of

if TYPE_CHECKING:
    from conveyor_sim.simulation import Events, Simulation


class Snapshot:
    """A simulation at one tick. Its bottles are observed at most once for all topics."""

    def __init__(self, sim: Simulation, run_id: str = "") -> None:
        self.sim = sim
        self.run_id = run_id

    @cached_property
    def bottles(self) -> BottleColumns:
        """The bottles present."""
        return self.sim.bottles()


@dataclass(frozen=True)
class Compare:
    """Rule by which a replay compares a topic's messages with the recorded ones, field by field."""

    entry: Callable[[Any, Any, int], str] = lambda line, message, index: ""
    """Returns entry i of a message in words, such as "belt feeder", from Line, message and i."""
    bottle: str | None = None
    """Field with the ids of the bottles, if entries belong to bottles."""
    within: Mapping[str, float] = field(default_factory=dict)
    """Tolerance on another machine or with other versions, by field: absolute, in the unit of the field, plus
    compare.RELATIVE of the value. Other fields are compared exactly. Empty: the topic is compared on the same machine
    only, bit for bit.

    The tolerances are wide compared with rounding, and narrow compared with a collision that ended differently. A dense
    line is chaotic, so runs on different machines diverge in the end.
    """


NOT_COMPARED = Compare()
"""Rule of topics that state no other."""


@dataclass(frozen=True)
class Topic:
    """One topic. It has a `state` or `events` if the simulation makes it."""

    name: str
    """Relative to the node's namespace, unless it begins with /. <...> stands for a name of the scene."""
    type: str
    what: str
    """Description for docs/ros/topics.md, like `when`."""
    when: str = ""
    """Times of its messages in words; "": at its rate."""
    qos: Qos = DATA
    rate: str | None = None
    """Key of Scene.outputs with its rate; None: sent at the start (`once`), or when there is a message."""
    state: Callable[[Snapshot], Any] | None = None
    """Returns its data at a tick; None means that no message is sent."""
    events: Callable[[Events], Sequence[Any]] | None = None
    """View of the event stream (`Simulation.take_events`): one message per event, with the tick of the event."""
    write: Callable[[Any, Header], bytes] | None = None
    """Serializes the result of `state` or `events`; None: field by field."""
    columns: Callable[..., Any] | None = None
    """Dataclass as which a message is read back, field by field."""
    read: Callable[[Any], Any] | None = None
    """Reads a message back in another way than field by field."""
    recorded: bool = True
    """True if it is recorded by default."""
    once: bool = False
    """True if it has a `state`, but is latched and sent at the start of a run only."""
    compare: Compare = NOT_COMPARED
    """Comparison by a replay."""
    subscribed: bool = False
    """True if the line receives it instead of sending it."""
    by_controller: bool = False
    """True if a controller sends it instead of the node."""

    @property
    def each_counts(self) -> bool:
        """True if the QoS is EVENTS: playback then never repeats a message as a state.

        Messages of other topics are treated as states, including those of `outcomes`.
        """
        return self.qos is EVENTS

    def pack(self, data: Any, header: Header) -> bytes:
        """Return the message of a result of `state` or `events`."""
        return encode.columns_message(self.type, data, header) if self.write is None else self.write(data, header)

    def unpack(self, message: Any) -> Any:
        """Return a decoded message as it is read back: columns, or the message itself if the row states none."""
        if self.read is not None:
            return self.read(message)
        return message if self.columns is None else to_columns(self.columns, message)

    @property
    def fields(self) -> tuple[str, ...]:
        """Compared fields of its messages."""
        return ("values",) if self.columns is None else tuple(field.name for field in fields(self.columns))  # type: ignore[arg-type]


def to_columns(kind: Callable[..., Any], message: Any) -> Any:
    """Read a message back as a dataclass, field by field."""
    return kind(**{field.name: getattr(message, field.name) for field in fields(kind)})  # type: ignore[arg-type]


_MOTION = {"x": 1e-6, "y": 1e-6, "theta": 1e-5, "vx": 1e-4, "vy": 1e-4, "omega": 1e-3}
"""m, m, rad, m/s, m/s, rad/s."""


def _bottle_name(line: Any, message: Any, index: int) -> str:
    """Return an entry of columns by bottle in words."""
    return f"bottle {message.id[index]}"


def _contact_name(line: Any, message: Any, index: int) -> str:
    """Return an entry of contacts in words."""
    other = int(message.b[index])
    if message.kind[index] == 0:
        return f"the contact of bottles {message.a[index]} and {other}"
    rail = line.rails[other] if other < len(line.rails) else other
    return f"the contact of bottle {message.a[index]} and rail {rail}"


def _command_name(line: Any, message: Any, index: int) -> str:
    """Return an entry of read-back values in words."""
    names = line.command_names
    return f"command {names[index]}" if index < len(names) else ""  # there may be more writers than commands


def _bin_name(line: Any, message: Any, index: int) -> str:
    """Return an entry of rail wear in words."""
    return f"rail {line.rails[message.rail[index]]} at ({message.x[index]:.4g}, {message.y[index]:.4g}) m"


_ROWS = (
    Topic(
        "line",
        encode.LINE,
        "names behind the indices, limits, scene text, seed, versions, time step",
        "once a run, latched",
        LATCHED,
        once=True,
        state=lambda now: (now.sim, now.run_id),
        write=lambda data, header: encode.line_message(data[0], data[1], header),
    ),
    Topic(
        "plant",
        encode.MARKERS,
        "belts, rails, directions of travel, and every device that has a place",
        "once a run, latched",
        LATCHED,
        once=True,
        state=lambda now: (now.sim.model.plant.surfaces, now.sim.model.plant.rails_at_rest, marks_of(now.sim.scene)),
        write=lambda data, header: plant_markers(data[0], data[1], data[2], header),
    ),
    Topic(
        "outcomes",
        encode.OUTCOME,
        "result of an input: its writer, tick, accepted or the reason of a refusal",
        "when it happens",
        OUTCOMES,
        events=lambda events: events.outcomes,
        write=encode.outcome_message,
        read=encode.to_outcome,
        columns=Outcome,
    ),
    Topic(
        "guard",
        "conveyor_msgs/msg/GuardEvent",
        "report of the [guard](../stability.md): bottle, place, reason, and remedy",
        "when it happens",
        EVENTS,
        events=lambda events: events.guard,
    ),
    Topic(
        "damage_events",
        "conveyor_msgs/msg/DamageEvent",
        "exceeded limit of the scene (`limits`): bottle, quantity, place",
        "when it happens",
        EVENTS,
        events=lambda events: events.damage,
        columns=DamageEvent,
    ),
    Topic(
        "bottles",
        "conveyor_msgs/msg/Bottles",
        "position, velocity, belt, peak force and impulse since the last message",
        rate="bottles",
        state=lambda now: now.bottles,
        columns=BottleColumns,
        compare=Compare(_bottle_name, "id", {**_MOTION, "peak_force": 1e-2, "impulse": 1e-4}),
    ),
    Topic(
        "poses",
        encode.POSES,
        "the same bottles as poses, in the same order",
        rate="poses",
        state=lambda now: now.bottles,
        write=encode.poses_message,
    ),
    Topic(
        "markers",
        encode.MARKERS,
        "bottles for RViz and Foxglove",
        "as `poses`, at most `marker_rate` per second of wall time",
        rate="poses",
        state=lambda now: (now.bottles, now.sim.model.type_radius, now.sim.moving_rails()),
        write=lambda data, header: bottles_markers(data[0], data[1], data[2], header),
    ),
    Topic(
        "contacts",
        "conveyor_msgs/msg/Contacts",
        "every closed contact with its forces at that tick",
        rate="contacts",
        state=lambda now: now.sim.contacts(),
        columns=ContactColumns,
        compare=Compare(_contact_name, "a"),
    ),
    Topic(
        "belts",
        "conveyor_msgs/msg/Belts",
        "commanded and actual speeds",
        rate="belts",
        state=lambda now: now.sim.belts(),
        columns=BeltColumns,
        compare=Compare(lambda line, _, index: f"belt {line.belts[index]}", within={"commanded": 1e-9, "actual": 1e-9}),
    ),
    Topic(
        "signals",
        "conveyor_msgs/msg/Signals",
        "the process image, in the order of `line`; which signals are forced",
        rate="signals",
        state=lambda now: now.sim.line.signals(),
        read=lambda message: message.values,
        compare=Compare(lambda line, _, index: f"signal {line.signal_names[index]}", within={"values": 1e-4}),
    ),
    Topic(
        "counters",
        encode.COUNTERS,
        "bottles, times and efficiency of each machine and of the line since their last reset",
        rate="counters",
        state=lambda now: now.sim.line.counters(),
        columns=CounterColumns,
        compare=Compare(lambda line, message, index: f"counters of {message.name[index]}"),
    ),
    Topic(
        "ledger",
        "conveyor_msgs/msg/Ledger",
        "the energy ledger: work of each belt, dissipated and stored energy, and the residual; "
        "[from impulses](../energy_and_damage.md#from-impulses) if `line.integrator` is impulses",
        rate="ledger",
        state=lambda now: now.sim.ledger(),
        columns=Ledger,
        compare=Compare(),
    ),
    Topic(
        "damage",
        "conveyor_msgs/msg/Damage",
        "loads on every bottle: sliding work so far; largest forces, impacts and index of tipping since the last "
        "message; [from impulses](../energy_and_damage.md#from-impulses) if `line.integrator` is impulses",
        rate="damage",
        state=lambda now: now.sim.damage(),
        columns=DamageColumns,
        compare=Compare(_bottle_name, "id"),
    ),
    Topic(
        "rail_wear",
        "conveyor_msgs/msg/RailWear",
        "sliding work and impulse in each bin of the rails, of at most 5 cm, since the start; bins of machines have "
        "their places at displacement 0",
        "as `damage`",
        rate="damage",
        state=lambda now: now.sim.rail_wear(),
        columns=RailWearColumns,
        compare=Compare(_bin_name),
    ),
    Topic(
        "events",
        "conveyor_msgs/msg/Events",
        "events: bottles fed, removed, rejected, alarms, states of machines, faults, refusals, limits",
        "each tick with events",
        EVENTS,
        state=lambda now: event_columns(now.sim.line.happened, now.sim.line.happened_so_far),
        columns=EventColumns,
        compare=Compare(lambda line, message, index: f"{message.kind[index]} of {message.name[index]}"),
    ),
    Topic(
        "readback",
        "conveyor_msgs/msg/ReadBack",
        "read-back values of commands, with the writer and the time",
        "latched, each tick with a change",
        LATCHED,
        state=lambda now: now.sim.line.read_back.changes(),
        columns=ReadBackColumns,
        compare=Compare(_command_name, within={"value": 1e-9}),
    ),
    Topic(
        "alarm_states",
        encode.ALARM_STATES,
        "all [alarms](../alarms.md), with their declarations and states by ISA-18.2",
        "latched, each tick with a change",
        LATCHED,
        state=lambda now: now.sim.line.alarms.changes(),
        write=encode.alarms_message,
        read=encode.to_alarms,
        columns=AlarmColumns,
        compare=Compare(lambda line, message, index: f"alarm {message.id[index]}"),
    ),
    Topic(
        "variables",
        "conveyor_msgs/msg/Variables",
        "a PLC program's variables that are [recorded](../structured_text.md#variables-in-recordings). In ROS, "
        "`controller_node` publishes the topic",
        "each scan of the program",
        columns=VariableColumns,
        by_controller=True,
    ),
    Topic(
        "run_state",
        "conveyor_msgs/msg/RunState",
        "state of the run: running, paused, lockstep, ended, stopped with the reason, replaying",
        "latched, when it changes",
        LATCHED,
        write=encode.run_state_message,
        read=lambda message: RunState(int(message.state), message.reason),
    ),
    Topic(
        "photo_eyes/<eye>",
        encode.BOOL,
        "true while a photo-eye is blocked, for simple controllers; not recorded, because `signals` has it",
        "latched, when it changes",
        LATCHED,
        write=encode.bool_message,
        recorded=False,
    ),
    Topic(
        "alarms",
        "diagnostic_msgs/msg/DiagnosticArray",
        "a controller's alarms, by `controller_node`: one status per alarm, ERROR while it is active",
        "latched, when one comes or goes",
        ALARMS,
        recorded=False,
        by_controller=True,
    ),
    Topic(
        "/tf_static",
        "tf2_msgs/msg/TFMessage",
        "frames of belts and devices in `frame_id`, named as in the scene: `belts/feeder`, `photo_eyes/exit`",
        "once, latched",
        LATCHED,
        recorded=False,
    ),
    Topic(
        "/clock",
        "rosgraph_msgs/msg/Clock",
        "simulated time, while paused too",
        "each tick, at most `clock_rate` per second of wall time",
        CLOCK,
        recorded=False,
    ),
    Topic(
        "/diagnostics",
        "diagnostic_msgs/msg/DiagnosticArray",
        "state of the simulation, warnings and errors",
        "once per second of wall time",
        recorded=False,
    ),
    Topic(
        "commands",
        encode.COMMANDS,
        "setpoints by name (`line.command_names`), applied together or refused together; alarms; spawned and deleted "
        "bottles",
        qos=EVENTS,
        recorded=False,
        subscribed=True,
    ),
    Topic(
        "belts/<belt>/cmd_speed",
        encode.SPEED,
        "speed of one belt, m/s, positive forward, for commands sent by hand",
        qos=EVENTS,
        recorded=False,
        subscribed=True,
    ),
    Topic(
        "drives/<drive>/cmd_speed",
        encode.SPEED,
        "speed of one named drive, m/s, likewise",
        qos=EVENTS,
        recorded=False,
        subscribed=True,
    ),
)

TOPICS: dict[str, Topic] = {topic.name: topic for topic in _ROWS}
"""All topics by name. Within a tick, messages are written in this order."""

CMD_SPEED = TOPICS["belts/<belt>/cmd_speed"]
"""Row for the speed commands of all belts. Those of named drives have the same quality of service."""

OUTPUTS = {name: topic for name, topic in TOPICS.items() if topic.recorded}
"""Topics that are recorded."""

COMPARED = {name: topic for name, topic in TOPICS.items() if topic.compare is not NOT_COMPARED}
"""Compared topics, in the order in which a replay looks for differences of one tick."""

STATES = {name: topic for name, topic in COMPARED.items() if topic.rate is not None}
"""Topics of which a recording must have at least one, to be replayed or drawn."""


def photo_eye_topics(names: Iterable[str]) -> dict[str, Topic]:
    """Return one topic per photo-eye, by name."""
    row = TOPICS["photo_eyes/<eye>"]
    return {topic.name: topic for topic in (replace(row, name=f"photo_eyes/{name}") for name in names)}
