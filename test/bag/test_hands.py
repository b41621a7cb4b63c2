# SPDX-License-Identifier: Apache-2.0
"""Modes, owners and forces in a recording: replayed bit for bit, and forced counters do not falsify its summary."""

import shutil
from pathlib import Path

import pytest
from bag.small_line import SMALL_LINE, SPEED, TURN

from conveyor_sim.bag.input_log import START_NAME
from conveyor_sim.bag.outputs import OutputWriter
from conveyor_sim.bag.reader import open_bag
from conveyor_sim.bag.recorder import Recorder
from conveyor_sim.bag.replay import replay
from conveyor_sim.columns.image import Image
from conveyor_sim.line.commands.inputs import DISOWN, FORCE, MODE, OWN, SET, UNFORCE, Input
from conveyor_sim.report.summarize import summarize
from conveyor_sim.scene import load_scene
from conveyor_sim.simulation import Simulation

STRAIGHT = "belts/straight"


def given(kind: str, operation: str, names: tuple[str, ...], values: tuple[float, ...], *texts: str) -> Input:
    return Input("here", f"{kind} 1", kind, operation, names, values, texts)


INPUTS = {
    5: [given("operator", MODE, (STRAIGHT,), (3.0,)), given("operator", SET, (SPEED,), (0.1,))],
    10: [given("engineer", FORCE, ("outfeeds/exit/removed", f"{STRAIGHT}/speed"), (700.0, 9.0))],
    20: [given("operator", MODE, (STRAIGHT,), (1.0,)), given("controller", OWN, (), (), "belts/turn")],
    40: [given("engineer", UNFORCE, (f"{STRAIGHT}/speed",), ()), given("controller", DISOWN, (), ())],
}
"""By tick; a controller of another name commands both belts at every tick."""


def play(simulation: Simulation, folder: Path, last: int) -> None:
    """Run on to a tick and record that."""
    with Recorder(folder) as recorder:
        outputs = OutputWriter(simulation, [recorder], run_id="run", frame_id="hall")
        outputs.start()
        while simulation.tick < last:
            for one in INPUTS.get(simulation.tick, []):
                simulation.give(one)
            simulation.command([SPEED, TURN], [0.3, 0.4])
            simulation.advance()
            outputs.after_tick()


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Simulation]:
    folder = tmp_path_factory.mktemp("hands") / "whole"
    simulation = Simulation(load_scene(SMALL_LINE))
    play(simulation, folder, 60)
    return folder, simulation


def test_it_replays_bit_for_bit(whole: tuple[Path, Simulation]) -> None:
    report = replay(whole[0])
    assert report.difference is None and report.exact
    with open_bag(whole[0]) as bag:
        outcomes = [(frame.tick, frame.data) for frame in bag.outcomes()]
    assert report.compared["outcomes"] == len(outcomes)
    refused = {tick: outcome.names for tick, outcome in outcomes if not outcome.accepted}
    assert refused == dict.fromkeys(range(5, 40), (SPEED,))  # of an operator, then of the owner


def test_from_a_checkpoint_too(whole: tuple[Path, Simulation], tmp_path: Path) -> None:
    first = Simulation(load_scene(SMALL_LINE))
    play(first, tmp_path / "first", 30)
    first.save(tmp_path / "kept.npz")
    second = Simulation.load(tmp_path / "kept.npz")
    second.take_events()
    play(second, tmp_path / "second", 60)
    assert second.full_state_hash() == whole[1].full_state_hash()
    assert second.line.signals().values.tolist() == whole[1].line.signals().values.tolist()
    shutil.copyfile(tmp_path / "kept.npz", tmp_path / "second" / START_NAME)
    assert replay(tmp_path / "second").difference is None
    with open_bag(whole[0]) as bag, open_bag(tmp_path / "second") as later:
        assert [f.data for f in bag.outcomes() if f.tick >= 30] == [f.data for f in later.outcomes()]


def test_forced_signals_are_marked_with_what_is_true(whole: tuple[Path, Simulation]) -> None:
    with open_bag(whole[0]) as bag:
        names = list(bag.line.signal_names)
        images = {frame.tick: Image(*(getattr(frame.data, name) for name in ("values", "forced", "actual")))
                  for frame in bag.messages("signals")}  # fmt: skip
    removed, speed = names.index("outfeeds/exit/removed"), names.index(f"{STRAIGHT}/speed")
    assert not images[10].forced.size
    assert images[11].forced.tolist() == sorted([removed, speed])
    assert (images[11].values[speed], images[11].truth[speed]) == (9.0, 0.1)
    assert images[41].forced.tolist() == [removed] and images[41].values[removed] == 700.0
    assert images[60].truth[removed] == whole[1].counts.removed


def test_a_forced_counter_does_not_falsify_the_summary(whole: tuple[Path, Simulation]) -> None:
    summary = summarize(whole[0])
    counts = whole[1].counts
    bottles = summary.bottles
    assert (bottles.fed, bottles.removed, bottles.present) == (counts.fed, counts.removed, counts.present)
