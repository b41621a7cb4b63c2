# SPDX-License-Identifier: Apache-2.0
"""`Spinner`: a SingleThreadedExecutor in a thread, with an orderly end."""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import Future
from typing import Any, TypeVar

from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node

from conveyor_sim.run.calls import settle

T = TypeVar("T")


class Spinner:
    """Runs the callbacks of one node from start() to close()."""

    def __init__(self, context: Context | None = None, died: Callable[[Exception], None] | None = None) -> None:
        """died: called by the thread with the exception of a callback that ended it."""
        self.executor = SingleThreadedExecutor(context=context)
        self._died = died
        self._closing = threading.Event()
        self._calls: list[Future[Any]] = []
        self._thread = threading.Thread(target=self._spin, name="executor", daemon=True)

    def start(self, node: Node) -> None:
        """Start to run the callbacks of `node`."""
        self.executor.add_node(node)
        self._thread.start()

    def call(self, function: Callable[[], T]) -> Future[T]:
        """Call `function` between two callbacks. The future is cancelled if the thread has ended. For other threads."""
        future: Future[T] = Future()

        def run() -> None:
            if future.set_running_or_notify_cancel():
                settle(future, function)

        self._calls.append(future)
        self.executor.create_task(run)
        if not self._thread.is_alive():
            future.cancel()
        return future

    def close(self) -> None:
        """End the thread after the present callback."""
        # Not Executor.shutdown() yet: it destroys objects that the thread uses. wake() does not end spin_once.
        self._closing.set()
        self.executor.create_task(lambda: None)
        if self._thread.is_alive():
            self._thread.join()
        self.executor.shutdown()

    def _spin(self) -> None:
        try:
            while not self._closing.is_set():
                self.executor.spin_once()
        except Exception as error:
            if self._died is None:
                raise
            self._died(error)
        finally:
            for future in self._calls:
                future.cancel()
