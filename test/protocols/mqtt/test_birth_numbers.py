# SPDX-License-Identifier: Apache-2.0
"""Numbers of connections: unique from process to process, and their sequence without a folder."""

from __future__ import annotations

import json
import logging
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from conveyor_sim.protocols.mqtt.edge_node import COUNT, BirthNumbers, state_folder
from conveyor_sim.support.file_lock import locked

if TYPE_CHECKING:
    from test.protocols.mqtt.kit import Line

URL = "mqtt://127.0.0.1:1883"


def numbers(node: str = "line", folder: Path | None = None, broker: str = URL) -> BirthNumbers:
    return BirthNumbers(broker, "plant", node, folder)


def kept(folder: Path) -> list[Path]:
    return sorted(folder.glob("*.json"))


def test_they_go_on_from_process_to_process_and_round(state: Path) -> None:
    assert state_folder() == state / "conveyor_sim" / "mqtt"
    first = numbers()
    assert [first.take() for _ in range(3)] == [0, 1, 2]
    assert [numbers().take() for _ in range(COUNT)] == [*range(3, COUNT), 0, 1, 2]
    assert first.take() == 3  # another process has counted meanwhile
    assert numbers("other").take() == numbers(broker="mqtt://127.0.0.1:1884").take() == 0
    assert len(kept(state_folder())) == 3


def test_processes_side_by_side_never_take_the_same(state: Path) -> None:
    code = "from conveyor_sim.protocols.mqtt.edge_node import BirthNumbers as B\n"
    code += f"n = B({URL!r}, 'plant', 'line')\nprint(*(n.take() for _ in range(20)))"
    running = [subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True) for _ in range(3)]
    taken = [int(number) for one in running for number in one.communicate()[0].split()]
    assert sorted(taken) == list(range(60))


@pytest.mark.parametrize("content", ["", "{", "[]", '{"bdSeq": "1"}', '{"bdSeq": 256}', '{"bdSeq": true}', "[" * 5000])
def test_a_damaged_file_is_remarked_and_replaced(
    tmp_path: Path, content: str, caplog: pytest.LogCaptureFixture
) -> None:
    numbers(folder=tmp_path).take()
    (file,) = kept(tmp_path)
    file.write_text(content)
    with caplog.at_level(logging.WARNING):
        one = numbers(folder=tmp_path)
        first = one.take()
    assert 0 <= first < COUNT and json.loads(file.read_text())["bdSeq"] == first
    assert one.take() == (first + 1) % COUNT
    assert [record.message.count("can't be read") for record in caplog.records] == [1]


def test_without_a_folder_they_begin_anywhere_with_one_remark(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    (tmp_path / "file").write_text("")
    with caplog.at_level(logging.WARNING):
        one = numbers(folder=tmp_path / "file" / "folder")
        taken = [one.take() for _ in range(3)]
    assert taken == [(taken[0] + place) % COUNT for place in range(3)]
    assert len(caplog.records) == 1
    others = {numbers(folder=tmp_path / "file" / "folder").take() for _ in range(20)}
    assert len(others) > 1


def test_a_lock_that_is_not_let_go_holds_up_nobody_for_long(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """A stopped process may hold it."""
    with locked(tmp_path), caplog.at_level(logging.WARNING):
        assert 0 <= numbers(folder=tmp_path).take() < COUNT
    assert "is locked by another process" in caplog.text and not kept(tmp_path)


def test_a_link_in_its_place_is_replaced_and_not_followed(tmp_path: Path) -> None:
    numbers(folder=tmp_path).take()
    (file,) = kept(tmp_path)
    target = tmp_path / "target"
    target.write_text("mine")
    file.unlink()
    file.symlink_to(target)
    numbers(folder=tmp_path).take()
    assert target.read_text() == "mine" and not file.is_symlink()


def test_relative_folders_in_the_environment_do_not_count(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", "state")
    assert state_folder() == Path.home() / ".local" / "state" / "conveyor_sim" / "mqtt"


def test_a_line_without_a_folder_is_served_all_the_same(
    serve: Callable[..., Line], state: Path, caplog: pytest.LogCaptureFixture
) -> None:
    state.write_text("a file")
    with caplog.at_level(logging.WARNING):
        line = serve()
    assert line.host.alive["line"] and "expected a folder that keeps bdSeq" in caplog.text
    line.stop()
    line.until(lambda: not line.host.alive["node"], "a death")
    os.unlink(state)
