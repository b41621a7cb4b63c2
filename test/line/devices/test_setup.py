# SPDX-License-Identifier: Apache-2.0
"""Random streams keyed by seed, device and purpose."""

import numpy as np
import pytest

from conveyor_sim.line.devices.setup import random_stream

KEYS = [
    (1, "machines/filler", "jam/between"),
    (2, "machines/filler", "jam/between"),
    (1, "machines/packer", "jam/between"),
    (1, "machines/filler", "jam/repair"),
    (1, "machines/filler/jam", "between"),
    (2**64 - 1, "machines/filler", "jam/between"),
    (0, "", ""),
]


def test_equal_keys_draw_equal_numbers_and_others_do_not() -> None:
    drawn = [random_stream(*key).uniform(size=4).tolist() for key in KEYS]
    assert drawn == [random_stream(*key).uniform(size=4).tolist() for key in KEYS]
    assert len({tuple(numbers) for numbers in drawn}) == len(KEYS)


@pytest.mark.parametrize("other", KEYS[1:], ids=str)
def test_streams_of_one_seed_are_not_correlated(other: tuple[int, str, str]) -> None:
    """The correlation of ten thousand pairs of numbers is within 4 standard deviations of 0."""
    one, two = (random_stream(*key).uniform(size=10_000) for key in (KEYS[0], other))
    assert abs(np.corrcoef(one, two)[0, 1]) < 4.0 / np.sqrt(10_000)


def test_the_numbers_are_the_same_on_every_machine() -> None:
    """Replays must draw recorded numbers again. These were recorded when streams got their names."""
    assert random_stream(7, "infeeds/inlet", "jitter").integers(0, 2**32, 3).tolist() == [
        4216004101,
        1007638240,
        1651591636,
    ]
