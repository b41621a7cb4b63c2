# SPDX-License-Identifier: Apache-2.0
"""Text of docs/cli.md: all commands with arguments and options, from the definitions that `--help` prints."""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterator

import click

from conveyor_sim.cli.command import main

HEAD = """\
# Command line

`conveyor-sim COMMAND --help` prints the same in a terminal. Results are printed on standard output; progress and errors
on standard error. Commands end with exit code 0, with 1 and one sentence after an error, with 2 after wrong arguments,
and with 130 after Ctrl-C.

`make docs` generates this page from the commands.
"""


def reference() -> str:
    """Return the page."""
    context = click.Context(main, info_name="conveyor-sim")
    commands = [(name, main.commands[name]) for name in main.list_commands(context)]
    rows = [f"| [`{name}`](#{name}) | {_first_sentence(command)} |" for name, command in commands]
    table = "\n".join(["| command | purpose |", "|---|---|", *rows])
    return "\n\n".join([HEAD.rstrip(), table, *(_section(name, command, context) for name, command in commands)]) + "\n"


def _section(name: str, command: click.Command, parent: click.Context) -> str:
    context = click.Context(command, info_name=name, parent=parent)
    usage = " ".join([context.command_path, *command.collect_usage_pieces(context)])
    records = [
        option.get_help_record(context)
        for option in command.get_params(context)
        if isinstance(option, click.Option) and "--help" not in option.opts
    ]
    rows = [f"| `{record[0].replace(' RANGE', '')}` | {_cell(record[1])} |" for record in records if record is not None]
    table = ["\n".join(["| option | meaning |", "|---|---|", *rows])] if rows else []
    return "\n\n".join([f"## {name}", *_paragraphs(command), f"    {usage}", *table])


def _paragraphs(command: click.Command) -> Iterator[str]:
    for paragraph in inspect.cleandoc(command.help or "").split("\n\n"):
        yield _cell(paragraph)


def _first_sentence(command: click.Command) -> str:
    return next(_paragraphs(command)).split(": ")[0].partition(". ")[0].rstrip(".") + "."


def _cell(text: str) -> str:
    """Return a text for a cell of a table, without characters that Markdown would take for marks."""
    return re.sub(r"([|*<\[])", r"\\\1", " ".join(text.split()))
