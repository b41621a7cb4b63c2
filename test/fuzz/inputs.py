# SPDX-License-Identifier: Apache-2.0
"""What a line takes, from its scene alone: commands and faults, with their types and limits (docs/line.md)."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from conveyor_sim.scene import Scene
from conveyor_sim.scene.drives import NamedDrive, SpeedSetpoint
from conveyor_sim.scene.gearing import top_speed
from conveyor_sim.scene.parts.axis import CYCLE
from conveyor_sim.scene.parts.machine import PackmlPart
from conveyor_sim.scene.parts.panel import Button, EmergencyStop, NumberField, Selector, StackLight
from conveyor_sim.scene.parts.reject import Reject


@dataclass(frozen=True)
class Input:
    """One of them."""

    kind: str = "bool"
    low: float = 0.0
    high: float = 1.0

    def takes(self, value: float) -> bool:
        """Whether a value is accepted."""
        whole = self.kind == "number" or float(value).is_integer()
        return math.isfinite(value) and self.low <= value <= self.high and whole


Table = Mapping[str, Input]

MOVERS = (("gates", "open"), ("pushers", "push"), ("diverters", "divert"), ("clamps", "close"))
GEARED = ("stars", "screws")
"""Fields of machines on the shaft of an axis."""
POSITIONED = (("dividers", "cmd_lane"), ("adjustable", "cmd_setting"))


def speed_parts(scene: Scene) -> list[tuple[str, SpeedSetpoint]]:
    """Named drives, then belts without one, by their tags."""
    drives = [(f"drives/{name}", drive) for name, drive in scene.drives.items()]
    return [*drives, *((f"belts/{name}", belt) for name, belt in scene.belts.items() if not belt.has_foreign_drive)]


def has_drive(part: SpeedSetpoint) -> bool:
    """Return True if a belt or a named drive runs, reverses and trips."""
    return isinstance(part, NamedDrive) or getattr(part, "drive", None) is not None


def commands_of(scene: Scene) -> Table:
    """The commands."""
    table: dict[str, Input] = {}
    for place, part in speed_parts(scene):
        table[f"{place}/cmd_speed"] = Input("number", *part.speed_limits)
        if has_drive(part):
            table |= {f"{place}/{what}": Input() for what in ("run", "reverse", "reset")}
    for field, order in MOVERS:
        table |= {f"{field}/{name}/{order}": Input() for name in getattr(scene, field)}
    for field, order in POSITIONED:
        for name, part in getattr(scene, field).items():
            table[f"{field}/{name}/{order}"] = Input("count", 0.0, len(part.positions) - 1.0)
    table |= {f"pushers/{name}/auto": Input() for name, part in scene.pushers.items() if part.zone is not None}
    for name, part in scene.panel.items():
        table |= {f"panel/{name}/{what}": given for what, given in _of_panel(part)}
    for name, axis in scene.axes.items():
        # Jogging is refused in gear, which the scene alone does not tell.
        table |= {f"axes/{name}/{what}": Input() for what in ("enable", "reset")}
        if axis.drive is None and axis.machine is None:
            most = axis.top_rate if axis.master is None else top_speed(scene, name) / CYCLE
            table[f"axes/{name}/rate"] = Input("number", -most, most)
        if axis.master is not None:
            table |= {f"axes/{name}/{what}": Input() for what in ("gear_in", "gear_out")}
            table[f"axes/{name}/phase_shift"] = Input("number", -CYCLE, CYCLE)
    for name, belt in scene.side_belts.items():
        if belt.axis is not None:
            continue
        table |= {
            f"side_belts/{name}/cmd_speed": Input("number", *belt.speed_limits),
            f"side_belts/{name}/run": Input(),
        }
    table |= {f"carousels/{name}/on": Input() for name in scene.carousels}
    for name, machine in scene.machines.items():
        if isinstance(machine, PackmlPart):
            most = machine.rate if machine.rate_limit is None else machine.rate_limit
            table |= {f"machines/{name}/run": Input(), f"machines/{name}/rate": Input("number", 0.0, most)}
        elif isinstance(machine, Reject):
            table[f"machines/{name}/fire"] = Input()
    return table


def _of_panel(part: object) -> list[tuple[str, Input]]:
    """Commands of a part of the operator panel."""
    if isinstance(part, Button):
        return [("press" if part.action == "momentary" else "pressed", Input())]
    if isinstance(part, Selector):
        return [("turn", Input("count", 0.0, len(part.positions) - 1.0))]
    if isinstance(part, EmergencyStop):
        return [("press", Input()), ("reset", Input())]
    if isinstance(part, StackLight):
        return [(light, Input()) for light in part.lights]
    if isinstance(part, NumberField):
        writers = {"operator": ("set",), "controller": ("write",), "both": ("set", "write")}
        return [(what, Input("number", *part.limits)) for what in writers[part.written_by]]
    return [("on", Input())]


def faults_of(scene: Scene) -> Table:
    """The faults."""
    table = {f"{place}/trip": Input() for place, part in speed_parts(scene) if has_drive(part)}
    for field, _ in (*MOVERS, *POSITIONED):
        table |= {f"{field}/{name}/jammed": Input() for name in getattr(scene, field)}
    table |= {
        f"{field}/{name}/jammed": Input() for field in ("axes", *GEARED, "side_belts") for name in getattr(scene, field)
    }
    table |= {
        f"{field}/{name}/slip": Input("number", -math.pi, math.pi) for field in GEARED for name in getattr(scene, field)
    }
    table |= {f"side_belts/{name}/slip": Input("number") for name in scene.side_belts}
    table |= {
        f"carousels/{name}/dead_tool": Input("count", 0.0, scene.stars[carousel.star].pockets)
        for name, carousel in scene.carousels.items()
    }
    table |= {f"machines/{name}/stop": Input() for name in scene.machines}
    table |= {f"spills/{name}/drop": Input() for name in scene.spills}
    for name in scene.photo_eyes:
        table |= {f"photo_eyes/{name}/{what}": Input() for what in ("stuck_on", "stuck_off")}
        table[f"photo_eyes/{name}/chatter"] = Input("number", 0.0, 1000.0)
        table[f"photo_eyes/{name}/delay"] = Input("number", 0.0, 60.0)
    table |= {f"zones/{name}/offset": Input("count", -1000.0, 1000.0) for name in scene.zones}
    return table


def accepted(table: Table, names: Sequence[str], values: Sequence[float]) -> bool:
    """Whether a set of them is applied; else it is refused as a whole."""
    if not names or len(names) != len(values) or len(set(names)) < len(names) or not set(names) <= set(table):
        return False
    return all(table[name].takes(value) for name, value in zip(names, values, strict=True))
