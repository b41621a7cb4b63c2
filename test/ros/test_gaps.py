# SPDX-License-Identifier: Apache-2.0
"""Missing messages, by the numbers of received ones."""

from collections.abc import Callable, Sequence

import pytest

from conveyor_sim.ros.commands import Gaps


def missing(numbers: Sequence[int | None], publishers: int) -> list[int]:
    gaps = Gaps()
    count: Callable[[], int] = lambda: publishers  # noqa: E731
    return [gaps.before(number, count) for number in numbers]


@pytest.mark.parametrize(
    ("numbers", "publishers", "expected"),
    [
        ([1, 2, 3, 4], 1, [0, 0, 0, 0]),
        ([7, 8], 1, [0, 0]),  # it sent the first ones before it was heard of
        ([1, 2, 5, 100], 1, [0, 0, 2, 94]),
        ([1, 2, 3, 1, 2], 1, [0, 0, 0, 0, 0]),  # it was started again
        ([1, 2, 1, 3, 2, 6, 3], 2, [0, 0, 0, 0, 0, 2, 0]),
        ([None, None], 1, [0, 0]),  # a middleware without numbers
    ],
)
def test_gaps_are_counted(numbers: list[int | None], publishers: int, expected: list[int]) -> None:
    assert missing(numbers, publishers) == expected
