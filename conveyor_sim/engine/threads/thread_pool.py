# SPDX-License-Identifier: Apache-2.0
"""Pool of threads, which wait in Python between ticks, and take the steps of a tick together (`workers.py`)."""

import os
import threading
import weakref
from queue import SimpleQueue
from typing import Any

from conveyor_sim.engine.arrays.world import Worker, World
from conveyor_sim.engine.compiler.numba_internals.machine_code import entry
from conveyor_sim.engine.integrators import Advance
from conveyor_sim.engine.integrators.callees import find_callees
from conveyor_sim.engine.threads.workers import workers

Task = tuple[Advance, World, Worker, int, float, int]


class ThreadPool:
    """Teams of up to `most` threads, the calling one included. The others start when first needed.

    A pool is for Worlds of one scene: their arrays may be replaced, their types must not change.
    """

    def __init__(self, most: int) -> None:
        self.most = most
        self._entries: dict[Any, Advance] = {}
        self._process = os.getpid()
        self._groups: dict[int, tuple[Worker, ...]] = {}
        self._tasks: list[SimpleQueue[Task | None]] = []
        self._done: SimpleQueue[BaseException | None] = SimpleQueue()
        weakref.finalize(self, _dismiss, self._tasks)

    def advance(self, size: int, function: Advance, world: World, steps: int, dt: float, phase: int) -> int:
        """Run an integrator on `size` threads; return the number of steps taken. Raise ValueError beyond `most`."""
        group = self.group(size)
        if not group[0].callees[0]:
            find_callees(world, group[0])
        function = self._compiled(function, world, group[0], steps, dt, phase)
        others = self._workers(size - 1)
        try:
            for task, worker in zip(others, group[1:], strict=True):
                task.put((function, world, worker, steps, dt, phase))
            taken = function(world, group[0], steps, dt, phase)
            for _ in others:
                if (error := self._done.get()) is not None:
                    raise error
        except BaseException:
            # After an interrupt the progress of threads is unknown, so the next call starts others.
            self._disband()
            raise
        return taken

    def group(self, size: int) -> tuple[Worker, ...]:
        """Return the workers of a group of `size`; a size always has the same workers."""
        if not 1 <= size <= self.most:
            raise ValueError(f"a group of {size} threads, expected 1 to {self.most}")
        if size not in self._groups:
            self._groups[size] = workers(size)
        return self._groups[size]

    def _compiled(self, function: Any, *arguments: Any) -> Advance:
        """Return the machine code for arguments of these types, which never change in a pool's life."""
        if function not in self._entries:
            self._entries[function] = entry(function, *arguments)
        return self._entries[function]

    def _disband(self) -> None:
        _dismiss(self._tasks)
        self._tasks.clear()
        self._groups, self._done = {}, SimpleQueue()

    def _workers(self, count: int) -> list["SimpleQueue[Task | None]"]:
        if self._process != os.getpid():
            # A fork copies the queues, not the threads.
            self._process = os.getpid()
            self._disband()
        while len(self._tasks) < count:
            tasks: SimpleQueue[Task | None] = SimpleQueue()
            self._tasks.append(tasks)
            threading.Thread(target=_work, args=(tasks, self._done), name="conveyor_sim steps", daemon=True).start()
        return self._tasks[:count]


def _work(tasks: "SimpleQueue[Task | None]", done: "SimpleQueue[BaseException | None]") -> None:
    while (task := tasks.get()) is not None:
        function, world, worker, steps, dt, phase = task
        try:
            function(world, worker, steps, dt, phase)
        except BaseException as error:
            done.put(error)
        else:
            done.put(None)
        # A waiting thread must not retain the arrays of a run that has ended.
        del task, function, world, worker


def _dismiss(tasks: list["SimpleQueue[Task | None]"]) -> None:
    for queue in tasks:
        queue.put(None)
