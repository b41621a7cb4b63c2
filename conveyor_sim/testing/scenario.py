# SPDX-License-Identifier: Apache-2.0
"""`Scenario`: a line with a controller, run in simulated time by a test that evaluates conditions at every tick."""

from __future__ import annotations

import math
import secrets
import uuid
from collections import ChainMap
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any, NoReturn

from conveyor_sim.bag.input_log import InputLog, copier
from conveyor_sim.bag.outputs import OutputWriter
from conveyor_sim.bag.recorder import Recorder
from conveyor_sim.control.scan import ALARMS, PROGRAM, ControlError, Controller, Inputs
from conveyor_sim.errors import CommandError, SimulationError
from conveyor_sim.line.changeover import changeover
from conveyor_sim.line.commands.authority import MODES
from conveyor_sim.line.commands.inputs import DISOWN, FAULT, FORCE, INJECT, MODE, SET, UNFORCE, Input, WriterKind
from conveyor_sim.line.run_state import ENDED, RUNNING, STOPPED, RunState
from conveyor_sim.protocols.attach.access import PlcAccess
from conveyor_sim.protocols.tags.tag_provider import SCADA_SOURCES, SteppedTagProvider
from conveyor_sim.run.scan_loop import AttachedController, LocalController, ScanLoop
from conveyor_sim.scene import Scene, load_scene
from conveyor_sim.scene.choices import choices
from conveyor_sim.scene.overrides import merged
from conveyor_sim.scene.recorded import sources_of
from conveyor_sim.simulation import Simulation
from conveyor_sim.support.modbus_rows import Row
from conveyor_sim.support.printable import SENTENCE, printable
from conveyor_sim.support.resources import scene_path
from conveyor_sim.testing import plc
from conveyor_sim.testing.conditions import text_of, words_of
from conveyor_sim.testing.history import ScenarioHistory
from conveyor_sim.testing.panel import OperatorPanel
from conveyor_sim.testing.plc import ServedPlc


def scene_of(
    scene: Scene | str | PathLike[str],
    overrides: Mapping[str, Any] | None,
    parameters: Mapping[str, Any] | None = None,
    variant: str | None = None,
    format: str | None = None,
) -> Scene:
    """Return the scene for the arguments of a Scenario. Raise the exceptions of Scenario."""
    chosen = choices(parameters, variant, format)
    if not isinstance(scene, Scene):
        return load_scene(scene_path(Path(scene)), merged(dict(overrides or {}), chosen))
    if overrides is not None or chosen:
        raise ValueError("overrides given for a scene that is loaded, expected them where it is loaded")
    return scene


Condition = Callable[["Present"], Any]
"""Function of the present signals that returns true or false: `lambda s: s["belts/table/bottles"] < 40`."""


class Present(Inputs):
    """Signals and alarms at a tick, by name. Records the names that are read."""

    __slots__ = ("read",)

    def __init__(self, signals: Mapping[str, float], time: float, tick: int, length: float) -> None:
        super().__init__(signals, time, tick, length)
        self.read: dict[str, None] = {}
        """Names, in the order of the first reading."""

    def __getitem__(self, name: str) -> float:
        """Return the value of a signal, an alarm by its full name, or a variable of a PLC program in any case.

        Raise NoSuchSignal, which is a KeyError.
        """
        if name[: len(PROGRAM)].lower() == PROGRAM and name not in self._signals:
            name = name.lower()
        value = super().__getitem__(name)
        self.read[name] = None
        return value


@dataclass(frozen=True)
class Assertion:
    """A condition that is asserted from a time on."""

    condition: Condition
    word: str
    """always, never, eventually or run_until."""
    since: float
    """s"""

    @property
    def text(self) -> str:
        """The assertion as the test states it."""
        return f"{self.word}({text_of(self.condition)})"

    @property
    def words(self) -> str:
        """The assertion without Python: "always: belts/table/bottles ≤ 40"."""
        return f"{self.word.replace('_', ' ')}: {words_of(self.condition)}"


def values(
    names: Iterable[str], present: Mapping[str, float], units: Callable[[str], str], forced: Collection[str] = ()
) -> str:
    """Return one line per signal: name, value and unit, and a note if it is forced."""
    lines = [
        f"    {name} = {present[name]:g} {units(name)}".rstrip() + " (forced)" * (name in forced) for name in names
    ]
    return "\n".join(lines) or "    (it reads no signals)"


NUMBERS = {text.lower(): number for number, text in MODES.items()}
"""Numbers of the modes, by name."""


class PanelUser:
    """An operator or engineer. Operations act at the next tick; CommandError is raised if it would refuse them."""

    def __init__(self, source: str, kind: WriterKind, give: Callable[[Input], None]) -> None:
        """source: of the inputs. kind: kind and name of the writer. give: takes an input, or raises CommandError."""
        self._source = source
        self._kind = kind
        self._give = give

    def set(self, name: str, value: float) -> None:
        """Give a command to a device that the person controls."""
        self.operate(SET, [name], [value])

    def mode(self, device: str, mode: int | str) -> None:
        """Set the mode of a device ("belts/table"), by number or as "automatic", "maintenance" or "manual"."""
        if isinstance(mode, str):
            if mode not in NUMBERS:
                raise CommandError(f"{device}: mode {mode!r} given, expected one of {', '.join(NUMBERS)}")
            mode = NUMBERS[mode]
        self.operate(MODE, [device], [mode])

    def force(self, signal: str, value: float) -> None:
        """Force a signal: controllers read this value until the signal is unforced."""
        self.operate(FORCE, [signal], [value])

    def unforce(self, *signals: str) -> None:
        """Unforce signals; without names: all signals."""
        self.operate(UNFORCE, signals)

    def acknowledge(self, *alarms: str) -> None:
        """Acknowledge alarms by ID; without IDs: all unacknowledged alarms."""
        self.operate("acknowledge", alarms)

    def confirm(self, *alarms: str) -> None:
        """Confirm acknowledged alarms by ID; without IDs: all that wait to be confirmed."""
        self.operate("confirm", alarms)

    def reset(self, *alarms: str) -> None:
        """Reset latched alarms whose condition has ended, by ID; without IDs: all of them."""
        self.operate("reset", alarms)

    def shelve(self, alarm: str, seconds: float = 0.0) -> None:
        """Shelve an alarm for `seconds`; 0: until its condition ends next."""
        self.operate("shelve", [alarm], [seconds])

    def unshelve(self, *alarms: str) -> None:
        """Unshelve alarms by ID; without IDs: all."""
        self.operate("unshelve", alarms)

    def reset_counters(self, *devices: str) -> None:
        """Reset the counters and times of devices; without names: of all devices."""
        self.operate("reset_counters", devices)

    def operate(
        self, operation: str, names: Sequence[str] = (), values: Sequence[float] = (), texts: Sequence[str] = ()
    ) -> None:
        """Give any operation of the line, like the service `operate`."""
        self._give(Input(self._source, self._kind, self._kind, operation, tuple(names), tuple(values), tuple(texts)))


TEST = "test"
"""Source of commands of the test."""

PATIENCE = 60.0
"""s of wall time that an attached node or PLC has for each request."""

_ROUNDING = 1e-9


class Scenario(AbstractContextManager["Scenario"]):
    """A line under test. All times are simulated. Conditions are evaluated at every tick.

    The controller scans at the tick at which it is attached, then once per tick, like `controller_node` in lockstep. It
    reads the signals of a tick, and its commands act from that tick on.
    """

    def __init__(
        self,
        scene: Scene | str | PathLike[str],
        overrides: Mapping[str, Any] | None = None,
        *,
        parameters: Mapping[str, Any] | None = None,
        variant: str | None = None,
        format: str | None = None,
        start: str | PathLike[str] | None = None,
        bag: Path | None = None,
        inputs: Path | None = None,
        history: float | None = None,
    ) -> None:
        """scene: a loaded scene, a scene file, or the name of a shipped scene. overrides: replace fields of a file.
        parameters, variant, format: choices among the versions of a file; None: those that the file makes.
        start: checkpoint of the same scene to begin from; None: the bottles of the scene.
        bag: new or empty folder to record to from the start; None: no recording.
        inputs: folder for the inputs, from which `conveyor-sim recover` makes the bag; None: not written.
        history: length of the stored history of signals, commands and alarms, s, for runs of hours; None: all.

        Raises SceneError for an invalid scene, CheckpointError for a start that is missing, damaged or of another
        scene, BagError if it can't be recorded, ValueError for overrides or choices of a loaded scene.
        """
        self.scene = scene_of(scene, overrides, parameters, variant, format)
        self.simulation = Simulation(self.scene) if start is None else Simulation.load(start, scene=self.scene)
        most = None if history is None else max(self._ticks(history), 1)
        self.history = ScenarioHistory(self.simulation.process_image, most)
        self.operator = PanelUser(TEST, "operator", self._give)
        """Operator at the panel of the line."""
        self.engineer = PanelUser(TEST, "engineer", self._give)
        """Engineer, with more rights than the operator (docs/line.md, Who may command)."""
        self.panel = OperatorPanel(self.simulation.process_image.tags, self.operator.set)
        """Operator panel of the line."""
        self.failed: Assertion | None = None
        """The assertion that failed; None if none did."""
        self.failure = ""
        """Sentence about that failure, without Python."""
        self.values_at_failure: dict[str, float] = {}
        """Values that the failed condition has read, by name."""
        self._read: dict[str, None] = {}
        self._recorder = None if bag is None else Recorder(bag, start=copier(start), sources=sources_of(self.scene))
        self._outputs = OutputWriter(
            self.simulation, [self._recorder] if self._recorder else [], run_id=uuid.uuid4().hex
        )
        began = self._began = None if start is None else Path(start)
        if began is not None:
            self.simulation.take_events()  # of the run before the checkpoint
            if owner := self.simulation.line.modes.owner:  # of the run before, without its controller
                self.simulation.give(Input(TEST, owner, "controller", DISOWN, (), ()))
        self._outputs.start()
        self._outputs.show_run(RunState(RUNNING))
        self._inputs = None if inputs is None else InputLog(inputs, self.simulation, began)
        self._noting = [self._outputs.show_variables, *([self._inputs.note_variables] if self._inputs else [])]
        self._loop = ScanLoop(self.simulation)
        # Alarms of a controller before the checkpoint: the next controller clears those that it does not raise.
        self._loop.alarms.of({f"{ALARMS}{alarm.id}": 1.0 for alarm in self.simulation.line.alarms if alarm.is_reported})
        self._read_by_controller: dict[str, None] = {}
        self._alarms: dict[str, float] = {}
        self._standing: list[Assertion] = []
        self._sources: list[SteppedTagProvider] = []
        self._signals: dict[str, float] = {}
        self._stopped = False  # True once the guard stopped the run
        self._look()

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """End the attached controller and the recording. The scenario can't run afterwards."""
        self._loop.close()
        if self._recorder is not None:
            if not self._stopped:
                self._outputs.show_run(RunState(ENDED))
            self._recorder.close()
        if self._inputs is not None:
            self._inputs.close()
            self._inputs = None

    @property
    def time(self) -> float:
        """Simulated time, s."""
        return self.simulation.time

    @property
    def signals(self) -> Present:
        """The present signals by name, with alarms ("alarms/<id>", 1 while they stand) and the variables of a PLC
        program (plc/main/speed).
        """
        variables: Any = self._loop.recorded.variables  # ChainMap is declared for mappings that change
        return self._present(ChainMap({**self._signals, **self._alarms}, variables))

    @property
    def alarms(self) -> frozenset[str]:
        """IDs of the alarms that stand."""
        return self.simulation.alarms

    @property
    def read_by_conditions(self) -> tuple[str, ...]:
        """Names of the signals that conditions have read, starting with the last condition."""
        return tuple(self._read)

    @property
    def read_by_controller(self) -> tuple[str, ...]:
        """Names of the signals that the controller has read."""
        return tuple(self._read_by_controller)

    def attach(self, controller: Controller, *, resume: bool = False) -> None:
        """Attach a controller in place of the one before. It scans at this tick and at every later one.

        resume: continue with the memory of the controller in the checkpoint (`save`), with the same bits as if the run
        had not stopped. Raises ControlError if that is impossible.
        """
        self._loop.attach(lambda: LocalController(self.simulation, controller, self._give))
        if resume:
            self._loop.resume(self._began)
        else:
            self._scan()

    def save(self, path: str | PathLike[str]) -> None:
        """Write a checkpoint of the line and its controller, from which another scenario can start.

        Raises CheckpointError, and ControlError for a controller whose memory can't be saved.
        """
        self.simulation.save(path, controller=self._loop.snapshot())

    def attach_node(
        self,
        command: Sequence[str],
        *,
        namespace: str = "",
        domain: int | None = None,
        patience: float = PATIENCE,
    ) -> None:
        """Attach a controller that is a ROS node in lockstep, in place of the one before. It scans from this tick on.

        command: starts the node, in the environment of its domain; empty: it is started elsewhere. namespace: that of
        `line` and `lockstep`. domain: ROS_DOMAIN_ID; None: a free one, on this machine only. patience: longest time for
        each request, s of wall time.

        Raises ControlError without ROS 2, or if no request comes, which every later tick may raise as well;
        CommandError, ConveyorError and OSError as `AttachedNode`.
        """
        try:
            from conveyor_sim.ros.attached import AttachedNode
        except ImportError as error:
            raise ControlError(f"a node can't be attached here: {error}; expected ROS 2 and conveyor_msgs") from error
        self._attach(
            lambda: AttachedNode(self.simulation, command, namespace=namespace, domain=domain, patience=patience)
        )

    def attach_modbus(
        self,
        command: Sequence[str] = (),
        *,
        port: int = 0,
        rows: Sequence[Row] | None = None,
        patience: float = PATIENCE,
    ) -> None:
        """Attach a PLC that is a Modbus TCP client of a server of this test, in place of the controller before.

        The PLC runs in lockstep. It reads the inputs of the tick given in input registers 65534 and 65535, and writes
        outputs. Then it writes the tick up to which the line may go to holding registers 65534 and 65535.
        command: starts the PLC, with the address of the server in the environment variable CONVEYOR_SIM_ADDRESS; empty:
        it is started elsewhere. port: 0 for any free port. rows: map of addresses; None: that of `conveyor-sim tags
        --modbus`. patience: longest time for each scan, s of wall time.

        Raises ControlError if the PLC does not let the line go on, which every later tick may raise as well;
        ServerError, OSError as `AttachedPlc`; ImportError without pymodbus.
        """
        make = plc.modbus(rows, port)
        self._attach(lambda: plc.AttachedPlc(self.simulation, make, command, {}, patience))

    def attach_opcua(
        self, command: Sequence[str] = (), *, port: int = 0, password: str = "", patience: float = PATIENCE
    ) -> None:
        """Attach a PLC that is an OPC UA client of a server of this test, in place of the controller before.

        The PLC runs in lockstep: it reads the inputs of `run/tick`, writes commands by name, then `run/target_tick`. It
        signs in as user "plc" with the role controller. password: password of that user; empty: a random one, in the
        environment variable CONVEYOR_SIM_PASSWORD of the command. Other parameters and exceptions: as for
        `attach_modbus`; ImportError without asyncua.
        """
        password = password or secrets.token_urlsafe()
        make, environment = plc.opcua(password, port), {plc.PASSWORD: password}
        self._attach(lambda: plc.AttachedPlc(self.simulation, make, command, environment, patience))

    def attach_plc(
        self,
        url: str,
        tags: str | PathLike[str],
        *,
        user: str = "",
        password: str = "",
        access: PlcAccess | None = None,
        patience: float = PATIENCE,
    ) -> None:
        """Attach a running PLC that is a server, in place of the controller before. The line is its client.

        url: "opc.tcp://host:port", "modbus://host:port", "s7://host/rack/slot", "eip://host/slot" or
        "ads://net-id:port?host=address". tags: CSV file that maps our tags to those of the PLC, including `run/tick`
        and `run/target_tick` (docs/plc.md). user: "" for anonymous. access: all settings of an OPC UA connection,
        instead of user and password. patience: longest time for each scan, s of wall time.

        Raises TagMapError for a map that does not fit; PlcLinkError if the PLC can't be reached or is not trusted;
        CertificateError for a certificate of ours that can't be used; ControlError if it does not answer, which every
        later tick may raise as well; ImportError without the library of the protocol.
        """
        image = self.simulation.process_image
        chosen = PlcAccess(user, password) if access is None else access
        self._attach(lambda: ServedPlc(image, url, Path(tags), chosen, patience))

    def source(self) -> SteppedTagProvider:
        """Return the line as a source for a protocol server. Inputs of clients are applied at the next tick.

        A refused input is a command result and an event, and fails no test.
        """
        self._sources.append(SteppedTagProvider(self.simulation))
        return self._sources[-1]

    def command(self, name: str, value: float) -> None:
        """Give a command for the next tick. A command of the controller with the same name comes after it.

        Raises CommandError if it would be refused.
        """
        self._give(Input(TEST, TEST, "test", SET, (name,), (value,)))

    def changeover(self, format: str) -> None:
        """Give the commands that set speeds, rates and bottle types of another format of the scene at the next tick.

        A controller that gives the same commands in its scans overwrites them. Raise SceneError for an unknown format,
        and for one that commands can't set.
        """
        commands = changeover(self.scene, format)
        if commands:
            self._give(Input(TEST, TEST, "test", SET, tuple(commands), tuple(commands.values())))

    def inject(self, fault: str, value: float = 1.0) -> None:
        """Begin a fault at the next tick, or end it with value 0. Raise CommandError if it would be refused."""
        self._give(Input(FAULT, TEST, "test", INJECT, (fault,), (value,)))

    def run_for(self, seconds: float) -> None:
        """Advance by `seconds`, rounded up to whole ticks.

        Raises AssertionError for a failed `always` or `never`, CommandError for a refused command of the controller,
        SimulationError.
        """
        __tracebackhide__ = True
        for _ in range(self._ticks(seconds)):
            self._step()

    def run_until(self, condition: Condition, within: float) -> float:
        """Advance until a condition is true, and return the seconds that passed: 0 if it is true already.

        It brings a scenario to its initial situation. Raises AssertionError if that takes more than `within` seconds.
        """
        __tracebackhide__ = True
        return self._wait(Assertion(condition, "run_until", self.time), within)

    def eventually(self, condition: Condition, within: float) -> float:
        """Assert that a condition becomes true within `within` seconds. Advance until then, and return that time, s."""
        __tracebackhide__ = True
        return self._wait(Assertion(condition, "eventually", self.time), within)

    def always(self, condition: Condition, for_: float | None = None) -> None:
        """Assert that a condition is true now and at every tick of the next `for_` seconds, and advance by them.

        for_: None: do not advance, and assert the condition at every later tick.
        """
        __tracebackhide__ = True
        self._hold(Assertion(condition, "always", self.time), for_)

    def never(self, condition: Condition, for_: float | None = None) -> None:
        """Assert that a condition is true at no tick, as `always` does."""
        __tracebackhide__ = True
        self._hold(Assertion(condition, "never", self.time), for_)

    def _hold(self, assertion: Assertion, for_: float | None) -> None:
        __tracebackhide__ = True
        self._check(assertion)
        self._standing.append(assertion)
        if for_ is not None:
            self.run_for(for_)
            self._standing.remove(assertion)

    def _wait(self, assertion: Assertion, within: float) -> float:
        __tracebackhide__ = True
        first, last = self.simulation.tick, self.simulation.tick + self._ticks(within)
        while not self._true(assertion, present := self.signals):
            if self.simulation.tick >= last:
                span = f"within {within:g} s, from {assertion.since:.2f} s to {self.time:.2f} s"
                self._fail(assertion, f"did not come true {span}", present)
            self._step()
        return round((self.simulation.tick - first) * self.scene.tick, 9)

    def _check(self, assertion: Assertion) -> None:
        __tracebackhide__ = True
        unwanted = assertion.word == "never"
        if self._true(assertion, present := self.signals) is unwanted:
            after = (
                f", {self.time - assertion.since:.2f} s after it was first asserted"
                if self.time > assertion.since
                else ""
            )
            when = f"at {self.time:.2f} s (tick {self.simulation.tick}){after}"
            self._fail(assertion, f"was {str(unwanted).lower()} {when}", present)

    def _true(self, assertion: Assertion, present: Present) -> bool:
        true = bool(assertion.condition(present))
        self._read = {**present.read, **self._read}
        return true

    def _fail(self, assertion: Assertion, result: str, present: Present) -> NoReturn:
        __tracebackhide__ = True
        self.failed, self.failure = assertion, f"{assertion.words} {result}"
        self.values_at_failure = {name: present[name] for name in tuple(present.read)}
        shown = values(present.read, present, self.history.unit, self.simulation.line.forcing.names)
        raise AssertionError(f"{assertion.text} {result}; the signals that it reads:\n{shown}")

    def _step(self) -> None:
        __tracebackhide__ = True
        for source in self._sources:
            source.before_tick()
        self._loop.give()
        if self._inputs is not None:
            self._inputs.before_tick()
        try:
            self.simulation.advance()
        except SimulationError as error:
            self._outputs.after_failure()
            self._outputs.show_run(RunState(STOPPED, printable(error, SENTENCE)))
            self._stopped = True
            if self._inputs is not None:
                self._inputs.after_failure()
            raise
        if self._inputs is not None:
            self._inputs.after_tick()
        refused = []
        outcomes = self._outputs.after_tick()
        self._loop.note(outcomes)
        for outcome in outcomes:
            if outcome.accepted:
                self.history.take(outcome, outcome.source == TEST)
            elif outcome.source in SCADA_SOURCES and not self._loop.wrote(outcome):
                continue
            elif not (outcome.without_control and outcome.input.writer_kind == "controller"):
                refused.append(outcome.reason)
        self._look()
        for source in self._sources:
            source.after_tick()
        if refused:
            raise CommandError(f"at {self.time - self.scene.tick:.2f} s a command was refused: {'; '.join(refused)}")
        if self._loop.attached:
            self._scan()
        for assertion in self._standing:
            self._check(assertion)
        self._watch()

    def _look(self) -> None:
        """Read the signals of the present tick."""
        now = self.simulation.signals()
        self.history.begin_tick(self.time, now)
        self._signals = dict(zip(self.simulation.process_image.signal_names, now.tolist(), strict=True))
        alarms = self.simulation.line.alarms
        if alarms.changed:
            self._alarms |= alarms.controller_alarms()
            self.history.alarms(self._alarms)

    def _watch(self) -> None:
        """Add the variables of the controller that conditions have read to the history."""
        variables = self._loop.recorded.variables
        self.history.watch({name: variables[name] for name in self._read if name in variables})

    def _attach(self, make: Callable[[], AttachedController]) -> None:
        self._loop.attach(make)
        self._scan()

    def _scan(self) -> None:
        inputs, recorded = self._present(self._signals), self._loop.recorded
        raised = self._loop.scan(inputs)
        self._read_by_controller |= inputs.read
        for note in self._noting:
            note(recorded.names, recorded.values())
        # The line gets new alarms as the next tick begins. Until then they are known, and do not stand.
        if new := {name: 0.0 for name in raised if name not in self._alarms}:
            self._alarms |= new
            self.history.alarms(new)

    def _present(self, values: Mapping[str, float]) -> Present:
        return Present(values, self.time, self.simulation.tick, self.scene.tick)

    def _give(self, request: Input) -> None:
        if reason := self.simulation.line.refusal(request):
            raise CommandError(reason)
        self.simulation.give(request)

    def _ticks(self, seconds: float) -> int:
        if not (math.isfinite(seconds) and seconds >= 0.0):
            raise ValueError(f"{seconds:g} s given, expected 0 s or more")
        return math.ceil(seconds / self.scene.tick - _ROUNDING)
