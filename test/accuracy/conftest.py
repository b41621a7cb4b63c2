# SPDX-License-Identifier: Apache-2.0
"""What tests of studies share."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from conveyor_sim.accuracy.measure import timing


@pytest.fixture(scope="module")
def brief_costs() -> Iterator[None]:
    """Each cost is measured over a moment: most of the time of a study of few bottles, and here it decides nothing."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(timing, "CHUNK", 0.001)
        yield
