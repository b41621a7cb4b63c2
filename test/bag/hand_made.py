# SPDX-License-Identifier: Apache-2.0
"""Columns made by hand, with values that are all different."""

import numpy as np

from conveyor_sim.bag.messages.encode import Header
from conveyor_sim.columns.bottles import BottleColumns, ContactColumns

HEADER = Header(tick=1234, stamp_ns=12_340_000_007, frame_id="hall")


def bottles(count: int) -> BottleColumns:
    """Some bottles of three types."""
    values = np.arange(7.0 * count).reshape(7, count) * 0.37 - 1.0
    ids = np.arange(count, dtype=np.uint64) + 2**60
    kinds = (np.arange(count) % 3).astype(np.uint16)
    belt = (np.arange(count) % 4 - 1).astype(np.int32)
    return BottleColumns(ids, kinds, *values[:6], belt, values[6], values[6] * 2.0)


def contacts(count: int) -> ContactColumns:
    """Some contacts of both kinds."""
    values = np.arange(7.0 * count).reshape(7, count)
    kinds = (np.arange(count) % 2).astype(np.uint8)
    ids = np.arange(count, dtype=np.uint64)
    return ContactColumns(kinds, ids, ids + np.uint64(5), *values)
