# SPDX-License-Identifier: Apache-2.0
"""Signals as requests that a thread waits for."""

import os
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from conveyor_sim.support.stop_request import StopRequest


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_is_a_request_and_interrupts_nothing(number: signal.Signals) -> None:
    before = signal.getsignal(number)
    with StopRequest() as stop:
        assert not stop.requested
        os.kill(os.getpid(), number)
        stop.wait()
        assert stop.requested
    assert signal.getsignal(number) is before


def test_a_request_may_come_from_another_thread() -> None:
    with StopRequest() as stop:
        thread = threading.Thread(target=stop.request)
        thread.start()
        stop.wait()
        thread.join()
        assert stop.requested


# A lock that is taken twice, in C and without letting Python go on: no handler ever runs.
HANGING = """
import ctypes
lock, c = ctypes.create_string_buffer(64), ctypes.PyDLL(None)
c.pthread_mutex_lock(lock)
print("hangs", flush=True)
c.pthread_mutex_lock(lock)
"""
# Here handlers run, but nothing follows them.
DEAF = """
import time
print("hangs", flush=True)
while True:
    time.sleep(1.0)
"""
IN_A_NODE = "from conveyor_sim.support.stop_request import StopRequest\nstop = StopRequest()\n"
IN_A_RUN = "from conveyor_sim.run.runner import _stop_request\nstop = _stop_request()\nstop.__enter__()\n"


@contextmanager
def started(code: str) -> Iterator[subprocess.Popen[str]]:
    """Start a process that runs code, and end it after the context."""
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True) as process:
        try:
            yield process
        finally:
            process.kill()


@pytest.mark.parametrize(
    ("code", "first", "second"),
    [
        (IN_A_NODE + HANGING, signal.SIGINT, signal.SIGINT),
        (IN_A_NODE + HANGING, signal.SIGTERM, signal.SIGTERM),
        (IN_A_NODE + DEAF, signal.SIGINT, signal.SIGTERM),
        (IN_A_RUN + HANGING, signal.SIGINT, signal.SIGINT),
    ],
    ids=["twice Ctrl-C", "twice SIGTERM", "Ctrl-C and SIGTERM", "a run"],
)
def test_a_second_signal_ends_what_hangs(code: str, first: signal.Signals, second: signal.Signals) -> None:
    with started(code) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "hangs\n"
        process.send_signal(first)
        with pytest.raises(subprocess.TimeoutExpired):
            process.wait(1.0)
        process.send_signal(second)
        assert process.wait(30.0) == -second


def test_a_command_that_hangs_after_ctrl_c_ends_at_the_second() -> None:
    code = f"""
from conveyor_sim.cli import main
@main.command()
def hang():
    try:
        {"; ".join(HANGING.strip().splitlines()[:-1])}
        while True: pass
    except KeyboardInterrupt:
        print("interrupted", flush=True)
        c.pthread_mutex_lock(lock)
main(["hang"])
"""
    with started(code) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "hangs\n"
        process.send_signal(signal.SIGINT)
        assert process.stdout.readline() == "interrupted\n"
        process.send_signal(signal.SIGINT)
        assert process.wait(30.0) == -signal.SIGINT
