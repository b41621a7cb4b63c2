# SPDX-License-Identifier: Apache-2.0
"""docs/troubleshooting.md: its commands exist, with their options."""

from __future__ import annotations

import re
from pathlib import Path

import click
import pytest

from conveyor_sim.cli.command import main

PAGE = (Path(__file__).parent.parent / "docs" / "troubleshooting.md").read_text(encoding="utf-8")
COMMANDS = sorted(set(re.findall(r"`conveyor-sim ([^`]+)`", PAGE)))


@pytest.mark.parametrize("text", COMMANDS)
def test_a_command_exists_with_its_options(text: str) -> None:
    name, *words = text.split()
    context = click.Context(main)
    command = main.get_command(context, name)
    assert command is not None
    options = {option for parameter in command.params for option in (*parameter.opts, *parameter.secondary_opts)}
    assert {word for word in words if word.startswith("--")} <= options


def test_each_row_has_a_symptom_a_cause_and_a_remedy() -> None:
    rows = [line for line in PAGE.splitlines() if line.startswith("|") and not line.startswith(("|---", "| symptom"))]
    assert len(rows) > 20
    assert [row for row in rows if len(re.split(r"(?<!\\)\|", row)) != 5 or "|  |" in row] == []
