"""What a simulation tells: which topic at which tick, serialized once, handed to every sink that wants it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Protocol

from conveyor_sim.bag import messages
from conveyor_sim.bag.markers import bottles_markers, plant_markers
from conveyor_sim.bag.messages import Header
from conveyor_sim.bag.qos import QOS, Qos
from conveyor_sim.scene.marks import marks_of

if TYPE_CHECKING:
    from conveyor_sim.line.commands import CommandOutcome
    from conveyor_sim.observe.columns import BottleColumns
    from conveyor_sim.observe.damage import DamageColumns, RailWearColumns
    from conveyor_sim.observe.ledger import Ledger
    from conveyor_sim.simulation import Simulation
    from conveyor_sim.stepping.guard import GuardEvent


@dataclass(frozen=True)
class Output:
    """One topic: its relative name, message type, and the scene output whose rate it follows."""

    name: str
    type: str
    rate: str | None
    """Key of Scene.outputs; None: latched at the start, or sent when it happens (outcomes, events, photo-eyes)."""

    @property
    def qos(self) -> Qos:
        """The quality of service offered for it."""
        return QOS[self.name.partition("/")[0]]


OUTPUTS: dict[str, Output] = {
    output.name: output
    for output in (
        Output("line", messages.LINE, None),
        Output("plant", messages.MARKERS, None),
        Output("outcomes", messages.OUTCOME, None),
        Output("guard", messages.GUARD_EVENT, None),
        Output("damage_events", messages.DAMAGE_EVENT, None),
        Output("bottles", messages.BOTTLES, "bottles"),
        Output("poses", messages.POSES, "poses"),
        Output("markers", messages.MARKERS, "poses"),
        Output("contacts", messages.CONTACTS, "contacts"),
        Output("belts", messages.BELTS, "belts"),
        Output("signals", messages.SIGNALS, "signals"),
        Output("ledger", messages.LEDGER, "ledger"),
        Output("damage", messages.DAMAGE, "damage"),
        Output("rail_wear", messages.RAIL_WEAR, "damage"),
    )
}
"""By name; within a tick, messages are written in this order. These are recorded."""


def photo_eye_outputs(names: Iterable[str]) -> dict[str, Output]:
    """A topic for each photo-eye, by name: latched, sent when it changes. Not recorded, for `signals` has them."""
    outputs = (Output(f"photo_eyes/{name}", messages.BOOL, None) for name in names)
    return {output.name: output for output in outputs}


class Sink(Protocol):
    """Takes serialized messages: the recorder, a node's publishers."""

    def wants(self, topic: str) -> bool:
        """Whether a message of this topic would be used now; nothing is computed that no sink wants."""

    def write(self, topic: str, data: bytes, stamp_ns: int) -> None:
        """Takes one message, with its simulated time in ns."""


class Snapshot:
    """A simulation at one tick: its bottles are observed at most once, however many topics show them."""

    def __init__(self, sim: Simulation) -> None:
        self.sim = sim

    @cached_property
    def bottles(self) -> BottleColumns:
        """The bottles present."""
        return self.sim.bottles()

    @property
    def ledger(self) -> Ledger:
        """The energy ledger, which a scene with that output has."""
        ledger = self.sim.ledger()
        assert ledger is not None
        return ledger

    @property
    def damage(self) -> DamageColumns:
        """What bottles have borne, which a scene with that output has."""
        damage = self.sim.damage()
        assert damage is not None
        return damage

    @property
    def rail_wear(self) -> RailWearColumns:
        """What rails have borne, likewise."""
        wear = self.sim.rail_wear()
        assert wear is not None
        return wear


SERIALIZERS: dict[str, Callable[[Snapshot, Header], bytes]] = {
    "bottles": lambda now, header: messages.bottles_message(now.bottles, header),
    "poses": lambda now, header: messages.poses_message(now.bottles, header),
    "markers": lambda now, header: bottles_markers(
        now.bottles, now.sim.model.type_radius, now.sim.moving_rails(), header
    ),
    "contacts": lambda now, header: messages.contacts_message(now.sim.contacts(), header),
    "belts": lambda now, header: messages.belts_message(now.sim.belts(), header),
    "signals": lambda now, header: messages.signals_message(now.sim.signals(), header),
    "ledger": lambda now, header: messages.ledger_message(now.ledger, header),
    "damage": lambda now, header: messages.damage_message(now.damage, header),
    "rail_wear": lambda now, header: messages.rail_wear_message(now.rail_wear, header),
}
"""The topics that have a rate."""


class Outputs:
    """Feeds sinks from a simulation: `start` once, then `after_tick` after every single tick."""

    def __init__(self, sim: Simulation, sinks: Sequence[Sink], *, run_id: str, frame_id: str = "world") -> None:
        self._sim = sim
        self._sinks = sinks
        self._run_id = run_id
        self._frame_id = frame_id
        self._noticed: list[GuardEvent] = []
        self._eyes: dict[str, bool] = {}

    def start(self) -> None:
        """Writes what is latched (line, plant) and the state at the present tick."""
        model, header = self._sim.model, self._header(self._sim.tick)
        marks = marks_of(self._sim.scene)
        self._hand_out("line", header, messages.line_message, self._sim, self._run_id)
        self._hand_out("plant", header, plant_markers, model.belt_shapes, model.rails_at_rest, marks)
        self._write_state()

    def after_tick(self) -> list[CommandOutcome]:
        """Writes the outcomes of the tick's commands, then every topic that is due; returns the outcomes."""
        outcomes = self.after_failure()
        self._write_state()
        return outcomes

    def after_failure(self) -> list[CommandOutcome]:
        """Writes what is known of a tick that failed: what became of its commands, what the guard says, and what went
        beyond limits.
        """
        outcomes = self._sim.take_outcomes()
        for outcome in outcomes:
            self.tell(outcome)
        for event in self._sim.take_guard_events():
            self._noticed.append(event)
            self._hand_out("guard", self._header(event.tick), messages.guard_message, event)
        for passed in self._sim.take_damage_events():
            self._hand_out("damage_events", self._header(passed.tick), messages.damage_event_message, passed)
        return outcomes

    def take_noticed(self) -> list[GuardEvent]:
        """What the guard said since the last call; it has been written."""
        noticed, self._noticed = self._noticed, []
        return noticed

    def tell(self, outcome: CommandOutcome) -> None:
        """Writes one outcome that belongs to no tick to come."""
        self._hand_out("outcomes", self._header(outcome.tick), messages.outcome_message, outcome)

    def _write_eyes(self) -> None:
        eyes = self._sim.photo_eyes()
        for topic, blocked in eyes.items():
            if self._eyes.get(topic) is not blocked:
                self._hand_out(topic, self._header(self._sim.tick), messages.bool_message, blocked)
        self._eyes = eyes

    def _write_state(self) -> None:
        if not self._sinks:
            return
        self._write_eyes()
        header, now = self._header(self._sim.tick), Snapshot(self._sim)
        for topic, serialize in SERIALIZERS.items():
            rate = OUTPUTS[topic].rate
            if rate is not None and self._sim.due(rate):
                self._hand_out(topic, header, serialize, now)

    def _hand_out(self, topic: str, header: Header, serialize: Callable[..., bytes], *what: object) -> None:
        takers = [sink for sink in self._sinks if sink.wants(topic)]
        if takers:
            data = serialize(*what, header)
            for sink in takers:
                sink.write(topic, data, header.stamp_ns)

    def _header(self, tick: int) -> Header:
        # ROS reads a stamp of 0 as "not set", so tick 0 is stamped 1 ns, as Simulation.stamp_ns does.
        return Header(tick, max(1, tick * self._sim.model.tick_ns), self._frame_id)
