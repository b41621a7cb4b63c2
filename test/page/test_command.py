# SPDX-License-Identifier: Apache-2.0
"""The command view: one file, or a server until Ctrl-C."""

from __future__ import annotations

import signal
import subprocess
import sys
from pathlib import Path
from urllib.request import urlopen

import pytest
from click.testing import CliRunner

from conveyor_sim.cli import main


def test_one_file_is_written_and_named(bag: Path, tmp_path: Path) -> None:
    file = tmp_path / "page.html"
    done = CliRunner().invoke(main, ["view", str(bag), "--html", str(file), "--last", "5"])
    assert (done.exit_code, done.output) == (0, f"{file}\n")
    assert file.read_text().startswith("<!doctype html>")


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--last", "5"], "--last: given without --html, expected both or neither"),
        (["--html", "page.html", "--port", "0"], "--port: given with --html, expected one of them"),
        (["--html", "page.html", "--last", "nan"], "--last: nan given, expected a number above 0"),
        (["--html", "page.html", "--last", "-1"], "--last: -1 given, expected a number above 0"),
    ],
)
def test_what_makes_no_sense_is_refused(
    bag: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, options: list[str], said: str
) -> None:
    monkeypatch.chdir(tmp_path)
    done = CliRunner().invoke(main, ["view", str(bag), *options])
    assert done.exit_code == 1 and said in done.output
    assert not Path("page.html").exists()


def test_a_recording_is_not_overwritten_by_its_page(bag: Path) -> None:
    for part in [file for file in bag.iterdir() if file.suffix in (".mcap", ".yaml")]:
        content = part.read_bytes()
        done = CliRunner().invoke(main, ["view", str(bag), "--html", str(part)])
        assert done.exit_code == 1 and "which is a file of the recording, expected another one" in done.output
        assert part.read_bytes() == content


def test_a_folder_that_is_not_there_is_not_made(bag: Path, tmp_path: Path) -> None:
    file = tmp_path / "new" / "page.html"
    done = CliRunner().invoke(main, ["view", str(bag), "--html", str(file)])
    assert done.exit_code == 1 and f"{file}: can't be written (No such file or directory)" in done.output
    assert not file.parent.exists()


def test_a_recording_is_served_until_ctrl_c(bag: Path) -> None:
    command = [sys.executable, "-c", "from conveyor_sim.cli import main; main()", "view", str(bag)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        said = process.stdout.readline()
        url = said.removeprefix(f"{bag}: ").split()[0]
        with urlopen(url, timeout=60) as answer:
            assert b"<canvas" in answer.read()
        process.send_signal(signal.SIGINT)
        assert process.wait(60) == 0
