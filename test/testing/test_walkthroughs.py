# SPDX-License-Identifier: Apache-2.0
"""The pages docs/plc/ word for word: files, the server that replaces the PLC, the test. Only the port differs."""

from __future__ import annotations

import os
import re
import shlex
import shutil
import socket
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest
from protocols.waiting import until
from shell_blocks import Block, Command, snippets

from conveyor_sim.support.child_process import Process

ROOT = Path(__file__).resolve().parents[2]
PAGES = {"siemens": ("snap7", "1102"), "rockwell": ("pylogix", "44818"), "beckhoff": ("pyads", "48898")}
"""Library and port of each page."""
ENVIRONMENT = dict(os.environ)
"""The environment before pytester changes HOME, where compiled kernels are cached."""
PLUGIN = ("-p", "conveyor_sim.testing.plugin", "-p", "no:cacheprovider")


def free_port() -> str:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        return str(listener.getsockname()[1])


@pytest.fixture
def stack() -> Iterator[ExitStack]:
    with ExitStack() as stack:
        yield stack


@pytest.mark.parametrize("page", [*PAGES])
def test_a_walkthrough_ends_in_a_test_that_passes(page: str, pytester: pytest.Pytester, stack: ExitStack) -> None:
    library, port = PAGES[page]
    pytest.importorskip(library)
    free = free_port()
    text = re.sub(rf"\b{port}\b", free, (ROOT / "docs" / "plc" / f"{page}.md").read_text())
    folder = pytester.path
    shutil.copy(ROOT / "examples" / "my_line.yaml", folder)
    attached = []
    for each in snippets(text):
        if isinstance(each, Block) and each.name:
            (folder / each.name).write_text(each.text)
        elif isinstance(each, Block) and each.text.startswith("tag,theirs\n"):
            (folder / "tags.csv").write_text(each.text)
        elif isinstance(each, Command) and each.words[0] == "python":
            assert each.words[-1] == "&"
            words = [sys.executable, *each.words[1:-1]]
            name = shlex.join(each.words[1:3]).replace("/", "_")
            stack.callback(_started(name, words, folder).stop)
            until(lambda: _listens(int(free)), f"{name} listens")  # a test starts at once here, without imports
        elif isinstance(each, Command) and each.words[0] == "pytest":
            pytester.runpytest_inprocess(*PLUGIN, *each.words[1:]).assert_outcomes(passed=1)
        elif isinstance(each, Command) and each.words[0] == "conveyor-sim":
            command = [
                sys.executable,
                "-c",
                "from conveyor_sim.cli import main; main()",
                *each.words[1:],
                "--no-record",
            ]
            attached.append(_started("attach", command, folder))
            stack.callback(attached[-1].stop)
    (attach,) = attached
    while "commands the line" not in attach.log.read_text():
        assert attach.exit_code is None, attach.obituary()
        time.sleep(0.1)
    attach.stop()
    assert attach.exit_code == 0 and "0 refused" in attach.log.read_text(), attach.last_words()


def _listens(port: int) -> bool:
    with socket.socket() as client:
        return client.connect_ex(("127.0.0.1", port)) == 0


def _started(name: str, words: list[str], folder: Path) -> Process:
    """Start a command in a folder."""
    lead = [sys.executable, "-c", f"import os, sys; os.chdir({str(folder)!r}); os.execv(sys.argv[1], sys.argv[1:])"]
    return Process(name, [*lead, *words], {**ENVIRONMENT, "PYTHONUNBUFFERED": "1"}, folder)
