# SPDX-License-Identifier: Apache-2.0
"""The tags of a scene, selected by name and kind, as a listing, as CSV or for JSON."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Sequence
from fnmatch import fnmatchcase
from typing import NamedTuple, get_args

from conveyor_sim.errors import ConveyorError
from conveyor_sim.line.line import image_of
from conveyor_sim.line.machines.weihenstephan import names_of
from conveyor_sim.line.tag import MOST_COUNT, Kind, Role, Tag
from conveyor_sim.report.listing import ListingRow, listing, matches
from conveyor_sim.scene import Scene
from conveyor_sim.support.printable import printable

KINDS: tuple[str, ...] = (*get_args(Role), *get_args(Kind))
"""Roles and data types."""

NONE = "-"
"""Placeholder for an absent property: no nominal rate, no texts, no name in another standard."""


class TagRow(NamedTuple):
    """Properties of a tag as texts; none is empty."""

    path: str
    """Its name below the path of the line in the plant (`where`)."""
    tag: str
    kind: str
    role: str
    unit: str
    unece: str
    """Code of the unit."""
    low: str
    high: str
    initial: str
    nominal: str
    texts: str
    device: str
    device_class: str
    description: str
    weihenstephan: str
    """Data points of the Weihenstephan Standards that are made from it."""


def line_tags(scene: Scene) -> tuple[Tag, ...]:
    """Return all tags of a scene's line, in listing order."""
    return image_of(scene).tags


def tag_rows(scene: Scene) -> list[TagRow]:
    """Return one row per tag, in the order of the process image."""
    return [_row(tag, scene.where) for tag in line_tags(scene)]


def _row(tag: Tag, where: str) -> TagRow:
    return TagRow(
        f"{where}/{tag.name}".lstrip("/"),
        tag.name,
        tag.kind,
        tag.role,
        tag.unit,
        tag.unece.code,
        _limit(tag, tag.low),
        _limit(tag, tag.high),
        f"{tag.initial:.15g}",
        NONE if tag.nominal is None else f"{tag.nominal:.15g}",
        tag.listed_texts or ("0 off, 1 on" if tag.kind == "bool" else NONE),
        tag.device,
        tag.device_class,
        tag.description,
        ", ".join(names_of(tag)) or NONE,
    )


def _limit(tag: Tag, value: float) -> str:
    return f"{value:.0f}" if tag.kind == "count" else f"{value:.15g}"


def chosen_tags(
    scene: Scene, names: Sequence[str] = (), kinds: Sequence[str] = (), added: Sequence[Tag] = ()
) -> list[Tag]:
    """Return the tags of a scene's line that fit, in listing order.

    added: alarms of a controller, listed behind those of the line. names, kinds: patterns (`belts/*`), one of which
    must match the name, and the role or the data type; empty: all.
    Raise ConveyorError for a pattern that matches no role and no data type.
    """
    for kind in kinds:
        if not any(fnmatchcase(known, kind) for known in KINDS):
            expected = f"one of {', '.join(KINDS)}, or a pattern with *"
            raise ConveyorError(f"--kind: {printable(kind)} given, expected {expected}")
    own = line_tags(scene)
    end = max((place + 1 for place, tag in enumerate(own) if tag.role == "alarm"), default=len(own))
    return [
        tag
        for tag in (*own[:end], *added, *own[end:])
        if matches(tag.name, names) and (matches(tag.role, kinds) or matches(tag.kind, kinds))
    ]


def tag_listing(tags: Sequence[Tag], width: int | None) -> list[str]:
    """Return the lines for a terminal; `tag_csv` has all properties. width: see `report.listing.listing`."""
    if not tags:
        return ["no such tag"]
    records = [
        ListingRow((tag.name, tag.role, _range(tag), tag.unit, f"{tag.initial:g}"), _description(tag)) for tag in tags
    ]
    return listing(("tag", "role", "range", "unit", "initial", "description"), records, width)


def tag_objects(scene: Scene, tags: Sequence[Tag]) -> Iterator[dict[str, object]]:
    """Yield the properties of tags with numbers as numbers, for JSON. Absent properties are None."""
    for tag in tags:
        row = _row(tag, scene.where)._asdict()
        texts = {str(value): text for value, text in tag.texts.items()}
        numbers = {"low": tag.low, "high": tag.high, "initial": tag.initial, "nominal": tag.nominal}
        yield {**{name: None if text == NONE else text for name, text in row.items()}, **numbers, "texts": texts}


def _description(tag: Tag) -> str:
    texts = f" {tag.listed_texts}." if tag.texts else ""
    nominal = "" if tag.nominal is None else f" Nominal: {tag.nominal:g}."
    return f"{tag.description}{texts}{nominal}"


def _range(tag: Tag) -> str:
    if tag.kind == "bool":
        return "0, 1"
    most = "" if tag.high == MOST_COUNT else f"{tag.high:.4g}"
    least = "" if tag.low == -MOST_COUNT else f"{tag.low:.4g}"
    return f"{least} ... {most}".strip()


def tag_csv(scene: Scene, tags: Sequence[Tag]) -> str:
    """Return one CSV line per tag, below a header."""
    text = io.StringIO(newline="")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(TagRow._fields)
    writer.writerows(_row(tag, scene.where) for tag in tags)
    return text.getvalue()
