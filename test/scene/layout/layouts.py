# SPDX-License-Identifier: Apache-2.0
"""Random layouts for property tests, and the same layouts turned and mirrored."""

from __future__ import annotations

import math
from typing import Any

from hypothesis import strategies as st

from conveyor_sim.scene.layout.expand import Expansion, expand

Data = dict[str, Any]


def expanded(**fields: Any) -> Expansion:
    """The expansion of a layout without problems."""
    expansion = expand(fields)
    assert expansion.problems == []
    return expansion


def _sizes(low: float, high: float) -> st.SearchStrategy[float]:
    return st.integers(round(1000 * low), round(1000 * high)).map(lambda mm: mm / 1000)


@st.composite
def paths(draw: st.DrawFn) -> list[Data]:
    """Two to five pieces."""
    moves = []
    for _ in range(draw(st.integers(2, 5))):
        if draw(st.booleans()):
            moves.append({"straight": draw(_sizes(0.2, 1.5))})
        else:
            angle = math.radians(draw(st.sampled_from([20, 30, 45, 90, 135])))
            moves.append({draw(st.sampled_from(["left", "right"])): angle, "radius": draw(_sizes(0.5, 1.0))})
    return moves


@st.composite
def layouts(draw: st.DrawFn) -> Data:
    """Up to four conveyors that follow each other or are beside each other, with lanes, sections and guides."""
    conveyors: dict[str, Data] = {}
    guides: dict[str, Data] = {}
    for index in range(draw(st.integers(1, 4))):
        conveyor: Data = {"path": draw(paths()), "material": "chain", "speed": draw(_sizes(0.1, 0.8))}
        if index == 0:
            conveyor |= {"start": [draw(_sizes(-3, 3)), draw(_sizes(-3, 3))], "heading": draw(_sizes(-3, 3))}
        elif draw(st.booleans()):
            conveyor |= {"after": f"c{index - 1}"}
            if draw(st.booleans()):
                conveyor |= {"gap": draw(_sizes(0.01, 0.1)), "plate": "nylon", "offset": draw(_sizes(-0.1, 0.1))}
            else:
                conveyor |= {"back": draw(_sizes(0.0, 0.15))}
        else:
            side = draw(st.sampled_from(["left", "right"]))
            conveyor |= {"beside": f"c{index - 1}", "side": side, "gap": draw(_sizes(0.001, 0.02))}
            if "straight" in conveyor["path"][0] and "straight" in conveyors[f"c{index - 1}"]["path"][0]:
                conveyor["plate"] = "nylon"
        if draw(st.booleans()):
            conveyor["width"] = draw(_sizes(0.2, 0.6))
        else:
            widths = draw(st.lists(_sizes(0.1, 0.25), min_size=2, max_size=3))
            conveyor["lanes"] = [{"width": width, "ratio": 1 + 0.25 * place} for place, width in enumerate(widths)]
        if draw(st.booleans()):
            conveyor["sections"] = [{"name": "a", "to": draw(_sizes(0.1, 0.35))}, {"name": "b", "speed": 0.3}]
        if draw(st.booleans()):
            conveyor["guides"] = {"clearance": draw(_sizes(0.1, 0.4)), "material": "steel"}
        else:
            left, right = draw(_sizes(0.05, 0.2)), draw(_sizes(-0.2, -0.05))
            guides[f"g{index}"] = {"along": f"c{index}", "material": "steel", "left": [[0, left]]}
            guides[f"g{index}"] |= {"right": [[0.05, right]], "open": {"left": [[0.1, 0.15]]}}
        conveyors[f"c{index}"] = conveyor
    return {"conveyors": conveyors, "guides": guides}


def turned(layout: Data, angle: float, shift: tuple[float, float]) -> Data:
    """A layout that is turned about the origin and shifted."""
    cos, sin = math.cos(angle), math.sin(angle)

    def each(conveyor: Data) -> Data:
        if "start" not in conveyor:
            return conveyor
        x, y = conveyor["start"]
        start = [cos * x - sin * y + shift[0], sin * x + cos * y + shift[1]]
        return {**conveyor, "start": start, "heading": conveyor["heading"] + angle}

    return {**layout, "conveyors": {name: each(conveyor) for name, conveyor in layout["conveyors"].items()}}


def mirrored(layout: Data) -> Data:
    """A layout that is mirrored at the x-axis."""
    return {
        "conveyors": {name: _mirrored_conveyor(conveyor) for name, conveyor in layout["conveyors"].items()},
        "guides": {name: _mirrored_guide(guide) for name, guide in layout["guides"].items()},
    }


_OTHER = {"left": "right", "right": "left"}


def _mirrored_conveyor(conveyor: Data) -> Data:
    result = {
        **conveyor,
        "path": [{_OTHER.get(key, key): size for key, size in move.items()} for move in conveyor["path"]],
    }
    if "start" in conveyor:
        x, y = conveyor["start"]
        result |= {"start": [x, -y], "heading": -conveyor["heading"]}
    if "offset" in conveyor:
        result["offset"] = -conveyor["offset"]
    if "side" in conveyor:
        result["side"] = _OTHER[conveyor["side"]]
    if "lanes" in conveyor:
        result["lanes"] = conveyor["lanes"][::-1]
    return result


def _mirrored_guide(guide: Data) -> Data:
    result = {key: value for key, value in guide.items() if key not in _OTHER}
    for side, other in _OTHER.items():
        if side in guide:
            result[other] = [[s, -offset] for s, offset in guide[side]]
    result["open"] = {_OTHER[side]: ranges for side, ranges in guide["open"].items()}
    return result
