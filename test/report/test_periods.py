# SPDX-License-Identifier: Apache-2.0
"""What machines spent their time on: why they did not run, in words."""

import pytest

from conveyor_sim.report.periods import Period, longest_stops, stop_reasons


@pytest.mark.parametrize(
    ("category", "reason", "why"),
    [
        ("starved", "", "starved"),
        ("idle", "", "idle"),
        ("idle", "command Stop by hand", "command Stop by hand"),
        ("planned", "planned stop break", "planned stop break"),
        ("idle", "planned stop break", "after planned stop break"),
        ("down", "failure jam", "failure jam"),
        ("idle", "fault stop", "after fault stop"),
        ("down", "command Abort", "command Abort"),
        ("idle", "command Abort by hand", "after command Abort by hand"),
    ],
)
def test_why(category: str, reason: str, why: str) -> None:
    """A machine that still stands when what stopped it is over does not stand for that any more."""
    period = Period("machines/packer", 1.0, 3.0, category, reason)
    assert period.why == why
    assert [(entry.why, entry.stops, entry.length) for entry in stop_reasons([period, period])] == [(why, 2, 4.0)]
    assert longest_stops([period], 1)[0].why == why
