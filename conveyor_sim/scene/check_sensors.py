"""Sensors and indicators that can't be: beams without length, zones that are none, names that refer to nothing."""

import math
from collections.abc import Collection, Iterator

from conveyor_sim.scene.geometry import TOUCH
from conveyor_sim.scene.polygons import why_not_simple
from conveyor_sim.scene.problems import Path, Problem
from conveyor_sim.scene.schema import Scene
from conveyor_sim.scene.words import shown


def sensor_problems(scene: Scene) -> list[Problem]:
    """Problems of photo-eyes, zones, counters and indicators."""
    return [*_lines(scene), *_zones(scene), *_indicators(scene)]


def _lines(scene: Scene) -> Iterator[Problem]:
    for field, lines in (("photo_eyes", scene.photo_eyes), ("counters", scene.counters)):
        for name, line in lines.items():
            if math.dist(line.from_, line.to) <= TOUCH:
                yield Problem(
                    (field, name, "to"), f"{shown(line.to)} given, expected a point away from `from` (zero length)"
                )


def _zones(scene: Scene) -> Iterator[Problem]:
    for name, zone in scene.zones.items():
        reason = why_not_simple(zone.region)
        if reason is not None:
            yield Problem(
                ("zones", name, "region"), f"{shown(zone.region)} given, expected a simple polygon ({reason})"
            )


def _indicators(scene: Scene) -> Iterator[Problem]:
    for name, indicator in scene.indicators.items():
        path: Path = ("indicators", name)
        for field, value, section, known in (
            ("counter", indicator.counter, "counters", scene.counters),
            ("belt", indicator.belt, "belts", scene.belts),
            ("zone", indicator.zone, "zones", scene.zones),
            ("downstream", indicator.downstream, "belts", scene.belts),
            ("backup", indicator.backup, "zones", scene.zones),
        ):
            if value is not None and value not in known:
                yield _unknown((*path, field), value, section, known)
        if indicator.downstream == indicator.belt:
            text = f"{shown(indicator.downstream)} given, expected another belt than `belt`"
            yield Problem((*path, "downstream"), text)
        backup = scene.zones.get(indicator.backup) if indicator.backup is not None else None
        if backup is not None and backup.full_at is None:
            yield Problem((*path, "backup"), f"{shown(indicator.backup)} given, expected a zone that has full_at")


def _unknown(path: Path, name: str, section: str, known: Collection[str]) -> Problem:
    return Problem(
        path, f"{shown(name)} given, expected a name from {section}: {', '.join(known) or 'none: there are none'}"
    )
