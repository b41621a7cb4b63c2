"""Underlay of a figure: an image or a drawing below belts and rails."""

from __future__ import annotations

import io
import math
import warnings
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.image import imread
from matplotlib.transforms import Affine2D

from conveyor_sim.page.drawings.underlay import ShownUnderlay
from conveyor_sim.scene.underlay import underlay_bytes

Z_UNDERLAY: Final = 0.5
_LINE: Final = "#616e7c"


def draw_underlay(ax: Axes, underlay: ShownUnderlay) -> None:
    """Draw an underlay. An image that can't be decoded is left out."""
    (x, y), angle = underlay.position, underlay.angle
    if underlay.lines:
        cos, sin = math.cos(angle), math.sin(angle)
        turn = np.array([[cos, sin], [-sin, cos]])
        lines = [np.asarray(line) @ turn + [x, y] for line in underlay.lines]
        collection = LineCollection(
            lines, colors=_LINE, linewidths=0.6, alpha=underlay.opacity, zorder=Z_UNDERLAY, gid="underlay"
        )
        ax.add_collection(collection, autolim=False)
    if underlay.image:
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error")  # an image that would take gigabytes
                pixels = imread(io.BytesIO(underlay_bytes(underlay.image)), format=_format(underlay.image))
        except (OSError, ValueError, SyntaxError, Warning):
            return
        height, width = pixels.shape[:2]
        extent = (x, x + width * underlay.pixel, y, y + height * underlay.pixel)
        image = ax.imshow(
            pixels,
            extent=extent,
            alpha=underlay.opacity,
            zorder=Z_UNDERLAY,
            cmap="gray",
            aspect="equal",
            gid="underlay",
        )
        image.set_transform(Affine2D().rotate_around(x, y, angle) + ax.transData)


def _format(url: str) -> str:
    return "png" if url.startswith("data:image/png") else "jpeg"
