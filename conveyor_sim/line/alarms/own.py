"""The alarms that a line has from the start: its devices', its limits', and those of the scene."""

from collections.abc import Mapping, Sequence

from conveyor_sim.columns.damage import DamageEvent
from conveyor_sim.line.alarms.alarms import Alarms
from conveyor_sim.line.alarms.declaration import LINE_GROUP, Declared, error
from conveyor_sim.scene.parts.alarm import AlarmFields
from conveyor_sim.scene.schema import Scene

LIMITS = "limits/"
"""What the ids of the limits' alarms begin with."""

CLOGGING = "clogging_time"
"""The limit whose alarm each outfeed has for itself."""

PASSED_FOR = 1.0
"""s for which the alarm of a limit stays active once it was passed: bottles pass it one by one."""


def scene_alarms(scene: Scene) -> list[Declared]:
    """Those that the scene declares."""
    return [Declared(name, AlarmFields(**vars(alarm))) for name, alarm in scene.alarms.items()]


def limit_alarms(scene: Scene) -> list[Declared]:
    """One for each limit of the scene, and for each outfeed that can clog."""
    found = []
    for kind, value in scene.limits:
        if value is not None and kind == CLOGGING:
            for name in scene.outfeeds:
                outfeed = f"outfeeds/{name}"
                found.append(error(f"{outfeed}/clogged", f"nothing leaves by {outfeed}", f"{outfeed}/removed"))
        elif value is not None:
            text = f"a bottle has passed limits.{kind}"
            fields = AlarmFields(text=text, latching=True, off_delay=PASSED_FOR, group=LINE_GROUP)
            found.append(Declared(LIMITS + kind, fields))
    return found


class LimitConditions:
    """Conditions of the alarms of limits: that one was passed in a tick; that an outfeed is clogged."""

    def __init__(self, alarms: Alarms) -> None:
        """alarms: with those of the limits."""
        self._alarms = [alarm for alarm in alarms if alarm.own and alarm.id.startswith(LIMITS)]
        self._all = alarms

    def changes(self, passed: Sequence[DamageEvent], clogged: Mapping[str, bool]) -> dict[str, bool]:
        """Those that have begun or ended, by id. passed: in the tick that ends; clogged: outfeeds."""
        if not (self._alarms or clogged):
            return {}
        now = {f"outfeeds/{name}/clogged": on for name, on in clogged.items()}
        if self._alarms:
            kinds = {LIMITS + limit.kind for limit in passed}
            now.update({alarm.id: alarm.id in kinds for alarm in self._alarms})
        return {id: on for id, on in now.items() if on is not self._all[id].condition}
