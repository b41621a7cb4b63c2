"""A controller in a run without ROS: it scans at every tick, as one that is attached to a scenario does."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from conveyor_sim.bag.outputs import Outputs
from conveyor_sim.control.line_tags import LineTags, bind
from conveyor_sim.control.recorded import RecordedVariables
from conveyor_sim.control.scan import AlarmChanges, ControlError, Controller, Inputs, commands_of, declared_alarms
from conveyor_sim.errors import CommandError, ConveyorError
from conveyor_sim.line.commands.inputs import DECLARE, CommandOutcome, Input
from conveyor_sim.simulation import Simulation

SOURCE = "controller"
"""Of its commands, in the bag's outcomes."""


class Controlled:
    """A simulation with a controller: `before_tick`, then the tick, then `after_tick` with what became of inputs."""

    def __init__(self, simulation: Simulation, controller: Controller, record: Sequence[str] = ()) -> None:
        """record: patterns of its variables that are recorded, beside those that it has itself (`RecordedVariables`).

        Raises ConveyorError for a controller that does not fit the line, and for such a pattern.
        """
        self._simulation, self._controller = simulation, controller
        self._names = simulation.process_image.signal_names
        self._changes = AlarmChanges()
        self._answer: Mapping[str, float] = {}
        self._scanned = -1
        image = simulation.process_image
        signals, commands = ({tag.name: tag.kind for tag in tags} for tags in (image.signals, image.commands))
        try:
            bind(controller, LineTags(signals, commands, image.command_limits))
            declared = declared_alarms(controller)
            self._recorded = RecordedVariables(controller, record)
        except ControlError as error:
            raise ConveyorError(str(error)) from error
        if declared:
            ids, texts = tuple(one.id for one in declared), tuple(one.as_text() for one in declared)
            simulation.give(Input(SOURCE, type(controller).__name__, "controller", DECLARE, ids, (), texts))

    @property
    def left_over(self) -> tuple[str, ...]:
        """Sentences of a controller that says what it has no tag for, and which commands it does not give."""
        return tuple(getattr(self._controller, "left_over", ()))

    def scan(self) -> None:
        """One scan at the present tick, if there was none. Raises ConveyorError for one that can't go on."""
        simulation = self._simulation
        if self._scanned == simulation.tick:
            return
        self._scanned = simulation.tick
        signals = dict(zip(self._names, simulation.signals().tolist(), strict=True))
        try:
            self._answer = self._controller.scan(
                Inputs(signals, simulation.time, simulation.tick, simulation.scene.tick)
            )
        except ControlError as error:
            raise ConveyorError(f"at {simulation.time:.2f} s: {error}") from error

    def before_tick(self, outputs: Outputs | None) -> None:
        """One scan, its commands to the line, its variables to the outputs. Raises as `scan`."""
        self.scan()
        if outputs is not None:
            outputs.show_variables(self._recorded.names, self._recorded.values())
        try:
            commands = commands_of(self._answer) | self._changes.of(self._answer)
        except ControlError as error:
            raise ConveyorError(f"at {self._simulation.time:.2f} s: {error}") from error
        if commands:
            names, values = tuple(commands), tuple(commands.values())
            self._simulation.command(names, values, SOURCE, writer=type(self._controller).__name__)

    def after_tick(self, outcomes: Sequence[CommandOutcome]) -> None:
        """Raises CommandError for a command that was refused."""
        refused = [one.reason for one in outcomes if one.source == SOURCE and not one.accepted]
        if refused:
            raise CommandError(f"at {self._simulation.time:.2f} s a command was refused: {'; '.join(refused)}")
