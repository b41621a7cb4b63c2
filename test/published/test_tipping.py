# SPDX-License-Identifier: Apache-2.0
"""The chain maker's rule: a container is at the limit if friction equals its radius over its height."""

import pytest
from published.studies import source

TIPPING = source("tipping")


@pytest.mark.parametrize("load", ["held by a rail at height h", "dragged by the chain, h of the centre of gravity"])
def test_the_index_is_friction_times_slenderness(load: str) -> None:
    for share in (0.8, 1.0, 1.2):
        result = TIPPING.simulate({"load": load, "h/R": 4.0, "mu h/R": share})
        assert result["index"] == pytest.approx(share, rel=1e-3)
