"""`Scenario`: a line with a controller attached, run in simulated time by a test that looks at it at every tick."""

from __future__ import annotations

import math
import secrets
import uuid
from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager
from os import PathLike
from pathlib import Path
from typing import Any, NoReturn

from conveyor_sim.bag.input_log import InputLog, copier
from conveyor_sim.bag.outputs import Outputs, forget_past
from conveyor_sim.bag.recorder import Recorder
from conveyor_sim.control.scan import Controller
from conveyor_sim.errors import CommandError, SimulationError
from conveyor_sim.line.commands.inputs import DISOWN, FAULT, INJECT, SET, Input
from conveyor_sim.line.run_state import ENDED, RUNNING, STOPPED, RunState
from conveyor_sim.protocols.tags.tag_provider import SCADA_SOURCES, SteppedTagProvider
from conveyor_sim.scene import Scene
from conveyor_sim.simulation import Simulation
from conveyor_sim.support.modbus_rows import Row
from conveyor_sim.support.printable import SENTENCE, printable
from conveyor_sim.testing import plc
from conveyor_sim.testing.conditions import Assertion, Condition, Present, values
from conveyor_sim.testing.history import History
from conveyor_sim.testing.person import Person
from conveyor_sim.testing.scan_cycle import PATIENCE, ScanCycle, by_other_hands
from conveyor_sim.testing.scene_of import scene_of

TEST = "test"
"""Source of commands that the test itself gives."""

_ROUNDING = 1e-9


class Scenario(AbstractContextManager["Scenario"]):
    """A line under test. All times are simulated; conditions are evaluated at every tick.

    The controller's first scan is at the tick at which it is attached, then there is one a tick, as with
    `controller_node` in lockstep: it sees the signals of a tick, and its commands act from that tick on.
    """

    def __init__(
        self,
        scene: Scene | str | PathLike[str],
        overrides: Mapping[str, Any] | None = None,
        *,
        start: str | PathLike[str] | None = None,
        bag: Path | None = None,
        inputs: Path | None = None,
        history: float | None = None,
    ) -> None:
        """scene: one that was loaded, a scene file, or the name of a shipped one. overrides: laid over a file's fields.
        start: checkpoint of the same scene to begin from; None: its bottles are as the scene has them.
        bag: folder to record to from the start, new or empty; None: nothing is recorded.
        inputs: folder to write the inputs to as they come, of which `conveyor-sim recover` makes the bag; None: none.
        history: s of the last signals, commands and alarms to keep, for runs of hours; None: all, from the start.

        Raises SceneError for a scene that can't be, CheckpointError for a start that is missing, damaged or of another
        scene, BagError if it can't be recorded, ValueError for overrides of a loaded scene.
        """
        self.scene = scene_of(scene, overrides)
        self.simulation = Simulation(self.scene) if start is None else Simulation.load(start, scene=self.scene)
        most = None if history is None else max(self._ticks(history), 1)
        self.history = History(self.simulation.process_image, most)
        self.operator = Person(TEST, "operator", self._give)
        """One at the line's panel."""
        self.engineer = Person(TEST, "engineer", self._give)
        """One who may do more (docs/line.md, Who may command)."""
        self.failed: Assertion | None = None
        """The condition that failed."""
        self.failure = ""
        """What became of it, in words."""
        self._read: dict[str, None] = {}
        self._recorder = None if bag is None else Recorder(bag, start=copier(start))
        self._outputs = Outputs(self.simulation, [self._recorder] if self._recorder else [], run_id=uuid.uuid4().hex)
        began = self._began = None if start is None else Path(start)
        if began is not None:
            forget_past(self.simulation)
            if owner := self.simulation.line.modes.owner:  # of the run before, whose controller is gone
                self.simulation.give(Input(TEST, owner, "controller", DISOWN, (), ()))
        self._outputs.start()
        self._outputs.show_run(RunState(RUNNING))
        self._inputs = None if inputs is None else InputLog(inputs, self.simulation, began)
        self._noting = [self._outputs.show_variables, *([self._inputs.note_variables] if self._inputs else [])]
        self._cycle = ScanCycle(self.simulation, self._give)
        self._alarms: dict[str, float] = {}
        self._standing: list[Assertion] = []
        self._sources: list[SteppedTagProvider] = []
        self._signals: dict[str, float] = {}
        self._stopped = False  # by the guard
        self._look()

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """End an attached node, and the recording, if there is one; it can't run on then."""
        self._cycle.close()
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
        """The present signals by name, alarms among them ("alarms/<id>"), 1 while they stand, and the variables of a
        PLC program (plc/main/speed).
        """
        return self._present(self._cycle.with_variables({**self._signals, **self._alarms}))

    @property
    def alarms(self) -> frozenset[str]:
        """Ids of the alarms that stand."""
        return self.simulation.alarms

    @property
    def read_by_conditions(self) -> tuple[str, ...]:
        """Names of the signals that conditions have read, those of the last one first."""
        return tuple(self._read)

    @property
    def read_by_controller(self) -> tuple[str, ...]:
        """Names of the signals that the controller has read."""
        return tuple(self._cycle.read)

    def attach(self, controller: Controller, *, resume: bool = False) -> None:
        """Have a controller scan at this tick and every one to come, in place of the one before.

        resume: it goes on from what the one of the checkpoint remembered, which `save` has kept: with the same bits as
        if the run had never stopped. Raises ControlError if it can't.
        """
        self._cycle.attach(controller)
        if resume:
            self._cycle.resume(self._began)
        else:
            self._scan()

    def save(self, path: str | PathLike[str]) -> None:
        """Write a checkpoint of the line and of its controller, which another scenario can start from.

        Raises CheckpointError, and ControlError for a controller that can't be held.
        """
        self.simulation.save(path, controller=self._cycle.snapshot())

    def attach_node(
        self,
        command: Sequence[str],
        *,
        namespace: str = "",
        domain: int | None = None,
        patience: float = PATIENCE,
    ) -> None:
        """Have a controller that is a ROS node in lockstep scan from this tick on, in place of the one before.

        command: starts it, in the environment of its domain; empty: others start it. namespace: in which it looks for
        `line` and `lockstep`. domain: ROS_DOMAIN_ID; None: one of its own, on this machine only. patience: s of wall
        time that it has for each request.

        Raises ControlError without ROS 2, or if no request comes, as every later tick does; CommandError, ConveyorError
        and OSError as `AttachedNode`.
        """
        self._cycle.attach_node(command, namespace, domain, patience)
        self._scan()

    def attach_modbus(
        self,
        command: Sequence[str] = (),
        *,
        port: int = 0,
        rows: Sequence[Row] | None = None,
        patience: float = PATIENCE,
    ) -> None:
        """Have a PLC scan that is a Modbus TCP client of a server for this test, in place of the one before.

        It goes in lockstep: it reads the inputs of the tick in input registers 65534 and 65535, writes outputs, and
        writes the tick up to which the line is to go into holding registers 65534 and 65535. command: starts it, with
        the server's address in the environment variable CONVEYOR_SIM_ADDRESS; empty: others start it. port: 0 for any
        that is free. rows: the map of addresses; None: that of `conveyor-sim tags --modbus`. patience: s of wall time
        that it has for each scan.

        Raises ControlError if it does not let the line go on, as every later tick does; ServerError, OSError as
        `AttachedPlc`; ImportError without pymodbus.
        """
        self._cycle.attach_plc(plc.modbus(rows, port), command, {}, patience)
        self._scan()

    def attach_opcua(
        self, command: Sequence[str] = (), *, port: int = 0, password: str = "", patience: float = PATIENCE
    ) -> None:
        """The same of a PLC that is an OPC UA client: `run/tick`, commands by name, then `run/target_tick`.

        It is the user "plc" of role controller. password: of that; empty: one that is drawn, and given to the command
        in the environment variable CONVEYOR_SIM_PASSWORD. Raises as `attach_modbus`; ImportError without asyncua.
        """
        password = password or secrets.token_urlsafe()
        self._cycle.attach_plc(plc.opcua(password, port), command, {plc.PASSWORD: password}, patience)
        self._scan()

    def attach_plc(
        self,
        url: str,
        tags: str | PathLike[str],
        *,
        user: str = "",
        password: str = "",
        patience: float = PATIENCE,
    ) -> None:
        """Have a PLC scan that is a server, and runs already, in place of the one before: the line is its client.

        url: "opc.tcp://host:port" or "modbus://host:port". tags: the CSV file that says which of its tags stands for
        which of ours, `run/tick` and `run/target_tick` among them (docs/plc.md). user: "" for anonymous. patience: s of
        wall time that it has for each scan.

        Raises TagMapError for a map that does not fit; LinkError if the PLC can't be reached; ControlError if it does
        not answer, as every later tick does; ImportError without the protocol's library.
        """
        self._cycle.attach_served_plc(url, Path(tags), user, password, patience)
        self._scan()

    def source(self) -> SteppedTagProvider:
        """The line as a SCADA face sees it, from now on. What clients of that give is applied at the next tick.

        One that is refused is an outcome and an event, and fails no test.
        """
        self._sources.append(SteppedTagProvider(self.simulation))
        return self._sources[-1]

    def command(self, name: str, value: float) -> None:
        """Give a command for the next tick; one of the controller's of the same name comes after it.

        Raises CommandError if it would be refused.
        """
        self._give(Input(TEST, TEST, "test", SET, (name,), (value,)))

    def inject(self, fault: str, value: float = 1.0) -> None:
        """Have a fault begin, or with value 0 end, at the next tick. Raises CommandError if it would be refused."""
        self._give(Input(FAULT, TEST, "test", INJECT, (fault,), (value,)))

    def run_for(self, seconds: float) -> None:
        """Let time pass, rounded up to whole ticks.

        Raises AssertionError for what must always or never be, CommandError for a command of the controller that is
        refused, SimulationError.
        """
        __tracebackhide__ = True
        for _ in range(self._ticks(seconds)):
            self._step()

    def run_until(self, condition: Condition, within: float) -> float:
        """Let time pass until a condition is true, and return the seconds that took; none if it is true already.

        For what a scenario needs to begin with; raises AssertionError if it takes more than `within` seconds.
        """
        __tracebackhide__ = True
        return self._wait(Assertion(condition, "run_until", self.time), within)

    def eventually(self, condition: Condition, within: float) -> float:
        """Assert that a condition comes true within so many seconds, let them pass until then; returns how many."""
        __tracebackhide__ = True
        return self._wait(Assertion(condition, "eventually", self.time), within)

    def always(self, condition: Condition, for_: float | None = None) -> None:
        """Assert that a condition is true now and at every tick of the next `for_` seconds, and let them pass.

        for_: None: lets no time pass, and asserts it at every tick of whatever is run later.
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
                self._fail(assertion, f"{assertion.text} did not come true {span}", present)
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
            self._fail(assertion, f"{assertion.text} was {str(unwanted).lower()} {when}", present)

    def _true(self, assertion: Assertion, present: Present) -> bool:
        true = bool(assertion.condition(present))
        self._read = {**present.read, **self._read}
        return true

    def _fail(self, assertion: Assertion, head: str, present: Present) -> NoReturn:
        __tracebackhide__ = True
        self.failed, self.failure = assertion, head
        shown = values(present.read, present, self.history.unit, self.simulation.line.forcing.names)
        raise AssertionError(f"{head}; the signals that it reads:\n{shown}")

    def _step(self) -> None:
        __tracebackhide__ = True
        for source in self._sources:
            source.before_tick()
        self._cycle.give()
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
        self._cycle.note(outcomes)
        for outcome in outcomes:
            if outcome.accepted:
                self.history.take(outcome, outcome.source == TEST)
            elif by_other_hands(outcome):
                continue
            elif outcome.source not in SCADA_SOURCES or self._cycle.answers_for(outcome):
                refused.append(outcome.reason)
        self._look()
        for source in self._sources:
            source.after_tick()
        if refused:
            raise CommandError(f"at {self.time - self.scene.tick:.2f} s a command was refused: {'; '.join(refused)}")
        if self._cycle.attached:
            self._scan()
        for assertion in self._standing:
            self._check(assertion)
        self._watch()

    def _look(self) -> None:
        """Read the signals of a tick that is reached."""
        now = self.simulation.signals()
        self.history.begin_tick(self.time, now)
        self._signals = dict(zip(self.simulation.process_image.signal_names, now.tolist(), strict=True))
        alarms = self.simulation.line.alarms
        if alarms.changed:
            self._alarms |= alarms.controller_alarms()
            self.history.alarms(self._alarms)

    def _watch(self) -> None:
        """Note the controller's variables that conditions have read: the history has them from then on."""
        variables = self._cycle.variables
        self.history.watch({name: variables[name] for name in self._read if name in variables})

    def _scan(self) -> None:
        said = self._cycle.scan(self._present(self._signals))
        for note in self._noting:
            note(self._cycle.recorded.names, self._cycle.recorded.values())
        # The line is given them as the next tick begins; until then they are there, and don't stand.
        if new := {name: 0.0 for name in said if name not in self._alarms}:
            self._alarms |= new
            self.history.alarms(new)

    def _present(self, values: Mapping[str, float]) -> Present:
        return Present(values, self.time, self.simulation.tick, self.scene.tick)

    def _give(self, given: Input) -> None:
        if reason := self.simulation.refusal(given):
            raise CommandError(reason)
        self.simulation.give(given)

    def _ticks(self, seconds: float) -> int:
        if not (math.isfinite(seconds) and seconds >= 0.0):
            raise ValueError(f"{seconds:g} s given, expected 0 s or more")
        return math.ceil(seconds / self.scene.tick - _ROUNDING)
