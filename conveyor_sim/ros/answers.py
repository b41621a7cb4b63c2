# SPDX-License-Identifier: Apache-2.0
"""Answers to requests: results of other threads, and those of simulation_interfaces."""

from __future__ import annotations

from concurrent.futures import Future, wait
from typing import Any, TypeVar

from rclpy.executors import Executor
from rclpy.task import Future as RosFuture

T = TypeVar("T")

PROMPT = 0.001
"""Time that the executor waits for an answer itself, s of wall time. Most answers take less than waking it."""


async def settled(executor: Executor, future: Future[T]) -> T:
    """Return the result of a future that another thread sets. Awaited in a callback of `executor`."""
    if wait([future], PROMPT).done:
        return future.result()
    arrived = RosFuture(executor=executor)

    def wake(_: Future[T]) -> None:
        arrived.set_result(None)
        executor.wake()  # nothing else wakes the executor when the callback can go on

    future.add_done_callback(wake)
    await arrived
    return future.result()


def with_result(response: Any, code: int, text: str = "") -> Any:
    """Return a response with a code of simulation_interfaces/Result in its field `result`."""
    response.result.result = code
    response.result.error_message = text
    return response
