# SPDX-License-Identifier: Apache-2.0
"""Ctrl-C, as a terminal sends it to a command, at any moment of its life."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
MAIN = "print('began', flush=True); import sys; from conveyor_sim.cli import main; sys.exit(main())"
"""Code of the console script."""
READING = f"""
import os, signal, click
read = click.Command.parse_args
click.Command.parse_args = lambda *given: (os.kill(os.getpid(), signal.SIGINT), read(*given))[1]
{MAIN}
"""
FUZZ = "print('began', flush=True); import runpy; runpy.run_module('fuzz', run_name='__main__')"

SWALLOWED = """
import ctypes, time
from conveyor_sim.support.interrupt import one_line

@ctypes.CFUNCTYPE(None)
def callback():
    print("compiling", flush=True)
    time.sleep(60.0)

with one_line():
    callback()
    time.sleep(60.0)
"""
"""Callback from C, as llvmlite makes it from the compiler: Python loses its exceptions."""

FAILS_LATER = SWALLOWED.replace(
    "    callback()\n    time.sleep(60.0)", "    callback()\n    raise RuntimeError('none yet')"
)


def interrupted(arguments: list[str], after: float = 0.0, words: str = "") -> tuple[int, str]:
    """Return status and output of a Python that gets SIGINT after some seconds, or after some output."""
    process = subprocess.Popen(
        [sys.executable, *arguments],
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": os.pathsep.join([str(ROOT / "test"), os.environ.get("PYTHONPATH", "")])},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    assert process.stdout is not None
    said = ""
    while words not in said:
        line = process.stdout.readline()
        assert line, said
        said += line
    time.sleep(after)
    process.send_signal(signal.SIGINT)
    said += process.communicate(timeout=60)[0]
    return process.returncode, said


@pytest.mark.parametrize("after", [0.2, 0.6, 1.2])
@pytest.mark.parametrize(
    "arguments",
    [
        ["-c", MAIN, "check", "glass_line", "--out", "/proc/no_such_folder"],
        ["-c", MAIN, "explain", "--price", "paper_plant"],
        ["-c", FUZZ],
    ],
    ids=["check", "explain", "fuzz"],
)
def test_a_command_ends_with_one_line(arguments: list[str], after: float) -> None:
    status, said = interrupted(arguments, after, "began")
    assert "Error: /proc/no_such_folder" in said or (status, said.splitlines()[-1]) == (130, "interrupted")
    assert "Traceback" not in said
    assert "Aborted" not in said


def test_a_command_that_is_reading_its_arguments_ends_with_one_line() -> None:
    done = subprocess.run([sys.executable, "-c", READING, "check", "glass_line"], capture_output=True, text=True)
    assert (done.returncode, done.stdout, done.stderr) == (130, "began\n", "interrupted\n")


def test_a_run_whose_pictures_are_being_drawn_ends_with_one_line_and_nothing_half_written(tmp_path: Path) -> None:
    folder = tmp_path / "run"
    arguments = ["-c", MAIN, "run", str(ROOT / "test/bag/small_line.yaml"), "--duration", "0.2", "--out", str(folder)]
    status, said = interrupted(arguments, words="forces ")
    assert (status, said.splitlines()[-1]) == (130, "interrupted")
    assert "Traceback" not in said
    assert {path.name for path in folder.iterdir()} <= {
        "run_0.mcap",
        "metadata.yaml",
        "page.html",
        "summary.json",
        "pictures",
    }
    assert not any(path.name.startswith(".") for path in folder.rglob("*"))


def test_an_interrupt_that_a_callback_loses_comes_again() -> None:
    status, said = interrupted(["-c", SWALLOWED], 0.2, "compiling")
    assert (status, said) == (130, "compiling\ninterrupted\n")


def test_what_fails_after_a_lost_interrupt_is_an_interrupt() -> None:
    status, said = interrupted(["-c", FAILS_LATER], 0.2, "compiling")
    assert (status, said) == (130, "compiling\ninterrupted\n")


def test_other_errors_stay_what_they_are() -> None:
    done = subprocess.run(
        [sys.executable, "-c", "from conveyor_sim.support.interrupt import one_line\nwith one_line(): 1 / 0"],
        cwd=ROOT, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert (done.returncode, "ZeroDivisionError" in done.stderr) == (1, True)


def test_an_interrupt_that_a_library_makes_an_error_of_is_one_all_the_same() -> None:
    """Pydantic does this when it is interrupted while it builds a validator."""
    code = (
        "import time\nfrom conveyor_sim.support.interrupt import one_line\nwith one_line():\n    try:\n"
        "        print('began', flush=True); time.sleep(60)\n"
        "    except KeyboardInterrupt as struck:\n        raise ValueError('no validator') from struck\n"
    )
    assert interrupted(["-c", code], 0.2, "began") == (130, "began\ninterrupted\n")


def test_an_interrupt_that_is_held_back_comes_when_the_work_is_done() -> None:
    """The work ends first; a second interrupt ends the process at once."""
    code = (
        "import time\nfrom conveyor_sim.support.interrupt import one_line\n"
        "from conveyor_sim.support.signals import held_back\nwith one_line():\n    with held_back():\n"
        "        print('began', flush=True)\n        end = time.monotonic() + 1.0\n"
        "        while time.monotonic() < end: time.sleep(0.01)\n        print('done', flush=True)\n"
        "    print('never')\n"
    )
    assert interrupted(["-c", code], 0.1, "began") == (130, "began\ndone\ninterrupted\n")


IGNORED = ["sh", "-c", 'trap "" INT; exec "$0" "$@"', sys.executable]
"""Python with SIGINT ignored, as shells start background jobs."""


def test_a_command_that_is_started_with_interrupts_ignored_goes_on() -> None:
    code = (
        "import os, signal, time\nfrom conveyor_sim.support.interrupt import one_line\nwith one_line():\n"
        "    os.kill(os.getpid(), signal.SIGINT); time.sleep(0.1)\nprint('done')\n"
    )
    done = subprocess.run([*IGNORED, "-c", code], cwd=ROOT, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, "done\n", "")


def test_processes_of_tests_can_be_interrupted_where_tests_are_started_with_interrupts_ignored() -> None:
    """This holds for new processes and for processes forked from a warm one."""
    code = (
        "import os, signal, subprocess, sys\nfrom ctrl_c import restore_for_children\nimport warm\n"
        "shown = 'import signal; print(signal.getsignal(signal.SIGINT) is signal.default_int_handler)'\n"
        "warm.FORKED.set_forkserver_preload([])\n"
        "restore_for_children()\nos.kill(os.getpid(), signal.SIGINT)\n"
        "print(subprocess.run([sys.executable, '-c', shown], capture_output=True, text=True).stdout, end='')\n"
        "print(warm.run(['-c', shown]).stdout, end='')\n"
    )
    done = subprocess.run([*IGNORED, "-c", code], cwd=ROOT / "test", capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (0, "True\nTrue\n"), done.stderr
