# SPDX-License-Identifier: Apache-2.0
"""docs/cli.md: all commands and options, as `--help` prints them."""

import re
from pathlib import Path

import click
from click.testing import CliRunner
from facts import missing

from conveyor_sim.cli import main
from conveyor_sim.cli.reference import reference

PAGE = Path(__file__).parents[1] / "docs" / "cli.md"


def test_the_page_is_current() -> None:
    assert PAGE.read_text(encoding="utf-8") == reference()


def test_every_command_and_option_of_the_help_is_on_the_page() -> None:
    sections = dict(re.findall(r"^## (\S+)\n(.*?)(?=^## |\Z)", reference(), re.MULTILINE | re.DOTALL))
    assert sections.keys() == main.commands.keys()
    for name, command in main.commands.items():
        printed = CliRunner().invoke(main, [name, "--help"]).stdout
        options = [option for option in command.params if isinstance(option, click.Option)]
        names = [opt for option in options for opt in option.opts]
        assert missing(printed, *names) == [] and missing(sections[name], *names) == []
        assert command.help and all(option.help for option in options if not option.hidden), name


def test_marks_of_markdown_are_escaped() -> None:
    for line in re.sub(r"`[^`]*`", "", reference()).splitlines():
        if line.startswith("| ") and "](#" not in line:
            assert not re.search(r"(?<!\\)[<*]", line), line
