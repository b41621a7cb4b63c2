# SPDX-License-Identifier: Apache-2.0
"""`Compilation`: a child process compiles the kernels of a scene.

The compiler can't be interrupted, and it blocks every other thread. A process can be ended at any time. Its kernels
stay in the cache, from which this process loads them in less than a second.
"""

from __future__ import annotations

import atexit
import gc
import os
import pickle
import subprocess
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from multiprocessing import Pipe

from conveyor_sim.engine.compiler.compile import ENGINE_HASH, KERNELS
from conveyor_sim.engine.compiler.kernel_folder import NotCached, cached_only
from conveyor_sim.physics.model import Model, build_model
from conveyor_sim.scene import Scene
from conveyor_sim.simulation import Simulation
from conveyor_sim.support.child_process import die_with_parent, end_with, pipes_of_child, start_python
from conveyor_sim.support.garbage import collected_later

BASE_SECONDS, EFFECT_SECONDS = 3.0, 0.75
"""Core time to compile the kernels without effects, and per enabled effect, s.

Fitted in 2026 to scenes with 5 to 14 effects.
"""

# Python collects garbage as it ends. With the many objects of numba, that would take half a second.
atexit.register(gc.freeze)


def compile_kernels(scene: Scene) -> None:
    """Compile the kernels that a scene needs, or read them from the cache, by one tick of a simulation."""
    rehearsal = Simulation(scene)
    rehearsal.advance(1)
    rehearsal.bottles()
    rehearsal.contacts()
    rehearsal.ledger()
    rehearsal.signals()
    rehearsal.line.rehearse()


class Cancelled(Exception):
    """Raised when the kernels are no longer needed."""


def seconds_to_compile(model: Model) -> float:
    """Return the approximate time to compile, s of wall time, including the load by other processes."""
    cores = len(os.sched_getaffinity(0))
    crowd = max(1.0, (os.getloadavg()[0] + 1.0) / cores)
    return crowd * (BASE_SECONDS + EFFECT_SECONDS * sum(effect.on for effect in model.effects))


def time_to_compile(scene: Scene) -> str:
    """Return one sentence with the expected time that the kernels of a scene take to compile."""
    return compiling(seconds_to_compile(build_model(scene)))


def compiling(seconds: float) -> str:
    """Return one sentence about kernels that take `seconds` to compile."""
    cached = "" if KERNELS.path is None else "; the next start finds them in the cache"
    return f"compiling the kernels for this kind of scene, about {seconds:.0f} s{cached}"


class Compilation:
    """Brings the kernels that a scene needs into this process: from the cache, or compiled by a child process."""

    def __init__(self, scene: Scene, say: Callable[[str], object]) -> None:
        """say: called with a sentence if kernels must be compiled."""
        self._scene = scene
        self._say = say
        self._lock = threading.Lock()
        self._process: subprocess.Popen[bytes] | None = None
        self._cancelled = self._compiles = False
        self._began = time.monotonic()
        self._expected = seconds_to_compile(build_model(scene))

    @property
    def progress(self) -> str:
        """Present activity, in words."""
        if not self._compiles:
            return "loading the kernels"
        return f"compiling the kernels, {time.monotonic() - self._began:.0f} s of about {self._expected:.0f} s"

    def run(self) -> None:
        """Return once this process has the kernels. Ctrl-C in the main thread interrupts it within a moment.

        Raises Cancelled, and SimulationError if the first tick of the scene fails.
        """
        KERNELS.before_read = self._require_wanted
        try:
            if not self._load():
                self._compiles = True
                self._say(compiling(self._expected))
                self._compile_aside()
                if not self._load():
                    self._say("the process that compiles has ended early; compiling in this one")
                    compile_kernels(self._scene)
        finally:
            KERNELS.before_read = None
            KERNELS.received.clear()

    def cancel(self) -> None:
        """End `run` within a moment. Any thread may call this."""
        with self._lock:
            self._cancelled = True
            if self._process is not None:
                self._process.kill()

    def _require_wanted(self) -> None:
        if self._cancelled:
            raise Cancelled

    def _load(self) -> bool:
        """Load the kernels from the cache. Return False if the cache lacks one."""
        try:
            with cached_only(), collected_later():
                compile_kernels(self._scene)
        except NotCached:
            return False
        return True

    def _compile_aside(self) -> None:
        """Compile the kernels in a child process. Its errors are ignored: compiling in this process reports them."""
        pipe, its_pipe = Pipe()
        with pipe:
            with its_pipe, self._lock:
                if self._cancelled:
                    return
                try:
                    self._process = process = start_python(__name__, its_pipe)
                except OSError:
                    return
            try:
                # It may end at any time, even before it has read the task or while it sends a kernel.
                with suppress(EOFError, OSError):
                    pipe.send((ENGINE_HASH, KERNELS.path, pickle.dumps(self._scene)))
                    while True:
                        name, content = pipe.recv()
                        KERNELS.received[name] = content
            finally:
                process.kill()
                process.wait()


def main() -> None:
    """Compile for the parent: receive a scene through the pipe, and send back kernels that can't be cached."""
    die_with_parent()
    (pipe,) = pipes_of_child()
    try:
        engine, folder, scene = pipe.recv()
    except EOFError:  # the parent was interrupted before it sent the task
        return
    end_with(pipe)  # the parent sends nothing more; it may have died before `die_with_parent`
    if engine != ENGINE_HASH:  # the sources have changed in between
        return
    KERNELS.use(folder)
    KERNELS.send = lambda name, content: pipe.send((name, content))
    with suppress(Exception):  # the parent finds the same error when it compiles itself
        compile_kernels(pickle.loads(scene))
    os._exit(0)  # skip freeing memory
