# SPDX-License-Identifier: Apache-2.0
"""The commands and Python blocks of docs/ros.md, docs/ros/ and the tutorial run in the order of each page."""

from __future__ import annotations

import array
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest
from action_msgs.msg import GoalStatus
from conveyor_msgs.msg import RunState
from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import SetParameters
from rclpy.action.client import ActionClient
from ros.line_client import LineClient, until
from rosgraph_msgs.msg import Clock
from ruamel.yaml import YAML
from shell_blocks import Block, Command, snippets
from simulation_interfaces.msg import Result
from warm import Warm

from conveyor_sim.ros.publishers import message_class

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "docs" / "ros.md", *sorted((ROOT / "docs" / "ros").glob("*.md")), ROOT / "docs" / "tutorial_ros.md"]
INSTALLATION = {"sudo", "source", "pip", "python3", "rosdep", "colcon", "cd"}
"""Commands that change the machine or need an installed ROS 2."""
NOT_INSTALLED = {"ros2 security", "ros2 bag"}
"""Commands of ROS 2 that the wheels don't have, and that no client takes the place of here."""
PLACEHOLDERS = {"my_node"}
"""Programs of the reader."""
ENDLESS = {"read_poses_and_forces.py": "bottles", "serve": "://", "view": "://", "--publish": "conveyor_replay"}
"""Words of commands that run until Ctrl-C, with a part of their output or the node that they start."""
COMPILING = 900.0
"""Longest time of a command that may compile kernels on a busy machine, s of wall time."""
REFUSED = ("feeder", "99")
"""Arguments of a command that the page describes as refused."""
RECORDED = 1
"""Simulated time until the reader goes on after the start of a recording, s."""
STARTED = re.compile(r"scene \w+, (playing|paused), run")
IN_LOCKSTEP = {RunState.LOCKSTEP, RunState.ENDED}


@dataclass
class Terminal:
    """A process, with its output in a file."""

    words: Sequence[str]
    process: Warm
    log: Path

    def interrupt(self) -> None:
        """Press Ctrl-C. Require an orderly end."""
        self.process.send_signal(signal.SIGINT)
        assert self.process.wait(60.0) == 0, f"{self.words}: {self.log.read_text()}"


@dataclass
class Reader:
    """A reader who follows a page in a folder with links to folders of the checkout."""

    folder: Path
    client: LineClient
    open: list[Terminal] = field(default_factory=list)
    called: int = 0

    def run(self, snippet: Command | Block) -> None:
        """Do what a page shows next."""
        if isinstance(snippet, Block):
            self._block(snippet)
            return
        words = snippet.words
        program, start = words[0], " ".join(words[:2])
        if program in INSTALLATION | PLACEHOLDERS or start in NOT_INSTALLED or "--enclave" in words:
            return
        actions: dict[str, Callable[[Sequence[str]], None]] = {
            "export": self._export,
            "sim_node": self._sim_node,
            "controller_node": self._controller_node,
            "conveyor-sim": self._program,
            "python": self._program,
            "tools/workspace.sh": self._script,
            "ros2 launch": self._launch,
            "ros2 param": self._param,
            "ros2 service": self._service,
            "ros2 action": self._action,
            "ros2 topic": self._topic,
        }
        action = actions.get(program) or actions.get(start)
        assert action is not None, f"{words}: expected a command that this test knows"
        action(words)

    def end(self) -> None:
        """Press Ctrl-C in all terminals, the newest first."""
        while self.open:
            self.open.pop().interrupt()

    def _block(self, block: Block) -> None:
        if block.name:
            (self.folder / block.name).write_text(block.text)
        elif block.language == "python":
            done = subprocess.run(
                [sys.executable, "-c", block.text], cwd=self.folder, capture_output=True, text=True, check=False
            )
            assert done.returncode == 0, done.stderr

    def _export(self, words: Sequence[str]) -> None:
        """Require the named files. The test has its own domain."""
        for _, _, value in (word.partition("=") for word in words[1:]):
            path = value.removeprefix("$PWD/")
            assert path == value or path == "keys" or (self.folder / path).exists(), value

    def _terminal(self, words: Sequence[str], arguments: Sequence[str]) -> Terminal:
        self.called += 1
        log = self.folder / f"log_{self.called}.txt"
        environment = {**os.environ, "ROS_LOG_DIR": str(self.folder / "ros_log"), "PYTHONUNBUFFERED": "1"}
        with log.open("wb") as output:
            terminal = Terminal(words, Warm(arguments, output, output, self.folder, environment), log)
        self.open.append(terminal)
        return terminal

    def _node(self, words: Sequence[str]) -> Terminal:
        return self._terminal(words, ["-m", f"conveyor_sim.ros.{words[0]}", *words[1:]])

    def _sim_node(self, words: Sequence[str]) -> None:
        if not any("__ns:=" in word for word in words):
            self.end()
        terminal = self._node(words)

        while not STARTED.search(terminal.log.read_text()):  # however long its kernels take to compile
            assert terminal.process.poll() is None, terminal.log.read_text()
            time.sleep(0.05)
        if any(word.startswith("record:=") for word in words):
            with self.client.listen(Clock, "/clock", "clock") as heard:
                until(lambda: heard.messages and heard.messages[-1].clock.sec >= RECORDED, "a recording")

    def _controller_node(self, words: Sequence[str]) -> None:
        terminal = self._node(words)
        with self.client.listen(RunState, "run_state") as heard:

            def controls() -> bool:
                assert not terminal.process.poll(), terminal.log.read_text()
                return any(message.state in IN_LOCKSTEP for message in heard.messages)

            until(controls, f"scans of {words}")

    def _program(self, words: Sequence[str]) -> None:
        if any(word.startswith("runs/") for word in words):
            self.end()  # its recording is complete
        if words[0] == "python":
            arguments = ["-c", f"import runpy; runpy.run_path({words[1]!r}, run_name='__main__')", *words[2:]]
        else:
            ports = [part for word in words[1:] for part in ((word, "0") if word == "--foxglove" else (word,))]
            arguments = ["-c", "from conveyor_sim.cli import main; main()", *ports]
        terminal = self._terminal(words, arguments)
        shown = [ENDLESS[part] for word in words for part in word.split("/") if part in ENDLESS]
        if shown:
            while not self._shows(terminal, shown[0]):
                time.sleep(0.05)
            self.open.remove(terminal)
            terminal.interrupt()
            return
        code = terminal.process.wait(COMPILING)
        assert code == (1 if tuple(words[-2:]) == REFUSED else 0), f"{words}: {terminal.log.read_text()}"
        self.open.remove(terminal)

    def _shows(self, terminal: Terminal, text: str) -> bool:
        """Return True once a program has printed a text or started a node of that name, or has ended."""
        names = self.client.node.get_node_names()
        return text in names or text in terminal.log.read_text() or terminal.process.poll() is not None

    def _script(self, words: Sequence[str]) -> None:
        done = subprocess.run([ROOT / words[0], self.folder / "ws"], capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr

    def _launch(self, words: Sequence[str]) -> None:
        """Require the arguments in the file. ROS's launch packages exist as no wheels."""
        text = (ROOT / "launch" / words[3]).read_text()
        assert [name for name in (word.partition(":=")[0] for word in words[4:]) if f'("{name}", ' not in text] == []

    def _param(self, words: Sequence[str]) -> None:
        kind, value = ParameterType.PARAMETER_DOUBLE, ParameterValue(double_value=float(words[5]))
        value.type = kind
        parameters = [Parameter(name=words[4], value=value)]
        (result,) = self.client.call(SetParameters, f"{words[3]}/set_parameters", parameters=parameters).results
        assert result.successful, result.reason

    def _service(self, words: Sequence[str]) -> None:
        kind = message_class(words[4])
        request = filled(kind.Request(), words[5] if len(words) > 5 else "{}")
        response = self.client.client(kind, words[3]).call(request, timeout_sec=60.0)
        assert response is not None, f"no answer to {words}"
        for flag in ("success", "accepted"):
            assert getattr(response, flag, True), f"{words}: {response}"
        if hasattr(response, "result"):
            assert response.result.result == Result.RESULT_OK, f"{words}: {response}"

    def _action(self, words: Sequence[str]) -> None:
        name, kind, text = (word for word in words[3:] if word != "--feedback")
        action = message_class(kind)
        client = ActionClient(self.client.node, action, name)
        until(client.server_is_ready, name)
        feedback: list[Any] = []
        handle = until(client.send_goal_async(filled(action.Goal(), text), feedback.append).result, f"{name} accepted")
        assert until(handle.get_result_async().result, f"the end of {name}").status == GoalStatus.STATUS_SUCCEEDED
        assert feedback
        self.client.between_callbacks(client.destroy)

    def _topic(self, words: Sequence[str]) -> None:
        if words[2] == "pub":
            _, name, kind, text = words[3:]
            message = filled(message_class(kind)(), text)
            publisher = self.client.node.create_publisher(type(message), name, 10)
            until(publisher.get_subscription_count, f"a subscription to {name}")
            publisher.publish(message)
            return
        heard: list[Any] = []
        (types,) = [types for name, types in self.client.node.get_topic_names_and_types() if name == words[3]]
        subscription = self.client.node.create_subscription(message_class(types[0]), words[3], heard.append, 10)
        until(lambda: heard, f"a message of {words[3]}")
        self.client.between_callbacks(lambda: self.client.node.destroy_subscription(subscription))


def filled(message: Any, text: str) -> Any:
    """Return a message with the fields of a YAML text, as the command `ros2` does."""
    return with_fields(message, YAML(typ="safe").load(text))


def with_fields(message: Any, fields: Mapping[str, Any]) -> Any:
    """Set fields of a message, and return it."""
    for name, value in fields.items():
        present = getattr(message, name)
        if isinstance(value, Mapping):
            value = with_fields(present, value)
        elif isinstance(present, array.array):
            value = array.array(present.typecode, value)
        setattr(message, name, float(value) if isinstance(present, float) else value)
    return message


@pytest.fixture
def reader(client: LineClient, tmp_path: Path) -> Iterator[Reader]:
    for name in ("config", "examples"):
        (tmp_path / name).symlink_to(ROOT / name)
    made = Reader(tmp_path, client)
    yield made
    for terminal in made.open:
        terminal.process.kill()


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_a_page_runs_as_it_is_written(page: Path, reader: Reader) -> None:
    shown = list(snippets(page.read_text(encoding="utf-8")))
    assert shown
    for snippet in shown:
        reader.run(snippet)
    reader.end()


@pytest.mark.parametrize("page", PAGES[:-1], ids=lambda page: page.name)
def test_a_page_has_a_diagram(page: Path) -> None:
    assert "\n```mermaid\n" in page.read_text(encoding="utf-8")
