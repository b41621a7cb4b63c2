# SPDX-License-Identifier: Apache-2.0
"""Changeover to another format in a run: the commands that set its speeds, rates, bottle types and guides."""

from collections.abc import Iterator
from contextlib import suppress
from typing import Any

from conveyor_sim.errors import SceneError
from conveyor_sim.scene.difference import scene_difference
from conveyor_sim.scene.load import chosen_data, parse_again
from conveyor_sim.scene.overrides import parse_overrides
from conveyor_sim.scene.parts.infeed import Infeed
from conveyor_sim.scene.parts.source import Source
from conveyor_sim.scene.problems import Path, dotted
from conveyor_sim.scene.schema import Scene
from conveyor_sim.scene.words import shown


def changeover(scene: Scene, format: str) -> dict[str, float]:
    """Return commands by name that set speeds, rates, bottle types and guides of a running line to a format.

    They set everything in which the formats differ, so they do not depend on the format that the line has now.
    Raise SceneError, in one sentence, for an unknown format, and for one that differs in other fields.
    """
    target = _in_format(scene, format)
    formats = chosen_data(scene.source_text, scene.source_name, parse_overrides(scene.overrides_text))["formats"]
    versions = [dict(_changeable(scene))]
    for name in formats:
        with suppress(SceneError):  # a line can't be in a format that is invalid
            versions.append(dict(_changeable(_in_format(scene, name))))
    other = scene_difference(_without_changes(scene, target), target)
    if other is not None:
        field, now, then = other
        raise SceneError(
            f"{scene.source_name}: formats.{format}: changes {field} from {now} to {then}, expected only speeds, "
            "rates, bottle types and settings of guides in a run: choose it at the start"
        )
    wanted = dict(_changeable(target))
    changed = [path for path, value in wanted.items() if any(version.get(path) != value for version in versions)]
    return dict(_command(scene, format, path, wanted[path]) for path in changed)


def _in_format(scene: Scene, format: str) -> Scene:
    overrides = {**parse_overrides(scene.overrides_text), "format": format}
    return parse_again(scene.source_text, scene.source_name, overrides)


def _changeable(scene: Scene) -> Iterator[tuple[Path, Any]]:
    """Yield the fields that commands can change, with their values."""
    for name, drive in scene.drives.items():
        yield ("drives", name, "speed"), drive.speed
    for name, belt in scene.belts.items():
        if not belt.has_foreign_drive:
            yield ("belts", name, "speed"), belt.speed
    for name, guide in scene.adjustable.items():
        yield ("adjustable", name, "setting"), guide.setting
    for path, part in scene.devices():
        if (rate := getattr(part, "rate", None)) is not None:
            yield (*path, "rate"), rate
        if isinstance(part, (Infeed, Source)):
            yield (*path, "bottle"), part.bottle


def _without_changes(scene: Scene, target: Scene) -> Scene:
    """Return the scene with the fields of the target that commands can change.

    The speed at which bottles enter follows that of their belt. It is not changed in a run, which is of no consequence
    for bottles that come at a rate.
    """
    update: dict[str, dict[str, Any]] = {}
    for field, parts in scene.named().items():
        others = getattr(target, field)
        update[field] = {name: _taken(part, others[name]) if name in others else part for name, part in parts.items()}
    return scene.model_copy(update=update)


def _taken(part: Any, other: Any) -> Any:
    fields = {
        "drive": ("speed",),
        "belt": ("speed",),
        "adjustable": ("setting",),
        "infeed": ("rate", "bottle", "speed") if getattr(part, "gap", None) is None else ("bottle",),
        "source": ("rate", "bottle", "speed"),
        "sink": ("rate",),
        "station": ("rate",),
    }.get(getattr(part, "KIND", ""), ())
    if type(part) is not type(other):
        return part
    return part.model_copy(update={name: getattr(other, name) for name in fields})


def _command(scene: Scene, format: str, path: Path, value: Any) -> tuple[str, float]:
    """Return the command for a field of the expanded scene. Raise SceneError if the scene declares none."""
    field, name, what = map(str, path)
    part = getattr(scene, field)[name]
    place = f"{scene.source_name}: formats.{format}: {dotted(path)}: {shown(value)} given, expected"
    if what == "speed":
        return f"{field}/{name}/cmd_speed", value
    if what == "setting":
        return f"{field}/{name}/cmd_setting", float(value)
    if what == "rate":
        most = part.rate_limit if isinstance(part, Infeed) or part.rate_limit is not None else part.rate
        if most is None or value > most:
            raise SceneError(f"{place} a rate_limit of at least {value:g} (1/s), which allows the command")
        return f"{field}/{name}/rate", value
    if value not in part.types:
        raise SceneError(f"{place} it in the list types, which allows the command cmd_bottle")
    return f"{field}/{name}/cmd_bottle", float(part.types.index(value))
