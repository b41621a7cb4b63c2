# SPDX-License-Identifier: Apache-2.0
"""What a run amounts to, counted from its bag."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bag.editing import edited
from bag.small_line import SMALL_LINE, record
from facts import missing
from rich.console import Console
from scenes import NO_OUTPUTS, bottle, scene
from swept import fields

from conveyor_sim.bag.outputs import OutputWriter
from conveyor_sim.bag.reader import open_bag
from conveyor_sim.bag.recorder import Recorder
from conveyor_sim.line.commands.authority import AUTOMATIC, MANUAL
from conveyor_sim.line.commands.inputs import MODE, Input
from conveyor_sim.physics.model import build_model
from conveyor_sim.physics.model.remedies import step_limit
from conveyor_sim.report.alarm_figures import AlarmFigures, Listed
from conveyor_sim.report.figures.recording import Recording
from conveyor_sim.report.labelled import MOST_LINES
from conveyor_sim.report.outline import FILES, outline
from conveyor_sim.report.report import render
from conveyor_sim.report.summarize import summarize
from conveyor_sim.report.summary import LoadHistory, Loop, Summary, Worst, write_summary
from conveyor_sim.run.runner import run_scene
from conveyor_sim.scene import Scene, load_scene, parse_scene
from conveyor_sim.simulation import Simulation

TICKS = 100

THREE_BELTS = """
name: ring
duration: 0.6
tick: 0.01
base:
  - {between: [glass, belt], friction: 0.4}
bottle_types:
  plain: {radius: 0.05, mass: 0.1, material: glass}
belts:
  a: {kind: straight, start: [0, 0], angle: 0, length: 1, width: 0.3, material: belt}
  b: {kind: straight, start: [1, 0], angle: 0, length: 1, width: 0.3, material: belt}
  c: {kind: straight, start: [2, 0], angle: 0, length: 1, width: 0.3, material: belt}
bottles:
  - {type: plain, position: [0.5, 0.15]}
outputs: {bottles: 100, signals: 0}
"""


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The small line."""
    folder = tmp_path_factory.mktemp("summary") / "small"
    record(load_scene(SMALL_LINE), folder, TICKS)
    return folder


def shown(summary: Summary) -> str:
    """The outline, and all details, as on a terminal."""
    lines = outline(summary)
    assert len(lines) <= MOST_LINES - FILES
    console = Console(width=200)
    with console.capture() as captured:
        console.print(render(summary))
    return "\n".join([*lines, captured.get()])


def test_counts_are_those_of_the_simulation(tmp_path: Path) -> None:
    simulation = record(load_scene(SMALL_LINE), tmp_path / "bag", TICKS)
    summary = summarize(tmp_path / "bag", wall=0.5)
    assert summary.simulated == pytest.approx(1.0)
    assert summary.real_time_factor == pytest.approx(2.0)
    counts = simulation.counts
    assert summary.bottles.fed == counts.fed > 0
    assert summary.bottles.removed == counts.removed > 0
    assert (summary.bottles.present, summary.bottles.held) == (counts.present, counts.held)
    on_belts = sum(flow.bottles for flow in summary.belts.values())
    assert on_belts + summary.on_floor == summary.bottles.present
    assert (summary.commands, summary.refused) == (5, 2)


def test_a_long_hold_is_one_occasion(tmp_path: Path) -> None:
    """A controller commands a belt in every scan that an operator holds, twice; a bad value beside that is a third."""
    simulation = Simulation(load_scene(SMALL_LINE))
    speed, device = "belts/straight/cmd_speed", "belts/straight"
    with Recorder(tmp_path / "bag") as recorder:
        outputs = OutputWriter(simulation, [recorder], run_id="run")
        outputs.start()
        for tick in range(60):
            if tick % 20 == 0:
                mode = MANUAL if tick % 40 == 0 else AUTOMATIC
                simulation.give(Input("operate", "Jo", "operator", MODE, (device,), (float(mode),)))
            simulation.command((speed,), (1e9 if tick == 30 else 0.2,))
            simulation.advance()
            outputs.after_tick()
    summary = summarize(tmp_path / "bag")
    assert (summary.commands, summary.refused, summary.occasions) == (63, 41, 3)
    assert "63 recorded, 41 refused on 3 occasions" in shown(summary)


def test_forces_are_of_all_recorded_peaks(bag: Path) -> None:
    with open_bag(bag) as opened:
        peaks = np.concatenate([frame.data.peak_force for frame in opened.bottles()])
    summary = summarize(bag)
    assert summary.peak_force == peaks.max() > 0.0
    assert summary.peak_force_99 == np.percentile(peaks[peaks > 0.0], 99.0)


def test_the_prediction_is_told_with_what_was_reached(bag: Path) -> None:
    summary = summarize(bag)
    model = build_model(load_scene(SMALL_LINE))
    assert summary.setting == f"leapfrog, dt = 100 us: {model.dt_reason}"
    assert summary.predicted == model.prediction.sentence
    assert summary.achieved is not None
    assert summary.achieved.peak_force == summary.peak_force
    assert summary.achieved.expected_force == model.prediction.force


def test_a_recording_is_told_the_errors_of_the_steps_it_ran_with(bag: Path, tmp_path: Path) -> None:
    def lengthen(topic: str, message: Any) -> None:
        if topic == "line":
            message.integrator, message.steps_per_tick = "leapfrog", 20

    ran = {"accuracy": {"integrator": "leapfrog", "per_tick": 20}}
    summary = summarize(edited(bag, tmp_path / "older", lengthen))
    assert summary.predicted == build_model(load_scene(SMALL_LINE, ran)).prediction.sentence
    assert summary.predicted != summarize(bag).predicted
    assert summary.limit is None


def test_a_recording_that_this_version_refuses_has_no_prediction(bag: Path, tmp_path: Path) -> None:
    def wrong(topic: str, message: Any) -> None:
        if topic == "line":
            message.integrator = "half_explicit_euler"

    summary = summarize(edited(bag, tmp_path / "foreign", wrong))
    assert summary.predicted is None
    assert summary.achieved is None
    assert summary.peak_force is not None
    assert summary.bottles == summarize(bag).bottles


def test_what_sets_the_steps_is_told(bag: Path, tmp_path: Path) -> None:
    summary = summarize(bag)
    expected = step_limit(load_scene(SMALL_LINE), bottles=summary.bottles.present)
    assert expected.lines != []
    assert summary.limit == expected
    assert json.loads(write_summary(summary, tmp_path).read_text())["steps"] == expected.lines


def test_foreign_text_in_a_recording_is_told_in_printable_words(bag: Path, tmp_path: Path) -> None:
    def forge(topic: str, message: Any) -> None:
        if topic == "line":
            message.scene_name = "plant\nguard  nothing to report\x1b[2J" + "x" * 5000
            message.dt_reason = "\r\x1b]0;title\x07" + "y" * 5_000_000

    summary = summarize(edited(bag, tmp_path / "forged", forge))
    assert summary.scene.isprintable() and len(summary.scene) == 200
    assert summary.setting.isprintable() and len(summary.setting) == 2000


def test_messages_and_bytes_are_counted_by_topic(bag: Path) -> None:
    with open_bag(bag) as opened:
        sizes = [len(data) for topic, _, data in opened.raw() if topic == "contacts"]
    count = summarize(bag).topics["contacts"]
    assert (count.messages, count.bytes) == (len(sizes), sum(sizes))


def ring(scene: Scene, tmp_path: Path, belt_of: Any) -> Path:
    """A recording of one bottle in which `belt_of(tick)` says on which belt it is."""
    record(scene, tmp_path / "still", 60)

    def move(topic: str, message: Any) -> None:
        if topic == "bottles":
            message.belt = np.array([belt_of(message.tick)], dtype=np.int32)

    return edited(tmp_path / "still", tmp_path / "moving", move)


def test_rounds_of_a_loop_are_counted_where_bottles_return(tmp_path: Path) -> None:
    """Once round in 15 ticks: it comes back to `a` at ticks 15, 30, 45 and 60, the last two in the second half."""
    summary = summarize(ring(parse_scene(THREE_BELTS), tmp_path, lambda tick: tick // 5 % 3))
    assert summary.loop is not None
    assert (summary.loop.belt, summary.loop.returns) == ("a", 4)
    assert summary.loop.per_minute == pytest.approx(400.0)
    assert summary.loop.per_minute_second_half == pytest.approx(400.0)
    assert summary.belts["b"].per_minute == pytest.approx(400.0)
    assert summary.bottles.fed == 0


def test_to_and_fro_between_two_belts_is_no_loop(tmp_path: Path) -> None:
    summary = summarize(ring(parse_scene(THREE_BELTS), tmp_path, lambda tick: tick // 5 % 2))
    assert summary.loop is None
    assert summary.belts["a"].per_minute == pytest.approx(600.0)


def test_a_bottle_that_returns_to_its_belt_has_not_come_onto_it_again(tmp_path: Path) -> None:
    """It leaves every belt at tick 20, comes back at tick 30, and changes the belt at tick 40."""
    belts = ring(parse_scene(THREE_BELTS), tmp_path, lambda tick: -1 if 20 <= tick < 30 else tick // 40)
    flow = summarize(belts).belts
    assert (flow["a"].per_minute, flow["b"].per_minute) == (0.0, pytest.approx(100.0))


def test_bottles_of_machines_count_too(tmp_path: Path) -> None:
    """A source and a sink; sums go by what a signal counts, not by its name."""
    buffer_lane = Path(__file__).parents[2] / "config" / "scenarios" / "buffer_lane.yaml"
    simulation = record(load_scene(buffer_lane, {"duration": 5.0}), tmp_path / "bag", 500)
    summary = summarize(tmp_path / "bag")
    assert (summary.bottles.fed, summary.bottles.removed) == (simulation.counts.fed, simulation.counts.removed)
    assert min(simulation.counts.fed, simulation.counts.removed) > 5
    assert summary.bottles.rejected == 0


def test_what_was_not_recorded_is_not_made_up(tmp_path: Path) -> None:
    record(load_scene(SMALL_LINE, {"outputs": {"signals": 0}}), tmp_path / "bag", 10)
    summary = summarize(tmp_path / "bag")
    assert summary.bottles.fed is not None
    assert summary.energy is None
    assert summary.wall is None
    assert summary.real_time_factor is None


def test_a_run_is_as_long_as_its_last_state(tmp_path: Path) -> None:
    """A scene that outputs nothing at its end."""
    scene = load_scene(SMALL_LINE, {"outputs": {"bottles": 0, "signals": 0, "contacts": 0, "counters": 0}})
    done = run_scene(scene.model_copy(update={"duration": 0.37}), tmp_path / "bag")
    assert summarize(tmp_path / "bag").simulated == pytest.approx(done.simulated) == pytest.approx(0.37)


def test_bottles_without_events_are_those_on_the_line(tmp_path: Path) -> None:
    simulation = Simulation(load_scene(SMALL_LINE))
    with Recorder(tmp_path / "bag", topics=["line", "bottles"]) as recorder:
        outputs = OutputWriter(simulation, [recorder], run_id="run")
        outputs.start()
    counts = summarize(tmp_path / "bag").bottles
    assert (counts.initial, counts.fed, counts.removed, counts.rejected, counts.held) == (None,) * 5
    assert missing(counts.sentence, f"{simulation.counts.present} on the line", "not recorded") == []


def test_the_energy_ledger_is_told_with_the_work_of_each_belt(tmp_path: Path) -> None:
    simulation = record(load_scene(SMALL_LINE, {"outputs": {"ledger": 20}}), tmp_path / "bag", TICKS)
    ledger, summary = simulation.ledger(), summarize(tmp_path / "bag")
    assert ledger is not None and summary.energy is not None
    assert summary.energy.belts == dict(zip(["straight", "turn"], ledger.belt_work.tolist(), strict=False))
    assert summary.energy.belts["straight"] > 0.0
    came = sum(summary.energy.belts.values()) + summary.energy.fed + summary.energy.residual
    dissipated = summary.energy.base_friction + summary.energy.contact_friction + summary.energy.damping
    assert came - dissipated - summary.energy.removed == pytest.approx(summary.energy.stored)
    text = shown(summary)
    assert f"% of a turnover of {ledger.turnover:.4g} J" in text
    assert f"{ledger.belt_work[0]:.4g}" in text
    assert json.loads(write_summary(summary, tmp_path).read_text())["energy"]["residual"] == ledger.residual


def test_figures_from_impulses_are_marked(bag: Path, tmp_path: Path) -> None:
    rates = {"bottles": 100, "ledger": 100, "damage": 100}
    bottles = [bottle(0.0, 0.0, 0.5), bottle(0.132, 0.0)]
    record(scene(**fields(bottles=bottles, outputs={**NO_OUTPUTS, **rates})), tmp_path / "bag", 2)
    lines = shown(summarize(tmp_path / "bag")).splitlines()
    assert [line.split()[0] for line in lines if ", from impulses" in line] == ["forces", "damage", "energy"]
    assert "from impulses" not in shown(summarize(bag))


def test_summary_is_written_as_json(bag: Path, tmp_path: Path) -> None:
    summary = summarize(bag, wall=2.0)
    content = json.loads(write_summary(summary, tmp_path).read_text())
    assert content["real_time_factor"] == pytest.approx(0.5)
    assert content["topics"]["bottles"]["messages"] == 51
    assert content["belts"].keys() == {"straight", "turn"}


def test_summary_can_be_read_on_a_terminal(bag: Path) -> None:
    summary = summarize(bag, wall=2.0)
    text = shown(summary)
    bottles = summary.bottles.sentence
    for words in (
        "small_line",
        "peak force of impacts",
        "peak force",
        "0.5 x real time",
        bottles,
        "straight",
        "signals",
        "2 refused",
    ):
        assert words in text


def test_what_is_absent_has_no_line(bag: Path) -> None:
    summary = summarize(bag)
    bare = replace(
        summary, loop=None, peak_force=None, borne=None, alarms=None, commands=0, refused=0, guard={}, achieved=None,
        pressed=None, damage_events={},
    )  # fmt: skip
    assert [line.split()[0] for line in outline(bare)] == ["small_line:", "bottles"]


def test_more_warnings_than_lines_are_counted(bag: Path) -> None:
    """Ten lines are for the outline: what does not fit is behind --details."""
    summary = replace(
        summarize(bag), loop=Loop("straight", 3, 1.0, 1.0), borne=LoadHistory(tipping=Worst(0.5, 3)),
        alarms=AlarmFigures(1, 1.0, 1, {"jam": 1}, [Listed("jam", "error", "", 0.5)], []),
        guard={"soft": 2}, guard_texts=["first"], damage_events={"scuffing": 1}, damage_texts=["bottle 3"],
        commands=9, refused=4,
    )  # fmt: skip
    lines = outline(summary)
    assert len(lines) == MOST_LINES - FILES
    assert missing(lines[-2], ["warning", "guard", "2 x soft", "first"]) == []
    assert missing(lines[-1], ["3 more warnings", "--details"]) == []


def test_bottles_in_stations_are_held_and_counted_once(tmp_path: Path) -> None:
    """Two stations on one belt: counts close at each recorded tick, and a station adds no entry onto its belt."""
    scene = load_scene(Path(__file__).parents[2] / "config" / "scenarios" / "two_stations.yaml")
    simulation = record(scene, tmp_path / "bag", 1500)
    counts = summarize(tmp_path / "bag").bottles
    assert counts.held == simulation.counts.held > 0
    assert counts.fed is not None and counts.removed is not None
    assert counts.fed == counts.removed + counts.present + counts.held
    assert missing(counts.sentence, f"{counts.fed} fed", f"{counts.held} held in machines") == []
    with open_bag(tmp_path / "bag") as bag:
        flow = Recording(bag).flow
    assert flow.fed is not None and flow.removed is not None and flow.held is not None
    assert (flow.fed == flow.removed + flow.present + flow.held).all()
    assert (int(flow.fed[-1]), int(flow.removed[-1])) == (counts.fed, counts.removed)
    assert int(flow.entered[-1].max()) <= counts.fed
