# SPDX-License-Identifier: Apache-2.0
"""All pictures of a recording say which signals were forced in it, and none says so where none was."""

from pathlib import Path

from bag.small_line import SMALL_LINE, record
from bag.test_hands import INPUTS, play

from conveyor_sim.bag.reader import open_bag
from conveyor_sim.report.figures import style
from conveyor_sim.report.figures.draw import figures_of
from conveyor_sim.scene import load_scene
from conveyor_sim.simulation import Simulation


def notes(bag: Path) -> set[str]:
    with open_bag(bag) as opened, style.look():
        figures = {name: draw() for name, draw in figures_of(opened, None, None).items()}
    assert len(figures) > 3
    return {figure.get_supxlabel() for figure in figures.values()}


def test_forced_signals_are_named(tmp_path: Path) -> None:
    sim = Simulation(load_scene(SMALL_LINE))
    play(sim, tmp_path / "whole", 30)
    assert notes(tmp_path / "whole") == {"forced: outfeeds/exit/removed, belts/straight/speed"}
    sim = Simulation(load_scene(SMALL_LINE))
    sim.advance(10)
    for given in INPUTS[10]:
        sim.give(given)
    sim.advance()
    play(sim, tmp_path / "later", 20)  # forced before it began
    assert notes(tmp_path / "later") == {"forced: belts/straight/speed, outfeeds/exit/removed"}


def test_nothing_is_said_where_nothing_was_forced(tmp_path: Path) -> None:
    record(load_scene(SMALL_LINE), tmp_path / "kept", 20)
    assert notes(tmp_path / "kept") == {""}
