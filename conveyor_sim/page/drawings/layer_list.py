# SPDX-License-Identifier: Apache-2.0
"""Content of each layer of a drawing, as a map of layers to start from."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterator
from typing import Any, Final

from conveyor_sim.page.drawings.scene_text import key_in_yaml
from conveyor_sim.scene.words import some_of
from conveyor_sim.support.printable import printable

_TEXT: Final = 24
"""Largest number of characters of a text of the drawing."""


def map_lines(document: Any) -> Iterator[str]:
    """Yield a map in which every used layer is ignored, with the content of each layer as a comment."""
    kinds: dict[str, Counter[str]] = defaultdict(Counter)
    texts: dict[str, list[str]] = defaultdict(list)
    for entity in document.modelspace():
        layer, kind = entity.dxf.get("layer", "0"), entity.dxftype()
        if kind == "INSERT":
            tags = [printable(attribute.dxf.tag, _TEXT) for attribute in entity.attribs]
            marked = f" with {', '.join(tags)}" if tags else ""
            kind = f"block {printable(entity.dxf.get('name', '?'), _TEXT)}{marked}"
        elif kind in ("TEXT", "MTEXT"):
            text = entity.plain_text() if kind == "MTEXT" else entity.dxf.text
            texts[layer].append(printable(" ".join(text.split()), _TEXT))
            kind = "text"
        kinds[layer][kind] += 1
    for layer in sorted(kinds):
        content = [f"{count} {kind}" for kind, count in kinds[layer].items() if kind != "text"]
        if texts[layer]:
            content.append(f"{len(texts[layer])} text: {some_of(texts[layer])}")
        yield f"{key_in_yaml(layer)}: {{as: ignore}}  # {'; '.join(content)}"
