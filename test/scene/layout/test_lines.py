# SPDX-License-Identifier: Apache-2.0
"""Whole layouts with parameters, drives, cells and devices, and a bottle that travels through one."""

from pathlib import Path

import pytest
from scene.layout.written import HEAD, read

from conveyor_sim.scene import load_scene
from conveyor_sim.simulation import Simulation

FUNNEL = """
parameters: {length: {default: 2.4 m, min: 1 m}, gap: 75 mm}
drives: {m1: {speed: 0.2, acceleration: 0.5}}
conveyors:
  table: {start: [0, 0], heading: 0 deg, path: [{straight: length}], width: 0.6, material: chain, drive: m1}
  lane: {after: table, back: 0.4, path: [{straight: 0.9}, {right: 90 deg, radius: 0.5}, {straight: 1.2}],
    width: 0.09, material: chain, drive: m1, ratio: 2, sections: [{name: z1, to: 1}, {name: z2, ratio: 1.5}]}
guides:
  funnel: {along: [table, lane], material: steel, left: [[0, 0.28], [1.9, gap/2]],
    right: [[0, -0.28], [1.9, -gap/2]], open: {left: [[4, 4.2]]}}
"""
CELL = """
parameters: {rate: {default: 20 000 /h, max: 40 000 /h}}
ports: {in: infeed.start, out: discharge.end}
conveyors:
  infeed: {path: [{straight: 1.5}], width: 0.09, material: chain}
  discharge: {after: infeed, gap: 5 mm, path: [{straight: 1}], width: 0.09, material: chain}
"""
BLOCK = """
cells: {block: {use: cells/filler.yaml, after: lane, set: {rate: 24 000 /h}}}
conveyors:
  lane: {start: [0, 0], path: [{straight: 2}], width: 0.09, material: chain}
  next: {after: block.out, gap: 60 mm, plate: nylon, path: [{straight: 2}], width: 0.09, material: chain,
    guides: {clearance: 75 mm, material: steel}}
machines: {capper: {kind: station, along: next, at: 1, length: 0.08, out: {along: next, at: 1.2}, rate: 6.7 /s}}
photo_eyes: {full: {along: next, at: 0.4}}
"""


def test_a_bottle_is_singled_and_turns_with_the_lane() -> None:
    start = "bottles: [{type: jar, position: [0.2, 0.2]}]\n"
    simulation = Simulation(read(FUNNEL + start))
    simulation.advance(1600)
    bottles = simulation.bottles()
    assert bottles.x[0] == pytest.approx(3.4, abs=0.0075 + 1e-3)  # the gap leaves 7.5 mm on either side
    assert bottles.y[0] < -0.5
    assert bottles.vy[0] == pytest.approx(-0.3, rel=0.05)


def test_a_cell_is_part_of_a_chain_of_conveyors(tmp_path: Path) -> None:
    (tmp_path / "cells").mkdir()
    (tmp_path / "cells" / "filler.yaml").write_text(CELL)
    (tmp_path / "line.yaml").write_text(HEAD + BLOCK)
    scene = load_scene(tmp_path / "line.yaml")
    assert scene.layout is not None
    assert set(scene.belts) == {"block_infeed", "block_discharge", "lane", "next"}
    assert scene.layout.conveyors["next"].route.start.x == pytest.approx(2 + 1.5 + 0.005 + 1 + 0.06, abs=1e-12)
    assert scene.photo_eyes["full"].from_[0] == pytest.approx(4.965, abs=1e-12)
