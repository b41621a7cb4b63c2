"""`ScanCycle`: what controls a line under test: a controller that scans at every tick, a node, or a PLC."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any

from conveyor_sim.control.line_tags import LineTags, bind
from conveyor_sim.control.memory import restore, snapshot
from conveyor_sim.control.recorded import RecordedVariables
from conveyor_sim.control.scan import (
    ALARMS,
    AlarmChanges,
    ControlError,
    Controller,
    commands_of,
    declared_alarms,
)
from conveyor_sim.line.commands.inputs import DECLARE, CommandOutcome, Input
from conveyor_sim.physics.state.checkpoint import read_checkpoint
from conveyor_sim.simulation import Simulation
from conveyor_sim.testing.conditions import Present

if TYPE_CHECKING:
    from conveyor_sim.protocols.server.interface import ProtocolServer
    from conveyor_sim.protocols.tags.tag_provider import TagProvider
    from conveyor_sim.ros.attached import AttachedNode
    from conveyor_sim.testing.plc import AttachedPlc
    from conveyor_sim.testing.plc_server import ServedPlc

CONTROLLER = "controller"
"""Source of the attached controller's commands, in the bag's outcomes."""

LOCKSTEP = "lockstep"
"""The same of an attached node, as `sim_node` has it."""

PATIENCE = 60.0
"""s of wall time that an attached node has for each request."""


class ScanCycle:
    """One controller or none; what it answers at a tick is given to the line as the next one begins."""

    def __init__(self, simulation: Simulation, give: Callable[[Input], None]) -> None:
        """give: has the line take an input, or raises CommandError."""
        self._simulation, self._give = simulation, give
        self._controller: Controller | None = None
        self._node: AttachedNode | None = None
        self._plc: AttachedPlc | ServedPlc | None = None
        self._answer: Mapping[str, float] = {}
        self._changes = AlarmChanges()
        self.recorded = RecordedVariables(None)
        """The controller's variables that are recorded."""
        self.read: dict[str, None] = {}
        """Names of the signals that were read, in the order of the first reading."""
        # Those of a controller before a checkpoint: one that is attached now and does not have them clears them.
        self._changes.of({f"{ALARMS}{alarm.id}": 1.0 for alarm in simulation.line.alarms if alarm.is_said})

    @property
    def attached(self) -> bool:
        """Whether anything scans."""
        return self._controller is not None

    @property
    def variables(self) -> Mapping[str, float]:
        """Those that the controller shows to conditions."""
        shown: Mapping[str, float] = getattr(self._controller, "variables", {})
        return shown

    def with_variables(self, signals: Mapping[str, float]) -> Mapping[str, float]:
        """Signals, and the controller's variables behind them."""
        return _Behind(signals, self.variables) if self.variables else signals

    def attach(self, controller: Controller) -> None:
        """Have a controller scan, in place of what did."""
        self.close()
        image = self._simulation.process_image
        signals, commands = ({tag.name: tag.kind for tag in tags} for tags in (image.signals, image.commands))
        bind(controller, LineTags(signals, commands, image.command_limits))
        self.recorded = RecordedVariables(controller)
        self._controller = controller
        if declared := declared_alarms(controller):
            ids, texts = tuple(alarm.id for alarm in declared), tuple(alarm.as_text() for alarm in declared)
            self._give(Input(CONTROLLER, type(controller).__name__, "controller", DECLARE, ids, (), texts))

    def attach_node(self, command: Sequence[str], namespace: str, domain: int | None, patience: float) -> None:
        """Have a ROS node in lockstep scan, as `Scenario.attach_node` says."""
        try:
            from conveyor_sim.ros.attached import AttachedNode
        except ImportError as error:
            raise ControlError(f"a node can't be attached here: {error}; expected ROS 2 and conveyor_msgs") from error
        self.close()
        self._node = self._controller = AttachedNode(
            self._simulation, command, namespace=namespace, domain=domain, patience=patience
        )

    def attach_plc(
        self,
        make: Callable[[TagProvider, Path], ProtocolServer],
        command: Sequence[str],
        environment: Mapping[str, str],
        patience: float,
    ) -> None:
        """Have a PLC scan that is a client of a server, as `AttachedPlc` says."""
        from conveyor_sim.testing.plc import AttachedPlc

        self.close()
        self._plc = self._controller = AttachedPlc(self._simulation, make, command, environment, patience)

    def attach_served_plc(self, url: str, tags: Path, user: str, password: str, patience: float) -> None:
        """Have a PLC scan that is a server, as `ServedPlc` says."""
        from conveyor_sim.testing.plc_server import ServedPlc

        self.close()
        image = self._simulation.process_image
        self._plc = self._controller = ServedPlc(image, url, tags, user, password, patience)
        self.recorded = RecordedVariables(self._plc)

    def snapshot(self) -> dict[str, Any] | None:
        """What the controller remembers and has answered last; None without one, or for a node or PLC."""
        if self._controller is None or self._node is not None or self._plc is not None:
            return None
        return {**snapshot(self._controller), "answer": dict(self._answer), "alarms": self._changes.snapshot()}

    def resume(self, start: Path | None) -> None:
        """Have the controller go on from a checkpoint. Raises ControlError."""
        kept = None if start is None else read_checkpoint(start).controller
        if kept is None or self._controller is None:
            raise ControlError(f"resume: found no controller in {start}, expected a checkpoint of `Scenario.save`")
        restore(self._controller, kept)
        self._answer = {str(name): float(value) for name, value in kept["answer"].items()}
        self._changes.restore(kept["alarms"])

    def close(self) -> None:
        """End the node or the PLC, if one is attached."""
        for outsider in (self._node, self._plc):
            if outsider is not None:
                outsider.close()
        self._node = self._plc = None
        self.recorded = RecordedVariables(None)

    def answers_for(self, outcome: CommandOutcome) -> bool:
        """Whether that was of the PLC which is attached, and not of another client of a server."""
        plc = self._plc
        return plc is not None and (outcome.source, outcome.input.writer) == (plc.source, plc.writer)

    def scan(self, inputs: Present) -> Collection[str]:
        """One scan; the names of the alarms that it says something of. Raises ControlError for what is no answer."""
        controller = self._controller
        assert controller is not None
        answer = controller.scan(inputs)
        commands = commands_of(answer)
        self.read |= inputs.read
        alarms = {name: value for name, value in answer.items() if name.startswith(ALARMS)}
        # A node answers what changes only, and nothing between its scans; alarms of a controller before it go.
        if self._node is not None:
            changes = self._changes.of({})
            self._answer = {**changes, **answer}
        else:
            changes = self._changes.of(alarms)
            self._answer = commands | changes
        return (*alarms, *changes)

    def give(self) -> None:
        """Hand the answer of the last scan over to the line."""
        if self._answer:
            names, values = tuple(self._answer), tuple(self._answer.values())
            source, writer = CONTROLLER, type(self._controller).__name__
            if self._node is not None:
                source, writer = LOCKSTEP, self._node.writer
            elif self._plc is not None:
                source, writer = self._plc.source, self._plc.writer
            self._simulation.command(names, values, source, writer=writer)

    def note(self, outcomes: Sequence[CommandOutcome]) -> None:
        """What became of inputs at a tick."""
        if self._node is not None:
            self._node.note(outcomes)


def by_other_hands(outcome: CommandOutcome) -> bool:
    """Whether a controller was refused what somebody else works."""
    return outcome.without_control and outcome.input.writer_kind == "controller"


class _Behind(Mapping[str, float]):
    """Two mappings as one, without a copy: a program's variables are read when a condition asks for them."""

    def __init__(self, first: Mapping[str, float], second: Mapping[str, float]) -> None:
        self._first, self._second = first, second

    def __getitem__(self, name: str) -> float:
        return self._first[name] if name in self._first else self._second[name]

    def __iter__(self) -> Iterator[str]:
        return chain(self._first, self._second)

    def __len__(self) -> int:
        return len(self._first) + len(self._second)
