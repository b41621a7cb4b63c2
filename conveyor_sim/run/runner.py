# SPDX-License-Identifier: Apache-2.0
"""`run_scene`: runs a scene without ROS at full speed, and records the bag that the node would record."""

from __future__ import annotations

import signal
import threading
import time
import uuid
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from pathlib import Path

from conveyor_sim.bag.outputs import OutputWriter
from conveyor_sim.bag.recorder import Recorder
from conveyor_sim.control.scan import Controller
from conveyor_sim.errors import ConveyorError, SimulationError
from conveyor_sim.line.run_state import ENDED, RUNNING, STOPPED, RunState
from conveyor_sim.run.force_check import PeakWatch
from conveyor_sim.run.queue_check import QueueCheck
from conveyor_sim.run.scan_loop import ScanLoop
from conveyor_sim.run.session import keep_stopped
from conveyor_sim.run.speed import Spent
from conveyor_sim.run.timed_actions import TimedActions
from conveyor_sim.scene import Scene
from conveyor_sim.scene.recorded import sources_of
from conveyor_sim.simulation import Simulation
from conveyor_sim.support.printable import SENTENCE, printable
from conveyor_sim.support.signals import HandledOnce


@dataclass(frozen=True)
class Run:
    """Result of `run_scene`."""

    bag: Path | None
    simulated: float
    """s"""
    wall: float
    """Time from the first tick to the end of the recording, s; includes compiling (`compile_kernels` avoids that)."""
    interrupted: bool
    """True if Ctrl-C or a request to terminate ended the run early."""
    peak_force: float | None
    """Largest normal contact force, N; None without the effect `peaks`."""
    load: float | None
    """Largest lasting load on a bottle (`force_check.Pressed`), N; None if it is unknown."""
    queue: QueueCheck | None
    """Longest queue with integrator impulses; None with others."""
    asleep: float | None
    """Share of bottles asleep, mean over the run; None if no bottle can sleep."""
    guard: tuple[str, ...]
    """Reports of the guard."""
    spent: Spent
    """Breakdown of `wall` by phase."""


def run_scene(
    scene: Scene,
    bag: Path | None,
    progress: Callable[[float], None] | None = None,
    threads: int | None = None,
    controller: Controller | None = None,
    record: Sequence[str] = (),
    say: Callable[[str], None] | None = None,
    actions: Path | None = None,
) -> Run:
    """Run a scene for its duration, and record it to the folder `bag`, if one is passed.

    progress: called with the simulated time (s) after every tick. threads: number of threads; None to choose it.
    controller: scans at every tick. record: patterns of its variables that are recorded (`control/recorded.py`).
    say: called with a sentence for each variable without a tag, and each command that the controller never gives.
    actions: file of an operator's actions at the panel (`timed_actions.py`).
    Ctrl-C ends the run at the next tick, with an intact bag; a second one ends the process.

    Raises SceneError, SimulationError, BagError if the recording can't be written, and ConveyorError for a controller
    that can't go on, CommandError for a file of actions that can't be read. A controller that can't begin leaves no
    recording.
    """
    simulation = Simulation(scene, threads)
    operator = None if actions is None else TimedActions(actions, simulation)
    scans = ScanLoop(simulation, controller, record)
    if say is not None:
        for sentence in getattr(controller, "left_over", ()):
            say(sentence)
    scans.scan_tick()
    recorder = Recorder(bag, sources=sources_of(scene)) if bag is not None else None
    with recorder or nullcontext(), _stop_request() as stop:
        outputs = OutputWriter(simulation, [recorder] if recorder else [], run_id=uuid.uuid4().hex)
        outputs.start()
        outputs.show_run(RunState(RUNNING))
        peaks = PeakWatch(simulation)
        stepping, start, end = 0.0, time.monotonic(), scene.duration_ticks
        while simulation.tick < end and not stop.is_set():
            began = time.perf_counter()
            try:
                if operator is not None:
                    operator.before_tick()
                scans.before_tick(outputs)
                simulation.advance(1)
            except SimulationError as error:
                outputs.after_failure()
                outputs.show_run(RunState(STOPPED, printable(error, SENTENCE)))
                raise keep_stopped(simulation, bag, error) from error
            except ConveyorError as error:  # of the controller
                outputs.show_run(RunState(STOPPED, printable(error, SENTENCE)))
                raise
            stepping += time.perf_counter() - began
            scans.after_tick(outputs.after_tick())
            peaks.after_tick()
            if progress is not None:
                progress(simulation.time)
        stopped = simulation.tick < end
        outputs.show_run(RunState(STOPPED, "on request") if stopped else RunState(ENDED))
        if recorder is not None:
            recorder.close()
        wall = time.monotonic() - start
        guard = tuple(event.text for event in outputs.take_noticed())
        kernels = simulation.integration.kernel_seconds
        spent = Spent(kernels, stepping - kernels, 0.0 if recorder is None else wall - stepping)
        simulated, reached = simulation.tick * scene.tick, (peaks.force, peaks.load, peaks.queue)
        return Run(bag, simulated, wall, stop.is_set(), *reached, simulation.integration.asleep_share, guard, spent)


@contextmanager
def _stop_request() -> Iterator[threading.Event]:
    """Yield an event that Ctrl-C and SIGTERM set. A KeyboardInterrupt could interrupt a write."""
    stop = threading.Event()
    with HandledOnce((signal.SIGINT, signal.SIGTERM), lambda _number, _frame: stop.set()):
        yield stop
