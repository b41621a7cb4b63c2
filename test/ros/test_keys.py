# SPDX-License-Identifier: Apache-2.0
"""Keys, read from a real terminal."""

from __future__ import annotations

import os
import termios
from collections.abc import Iterator

import pytest

from conveyor_sim.ros.replay_job import Keys, readable


@pytest.fixture
def terminal() -> Iterator[tuple[int, int]]:
    """The end on which is typed, and the end that a program reads."""
    typist, reader = os.openpty()
    yield typist, reader
    os.close(typist)
    os.close(reader)


def test_keys_have_names_and_others_are_dropped(terminal: tuple[int, int]) -> None:
    typist, reader = terminal
    with Keys(reader) as keys:
        os.write(typist, b" x\x1b[C\x1bOD\x1b[Aq")
        assert keys.read(10.0) == ["space", "right", "left", "q"]
        assert keys.read(0.0) == []


def test_a_key_that_comes_in_parts_is_one_key(terminal: tuple[int, int]) -> None:
    typist, reader = terminal
    with Keys(reader) as keys:
        os.write(typist, b"\x1b[")
        assert keys.read(10.0) == []
        os.write(typist, b"D")
        assert keys.read(10.0) == ["left"]


def test_the_terminal_is_put_back(terminal: tuple[int, int]) -> None:
    _, reader = terminal
    before = termios.tcgetattr(reader)
    with Keys(reader):
        assert termios.tcgetattr(reader) != before
    assert termios.tcgetattr(reader) == before


def test_only_terminals_are_read(terminal: tuple[int, int]) -> None:
    _, reader = terminal
    assert readable(reader)
    with open(os.devnull) as nothing:
        assert not readable(nothing.fileno())
