"""The alarms of a line as a device: what of them a controller reads."""

from collections.abc import Sequence

from conveyor_sim.line.alarms.alarms import Alarms
from conveyor_sim.line.alarms.declaration import MOST_ALARMS
from conveyor_sim.line.device import Device, ScanContext
from conveyor_sim.line.tag import count, switch
from conveyor_sim.scene.parts.alarm import PREFIX

NAME = "alarms"
COUNTS = "alarm_counts"
"""What the names of its counts begin with: those of alarms may be anything."""


class AlarmsDevice(Device):
    """Which alarms of line and scene stand, and how many in all. What it remembers, the alarms themselves do."""

    def __init__(self, alarms: Alarms) -> None:
        """alarms: with those of line and scene, and no others yet."""
        most = len(alarms) + MOST_ALARMS
        standing = "alarms that stand, of controllers too."
        super().__init__(
            NAME,
            [
                count(f"{COUNTS}/errors", "alarm", f"Errors among the {standing}", high=most),
                count(f"{COUNTS}/warnings", "alarm", f"Warnings among the {standing}", high=most),
                count(f"{COUNTS}/messages", "alarm", f"Messages among the {standing}", high=most),
                count(f"{COUNTS}/unacknowledged", "alarm", "Alarms that wait to be acknowledged.", high=most),
                count(f"{COUNTS}/first_out", "alarm", "Number of the alarm that came first, 0 without one."),
                *(switch(PREFIX + alarm.id, "alarm", "It is active or latched, and not hidden.") for alarm in alarms),
            ],
        )
        self.classify(NAME)
        self._alarms = alarms

    def values(self, now: ScanContext) -> Sequence[float]:
        """The counts, then 1 for each that stands."""
        return self._alarms.tag_values()
