# SPDX-License-Identifier: Apache-2.0
"""Options of all commands that read a scene: `--set`, `--variant`, `--format`, `--outside-tables`."""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeVar

import click

if TYPE_CHECKING:
    from pathlib import Path

    from conveyor_sim.scene import Scene

NAMES = ("set", "variant", "format", "outside_tables")
"""Names of the options in a click context."""

Command = TypeVar("Command", bound=Callable[..., Any])


@dataclass(frozen=True)
class SceneOptions:
    """Values of the options."""

    settings: tuple[str, ...] = ()
    """Texts NAME=VALUE."""
    variant: str | None = None
    format: str | None = None
    outside_tables: bool = False

    @property
    def are_choices(self) -> bool:
        """True if parameters, a variant or a format are chosen."""
        return bool(self.settings or self.variant or self.format)

    def load(self, scene: str, duration: float | None = None) -> Scene:
        """Read a scene file or a shipped scene. duration: simulated time (s) in place of the scene's.

        Raise SceneError.
        """
        from conveyor_sim.support.resources import scene_path

        return self.load_file(scene_path(scene), duration)

    def load_file(self, file: Path, duration: float | None = None) -> Scene:
        """Read a scene file. See `load`."""
        from conveyor_sim.scene import load_scene
        from conveyor_sim.scene.choices import choices, settings_of

        overrides = choices(settings_of(self.settings), self.variant, self.format)
        if duration is not None:
            overrides["duration"] = duration
        return load_scene(file, overrides, self.outside_tables)


def scene_options(command: Command) -> Command:
    """Add the options to a command, which gets their values as `options`."""

    @click.option("--set", multiple=True, metavar="NAME=VALUE", help="A parameter of SCENE: 'length=3 m'.")
    @click.option("--variant", metavar="NAME", help="A variant of SCENE.")
    @click.option("--format", metavar="NAME", help="A format of SCENE: its bottle and parameters.")
    @click.option("--outside-tables", is_flag=True, help="Let SCENE name files that lie outside its own folder.")
    @functools.wraps(command)
    def wrapped(*arguments: Any, **given: Any) -> Any:
        options = SceneOptions(*(given.pop(name) for name in NAMES))
        return command(*arguments, options=options, **given)

    return wrapped  # type: ignore[return-value]
