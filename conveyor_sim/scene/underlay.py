# SPDX-License-Identifier: Apache-2.0
"""Underlays of a scene file: an image or a drawing that is shown below the plan."""

import base64
from pathlib import PurePath
from typing import Annotated

from annotated_types import Len

from conveyor_sim.scene.beside import Beside
from conveyor_sim.scene.part import Part
from conveyor_sim.scene.types import Angle, Point, Positive, Says, Share, quantity
from conveyor_sim.scene.words import shown
from conveyor_sim.support.files import MB

_MOST_BYTES = 4 * MB
_KINDS = {".png": "image/png", ".jpg": "image/jpeg", ".jpeg": "image/jpeg", ".dxf": "image/vnd.dxf"}
"""Media types by suffix."""
_STORED = b"data:"
"""Start of the content that a recording holds."""


class Underlay(Part):
    """An image or a drawing below the plan on pictures and on the page. Nothing that is simulated depends on it."""

    file: Annotated[str, Len(1, 1000), Says("a path of a PNG, JPEG or DXF file")] = quantity(
        "PNG, JPEG or DXF file in the scene's folder, of at most 4 MB. DXF needs ezdxf."
    )
    position: Point = quantity(
        "Position of the lower left corner of an image, or of the origin of a drawing.", "m", default=(0.0, 0.0)
    )
    scale: Positive | None = quantity(
        "Size of a pixel of an image, or of the unit of a drawing. Left out: 1 mm for an image, and the unit that a "
        "drawing states.",
        "m",
        default=None,
    )
    angle: Angle = quantity("Angle by which it is turned about `position`, counter-clockwise.", "rad", default=0.0)
    opacity: Share = quantity("From 0, invisible, to 1, opaque.", "1", default=0.5)


def read_underlay(underlay: Underlay, beside: Beside) -> tuple[str, str]:
    """Return the content of an underlay as a data URL, and the reason why there is none; one of them is "".

    A scene whose underlay can't be read runs all the same.
    """
    kind = _KINDS.get(PurePath(underlay.file).suffix.lower())
    if kind is None:
        return "", f"{shown(underlay.file)} given, expected a PNG, JPEG or DXF file"
    try:
        content, _ = beside.read(underlay.file, _MOST_BYTES * (2 if beside.stored else 1), "a PNG, JPEG or DXF file")
    except ValueError as error:
        return "", f"{shown(underlay.file)} given, {error}"
    # It may be binary, and the files that were used are stored as texts.
    beside.used.pop(underlay.file, None)
    if content.startswith(_STORED):
        return content.decode(), ""
    return f"data:{kind};base64,{base64.b64encode(content).decode()}", ""


def underlay_bytes(url: str) -> bytes:
    """Return the content of a data URL. Raise ValueError if it is invalid."""
    head, comma, text = url.partition(",")
    if not comma or not head.endswith(";base64"):
        raise ValueError("no data URL in base64")
    return base64.b64decode(text, validate=True)
