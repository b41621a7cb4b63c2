# SPDX-License-Identifier: Apache-2.0
"""Pictures drawn by processes beside this one: the same bytes, errors as sentences, and nothing left behind."""

from __future__ import annotations

import os
import signal
import socket
import time
from pathlib import Path

import pytest
from facts import stating
from report.figures.small_bag import record

from conveyor_sim.errors import ConveyorError
from conveyor_sim.report.drawing import Drawing
from conveyor_sim.report.figures.draw import plot_bag


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    outputs = {"bottles": 50, "contacts": 25, "belts": 10, "ledger": 10}
    return record(tmp_path_factory.mktemp("bags") / "drawn", changes={"outputs": outputs})


def group_of(drawing: Drawing) -> int:
    drawing.get_ready()
    assert drawing._process is not None
    return drawing._process.pid


def is_gone(group: int) -> bool:
    try:
        os.killpg(group, 0)
    except ProcessLookupError:
        return True
    return False


def test_processes_draw_what_one_does_to_the_bit(bag: Path, tmp_path: Path) -> None:
    alone = plot_bag(bag, tmp_path / "alone", times=[0.2, 0.4], bottles=[3, 4])
    with Drawing() as drawing:
        drawing.begin(bag, [0.2, 0.4], [3, 4])
        aside = drawing.pictures(tmp_path / "aside")
    assert [path.name for path in aside] == [path.name for path in alone]
    assert {path.stem for path in aside} == {
        "table", "plant", "velocity_bottle_3", "velocity_bottle_4", "flow", "force", "energy",
    }  # fmt: skip
    for one, other in zip(alone, aside, strict=True):
        assert one.read_bytes() == other.read_bytes(), one.name
    assert {path.name for path in (tmp_path / "aside").iterdir()} == {path.name for path in aside}


def test_what_can_not_be_drawn_is_one_sentence_and_nothing_is_written(bag: Path, tmp_path: Path) -> None:
    with Drawing() as drawing:
        drawing.begin(bag, [20.0])
        with pytest.raises(ConveyorError, match=stating(str(bag), "time 20 s", "recording")):
            drawing.pictures(tmp_path / "pictures")
    assert not (tmp_path / "pictures").exists()


def test_an_end_in_the_midst_of_drawing_leaves_no_process_and_no_file(bag: Path, tmp_path: Path) -> None:
    with pytest.raises(KeyboardInterrupt), Drawing() as drawing:
        group = group_of(drawing)
        drawing.begin(bag)
        while len(members(group)) < 2:  # it has forked, so it draws
            time.sleep(0.01)
        raise KeyboardInterrupt
    while not is_gone(group):
        time.sleep(0.01)
    assert sorted(path.name for path in tmp_path.iterdir()) == []


def test_it_ends_with_the_process_that_it_draws_for(bag: Path, tmp_path: Path) -> None:
    with Drawing() as drawing:
        group = group_of(drawing)
        drawing.begin(bag)
        while len(members(group)) < 2:
            time.sleep(0.01)
        with socket.fromfd(drawing._pipe.fileno(), socket.AF_UNIX, socket.SOCK_STREAM) as pipe:
            pipe.shutdown(socket.SHUT_WR)  # as the kernel does for a process that was killed
        with pytest.raises(ConveyorError, match="has ended early"):
            drawing.pictures(tmp_path / "pictures")


def test_a_process_that_was_killed_is_one_sentence(bag: Path, tmp_path: Path) -> None:
    with Drawing() as drawing:
        os.killpg(group_of(drawing), signal.SIGKILL)
        drawing.begin(bag)
        with pytest.raises(ConveyorError, match="has ended early"):
            drawing.pictures(tmp_path / "pictures")


def members(group: int) -> list[int]:
    """The processes of a group that run."""
    found = []
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            state, _, its_group = stat.read_text().rpartition(")")[2].split()[:3]
        except (FileNotFoundError, ProcessLookupError):
            continue
        if int(its_group) == group and state not in "ZX":
            found.append(int(stat.parent.name))
    return found
