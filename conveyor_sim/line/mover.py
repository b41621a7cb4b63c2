"""Gates, pushers and diverters: rails that go to and fro on command, with end switches."""

from collections.abc import Sequence

from conveyor_sim.engine.moving_arrays import MovingRails
from conveyor_sim.line.course import course_to, later, resting
from conveyor_sim.line.device import Device, Now
from conveyor_sim.line.process_image import Signal, switch
from conveyor_sim.model import Model
from conveyor_sim.scene.moving import MovingShape

WORDS = {
    "gates": ("open", "is_closed", "is_open"),
    "pushers": ("push", "retracted", "extended"),
    "diverters": ("divert", "at_home", "diverting"),
}
"""By kind: the command, and the end switches at home and at the end of the stroke."""

SWITCHED = 1e-3
"""Of the stroke: within it of an end that end's switch is on."""


class Mover(Device):
    """One rail that moves: to the end of its stroke while its command is on, home while it is off.

    While it is jammed it stands where it was; it goes on when it is free again.
    """

    def __init__(self, number: int, shape: MovingShape) -> None:
        """number: among the rails that move."""
        kind = shape.name.split("/")[0]
        order, home, away = WORDS[kind]
        super().__init__(
            shape.name,
            (
                Signal(f"{shape.name}/position", "1", "number"),
                Signal(f"{shape.name}/{home}", "1", "bool"),
                Signal(f"{shape.name}/{away}", "1", "bool"),
            ),
            (switch(f"{shape.name}/{order}"),),
            (switch(f"{shape.name}/jammed"),),
        )
        self._number, self._shape = number, shape
        self.target = self.position = shape.first
        """m or rad."""
        self.speed = 0.0
        self.jammed = False
        self.course = resting(shape.first)
        self.since = 0
        """Tick at which the course began."""

    def command(self, name: str, value: float, now: Now) -> None:
        """Go to the other end, jam or be free again, from where it is on."""
        if name == self.faults[0].name:
            self.jammed = value != 0.0
        else:
            self.target = self._shape.stroke if value != 0.0 else 0.0
        self.since = now.tick
        if self.jammed:
            self.course = resting(self.position)
        else:
            shape = self._shape
            speed = self.speed
            self.course = course_to(self.position, speed, self.target, shape.max_speed, shape.acceleration)

    def begin(self, now: Now) -> None:
        """Tell the engine where the rail is in the steps of this tick."""
        self._rails(now).course[self._number] = later(self.course, (now.tick - self.since) * now.length)

    def end(self, now: Now) -> None:
        """See where it is."""
        rails = self._rails(now)
        self.position, self.speed = float(rails.position[self._number]), float(rails.speed[self._number])

    def values(self, now: Now) -> Sequence[float]:
        """Position from 0, at home, to 1, and both end switches."""
        share = min(1.0, max(0.0, self.position / self._shape.stroke))
        return share, float(share <= SWITCHED), float(share >= 1.0 - SWITCHED)

    def _rails(self, now: Now) -> MovingRails:
        moving = now.state.world.moving
        assert moving is not None
        return moving


def mover_devices(model: Model) -> tuple[Mover, ...]:
    """The gates, pushers and diverters of a scene."""
    return tuple(Mover(number, shape) for number, shape in enumerate(model.moving_shapes))
