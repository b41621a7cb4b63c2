"""A SingleThreadedExecutor in a thread of its own, with an orderly end."""

from __future__ import annotations

import threading
from collections.abc import Callable

from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node


class Spinner:
    """Runs the callbacks of one node from start() to close()."""

    def __init__(self, context: Context | None = None, died: Callable[[Exception], None] | None = None) -> None:
        """`died` is called, from the thread, with the exception of a callback that ended it."""
        self.executor = SingleThreadedExecutor(context=context)
        self._died = died
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._spin, name="executor", daemon=True)

    def start(self, node: Node) -> None:
        """Begin to run the callbacks of `node`."""
        self.executor.add_node(node)
        self._thread.start()

    def close(self) -> None:
        """Return once the callback under way has ended and none will follow."""
        # Not Executor.shutdown() yet: it takes away what the thread uses. And a task: wake() does not end spin_once.
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
