# SPDX-License-Identifier: Apache-2.0
"""The scan loop of all attached controllers: objects of this process, ROS nodes and PLCs.

A scan reads the signals of a tick. Its commands act from the beginning of the next tick on.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Protocol

from conveyor_sim.bag.outputs import OutputWriter
from conveyor_sim.control.memory import restore, snapshot
from conveyor_sim.control.recorded import RecordedVariables
from conveyor_sim.control.scan import ControlError, Controller, Inputs, LineTags, alarm_names, bind, declared_alarms
from conveyor_sim.errors import CommandError, ConveyorError
from conveyor_sim.line.commands.inputs import DECLARE, OWN, CommandOutcome, Input
from conveyor_sim.line.tag import CONTROLLED, ProcessImage, of_roles
from conveyor_sim.physics.state.checkpoint import read_checkpoint
from conveyor_sim.run.alarm_changes import AlarmChanges
from conveyor_sim.run.controller_source import located
from conveyor_sim.simulation import Simulation

CONTROLLER = "controller"
"""Source of the commands of a controller that is an object of this process."""


def tags_for_control(image: ProcessImage) -> LineTags:
    """Return the tags of a line that a controller may read and command."""
    controlled = of_roles(image.commands, CONTROLLED)
    signals, commands = ({tag.name: tag.kind for tag in tags} for tags in (image.signals, controlled))
    return LineTags(signals, commands, image.command_limits)


class AttachedController(Protocol):
    """A controller as `ScanLoop` drives it. There is one implementation per kind of attachment."""

    source: str
    """Source of its commands, in recorded command results."""
    writer: str
    """Name of the writer of its commands."""
    controller: Controller | None = None
    """Controller object of this process, whose memory is stored in checkpoints; None if there is no such object."""
    signals_read: tuple[str, ...] | None = None
    """Names of the signals that it reads; None: all of them may be read."""
    recorded: RecordedVariables = RecordedVariables(None)
    """Variables that are recorded, and that test conditions can read."""

    def scan(self, inputs: Inputs, alarms: AlarmChanges) -> dict[str, float]:
        """Return the commands for the next tick, and the alarms that change. alarms: those given to the line so far.

        Raises ControlError if there is no valid answer.
        """

    def note(self, outcomes: Sequence[CommandOutcome]) -> None:
        """Take the command results of a tick, before the next scan. Most controllers do not need them."""
        return

    def close(self) -> None:
        """End processes and connections of the attachment. Closing twice is harmless."""
        return


class LocalController(AttachedController):
    """A controller that is an object of this process."""

    source = CONTROLLER

    def __init__(
        self,
        simulation: Simulation,
        controller: Controller,
        give: Callable[[Input], object],
        record: Sequence[str] = (),
    ) -> None:
        """Bind a controller to the tags of the line, and declare its alarms by `give`.

        record: patterns of recorded variables, in addition to the controller's own patterns (`RecordedVariables`).
        Raises ControlError for a controller that does not fit the line, and for a pattern that fits no variable.
        """
        bind(controller, tags_for_control(simulation.process_image))
        declared = declared_alarms(controller)
        self.writer = type(controller).__name__
        self.controller = controller
        self.signals_read = getattr(controller, "signals_read", None)
        self.recorded = RecordedVariables(controller, record)
        if declared:
            ids, texts = tuple(alarm.id for alarm in declared), tuple(alarm.as_text() for alarm in declared)
            give(Input(CONTROLLER, self.writer, "controller", DECLARE, ids, (), texts))

    def scan(self, inputs: Inputs, alarms: AlarmChanges) -> dict[str, float]:
        """Return the commands of one scan, and the alarms that change."""
        assert self.controller is not None
        return alarms.with_commands(self.controller.scan(inputs))


class ScanLoop:
    """The controller attached to a simulation, if there is one: its scans, and its commands to the line.

    A run calls `before_tick`, advances one tick, and calls `after_tick`. A test calls `scan`, `give` and `note`.
    """

    def __init__(
        self, simulation: Simulation, controller: Controller | None = None, record: Sequence[str] = ()
    ) -> None:
        """Attach a controller of this process, if one is passed. record: as for `LocalController`.

        Raises ConveyorError for a controller that does not fit the line.
        """
        self._simulation = simulation
        self._attached: AttachedController | None = None
        self._answer: dict[str, float] = {}
        self._scanned = -1
        self.alarms = AlarmChanges()
        """Alarms that the line was given, by this controller or the one before."""
        if controller is not None:
            try:
                self.attach(lambda: LocalController(simulation, controller, simulation.give, record))
            except ControlError as error:
                raise ConveyorError(str(error)) from error

    @property
    def attached(self) -> bool:
        """True while a controller is attached."""
        return self._attached is not None

    @property
    def recorded(self) -> RecordedVariables:
        """Variables of the controller."""
        return RecordedVariables(None) if self._attached is None else self._attached.recorded

    def attach(self, make: Callable[[], AttachedController]) -> None:
        """Attach the controller that `make` returns. The one before is closed first."""
        self.close()
        self._attached = make()

    def close(self) -> None:
        """Close the attached controller."""
        if self._attached is not None:
            self._attached.close()

    def own(self) -> None:
        """Take the line for the attached controller, so that others need its release; nothing without a controller."""
        if self._attached is not None:
            self._simulation.give(Input(self._attached.source, self._attached.writer, "controller", OWN, (), ()))

    def scan(self, inputs: Inputs) -> tuple[str, ...]:
        """Scan once. Return the names of the alarms in the answer. Raise ControlError if there is no valid answer."""
        assert self._attached is not None
        self._answer = self._attached.scan(inputs, self.alarms)
        return alarm_names(tuple(self._answer))

    def give(self) -> None:
        """Queue the commands of the last scan for the next tick."""
        if self._attached is not None and self._answer:
            names, values = tuple(self._answer), tuple(self._answer.values())
            self._simulation.command(names, values, self._attached.source, writer=self._attached.writer)

    def note(self, outcomes: Sequence[CommandOutcome]) -> None:
        """Pass the command results of a tick on to the controller."""
        if self._attached is not None:
            self._attached.note(outcomes)

    def wrote(self, outcome: CommandOutcome) -> bool:
        """Return True if a command result belongs to the attached controller."""
        attached = self._attached
        return attached is not None and (outcome.source, outcome.input.writer) == (attached.source, attached.writer)

    def snapshot(self) -> dict[str, Any] | None:
        """Return the memory of a controller of this process, its last commands and alarms; None for any other."""
        controller = None if self._attached is None else self._attached.controller
        if controller is None:
            return None
        return {**snapshot(controller), "answer": dict(self._answer), "alarms": self.alarms.snapshot()}

    def resume(self, start: Path | None) -> None:
        """Continue with the attached controller from a checkpoint. Raise ControlError if it holds no controller."""
        memory = None if start is None else read_checkpoint(start).controller
        controller = None if self._attached is None else self._attached.controller
        if memory is None or controller is None:
            raise ControlError(f"resume: found no controller in {start}, expected a checkpoint of `Scenario.save`")
        restore(controller, memory)
        self._answer = {str(name): float(value) for name, value in memory["answer"].items()}
        self.alarms.restore(memory["alarms"])

    def scan_tick(self) -> None:
        """Scan at the present tick, unless that was done. Raise ConveyorError for a controller that can't go on."""
        simulation = self._simulation
        if self._attached is None or self._scanned == simulation.tick:
            return
        self._scanned = simulation.tick
        reads = self._attached.signals_read
        if reads is None:
            signals = dict(zip(simulation.process_image.signal_names, simulation.signals().tolist(), strict=True))
        else:
            signals = simulation.values_of(reads)
        try:
            self.scan(Inputs(signals, simulation.time, simulation.tick, simulation.scene.tick))
        except ControlError as error:
            raise ConveyorError(f"at {simulation.time:.2f} s: {error}") from error
        except (Exception, SystemExit) as error:  # of the user's Python code
            raise ConveyorError(f"at {simulation.time:.2f} s: controller: {located(error)}") from error

    def before_tick(self, outputs: OutputWriter | None) -> None:
        """Scan, write the recorded variables to the outputs, and queue the commands. Raise as `scan_tick`."""
        self.scan_tick()
        if outputs is not None and self._attached is not None:
            recorded = self._attached.recorded
            outputs.show_variables(recorded.names, recorded.values())
        self.give()

    def after_tick(self, outcomes: Sequence[CommandOutcome]) -> None:
        """Raise CommandError if a command of the controller was refused.

        Refusals for lack of control authority are no errors of the controller: an operator has taken the device.
        """
        self.note(outcomes)
        source = None if self._attached is None else self._attached.source
        if refused := [
            outcome.reason
            for outcome in outcomes
            if outcome.source == source and not outcome.accepted and not outcome.without_control
        ]:
            raise CommandError(f"at {self._simulation.time:.2f} s a command was refused: {'; '.join(refused)}")
