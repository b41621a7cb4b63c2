"""Bottle type of an infeed or a source, which a command may change in a run."""

from conveyor_sim.line.devices.entry import BottleEntry
from conveyor_sim.line.devices.setup import DeviceSetup
from conveyor_sim.line.tag import Tag, choice
from conveyor_sim.scene.parts.infeed import Infeed
from conveyor_sim.scene.parts.source import Source

CMD_BOTTLE = "/cmd_bottle"


def type_tags(name: str, part: Infeed | Source) -> list[Tag]:
    """Return the tag of the command that chooses the type; none without a choice."""
    if not part.types:
        return []
    text = "Type of new bottles."
    return [choice(f"{name}{CMD_BOTTLE}", "setpoint", text, dict(enumerate(part.types)), part.types.index(part.bottle))]


class Switching:
    """Type of new bottles.

    Without a choice no instance attributes are set: states of such devices are those of scenes without `types`.
    """

    bottle = 0
    """Place of the present type."""

    def switch_among(self, part: Infeed | Source, setup: DeviceSetup) -> None:
        """Store the entries of all types, and begin with that of the scene."""
        self._entries = [setup.entry(kind, part.direction, part.speed) for kind in part.kinds]
        if part.types:
            self.bottle = part.types.index(part.bottle)

    def check_type(self) -> None:
        """Raise ValueError if a restored type is not among those of the scene."""
        if not 0 <= self.bottle < len(self._entries):
            raise ValueError(f"bottle is {self.bottle}, expected the place of one of {len(self._entries)} types")

    @property
    def _entry(self) -> BottleEntry:
        return self._entries[self.bottle]
