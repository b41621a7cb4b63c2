# SPDX-License-Identifier: Apache-2.0
"""`MachineDevice`: PackML states, rate, failures and planned stops of machines that feed or take bottles."""

from collections.abc import Collection, Sequence
from types import SimpleNamespace

from conveyor_sim.line.alarms.declaration import Declared, error
from conveyor_sim.line.device import Device, ScanContext
from conveyor_sim.line.devices.setup import DeviceSetup
from conveyor_sim.line.machines.efficiency import CATEGORIES, Category, TimeAccount
from conveyor_sim.line.machines.failures import Draws, FailureClock, PlannedTimes
from conveyor_sim.line.machines.packml import (
    CNTRL_CMD,
    COMMAND_TEXTS,
    STATE_TEXTS,
    Command,
    PackMLState,
    StateMachine,
    mode_objection,
    objection,
    stops,
)
from conveyor_sim.line.machines.stop_reason import (
    BLOCKED,
    BY_HAND,
    COMMANDED,
    FAULT,
    FIRST_FAILURE,
    FIRST_PLANNED,
    NONE,
    RUN,
    STARVED,
    WORKING,
    category_of,
    is_failure,
    reason_texts,
)
from conveyor_sim.line.tag import Tag, choice, count, number, switch
from conveyor_sim.scene.failures import Times
from conveyor_sim.scene.parts.machine import PackmlPart

ROUNDING = 1e-9
"""Tolerance of a cycle against rounding: sums of rate x tick must not miss the tick they fall on."""

EXECUTE, SUSPENDED, HELD = int(PackMLState.EXECUTE), int(PackMLState.SUSPENDED), int(PackMLState.HELD)


class MachineDevice(Device):
    """Machine that works in cycles of one bottle, or of a batch, and follows the PackML state model.

    It runs at the start.
    """

    def __init__(
        self,
        name: str,
        part: PackmlPart,
        setup: DeviceSetup,
        own: Sequence[Tag],
        conditional: Collection[PackMLState] = (),
    ) -> None:
        """Build the tags and the state machine.

        own: signals of its kind. conditional: acting states that end only when it is `ready`.
        """
        rate, most = part.rate, part.rate if part.rate_limit is None else part.rate_limit
        reasons = reason_texts(part)
        first = PackMLState.STARTING if PackMLState.STARTING in conditional else PackMLState.EXECUTE
        category = category_of(first, NONE, NONE, False)
        shown = CATEGORIES.index(category)
        super().__init__(
            name,
            [
                switch(f"{name}/running", "status", "Running, and not stopped.", 1.0, "state"),
                *own,
                choice(f"{name}/state", "status", "PackML state.", STATE_TEXTS, first, "state"),
                choice(f"{name}/category", "status", "Time category.", dict(enumerate(CATEGORIES)), shown, "state"),
                choice(f"{name}/stop_reason", "status", "Reason for the present or last stop.", reasons, NONE, "state"),
                switch(f"{name}/fault", "status", "Failed and not repaired, or aborted."),
                count(f"{name}/failures", "counter", "Number of failures."),
                number(f"{name}/cur_rate", "actual", "Present rate.", "1/s", 0.0, most, rate),
                switch(f"{name}/run", "command", "Runs while on.", 1.0),
                choice(f"{name}{CNTRL_CMD}", "command", "PackML command; acts when it changes.", COMMAND_TEXTS),
                number(f"{name}/rate", "setpoint", "Bottles per second.", "1/s", 0.0, most, rate, nominal=rate),
                switch(f"{name}/stop", "fault", "Stopped from outside while on."),
            ],
        )
        tick = self._tick = setup.scene.tick
        self._suspend_ticks = setup.ticks(part.suspend_after)
        self._ramp = part.rate * tick / part.ramp_up if part.ramp_up else 0.0
        self._plans = [PlannedTimes(stop, tick) for stop in part.planned_stops.values()]
        self._counts_starts = setup.scene.counts_starts
        self._reference = part.rate if self._counts_starts else most
        self.time = TimeAccount(category, rate)
        self.run = True
        self.rate = rate
        self.stop = False
        self.cntrl_cmd = 0
        self.packml = StateMachine(
            first,
            {PackMLState[field.upper()]: setup.ticks(time) for field, time in part.acting_times},
            conditional,
        )
        self.speed = rate
        """Present rate during a ramp, 1/s."""
        self.cycle = 1.0
        """Completed part of the cycle; from 1 on the machine needs a bottle."""
        self.cause = NONE
        """STARVED or BLOCKED if the machine waited in the last tick, else NONE."""
        self.waited = 0
        """Ticks for which it has waited without a break."""
        self.reason = NONE
        """Reason for the present or last stop."""
        self.restart = False
        """True if the machine must be reset and started as soon as possible."""
        self.planned = NONE
        """Present planned stop."""
        self.failures = 0
        self.clocks = SimpleNamespace(
            **{
                mode: FailureClock(
                    failure,
                    *(
                        self._draws(setup, times, f"failures/{mode}/{what}")
                        for what, times in (("between", failure.between), ("repair", failure.repair))
                    ),
                )
                for mode, failure in part.failures.items()
            }
        )
        self._clocks: list[FailureClock] = list(vars(self.clocks).values())
        self._power = setup.power("machines", self)
        self.restored(0)

    @property
    def alarms(self) -> Sequence[Declared]:
        """Alarm that the machine has failed or was aborted."""
        return (error(f"{self.name}/fault", f"{self.name} has failed", f"{self.name}/fault"),)

    @property
    def state(self) -> int:
        """PackML state."""
        return self.packml.state

    @property
    def category(self) -> Category:
        """Time category since the last tick."""
        return self._category

    @property
    def reference_rate(self) -> float:
        """Rate to which effectiveness refers, 1/s: the fastest permitted one."""
        return self._reference

    def restored(self, tick: int) -> None:
        """Derive flags, category and status from the stored attributes."""
        self._note_failures()
        self._note_state()
        self._category: Category = category_of(self.state, self.reason, self.cause, bool(self._failed))
        self._show()

    def objection(self, name: str, value: float, now: ScanContext) -> str:
        """Return why a command can't be taken now, "" if it can."""
        command = int(value)
        if not name.endswith(CNTRL_CMD) or command in (0, self.cntrl_cmd):
            return ""
        if wrong := objection(command, self.state):
            return f"{name}: {wrong}"
        if not self.run and command in (Command.RESET, Command.START):
            return f"{name}: {COMMAND_TEXTS[command]} given while {self.name}/run is 0, expected 1 before"
        if self._failed and command == Command.UNHOLD:
            return f"{name}: Unhold given while it is not repaired, expected {self.name}/fault to be off"
        stops = self._power.taken_by("machines", self.name) if self._power is not None else []
        if command == Command.CLEAR and stops:
            return f"{name}: Clear given without power, expected {' and '.join(stops)} to be reset before"
        return ""

    def cut_power(self, now: ScanContext) -> None:
        """Abort."""
        self._take(Command.ABORT, by_hand=True)
        self._settle_state()

    def mode_objection(self) -> str:
        """Return why the control mode can't change in the present state, "" if it can."""
        return mode_objection(self.state)

    def stops(self, name: str, value: float) -> bool:
        """Return True for the PackML commands Stop and Abort."""
        return stops(name, value)

    def stop_by_hand(self, name: str, value: float) -> None:
        """Take Stop or Abort. `cntrl_cmd` keeps the value of the writer in control."""
        self._take(int(value), by_hand=True)
        self._settle_state()

    def command(self, name: str, value: float, now: ScanContext) -> None:
        """Apply run, cntrl_cmd, rate (1/s), or the fault `stop`."""
        what = name.rpartition("/")[2]
        if what == "rate":
            self.rate = value
            self.time.change_rate(now.tick, value)
            return
        if what == "stop":
            self.failures += value != 0.0 and not self.stop
            self.stop = value != 0.0
            self._note_failures()
        elif value == (self.run if what == "run" else self.cntrl_cmd):
            return  # a repeated command changes nothing
        elif what == "run":
            self._switch(value != 0.0, now.by_hand)
        else:
            self.cntrl_cmd = int(value)
            self._take(self.cntrl_cmd, now.by_hand)
        self._settle_state()

    @property
    def takes_repeats(self) -> bool:
        """Return False."""
        return False

    def _switch(self, run: bool, by_hand: bool) -> None:
        """Stop when the switch `run` turns off. Reset and start when it turns on, unless aborted."""
        before, self.run = self.run, run
        if before and not run:
            self.restart = False
            self._stand(Command.STOP, RUN + BY_HAND * by_hand)
        elif run and not before:
            self.restart = self.state not in (PackMLState.ABORTING, PackMLState.ABORTED, PackMLState.CLEARING)

    def _take(self, command: int, by_hand: bool) -> None:
        """Take a PackML command, unless an earlier command of the input has changed the state."""
        if command == 0 or not self.packml.takes(command):
            return
        if command in (Command.STOP, Command.ABORT, Command.RESET):
            self.restart, self.planned = False, NONE
        if command in COMMANDED:
            self._stand(Command(command), COMMANDED[command] + BY_HAND * by_hand)
        else:
            self.packml.take(command)

    def _stand(self, command: Command, reason: int) -> None:
        """Stop working by a PackML command, if the state allows it. A failure stays the reason."""
        if self.packml.takes(command):
            hidden = is_failure(self.reason) and self.state not in WORKING and reason < STARVED
            self.reason = self.reason if hidden else reason
            self.packml.take(command)

    def advance(self, now: ScanContext) -> None:
        """Advance by one tick: failures, repairs, planned stops, acting states, ramp.

        Called once per tick, first, if the machine is busy.
        """
        if now.tick == 0:
            return
        if self._clocks:
            self._count_failures()
        if self._plans:
            self._follow_plan(now.tick)
        if self.packml.acts:
            self.packml.advance(self.ready(now))
            self._settle_state()
        if self._ramp and self.packml.state in WORKING:
            self.speed = min(self.rate, self.speed + self._ramp)

    def ready(self, now: ScanContext) -> bool:
        """Return True if a conditional acting state may end."""
        return True

    def _count_failures(self) -> None:
        running = self.packml.state == EXECUTE and not self.waited
        changed = [clock for clock in self._clocks if clock.advance(running)]
        if changed:
            self.failures += sum(clock.failed for clock in changed)
            self._note_failures()
            self._settle_state()

    def _follow_plan(self, tick: int) -> None:
        for index, plan in enumerate(self._plans):
            on, before = plan.on(tick), tick > 1 and plan.on(tick - 1)
            if on and not before:
                self.planned = FIRST_PLANNED + index
                self._stand(Command.STOP, self.planned)
            elif before and not on and self.planned:
                self._end_plan(tick)
            else:
                continue
            self._settle_state()

    def _end_plan(self, tick: int) -> None:
        """End a planned stop: enter another one that is due, or reset and start."""
        self.planned = next((FIRST_PLANNED + index for index, plan in enumerate(self._plans) if plan.on(tick)), NONE)
        if not self.planned:
            self.restart = self.run and self.state in (PackMLState.STOPPING, PackMLState.STOPPED)
        elif self.reason >= FIRST_PLANNED:
            self.reason = self.planned

    def _settle_state(self) -> None:
        """Make the transitions that follow without a command."""
        machine = self.packml
        if machine.state == HELD and not self._failed and is_failure(self.reason):
            machine.take(Command.UNHOLD)
        while self.restart and (machine.takes(Command.RESET) or machine.takes(Command.START)):
            self.restart = not machine.takes(Command.START)
            machine.take(Command.RESET if machine.takes(Command.RESET) else Command.START)
        if self._failed:
            self._stand(Command.HOLD, self._failed)
        self._note_state()

    def _note_failures(self) -> None:
        first = (FIRST_FAILURE + index for index, clock in enumerate(self._clocks) if clock.failed)
        self._failed = FAULT if self.stop else next(first, NONE)
        """First reason that prevents work, NONE if there is none."""

    def _note_state(self) -> None:
        self._changed = True
        self._waits = self.state == SUSPENDED and self.reason in (STARVED, BLOCKED)
        self._works = (self.state in self._working or self._waits) and not self._failed
        self._busy = bool(self._clocks or self._plans or self._ramp) or self.packml.acts
        if self.state not in WORKING:
            self.speed = 0.0 if self._ramp else self.speed

    _batch = 1
    """Bottles of a cycle."""

    _working: Collection[int] = (EXECUTE,)
    """States in which the machine works on bottles."""

    @property
    def works(self) -> bool:
        """True if the machine works on bottles, or would if it did not wait."""
        return self._works

    def turn(self, now: ScanContext) -> bool:
        """Advance the cycle by one tick, and return True if it is complete.

        It advances in ticks that are charged as running, and in no others.
        """
        ran = now.tick > 0 if self._counts_starts else self._category == "running"
        if self._works and ran and now.tick > 0:
            self.cycle += (self.speed if self._ramp else self.rate) * now.length / self._batch
        return self._works and self.cycle >= 1.0 - ROUNDING

    def wait(self) -> None:
        """Stay at the end of the cycle. Time lost by waiting is not recovered."""
        self.cycle = 1.0

    def goes_on(self) -> bool:
        """Return True if the machine can take or give a bottle now. It leaves Suspended for that."""
        if self._waits:
            self.packml.take(Command.UNSUSPEND)
            self._note_state()
        return self._works

    def conclude(self, cause: int, now: ScanContext) -> None:
        """End the work of a tick.

        cause: STARVED or BLOCKED if the machine had to wait, else NONE. Called once per tick, last.
        """
        if not (cause or self.waited or self._changed):
            return
        if cause:
            self.waited = self.waited + 1 if cause == self.cause else 1
            if self.waited >= self._suspend_ticks and self.packml.state == EXECUTE:
                self._stand(Command.SUSPEND, cause)
                self._note_state()
        elif self.waited:
            self.waited = 0
        if cause != self.cause or self._changed:
            self.cause = cause
            failed = self._shown[3]
            self._category = category_of(self.state, self.reason, cause, bool(self._failed))
            self._show()
            if failed != self._shown[3]:
                now.alarm(f"{self.name}/fault", self._shown[3])
            self.time.change(now.tick, self._category)

    def _show(self) -> None:
        """Update the status."""
        self._changed = False
        fault = bool(self._failed) or self.state == PackMLState.ABORTED
        self._shown = self.state, CATEGORIES.index(self._category), self.reason, fault

    @property
    def condition(self) -> Sequence[float]:
        """State, category and stop reason."""
        return self._shown[:3]

    @property
    def cycle_rate(self) -> float:
        """Present rate, 1/s; 0 while it does not work."""
        return (self.speed if self._ramp else self.rate) if self._works and not self._waits else 0.0

    def status(self) -> Sequence[float]:
        """Return state, category, stop_reason, fault, failures and cur_rate (1/s)."""
        return *self._shown, self.failures, self.cycle_rate

    def waited_time(self, category: Category, ticks: int, now: ScanContext) -> float:
        """Return the total time starved or blocked, s. ticks: number of ticks at whose end it waited."""
        return (ticks if self._counts_starts else self.time.ticks_of(category, now.tick)) * now.length

    @property
    def begun_part(self) -> float:
        """Bottles of the present cycle that are done, a part of them; 0 without a bottle."""
        return self.cycle * self._batch

    def _draws(self, setup: DeviceSetup, times: Times, purpose: str) -> Draws:
        return Draws(times, setup.random(self.name, purpose), self._tick)
