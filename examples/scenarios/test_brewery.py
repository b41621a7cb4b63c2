# SPDX-License-Identifier: Apache-2.0
"""A whole line in production: it starts from standstill, works in line with its neighbours, and changes its bottle.

Run it by hand: `pytest examples/scenarios/test_brewery.py`.
"""

from typing import Any

from conveyor_sim.control.brewery import brewery, hall
from conveyor_sim.control.st import StructuredText
from conveyor_sim.support.resources import config_dir
from conveyor_sim.testing.plugin import Lines

PROJECT = config_dir() / "brewery" / "plc"
RATE = 40_000 / 3600  # bottles per second
AT_START = 5152


def few(type: str, conveyor: str, at: float, offset: float, rows: int, columns: int) -> dict[str, Any]:
    """Return a grid of bottles at the start."""
    grid = {"type": type, "along": conveyor, "at": at, "offset": offset, "rows": rows, "columns": columns}
    return {"grid": {**grid, "pitch": 0.07, "pattern": "hexagonal"}}


SHORT = {
    "parameters": {"dwell": 2.0},
    "bottles": [few("empty", "single_lane", 0.1, 0.0, 1, 24), few("full", "packing", 7.2, -0.55, 10, 6)],
    "conveyors": {"filled": {"speed": 0.5}, "packing": {"speed": 0.5}, "cold": {"path": [{"straight": 2.0}]}},
    "machines": {
        "depalletiser": {"layer": {"rows": 6, "columns": 15, "pitch": 0.0675, "pusher": "sweep"}},
        "labeller": {"sets": {"label": {"share": 0.9}}},
    },
    "zones": {"layer": {"full_at": 90}},
}
"""The line with few bottles, fast or short conveyors, small layers, a short pasteurisation and many bad labels."""


def test_the_line_starts_and_fills(line: Lines) -> None:
    plant = line("brewery")
    plant.attach(brewery())
    plant.run_for(0.5)
    assert plant.signals["belts/supply/speed"] == plant.signals["axes/block_master/speed"] == 0.0
    plant.panel.press("start")
    plant.run_for(0.2)
    plant.panel.release("start")
    plant.eventually(lambda s: s["machines/packer/taken"] > 200, within=60.0)
    packed, at_rate = plant.signals["machines/packer/taken"], False
    # The depalletiser waits until the conveyor has room for a layer.
    plant.eventually(lambda s: s["belts/supply/bottles"] < 2250, within=70.0)
    assert plant.signals["machines/depalletiser/produced"] == 0.0 < plant.signals["belts/supply/speed"]
    plant.eventually(lambda s: s["machines/depalletiser/produced"] > 0.0, within=30.0)
    plant.eventually(lambda s: s["carousels/block_heads/good"] >= 1, within=70.0)
    # In one of five starts, the first combiner clears a jam, and the block starts slowly.
    while not at_rate and plant.time < 120.0:
        filled = plant.signals["carousels/block_valves/good"]
        plant.run_for(6.0)
        signals = plant.signals
        at_rate = abs(signals["carousels/block_valves/good"] - filled - 6.0 * RATE) <= 3.0
    assert at_rate
    assert signals["machines/packer/taken"] > packed
    assert signals["machines/pasteuriser/held"] > 300
    assert signals["carousels/block_valves/lost"] == signals["carousels/block_heads/lost"] == 0.0
    counts = plant.simulation.counts
    assert AT_START + counts.fed == counts.present + counts.removed + counts.held
    plant.panel.press("estop")
    plant.eventually(lambda s: s["axes/block_master/speed"] == 0.0 and s["belts/block_infeed/speed"] == 0.0, within=3.0)
    assert plant.signals["carousels/block_valves/lost"] == 0.0


def test_the_line_is_empty_before_the_next_bottle_comes(line: Lines) -> None:
    plant = line("brewery", SHORT)
    plant.attach(StructuredText(PROJECT))
    empty, light, full = range(3)

    def types() -> set[int]:
        return set(plant.simulation.bottles().type.tolist())

    plant.run_for(0.5)
    plant.panel.turn("format", "light")
    plant.panel.press("start")
    plant.run_for(0.2)
    plant.panel.release("start")
    assert types() == {empty, full}
    plant.eventually(lambda s: s["carousels/block_heads/good"] == 24, within=60.0)
    assert types() == {full}
    plant.eventually(lambda s: s["machines/packer/taken"] == 72, within=130.0)
    assert plant.simulation.counts.fed == 0
    plant.eventually(lambda s: s["machines/depalletiser/produced"] == 90, within=40.0)
    assert types() == {full, light}
    rejected = plant.signals["machines/reject/rejected_bad"]
    assert rejected == plant.signals["machines/camera/bad"] == plant.signals["machines/labeller/defective"] > 0
    assert plant.signals["machines/reject/rejected_good"] == plant.signals["machines/reject/missed"] == 0
    assert plant.simulation.bottles().type.tolist().count(full) == 84 - 72 - rejected < 24


def test_a_squeezed_bottle_stops_the_block_until_an_operator_takes_it_away(line: Lines) -> None:
    plant = line("brewery", SHORT)
    plant.attach(brewery())

    def push(button: str) -> None:
        plant.panel.press(button)
        plant.run_for(0.2)
        plant.panel.release(button)

    plant.run_for(0.5)
    push("start")
    plant.eventually(lambda s: s["gates/block_stop/is_open"] == 1.0, within=30.0)
    plant.inject("stars/block_in/slip", 0.15)
    plant.eventually(lambda s: s["axes/block_inlet/fault"] == 1.0, within=5.0)
    plant.eventually(lambda s: s["axes/block_filler/speed"] == 0.0, within=3.0)
    assert plant.signals["belts/block_infeed/running"] == 0.0 and plant.signals["belts/spread/running"] == 1.0
    plant.inject("stars/block_in/slip", 0.0)
    bottles = plant.simulation.bottles()
    places = zip(bottles.id.tolist(), bottles.x.tolist(), bottles.y.tolist(), strict=True)
    plant.simulation.delete(*(bottle for bottle, x, y in places if abs(x - 35.86) < 0.5 and abs(y - 0.817) < 0.5))
    plant.run_for(0.5)
    push("reset")
    plant.eventually(lambda s: s["axes/block_inlet/following_error"] == 0.0, within=10.0)
    push("start")
    plant.eventually(lambda s: s["axes/block_master/speed"] > 20.0, within=10.0)
    assert "axes/block_inlet/fault" not in plant.alarms


def test_a_stuck_eye_makes_the_combiner_clear_itself_with_an_alarm(line: Lines) -> None:
    plant = line("brewery", {**SHORT, "bottles": []})
    plant.attach(StructuredText(PROJECT))
    plant.inject("photo_eyes/label_standing/stuck_on", 1)
    plant.run_for(0.5)
    plant.panel.press("start")
    plant.eventually(lambda s: s["belts/label_chains/speed"] < -1.0, within=5.0)
    assert "label_wedged" in plant.alarms and "single_wedged" not in plant.alarms
    assert plant.signals["belts/cold/running"] == 0.0 < plant.signals["belts/label_lane/speed"]
    plant.inject("photo_eyes/label_standing/stuck_on", 0)
    plant.eventually(lambda s: s["belts/label_chains/speed"] == 1.75, within=4.0)
    assert "label_wedged" not in plant.alarms


def test_the_failure_of_the_depalletiser_explains_the_low_supply(line: Lines) -> None:
    early = {
        "machines": {"depalletiser": {"failures": {"pallet": {"between": {"mean": 0.5}, "repair": {"mean": 2.0}}}}}
    }
    plant = line("brewery", {**SHORT, **early}, variant="failures")
    plant.attach(StructuredText(PROJECT))
    plant.run_for(2.5)
    assert plant.alarms == {"supply_low"}
    plant.panel.press("start")
    plant.eventually(lambda s: s["machines/depalletiser/fault"], within=20.0)
    plant.run_for(0.1)
    assert plant.alarms == {"machines/depalletiser/fault"}
    plant.eventually(lambda s: not s["machines/depalletiser/fault"], within=10.0)
    assert plant.signals["machines/depalletiser/running"]


def test_every_line_of_a_hall_has_its_controller(line: Lines) -> None:
    plant = line("brewery/hall", {"bottles": []})
    plant.attach(hall())
    plant.run_for(0.1)
    plant.panel.press("line_3_start")
    plant.run_for(1.7)
    running = [plant.signals[f"belts/line_{number}_filled/running"] for number in range(10)]
    assert running == [float(number == 3) for number in range(10)]
    plant.panel.press("line_4_estop")
    plant.run_for(0.1)
    assert plant.signals["belts/line_3_filled/running"] == 1.0
    plant.panel.press("line_3_estop")
    plant.eventually(lambda s: s["belts/line_3_filled/speed"] == 0.0, within=1.0)
