# SPDX-License-Identifier: Apache-2.0
"""The options --controller, --parameters and --record-variables of commands that run a scene."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, TypeVar

import click

from conveyor_sim.errors import ConveyorError

if TYPE_CHECKING:
    from conveyor_sim.run.controller_source import ControllerSource

NAMES = ("controller", "parameters", "variables")
"""Names of the options as arguments of a command."""

C = TypeVar("C", bound=Callable[..., object])


def controller_options(command: C) -> C:
    """Add the options to a command, as the arguments NAMES."""
    for option in (
        click.option(
            "--record-variables", "variables", multiple=True, help="The controller's: main/state, main/*; repeatable."
        ),
        click.option("--parameters", default="", help="The controller's, by name: a mapping in YAML, or a .yaml file."),
        click.option(
            "--controller", help="Scans at every tick: program.st, library.so, file.py:factory or module:factory."
        ),
    ):
        command = option(command)
    return command


def controller_source(controller: str | None, parameters: str, variables: tuple[str, ...]) -> ControllerSource | None:
    """Return the controller that the options name, not loaded yet; None if there is none. Raises ConveyorError."""
    if controller is None:
        for option, given in (("--parameters", parameters), ("--record-variables", variables)):
            if given:
                raise ConveyorError(f"{option}: given without --controller, expected both or neither")
        return None
    from conveyor_sim.run.controller_parameters import controller_parameters
    from conveyor_sim.run.controller_source import ControllerSource

    return ControllerSource(controller, controller_parameters(parameters, "--parameters"), variables)
