# SPDX-License-Identifier: Apache-2.0
"""Pool of processes that end with this one; the death of one affects no other task."""

from __future__ import annotations

import os
import signal
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import AbstractContextManager
from multiprocessing import get_context
from multiprocessing.connection import Connection
from typing import TypeVar

from conveyor_sim.support.child_process import end_with

T = TypeVar("T")
R = TypeVar("R")

DIED = "the process that ran it ended without a word, twice: killed, or out of memory"


class DiedError(Exception):
    """Error: two processes in a row ended without a result for a task."""

    def __init__(self) -> None:
        super().__init__(DIED)


def free_cores() -> int:
    """Return the number of cores that this process may use."""
    return len(os.sched_getaffinity(0))


class WorkerPool(AbstractContextManager["WorkerPool"]):
    """Processes of this machine. They are spawned: a program in a file needs its `if __name__ == "__main__"`.

    Leaving the context by an exception, such as a Ctrl-C, or ending this process in any way ends them at once, in the
    middle of their tasks.
    """

    is_here = True
    """True: all processes run on this machine, with its files."""

    def __init__(self, processes: int | None = None) -> None:
        """Prepare the pool. processes: None: one for each core that this process may use."""
        self.processes = free_cores() if processes is None else max(1, processes)
        self._pool: ProcessPoolExecutor | None = None
        self._lifeline: tuple[Connection, Connection] | None = None

    def each(self, function: Callable[[T], R], tasks: Iterable[T]) -> Iterator[tuple[T, R | DiedError]]:
        """Yield each task with the function's result, in the order of completion.

        Raises what the function raises. If a process dies, each task in progress is repeated alone once, to find out
        which one killed it.
        """
        todo = deque(tasks)
        pending: dict[Future[R], T] = {}
        while todo or pending:
            # One more than there are processes waits in the pool: none of them has to wait for us.
            while todo and len(pending) <= self.processes:
                try:
                    pending[self._workers().submit(function, todo[0])] = todo[0]
                    todo.popleft()
                except BrokenProcessPool:
                    if pending:
                        break  # they will tell
                    self._close(at_once=True)
            finished, _ = wait(pending, return_when=FIRST_COMPLETED)
            died = any(isinstance(future.exception(), BrokenProcessPool) for future in finished)
            if died:
                finished, _ = wait(pending)  # one process that dies takes the tasks of all others with it
                self._close(at_once=True)
            for future in finished:
                task = pending.pop(future)
                alone = isinstance(future.exception(), BrokenProcessPool)
                yield task, self._alone(function, task) if alone else future.result()

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        self._close(at_once=kind is not None)

    def _alone(self, function: Callable[[T], R], task: T) -> R | DiedError:
        try:
            return self._workers().submit(function, task).result()
        except BrokenProcessPool:
            self._close(at_once=True)
            return DiedError()

    def _workers(self) -> ProcessPoolExecutor:
        if self._pool is None:
            context = get_context("spawn")
            self._lifeline = context.Pipe(duplex=False)
            self._pool = ProcessPoolExecutor(self.processes, context, _begin, (self._lifeline[0],))
        return self._pool

    def _close(self, at_once: bool) -> None:
        if self._pool is None or self._lifeline is None:
            return
        if at_once:
            self._lifeline[1].close()
        self._pool.shutdown(cancel_futures=True)
        for end in self._lifeline:
            end.close()
        self._pool = self._lifeline = None


def _begin(lifeline: Connection) -> None:
    """Prepare a worker: it ignores Ctrl-C, and ends with its parent or on request."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    end_with(lifeline)
