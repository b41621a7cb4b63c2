# SPDX-License-Identifier: Apache-2.0
"""The velocity of a bottle over time is drawn as recorded."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from conveyor_sim.report.figures import style
from conveyor_sim.report.figures.data import Velocity
from conveyor_sim.report.figures.series import ordinal, velocity_figure


@pytest.fixture(autouse=True)
def look() -> Iterator[None]:
    with style.look():
        yield


def velocity(born: int = 50, belt: tuple[int, ...] = (0, 0, 1, 1, -1)) -> Velocity:
    time = np.array([2.0, 2.5, 3.0, 3.5, 4.0])
    return Velocity(
        49, born, time, np.array([0.8, 0.8, 0.2, 0.1, 0.0]), np.array([0.0, 0.5, -0.5, 0.0, 0.0]), np.array(belt)
    )


def test_both_components_are_the_recorded_arrays() -> None:
    recorded = velocity()
    for ax, name, values in zip(
        velocity_figure(recorded, ["feeder", "table"], 20.0).axes, ("vx", "vy"), (recorded.vx, recorded.vy), strict=True
    ):
        (line,) = [line for line in ax.lines if line.get_gid() == name]
        np.testing.assert_array_equal(line.get_xdata(), recorded.time)
        np.testing.assert_array_equal(line.get_ydata(), values)


def test_both_panels_share_their_scales_and_have_units() -> None:
    left, right = velocity_figure(velocity(), ["feeder", "table"], 20.0).axes
    assert left.get_ylim() == right.get_ylim()
    assert left.get_xlim() == right.get_xlim() == (0.0, 20.0)
    assert left.get_ylabel() == "v$_x$ (m/s)" and right.get_ylabel() == "v$_y$ (m/s)"
    assert left.get_xlabel() == right.get_xlabel() == "time (s)"


def test_the_strip_names_the_belts_in_the_order_passed() -> None:
    left, _ = velocity_figure(velocity(), ["feeder", "table"], 4.0).axes
    assert [text.get_text() for text in left.texts] == ["feeder", "table"]


def test_title_says_which_bottle_it_is() -> None:
    assert velocity_figure(velocity(), ["a", "b"], 20.0).get_suptitle() == "Velocity of bottle 49, the 50th fed"
    initial = velocity_figure(velocity(born=0), ["a", "b"], 20.0)
    assert initial.get_suptitle() == "Velocity of bottle 49, on the line from the start"


def test_a_single_record_is_drawn_too() -> None:
    one = Velocity(0, 1, np.array([0.0]), np.array([0.1]), np.array([0.0]), np.array([0]))
    assert len(velocity_figure(one, ["feeder"], 0.0).axes) == 2


@pytest.mark.parametrize(
    ("number", "word"), [(1, "1st"), (2, "2nd"), (3, "3rd"), (4, "4th"), (11, "11th"), (22, "22nd"), (112, "112th")]
)
def test_ordinals(number: int, word: str) -> None:
    assert ordinal(number) == word
