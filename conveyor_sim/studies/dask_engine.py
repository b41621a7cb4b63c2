# SPDX-License-Identifier: Apache-2.0
"""Workers of Dask as the engine of a study: on this machine, or wherever a scheduler has them."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import CancelledError
from contextlib import AbstractContextManager, suppress
from queue import Empty, SimpleQueue
from typing import Any, TypeVar

from distributed import Client, KilledWorker, LocalCluster
from distributed.comm.core import CommClosedError

from conveyor_sim.errors import StudyError
from conveyor_sim.support.worker_pool import DiedError, free_cores

T = TypeVar("T")
R = TypeVar("R")

LOCAL = "local"
PATIENCE = 60.0
"""s of wall time that a scheduler may be away, or without workers."""
LOOK = 1.0
"""Time between two checks of the scheduler, s."""
AHEAD = 4
"""Runs submitted ahead per worker; each is stored as soon as it is finished."""
_GONE = (CancelledError, CommClosedError, TimeoutError, OSError)


class DaskEngine(AbstractContextManager["DaskEngine"]):
    """Each task as one of Dask's. A worker that dies gives its task to another; where the scheduler is restarted, all
    that is not finished is handed out again.
    """

    def __init__(self, address: str, processes: int | None, say: Callable[[str], object]) -> None:
        """address: of a scheduler, or "local" for processes of this machine, as many as `processes` (None: cores).

        Raises StudyError if there is no scheduler, or it has no workers.
        """
        self.is_here = address == LOCAL
        self._say = say
        logging.getLogger("distributed").setLevel(logging.CRITICAL)  # what it loses is tried again, and said here
        self._cluster: LocalCluster | None = None
        self._address = address
        self._client: Client | None = None
        if self.is_here:
            self._cluster = LocalCluster(
                n_workers=processes or free_cores(),
                threads_per_worker=1,
                host="127.0.0.1",
                dashboard_address=None,
                silence_logs=logging.CRITICAL,
            )
            self._address = self._cluster.scheduler_address
        self.processes = 1
        try:
            self._connect(PATIENCE)
        except BaseException:
            self._close()
            raise

    def each(self, function: Callable[[T], R], tasks: Iterable[T]) -> Iterator[tuple[T, R | DiedError]]:
        """Run tasks as `Engine.each`. Raise StudyError if the scheduler is silent or the workers lack the function."""
        todo = list(tasks)[::-1]
        pending: dict[Any, T] = {}
        done: SimpleQueue[Any] = SimpleQueue()
        while todo or pending:
            client = self._client
            assert client is not None
            try:
                while todo and len(pending) < AHEAD * self.processes:
                    future = client.submit(function, todo[-1], pure=False)
                    pending[future] = todo.pop()
                    future.add_done_callback(done.put)
                with suppress(Empty):
                    done.get(timeout=LOOK)
                gone = client.status != "running"
            except _GONE:
                gone = True
            for future in [future for future in pending if future.done()]:
                try:
                    result = self._result(future)
                except _GONE:
                    gone = True
                else:
                    yield pending.pop(future), result
            if gone:
                todo += list(pending.values())[::-1]
                pending = {}
                self._say("the connection to Dask's scheduler is lost; waiting for it to come back")
                self._connect(PATIENCE)

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        self._close()

    def _result(self, future: Any) -> Any:
        """Return the result of a finished task.

        Raise one of _GONE, or StudyError: functions report failures of runs as results, so any other exception
        means that a worker lacks a file or package.
        """
        try:
            return future.result(timeout=PATIENCE)
        except KilledWorker:
            return DiedError()
        except _GONE:
            raise
        except Exception as error:
            why = " ".join(f"{type(error).__name__}: {error}".split())
            cause = "" if error.__cause__ is None else f" ({' '.join(str(error.__cause__).split())})"
            raise StudyError(
                f"{self._address}: a worker of Dask can't make runs: {why}{cause}; expected workers with the same "
                "conveyor_sim and Python packages as here"
            ) from None

    def _connect(self, patience: float) -> None:
        """To the scheduler, once it is there and has a worker."""
        until = time.monotonic() + patience
        while True:
            left = until - time.monotonic()
            try:
                self._drop_client()
                self._client = Client(self._address, timeout=max(1.0, min(left, 10.0)), set_as_default=False)
                self._client.wait_for_workers(1, timeout=max(1.0, left))
                self.processes = sum(self._client.nthreads().values()) or 1
                return
            except (OSError, TimeoutError) as error:
                if time.monotonic() > until:
                    raise StudyError(
                        f"{self._address}: no scheduler of Dask with workers within {patience:.0f} s ({error}); "
                        "the same command goes on with what is finished"
                    ) from None
                time.sleep(LOOK)

    def _drop_client(self) -> None:
        if self._client is not None:
            with suppress(*_GONE):
                self._client.close(timeout=1)
            self._client = None

    def _close(self) -> None:
        self._drop_client()
        if self._cluster is not None:
            with suppress(*_GONE):
                self._cluster.close(timeout=1)
            self._cluster = None
