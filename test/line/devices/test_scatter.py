# SPDX-License-Identifier: Apache-2.0
"""Scatter of bottles at infeeds, sources and stations: its bounds, its seed, and no random numbers without it."""

import json
import math
from typing import Any

import numpy as np
import pytest
from line.devices.test_infeed import infeed
from line.machines.machine_line import line, sink, source, station
from line.machines.test_station import BEFORE, BEHIND, RAILS
from scenes import base, contact, kind, polyline, scene, segment

from conveyor_sim.errors import SceneError
from conveyor_sim.physics.state.snapshot import restore, snapshot
from conveyor_sim.scene.types import XY
from conveyor_sim.simulation import Simulation

JITTER = 0.004
ANGLE = math.radians(2.0)
SCATTER = {"lateral_jitter": JITTER, "angular_jitter": ANGLE}


def births(sim: Simulation, ticks: int) -> np.ndarray:
    """Return y (m) and direction (rad) of each new bottle, (n, 2)."""
    rows, before = [], set(sim.bottles().id.tolist())
    for _ in range(ticks):
        sim.advance()
        state = sim.bottles()
        rows += [
            (state.y[slot], math.atan2(state.vy[slot], state.vx[slot]))
            for slot, bottle in enumerate(state.id.tolist())
            if bottle not in before
        ]
        before = set(state.id.tolist())
    return np.array(rows).reshape(-1, 2)


def with_source(**fields: Any) -> Simulation:
    """Return a source with a sink."""
    return line(machines={"filler": source(5.0, **fields), "packer": sink(20.0)}, duration=100.0)


def with_station(**fields: Any) -> Simulation:
    """Return a station behind a source in single file."""
    return line(
        machines={"filler": source(2.0), "capper": station(BEFORE, BEHIND, 4.0, **fields), "packer": sink(20.0)},
        rails=RAILS,
        duration=100.0,
    )


@pytest.mark.parametrize("build", [infeed, with_source])
def test_bottles_are_scattered_within_the_bounds(build: Any) -> None:
    """Places and directions fill the range evenly; mean and bounds agree."""
    fields = {"rate": 2.0} if build is infeed else {}
    born = births(build(**SCATTER, **fields), 2500)
    assert len(born) > 40
    for column, most in zip(born.T, (JITTER, ANGLE), strict=True):
        assert np.all(np.abs(column) <= most + 1e-12)
        assert column.min() < -0.6 * most
        assert column.max() > 0.6 * most


def test_returned_bottles_of_a_station_are_scattered() -> None:
    """Only the bottles that the station gives back are off the middle."""
    sim = with_station(**SCATTER)
    seen = births(sim, 1500)
    returned = seen[seen[:, 0] != 0.0]
    assert len(returned) > 10
    assert np.all(np.abs(returned) <= [JITTER, ANGLE])
    assert np.ptp(returned[:, 0]) > JITTER
    assert np.ptp(returned[:, 1]) > ANGLE


@pytest.mark.parametrize("build", [with_source, with_station])
def test_machines_without_scatter_draw_nothing(build: Any) -> None:
    """No random stream and no other state is added, with the fields left out or 0."""
    bare, zero = build(), build(lateral_jitter=0.0, angular_jitter=0.0)
    bare.advance(300)
    zero.advance(300)
    assert bare.full_state_hash() == zero.full_state_hash()
    for sim in (bare, zero):
        for device in sim._line._devices:
            assert not {"random", "offset", "deflection"} & snapshot(device).keys()


def test_an_infeed_without_angular_scatter_keeps_its_state() -> None:
    """The state of an infeed is that of scenes older than angular scatter."""
    sim = infeed(rate=2.0, lateral_jitter=JITTER)
    device = next(device for device in sim._line._devices if device.name == "infeeds/in")
    assert list(snapshot(device)) == [
        "random", "quality", "fed", "blocked", "blocked_ticks", "last", "due", "extra", "offset",
    ]  # fmt: skip


def test_scatter_is_drawn_from_the_seed_and_survives_a_snapshot() -> None:
    """Equal seeds give equal bottles. A restored source goes on as the first."""

    def filler(sim: Simulation) -> Any:
        return next(device for device in sim._line._devices if device.name == "machines/filler")

    one, other = with_source(**SCATTER), with_source(**SCATTER)
    assert births(one, 400).tolist() == births(other, 400).tolist()
    memory = json.loads(json.dumps(snapshot(filler(one))))
    following = births(one, 200)
    restore(filler(other), memory)
    assert births(other, 200).tolist() == following.tolist()


def table(**scatter: Any) -> Simulation:
    """Return a lane that feeds 30 bottles into the middle of a table of 0.6 m, with a rail at its end."""
    walls: list[XY] = [(0, -0.0375), (1, -0.0375), (1, -0.3), (3, -0.3), (3, 0.3), (1, 0.3), (1, 0.0375), (0, 0.0375)]
    laws: dict[str, Any] = {"damping": ("normal", 0.4), "friction": 0.1}
    return Simulation(
        scene(
            duration=60.0,
            accuracy="draft",
            friction_solver="implicit",
            bottle_types={"bottle": kind(0.033, 0.35)},
            contacts=[contact(5e4, **laws), contact(5e4, "steel", **laws)],
            base=base(0.15),
            belts={
                "lane": {"kind": "straight", "start": [0.0, -0.0413], "angle": 0.0, "length": 1.0, "width": 0.0826,
                         "speed": 0.4, "material": "chain"},
                "table": {"kind": "straight", "start": [1.0, -0.3], "angle": 0.0, "length": 2.0, "width": 0.6,
                          "speed": 0.1, "material": "chain"},
            },
            rails={"walls": polyline(walls)},
            infeeds={"in": {"bottle": "bottle", "position": [0.05, 0.0], "direction": 0.0, "speed": 0.4, "rate": 1.5,
                            "count": 30, **scatter}},
        )
    )  # fmt: skip


@pytest.mark.parametrize("scatter", [{"lateral_jitter": 5e-4}, {"angular_jitter": "0.5 deg"}])
def test_a_column_of_bottles_on_a_table_breaks_with_scatter(scatter: dict[str, Any]) -> None:
    """Without scatter 30 bottles stand in one column behind the rail, because nothing moves them sideways."""
    perfect, scattered = table(), table(**scatter)
    perfect.advance(4000)
    scattered.advance(4000)
    assert perfect.bottles().y.tolist() == [0.0] * 30
    assert np.ptp(scattered.bottles().y) > 0.2


@pytest.mark.parametrize("jitter", [0.02, 0.5])
def test_scatter_into_a_rail_is_refused(jitter: float) -> None:
    """A source whose bottles could be born in a rail is refused by its position, also if they could be beyond it."""
    with pytest.raises(SceneError, match="lateral_jitter included") as error:
        line(
            machines={"filler": source(lateral_jitter=jitter)},
            rails={"side": segment((-0.1, 0.075), (0.1, 0.075))},
        )
    assert "machines.filler.position" in str(error.value)
