# SPDX-License-Identifier: Apache-2.0
"""The command `conveyor-sim`: check, explain, run, accuracy and more. Errors are one sentence, no traceback."""

from __future__ import annotations

import errno
import io
import signal
import sys
from typing import Any

import click

from conveyor_sim import __version__
from conveyor_sim.cli.accuracy import accuracy
from conveyor_sim.cli.attach import attach
from conveyor_sim.cli.calibrate import calibrate
from conveyor_sim.cli.demo import demo
from conveyor_sim.cli.drawings import draw, import_
from conveyor_sim.cli.optimise import optimise
from conveyor_sim.cli.recordings import alarms, events, export, plot, recover, replay, report, sources
from conveyor_sim.cli.run import run
from conveyor_sim.cli.scenes import check, explain, tags
from conveyor_sim.cli.schema import schema
from conveyor_sim.cli.serve import serve
from conveyor_sim.cli.studies import study_, sweep
from conveyor_sim.cli.user import user
from conveyor_sim.cli.view import view
from conveyor_sim.errors import ConveyorError
from conveyor_sim.support.interrupt import one_line
from conveyor_sim.support.printable import printable_lines
from conveyor_sim.support.signals import HandledOnce

# Commands import what they need when they run, so that `conveyor-sim --help` answers at once.


class _Group(click.Group):
    """Command group: user errors end in one sentence and exit code 1, Ctrl-C in one line and exit code 130."""

    def make_context(self, *args: Any, **kwargs: Any) -> click.Context:
        """Read the arguments; without this, click would end a Ctrl-C with "Aborted!" and exit code 1."""
        with one_line():
            return super().make_context(*args, **kwargs)

    def invoke(self, ctx: click.Context) -> Any:
        try:
            with one_line():
                return super().invoke(ctx)
        except ConveyorError as error:
            raise click.ClickException(printable_lines(error)) from error
        except OSError as error:
            if error.errno == errno.EPIPE:
                raise  # the reader of the output has ended: click ends silently
            where = f"{error.filename}: " if error.filename else ""
            raise click.ClickException(printable_lines(f"{where}{error.strerror or error}")) from error


@click.group(cls=_Group)
@click.version_option(__version__, prog_name="conveyor-sim")
@click.pass_context
def main(context: click.Context) -> None:
    """Bottles on industrial conveyors, simulated by force."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")  # file names may be bytes that are not text
    context.with_resource(HandledOnce([signal.SIGINT], signal.default_int_handler))


for command in (
    demo, check, schema, tags, explain, draw, import_, run, serve, attach, user, accuracy, recover, replay, events,
    alarms, export, report, plot, sources, view, sweep, optimise, study_,
    calibrate,
):  # fmt: skip
    main.add_command(command)
