# SPDX-License-Identifier: Apache-2.0
"""Accumulation as a layout: a bidirectional store returns the last bottle first, a spiral the first one."""

import math
import re
from pathlib import Path

import numpy as np
import pytest

from conveyor_sim.scene import parse_scene
from conveyor_sim.simulation import Simulation

PAGE = Path(__file__).resolve().parents[3] / "docs" / "parts" / "accumulation.md"
DIAMETER = 0.066


def line(without: str) -> Simulation:
    """Return the line of the docs page without one of its infeeds."""
    match = re.search(r"^```yaml\n(name: .*?)^```$", PAGE.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE)
    assert match is not None
    text = re.sub(rf"^  {without}: \{{along: [a-z]+, at: 0.05, .*\n", "", match[1], flags=re.MULTILINE)
    return Simulation(parse_scene(text))


def signal(sim: Simulation, name: str) -> float:
    return float(sim.signals()[sim.process_image.signal_names.index(name)])


def leaving(sim: Simulation, ticks: int) -> list[int]:
    """Return the ids of bottles in the order in which they leave within a number of ticks."""
    gone: list[int] = []
    before = set(sim.bottles().id.tolist())
    for _ in range(ticks):
        sim.advance(1)
        now = set(sim.bottles().id.tolist())
        gone += sorted(before - now)
        before = now
    return gone


def test_a_bidirectional_store_returns_the_last_bottle_first() -> None:
    sim = line("washer")
    sim.advance(1200)
    bottles = sim.bottles()
    assert signal(sim, "pushers/into_store/strokes") == 5
    assert (bottles.y > 0.045).all() and bottles.id.size == 5
    # The first bottle is farthest from the lane.
    assert np.argsort(-bottles.y).tolist() == np.argsort(bottles.id).tolist()
    stored = sorted(bottles.id.tolist())
    sim.command(["pushers/into_store/auto", "gates/back_stop/open"], [0, 1])
    sim.advance(50)
    sim.command(["belts/store/cmd_speed"], [-0.3])
    assert leaving(sim, 1500) == stored[::-1]


def test_a_spiral_returns_bottles_in_their_order() -> None:
    """Full, it holds its length over the diameter, within the free place between guides that a queue bends into."""
    sim = line("filler")
    sim.advance(3000)
    length = 1.5 + math.pi * (0.5 + 0.4 + 0.3 + 0.2)
    held = signal(sim, "zones/level/bottles")
    assert held == pytest.approx((length - 0.1 - 0.05) / DIAMETER, rel=0.05)
    assert signal(sim, "outfeeds/filler/removed") == 0
    stored = sorted(sim.bottles().id.tolist())
    sim.command(["gates/release/open"], [1])
    gone = leaving(sim, 1500)
    assert len(gone) > 0.5 * held
    assert gone == sorted(gone) and gone == stored[: len(gone)]
