"""A problem of a scene: where it is, and what is wrong."""

from dataclasses import dataclass

from conveyor_sim.support.printable import printable

Path = tuple[str | int, ...]


@dataclass(frozen=True)
class Problem:
    """One thing that is wrong at a path of the scene, in words that follow the path."""

    path: Path
    text: str


def dotted(path: Path) -> str:
    """A path as users write it: `bottles[3].position`; names that are too long are cut."""
    text = ""
    for part in path:
        text += f"[{part}]" if isinstance(part, int) else f".{printable(part)}"
    return text.removeprefix(".")
