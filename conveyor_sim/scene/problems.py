# SPDX-License-Identifier: Apache-2.0
"""A problem of a scene: path and words."""

from dataclasses import dataclass

from conveyor_sim.support.printable import printable

Path = tuple[str | int, ...]


@dataclass(frozen=True)
class Problem:
    """A problem at a path of the scene, in words that follow the path."""

    path: Path
    text: str


def dotted(path: Path) -> str:
    """Return a path as users write it: `bottles[3].position`. Long names are cut."""
    text = ""
    for part in path:
        text += f"[{part}]" if isinstance(part, int) else f".{printable(part)}"
    return text.removeprefix(".")
