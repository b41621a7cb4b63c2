"""Signals as something to wait for."""

import os
import signal
import threading

import pytest

from conveyor_sim.ros.stop_request import StopRequest


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
