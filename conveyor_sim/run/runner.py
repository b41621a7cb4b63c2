"""Runs a scene without ROS, as fast as it goes, into the same bag that the node records."""

from __future__ import annotations

import signal
import threading
import time
import uuid
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from pathlib import Path

from conveyor_sim.bag.outputs import Outputs
from conveyor_sim.bag.recorder import Recorder
from conveyor_sim.control.scan import Controller
from conveyor_sim.errors import ConveyorError, SimulationError
from conveyor_sim.line.run_state import ENDED, RUNNING, STOPPED, RunState
from conveyor_sim.run.force_check import PeakWatch
from conveyor_sim.run.scan_loop import ScanLoop
from conveyor_sim.run.speed import Spent
from conveyor_sim.run.stopped import keep_stopped
from conveyor_sim.scene import Scene
from conveyor_sim.simulation import Simulation
from conveyor_sim.support.printable import SENTENCE, printable
from conveyor_sim.support.signals import HandledOnce


@dataclass(frozen=True)
class Run:
    """What `run_scene` did."""

    bag: Path | None
    simulated: float
    """s"""
    wall: float
    """s, from the first tick to the end of the recording; kernels not compiled yet (`compile_kernels`) are in it."""
    interrupted: bool
    """Ended early by Ctrl-C or a request to terminate."""
    peak_force: float | None
    """N, the largest normal contact force; None where the scene has no effect `peaks`."""
    load: float | None
    """N, that pressed on a bottle for long (`force_check.Pressed`); None where it is not known."""
    guard: tuple[str, ...]
    """What the guard said."""
    spent: Spent
    """What `wall` went to."""


def run_scene(
    scene: Scene,
    bag: Path | None,
    progress: Callable[[float], None] | None = None,
    threads: int | None = None,
    controller: Controller | None = None,
    record: Sequence[str] = (),
    told: Callable[[str], None] | None = None,
) -> Run:
    """Runs a scene for its duration and records it to the folder `bag`, if given.

    progress(simulated time, s) is called after every tick. threads: to step with, None has them chosen.
    controller: scans at every tick. record: patterns of its variables that are recorded (`control/recorded.py`).
    told: what a controller has no tag for, and the commands that it does not give.
    Ctrl-C ends the run at the next tick, with a whole bag; a second one ends the process.
    Raises SceneError, SimulationError, BagError if the recording can't be written, and ConveyorError for a controller
    that can't go on; one that can't begin leaves no recording.
    """
    simulation = Simulation(scene, threads)
    scans = ScanLoop(simulation, controller, record)
    if told is not None:
        for sentence in getattr(controller, "left_over", ()):
            told(sentence)
    scans.scan_tick()
    recorder = Recorder(bag) if bag is not None else None
    with recorder or nullcontext(), _stop_request() as stop:
        outputs = Outputs(simulation, [recorder] if recorder else [], run_id=uuid.uuid4().hex)
        outputs.start()
        outputs.show_run(RunState(RUNNING))
        peaks = PeakWatch(simulation)
        stepping, start = 0.0, time.monotonic()
        while simulation.tick < scene.duration_ticks and not stop.is_set():
            began = time.perf_counter()
            try:
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
        asked = RunState(STOPPED, "on request") if simulation.tick < scene.duration_ticks else RunState(ENDED)
        outputs.show_run(asked)
        if recorder is not None:
            recorder.close()
        wall = time.monotonic() - start
        noticed = tuple(event.text for event in outputs.take_noticed())
        kernels = simulation.kernel_seconds
        spent = Spent(kernels, stepping - kernels, 0.0 if recorder is None else wall - stepping)
        return Run(bag, simulation.tick * scene.tick, wall, stop.is_set(), peaks.force, peaks.load, noticed, spent)


@contextmanager
def _stop_request() -> Iterator[threading.Event]:
    """An event that Ctrl-C and SIGTERM set; a KeyboardInterrupt could strike in the middle of a write."""
    stop = threading.Event()
    with HandledOnce((signal.SIGINT, signal.SIGTERM), lambda _number, _frame: stop.set()):
        yield stop
