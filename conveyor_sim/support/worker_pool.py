"""Processes that work off tasks and end with this one; one of them that dies takes no other task along."""

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
    """The processes that were given a task have ended without a word, twice."""

    def __init__(self) -> None:
        super().__init__(DIED)


def free_cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0))


class WorkerPool(AbstractContextManager["WorkerPool"]):
    """Processes of this machine. They are spawned: a program that is a file needs its `if __name__ == "__main__"`.

    Leaving the context by an exception, such as a Ctrl-C, or ending this process in any way ends them at once, in the
    middle of what they are at.
    """

    is_here = True
    """All of it is this machine, with its files."""

    def __init__(self, processes: int | None = None) -> None:
        """processes: None is one for each core that this process may use."""
        self.processes = free_cores() if processes is None else max(1, processes)
        self._pool: ProcessPoolExecutor | None = None
        self._lifeline: tuple[Connection, Connection] | None = None

    def each(self, function: Callable[[T], R], tasks: Iterable[T]) -> Iterator[tuple[T, R | DiedError]]:
        """Each task with what the function makes of it, as they are finished.

        Raises what the function raises. A task whose process, or another beside it, has died is tried once more by
        itself, to find out which it was.
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
    """Start of a process: Ctrl-C is its parent's affair, and it ends with its parent, or when asked to."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    end_with(lifeline)
