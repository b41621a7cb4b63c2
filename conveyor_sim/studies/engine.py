"""What makes runs: processes of this machine, or those of Dask."""

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
    """Whether all of it is this machine, with its files."""

    def each(self, function: Callable[[T], R], tasks: Iterable[T]) -> Iterator[tuple[T, R | DiedError]]:
        """Each task with what the function makes of it, as they are finished, in whatever order."""

    def __enter__(self) -> Engine: ...
    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None, /
    ) -> None: ...
