# SPDX-License-Identifier: Apache-2.0
"""One tick of the engine: steps on a pool of threads, checked by the guard."""

import os
import time
from typing import Any

from conveyor_sim.columns.events import GuardEvent
from conveyor_sim.engine.arrays.rails import RailContacts
from conveyor_sim.engine.integrators import INTEGRATORS, RESUME, START
from conveyor_sim.engine.support.vibration import start_tick
from conveyor_sim.engine.threads.thread_choice import ThreadChoice
from conveyor_sim.engine.threads.thread_pool import ThreadPool
from conveyor_sim.errors import SimulationError
from conveyor_sim.physics.model.moving_rails import FastestRail
from conveyor_sim.physics.state import State
from conveyor_sim.physics.state.snapshot import restore, snapshot
from conveyor_sim.physics.stepping.guard import chatter
from conveyor_sim.physics.stepping.guard.guard import Guard
from conveyor_sim.physics.stepping.guard.violation import Violation
from conveyor_sim.physics.stepping.guard.world_snapshot import WorldSnapshot
from conveyor_sim.physics.stepping.sleep import SleepDecision, asleep_share

SHORTER = (4, 16, 64)
"""Factors by which the steps of a failed tick are shortened, one after the other."""


class Integration:
    """Time integration of a State, tick by tick."""

    def __init__(self, state: State, threads: int | None, shorten: bool) -> None:
        """Prepare the first tick. threads: None chooses them. shorten: repeat failed ticks before stopping the run."""
        cores = len(os.sched_getaffinity(0))
        self._state = state
        self._model = state.model
        self._advance = INTEGRATORS[state.model.integrator]
        self._pool = ThreadPool(cores if threads is None else threads)
        self._choice = ThreadChoice(cores) if threads is None else None
        self._shorter = SHORTER if shorten else ()
        self._guard = Guard(state, self.found)
        self._rails = FastestRail(state.model.plant)
        self._memory = self._guard.memory
        self._chatter_ticks = self._ticks_between_checks()
        self._kernel_seconds = 0.0
        self._sleep = SleepDecision()

    @property
    def kernel_seconds(self) -> float:
        """Wall time of all steps, s."""
        return self._kernel_seconds

    @property
    def threads(self) -> int:
        """Threads of the next tick."""
        return self._pool.most if self._choice is None else self._choice.size

    @property
    def found(self) -> RailContacts:
        """Work arrays of the calling thread for rail contacts."""
        return self._pool.group(1)[0].rail_contacts

    @property
    def asleep_share(self) -> float | None:
        """Share of bottles asleep, over all ticks so far; None if no bottle can sleep, or before the first tick."""
        return asleep_share(self._state.world)

    @property
    def deepest_overlap(self) -> float:
        """Largest ratio of overlap to radius so far."""
        return self._memory.deepest

    @property
    def shortened_ticks(self) -> int:
        """Ticks that were repeated in shorter steps."""
        return self._memory.shortened_ticks

    def take_events(self) -> list[GuardEvent]:
        """Return what the guard has reported since the last call."""
        events, self._memory.events = self._memory.events, []
        return [GuardEvent(*event) for event in events]

    def snapshot(self) -> dict[str, Any]:
        """Return the memory of the guard as plain data for `restore`."""
        memory: dict[str, Any] = snapshot(self._memory)
        return memory

    def restore(self, memory: dict[str, Any]) -> None:
        """Restore the snapshot of an Integration of the same Model. Raise ValueError for any other data."""
        restore(self._memory, memory, "integration")

    def put_in(self) -> None:
        """Note that bottles were placed by an edit or a restore, not by devices."""
        self._memory.put_in = True

    def take_tick(self, tick: int, surface_speed: float) -> None:
        """Advance by one tick. surface_speed: m/s, of the fastest belt.

        Raise SimulationError if the guard stops the run; the state is that at the beginning of the tick then.
        """
        seconds = tick * self._model.tick_ns * 1e-9
        wrong = self._guard.begin(tick, surface_speed, self._rails.speed(self._state.world.moving))
        if wrong is not None:
            raise self._stopped(tick, wrong, wrong.sentence(seconds, 1))
        if self._state.world.vibration is not None:
            start_tick(self._state.world.vibration, seconds)
        began = time.perf_counter()
        self._state.moves += 1
        self._take_steps(1)
        took = time.perf_counter() - began
        self._kernel_seconds += took
        if self._choice is not None:
            self._choice.took(took, self._model.steps_per_tick * self._state.world.bottles.id.size)
        wrong = self._guard.end(self._model.dt)
        if wrong is not None:
            self._repeat(tick, seconds, wrong)
        self._report_once(tick + 1)

    def _repeat(self, tick: int, seconds: float, wrong: Violation) -> None:
        """Repeat the tick in shorter steps. The guard has restored the state at the beginning of the tick."""
        tried, first = 1, wrong
        for factor in self._shorter if wrong.curable else ():
            self._take_steps(factor)
            again = self._guard.end(self._model.dt / factor, repeated=True)
            if again is None:
                self._memory.shortened_ticks += 1
                text = f"{first.sentence(seconds, 1)}; the tick was repeated in steps {factor} times shorter"
                self._memory.report(GuardEvent(tick + 1, "shorter_steps", first.bottle, first.x, first.y, text))
                return
            tried, wrong = factor, again
        raise self._stopped(tick, wrong, wrong.sentence(seconds, tried))

    def _stopped(self, tick: int, wrong: Violation, text: str) -> SimulationError:
        self._memory.report(GuardEvent(tick, "stopped", wrong.bottle, wrong.x, wrong.y, text))
        return SimulationError(text, wrong.kind)

    def _take_steps(self, factor: int) -> None:
        """Take the steps of one tick, shortened by a factor. Lengthen lists that are too short; bits stay the same."""
        done, phase, steps, dt = 0, START, factor * self._model.steps_per_tick, self._model.dt / factor
        self._set_clock(0)
        self._sleep.begin(self._state.world, dt, steps)
        while True:
            done += self._pool.advance(self.threads, self._advance, self._state.world, steps - done, dt, phase)
            if not self._state.world.neighbourhood.stale[0]:
                break
            self._state.make_lists()
            phase = RESUME
        self._sleep.end(self._state.world)

    def _set_clock(self, steps: int) -> None:
        """Put bodies and vibrating belts where they are after `steps` steps of the tick."""
        world = self._state.world
        for group in (world.moving, world.vibration):
            if group is not None:
                group.clock[0] = steps

    def _report_once(self, tick: int) -> None:
        """Report soft contacts and chatter the first time they occur. They do not stop a run."""
        if (event := self._guard.soft(tick)) is not None:
            self._memory.report(event)
        if self._chatter_ticks and not self._memory.chatters and tick % self._chatter_ticks == 0:
            self._check_chatter(tick)

    def _ticks_between_checks(self) -> int:
        """Return the ticks between two checks for chatter; 0 without explicit friction."""
        model = self._model
        rubs = model.base_friction is not None or any(
            law is not None and law.friction is not None for law in (model.pair_law, model.rail_law)
        )
        if not rubs or model.friction_solver == "implicit" or model.integrator not in chatter.EXPLICIT:
            return 0
        return -(-chatter.EVERY // model.steps_per_tick)

    def _check_chatter(self, tick: int) -> None:
        """Take single trial steps, measure chatter, and go back."""
        state, model = self._state, self._model
        copy = WorldSnapshot()
        copy.take(state.world)
        self._set_clock(model.steps_per_tick)
        meter = chatter.ChatterMeter()
        chatter.note_world(meter, state.world)
        for _ in range(chatter.STEPS):
            self._pool.advance(self.threads, self._advance, state.world, 1, model.dt, START)
            state.make_lists()
            chatter.note_world(meter, state.world)
        copy.restore(state)
        self._guard.forget()
        worst, amplitude = meter.worst()
        share = amplitude / model.settings.slip_limit
        if share > chatter.LEAST:
            self._memory.chatters = True
            self._memory.report(self._guard.chatters(tick, worst, share))
