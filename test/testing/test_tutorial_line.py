# SPDX-License-Identifier: Apache-2.0
"""docs/tutorial_line.md word for word: every command runs, and prints what the page shows."""

from __future__ import annotations

import re
import shutil
import sys
from pathlib import Path

import pytest
from protocols.waiting import until
from shell_blocks import Block, Command, snippets
from testing.test_walkthroughs import ENVIRONMENT, PLUGIN, free_port
from warm import run

from conveyor_sim.support.child_process import Process

pytest.importorskip("ezdxf", reason="ezdxf is not installed: pip install conveyor-sim[cad]")
pytest.importorskip("asyncua", reason="asyncua is not installed: pip install conveyor-sim[scada]")

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "tutorial_line.md").read_text()
EXAMPLE = ROOT / "examples" / "afternoon"
FILES = dict(re.findall(r"^```\w*\n(?:# |\(\* )(\S+\.\w+)(?: \*\))?\n(.*?)^```$", PAGE, re.DOTALL | re.MULTILINE))
"""Files that the reader saves, by name."""
OF_THIS_RUN = re.compile(r"\d x real time$|^recorded ")
"""Lines with a speed of the machine, or with pictures."""


def test_the_files_of_the_example_are_those_of_the_page() -> None:
    header = re.compile(r'\A# SPDX-.*\n""".*"""\n\n')
    assert {name: header.sub("", (EXAMPLE / name).read_text()) for name in FILES} == FILES
    assert set(FILES) == {"layers.yaml", "line.yaml", "line.st", "test_line.py"}


def test_the_page_does_what_it_says(pytester: pytest.Pytester) -> None:
    folder = pytester.path
    shutil.copy(EXAMPLE / "hall.dxf", folder)
    output = ""
    seen = set()
    for each in snippets(PAGE):
        if isinstance(each, Block) and each.name:
            (folder / each.name).write_text(each.text)
        elif isinstance(each, Block) and not each.language:
            (folder / "line.st").write_text(FILES["line.st"])
        elif isinstance(each, Block) and each.language == "text":
            lines = [line for line in each.text.splitlines() if not OF_THIS_RUN.search(line)]
            printed = [line.rstrip() for line in output.splitlines()]
            assert [line for line in lines if line not in printed] == []
        elif isinstance(each, Command) and each.words[:2] == ("conveyor-sim", "serve"):
            output = served(each.words[1:], folder)
            seen.add("serve")
        elif isinstance(each, Command) and each.words[0] == "conveyor-sim":
            seen.add(each.words[1])
            if each.words[1] == "view" and "--html" not in each.words:
                continue  # serves a page until Ctrl-C
            output = printed_by(each.words[1:], folder)
        elif isinstance(each, Command) and each.words[0] == "pytest":
            output = pytest_output(each.words[1:], pytester)
            seen.add("pytest")
    assert seen == {"import", "check", "run", "view", "pytest", "serve", "report"}
    assert (folder / "minute.html").stat().st_size > 100_000


def printed_by(words: tuple[str, ...], folder: Path) -> str:
    """Return what a command prints. Pictures of runs and reports, which other tests draw, are left out."""
    plain = ("--no-pictures",) if words[0] in ("run", "report") else ()
    command = ["-c", "from conveyor_sim.cli import main; main()", *words, *plain]
    done = run(command, cwd=folder, env={**ENVIRONMENT, "COLUMNS": "120"})
    assert done.returncode == 0, done.stderr
    return str(done.stdout)


def pytest_output(words: tuple[str, ...], pytester: pytest.Pytester) -> str:
    """Run the tests of the page: with the controller, and, if some are chosen, without it."""
    if "-k" not in words:
        pytester.runpytest_inprocess(*PLUGIN, *words).assert_outcomes(passed=2)
        return ""
    test = pytester.path / "test_line.py"
    text = test.read_text()
    assert text.count("    plant.attach(") == 1
    test.write_text(text.replace("    plant.attach(", "    # plant.attach("))
    result = pytester.runpytest_inprocess(*PLUGIN, *words)
    test.write_text(text)
    result.assert_outcomes(failed=1, deselected=1)
    assert list(pytester.path.glob("line-failures/*packer*/line.html"))
    return str(result.stdout)


def served(words: tuple[str, ...], folder: Path) -> str:
    """Serve the line on other ports, read the tags of the page over OPC UA, and return what the server prints."""
    opcua, web = free_port(), free_port()
    ports = {"--opcua": opcua, "--web": web}
    command = [text for word in words for text in ([word, ports[word]] if word in ports else [word])]
    lead = f"import os; os.chdir({str(folder)!r}); from conveyor_sim.cli import main; main()"
    server = Process("serve", [sys.executable, "-c", lead, *command], {**ENVIRONMENT, "PYTHONUNBUFFERED": "1"}, folder)
    try:
        until(lambda: "commands the line" in server.log.read_text(), "the line is served")
        reads = re.findall(r'uaread -u \S+ -n "(\S+)" +# ([\d.]+)', PAGE)
        assert len(reads) == 2
        for node, value in reads:
            reader = ["-c", "from asyncua.tools import uaread; uaread()"]
            client = run([*reader, "-u", f"opc.tcp://127.0.0.1:{opcua}", "-n", node])
            assert float(client.stdout) == pytest.approx(float(value)), client.stderr
    finally:
        server.stop()
    return server.log.read_text().replace(f":{opcua}", ":4840").replace(f":{web}", ":8080")
