# SPDX-License-Identifier: Apache-2.0
"""Loads of bottles and rails, and exceeded limits, are part of the bag, the summary and the figures."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from physics.test_damage import DRAGGED, HELD, LEFT, LIMITS, OBLIQUE, RIGHT, damage_of, experiments, wear_of
from scenes import NO_OUTPUTS, scene

from conveyor_sim.bag.outputs import OutputWriter
from conveyor_sim.bag.reader import open_bag
from conveyor_sim.bag.recorder import Recorder
from conveyor_sim.bag.replay import replay
from conveyor_sim.report.figures import style
from conveyor_sim.report.figures.damage import bottles_figure, rails_figure
from conveyor_sim.report.figures.data import Damage
from conveyor_sim.report.figures.recording import Recording
from conveyor_sim.report.report import render
from conveyor_sim.report.summarize import summarize
from conveyor_sim.simulation import Simulation


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Simulation]:
    """Half a second of the experiments; without peaks, so that they are compiled once for all their tests."""
    rates = {**NO_OUTPUTS, "damage": 20, "bottles": 20, "signals": 20}
    sim = Simulation(scene(**experiments(outputs=rates, effects={"peaks": "off"}, duration=0.5)))
    path = tmp_path_factory.mktemp("damage") / "bag"
    with Recorder(path) as recorder:
        outputs = OutputWriter(sim, [recorder], run_id="run")
        outputs.start()
        for _ in range(50):
            sim.advance()
            outputs.after_tick()
    return path, sim


def test_a_bag_holds_what_the_simulation_tells(recorded: tuple[Path, Simulation]) -> None:
    path, sim = recorded
    with open_bag(path) as bag:
        damage, wear, events = (list(bag.read(topic)) for topic in ("damage", "rail_wear", "damage_events"))
    assert [frame.tick for frame in damage] == [frame.tick for frame in wear] == list(range(0, 51, 5))
    for then, now in ((damage[-1].data, damage_of(sim)), (wear[-1].data, wear_of(sim))):
        for field in fields(now):
            np.testing.assert_array_equal(getattr(then, field.name), getattr(now, field.name))
    # Largest values are those since the message before.
    hits = [frame.data.impact_speed[LEFT] for frame in damage]
    assert hits == pytest.approx([0.0, 1.0, *[0.0] * 9])
    assert [(event.tick, event.data.kind) for event in events if event.data.bottle == LEFT] == [
        (2, "crushing_force"), (2, "impact_speed"),
    ]  # fmt: skip


def test_the_summary_tells_the_worst_and_what_passed_a_limit(recorded: tuple[Path, Simulation]) -> None:
    path, sim = recorded
    summary = summarize(path)
    borne = summary.borne
    assert borne is not None and borne.impact_speed is not None and borne.scuffing_work is not None
    assert (borne.impact_speed.value, borne.impact_speed.bottle) == (pytest.approx(1.0), LEFT)
    assert (borne.scuffing_work.value, borne.scuffing_work.bottle) == (damage_of(sim).scuffing_work[DRAGGED], DRAGGED)
    assert summary.damage_events["impact_speed"] == 2
    assert len(summary.damage_texts) == 3
    assert render(summary)


def test_a_replay_bears_the_same(recorded: tuple[Path, Simulation]) -> None:
    report = replay(recorded[0])
    assert report.difference is None
    assert report.compared["damage"] == report.compared["rail_wear"] == 11


@pytest.fixture
def borne(recorded: tuple[Path, Simulation]) -> Iterator[tuple[Recording, Damage]]:
    with open_bag(recorded[0]) as opened, style.look():
        recording = Recording(opened)
        damage = recording.damage
        assert damage is not None
        yield recording, damage


def test_rails_are_as_hot_as_what_they_bore(borne: tuple[Recording, Damage], recorded: tuple[Path, Simulation]) -> None:
    recording, damage = borne
    wear = wear_of(recorded[1])
    figure = rails_figure(recording.plant, damage, "experiments")
    for gid, values in (("pressure", wear.impulse / 0.5), ("scuffing", wear.scuffing_work)):
        drawn = heat(figure, gid)
        hot = values > 0.0
        np.testing.assert_allclose(np.sort(drawn.get_array()), np.sort((values / wear.length)[hot]))
        # Each bin lies where it is.
        middles = np.array([line[1] for line in drawn.get_segments()])
        there = np.column_stack([wear.x, wear.y])[hot]
        distance = np.hypot(*(middles[:, None] - there).transpose(2, 0, 1))
        assert distance.min(axis=1).max() < 1e-3
    assert "N/m on stop at (21.00" in figure.axes[0].get_title("left")


def heat(figure: Figure, gid: str) -> LineCollection:
    (found,) = [part for ax in figure.axes for part in ax.collections if part.get_gid() == gid]
    assert isinstance(found, LineCollection)
    return found


def test_bottles_are_spread_by_the_worst_that_each_bore(borne: tuple[Recording, Damage]) -> None:
    _, damage = borne
    assert damage.limits == LIMITS
    assert damage.worst["impact_speed"][[LEFT, RIGHT, OBLIQUE]] == pytest.approx([1.0, 1.0, 0.2])
    assert len(damage.worst["tipping"]) == 5
    figure = bottles_figure(damage, "experiments")
    by_name = {ax.get_xlabel().split(" (")[0]: ax for ax in figure.axes}
    assert set(by_name) == {name.replace("_", " ") for name in damage.worst}
    for name, limit in LIMITS.items():
        ax = by_name[name.replace("_", " ")]
        assert sum(bar.get_height() for bar in ax.patches) == len(damage.worst[name])  # type: ignore[attr-defined]
        (line,) = [line for line in ax.lines if line.get_gid() == f"limit {name}"]
        assert list(line.get_xdata()) == [limit, limit]
        beyond = int((damage.worst[name] > limit).sum())
        assert ax.get_xlabel().endswith(f"; {beyond} of {len(damage.worst[name])} beyond {limit:g}")
    assert damage.worst["crushing_force"][HELD] > LIMITS["crushing_force"]
