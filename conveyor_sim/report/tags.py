"""The tags of a scene, as a table or as CSV."""

from __future__ import annotations

import csv
import io
from typing import NamedTuple

from rich.box import SIMPLE
from rich.console import RenderableType
from rich.table import Table

from conveyor_sim.line.line import image_of
from conveyor_sim.line.machines.weihenstephan import names_of
from conveyor_sim.line.tag import MOST_COUNT, Tag
from conveyor_sim.scene import Scene

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


def tag_table(scene: Scene) -> RenderableType:
    """For a terminal; what else is known is in `tag_csv`."""
    table = Table(box=SIMPLE, pad_edge=False, caption=scene.where or None, caption_justify="left", leading=1)
    table.add_column("tag", overflow="fold", ratio=1)
    for head in ("role", "range", "initial", "unit", "UNECE"):
        table.add_column(head, no_wrap=True)
    for tag in line_tags(scene):
        told = [f"{tag.name}\n  {tag.description}"]
        told += [f"  {tag.listed_texts}"] if tag.texts else []
        told += [] if tag.nominal is None else [f"  Nominal: {tag.nominal:g}."]
        table.add_row("\n".join(told), tag.role, _range(tag), f"{tag.initial:g}", tag.unit, tag.unece.code)
    return table


def _range(tag: Tag) -> str:
    if tag.kind == "bool":
        return "0, 1"
    most = "" if tag.high == MOST_COUNT else f"{tag.high:.4g}"
    least = "" if tag.low == -MOST_COUNT else f"{tag.low:.4g}"
    return f"{least} ... {most}".strip()


def tag_csv(scene: Scene) -> str:
    """Return one CSV line per tag, below a header."""
    text = io.StringIO(newline="")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(TagRow._fields)
    writer.writerows(tag_rows(scene))
    return text.getvalue()
