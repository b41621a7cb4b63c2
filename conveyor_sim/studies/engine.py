"""Engines that run tasks: processes of this machine, or Dask workers."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from types import TracebackType
from typing import Protocol, TypeVar

from conveyor_sim.support.worker_pool import DiedError

T = TypeVar("T")
R = TypeVar("R")


class Engine(Protocol):
    """A context: leaving it by an exception ends at once what is under way."""

    processes: int
    """Runs at a time, as far as it is known."""
    is_here: bool
    """True if all workers are on this machine, with its files."""

    def each(self, function: Callable[[T], R], tasks: Iterable[T]) -> Iterator[tuple[T, R | DiedError]]:
        """Yield each task with the result of `function`, in order of completion."""

    def __enter__(self) -> Engine: ...
    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None, /
    ) -> None: ...
