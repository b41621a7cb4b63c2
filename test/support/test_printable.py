# SPDX-License-Identifier: Apache-2.0
"""Foreign text made printable."""

import pytest

from conveyor_sim.support.printable import MOST, printable, printable_lines


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("belts/feeder/cmd_speed", "belts/feeder/cmd_speed"),
        ("Zuführung 3", "Zuführung 3"),
        ("a\nb\r\x1b[2J\x00", "a\\nb\\r\\x1b[2J\\x00"),
        ("\u2028\u202e\ufeff\ud800", "\\u2028\\u202e\\ufeff\\ud800"),
        ("", ""),
        (3, "3"),
    ],
)
def test_it_is_one_printable_line(text: object, shown: str) -> None:
    assert printable(text) == shown
    assert printable(shown) == shown


@pytest.mark.parametrize("text", ["x" * 5_000_000, "\x1b" * 5_000_000, "x" * 198 + "\n\n"])
def test_it_is_cut(text: str) -> None:
    shown = printable(text)
    assert len(shown) == MOST
    assert shown.endswith("…")
    assert printable(shown) == shown


def test_what_just_fits_is_whole() -> None:
    assert printable("x" * MOST) == "x" * MOST


def test_lines_stay_lines() -> None:
    assert printable_lines("one\ntwo\x07\n" + "x" * 30, 20) == "one\ntwo\\x07\n" + "x" * 19 + "…"
