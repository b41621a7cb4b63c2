# SPDX-License-Identifier: Apache-2.0
"""Values of commands over a recording, and the figures that follow from set rates."""

from __future__ import annotations

from pathlib import Path

import pytest
from report.test_production import FAILING_LINE, MACHINES

from conveyor_sim.bag.messages.topics import OUTPUTS
from conveyor_sim.bag.outputs import OutputWriter
from conveyor_sim.bag.reader import open_bag
from conveyor_sim.bag.recorder import Recorder
from conveyor_sim.line.commands.inputs import FORCE, Input
from conveyor_sim.report.command_changes import Change, command_changes
from conveyor_sim.report.production import read_production
from conveyor_sim.report.span import Times
from conveyor_sim.scene import load_scene
from conveyor_sim.simulation import Simulation

FILLER, CAPPER, FORCED = "machines/filler/rate", "machines/capper/rate", "machines/filler/fault"
TICKS = 2000


def test_each_change_of_a_repeated_command_counts_from_its_tick(tmp_path: Path) -> None:
    """Set rates are equal with and without read-back; the counters of the run state the same cycles at them."""
    sim = Simulation(load_scene(FAILING_LINE))
    initial = dict(zip(sim.process_image.command_names, sim.line.read_back.values, strict=True))
    with (
        Recorder(tmp_path / "all") as recorder,
        Recorder(tmp_path / "less", topics=OUTPUTS.keys() - {"readback"}) as less,
    ):
        outputs = OutputWriter(sim, [recorder, less], run_id="run")
        outputs.start()
        while sim.tick < TICKS:
            sim.command([FILLER, CAPPER], [1.0 if 300 <= sim.tick < 1111 else 0.5, 1.0 + 0.25 * (sim.tick // 500)])
            if sim.tick == 700:
                sim.give(Input("operate", "Jo", "engineer", FORCE, (FORCED,), (1.0,)))
            sim.advance()
            outputs.after_tick()
    expected = {
        FILLER: [Change(0, 0.5), Change(300, 1.0), Change(1111, 0.5)],
        CAPPER: [Change(tick, 1.0 + 0.25 * (tick // 500)) for tick in range(0, TICKS, 500)],
        "no/such": [],
    }
    counted = sim.line.counters()
    assert counted is not None
    for folder in ("all", "less"):
        with open_bag(tmp_path / folder) as bag:
            changes = command_changes(bag, list(expected))
        if folder == "all":
            assert [changes[name].pop(0).value for name in (FILLER, CAPPER)] == [initial[FILLER], initial[CAPPER]]
        assert changes == expected
        production = read_production(tmp_path / folder, Times(0.0))
        assert production.counters.set_effectiveness == pytest.approx(counted.set_effectiveness, nan_ok=True)
        assert production.forced == (FORCED,)
    filler = counted.set_effectiveness[MACHINES.index("machines/filler")]
    assert filler != pytest.approx(counted.effectiveness[MACHINES.index("machines/filler")])
