# SPDX-License-Identifier: Apache-2.0
"""Garbage collection is delayed and then restored."""

import gc

import pytest

from conveyor_sim.support.garbage import collected_later


def test_garbage_is_not_looked_for_inside_and_is_afterwards() -> None:
    with collected_later():
        assert not gc.isenabled()
        with collected_later():
            pass
        assert not gc.isenabled()
    assert gc.isenabled()
    with pytest.raises(RuntimeError), collected_later():
        raise RuntimeError
    assert gc.isenabled()


def test_what_was_made_inside_is_not_looked_through_later() -> None:
    with collected_later():
        kept = [[] for _ in range(1000)]
    assert gc.get_freeze_count() >= len(kept)
    gc.unfreeze()
