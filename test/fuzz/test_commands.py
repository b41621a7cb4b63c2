# SPDX-License-Identifier: Apache-2.0
"""A sample of command streams over DDS."""

from __future__ import annotations

from pathlib import Path

import pytest

pytest.importorskip("rclpy", reason="needs ROS 2")

from fuzz.targets.commands import attack, finish

BATCHES, SIZE = 3, 8


@pytest.mark.parametrize("batch", range(BATCHES))
def test_whatever_is_sent_the_node_stays_in_order(batch: int, tmp_path: Path) -> None:
    came = set()
    for seed in range(SIZE * batch, SIZE * (batch + 1)):
        folder = tmp_path / str(seed)
        folder.mkdir()
        came.add(attack(seed, folder))
    assert len(came) >= 3
    if batch == BATCHES - 1:
        finish()
