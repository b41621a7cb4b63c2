# SPDX-License-Identifier: Apache-2.0
"""Processor time is what a study counts, and compiling is counted apart."""

from __future__ import annotations

import time

import numba
import pytest

from conveyor_sim.accuracy.measure.cpu import Meter


def test_to_wait_costs_nothing_and_to_compile_is_told_apart() -> None:
    with Meter() as meter:
        time.sleep(0.5)
        waited = meter.cpu
        began = time.process_time()
        numba.njit(lambda x: x + 1)(1)
        compiled = time.process_time() - began
    assert waited < 0.25
    assert meter.compiling == pytest.approx(compiled, rel=0.5)
    assert meter.cpu < waited + 0.5 * compiled
