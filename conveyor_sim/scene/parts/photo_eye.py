# SPDX-License-Identifier: Apache-2.0
"""Photo-eyes of a scene file."""

from collections.abc import Iterator
from typing import ClassVar

from conveyor_sim.scene.parts.device_part import DevicePart, Mark, Others, line_problems
from conveyor_sim.scene.problems import Path, Problem
from conveyor_sim.scene.types import NotNegative, Point, quantity


class PhotoEye(DevicePart):
    """A beam across the line: blocked while the outline of a bottle crosses it."""

    KIND: ClassVar[str] = "photo_eye"
    WORD: ClassVar[str] = "eye"

    from_: Point = quantity("Start of the beam.", "m", alias="from")
    to: Point = quantity("End of the beam.", "m")
    debounce: NotNegative = quantity(
        "Changes in either direction that last for less than this time are ignored. All others are reported later "
        "by this time.",
        "s",
        default=0.0,
    )
    on_delay: NotNegative = quantity("`blocked` turns on when the beam was blocked for this time.", "s", default=0.0)
    off_delay: NotNegative = quantity("`blocked` turns off when the beam was free for this time.", "s", default=0.0)

    def problems(self, path: Path, others: Others) -> Iterator[Problem]:
        """Yield a problem for a beam without length."""
        yield from line_problems(path, self.from_, self.to)

    def mark(self, name: str) -> Mark:
        """Return its beam."""
        return self._mark("beam", name, (self.from_, self.to))
