# SPDX-License-Identifier: Apache-2.0
"""Row pushers, packers that take a case at once, and depalletisers that set down layers."""

import math
from typing import Any

import numpy as np
import pytest
from physics.test_moving_rails import plant
from scenes import MASS, RADIUS, bottle

from conveyor_sim.simulation import Simulation

TOP, ACCELERATION, STROKE = 0.4, 4.0, 0.25
ROW = 4
PITCH = 2.0 * RADIUS + 0.001
MOVES: dict[str, Any] = {"material": "ice", "max_speed": TOP, "acceleration": ACCELERATION, "force_limit": "none"}
ROW_ZONE = {"region": [[-0.1, 5.0], [0.4, 5.0], [0.4, 5.1], [-0.1, 5.1]], "full_at": ROW}


def row(number: int = ROW) -> list[dict[str, Any]]:
    """Return bottles in a row along x, which touch neither each other nor the pusher."""
    return [bottle(PITCH * k, 5.0 + RADIUS + 0.002) for k in range(number)]


def line(*bottles: dict[str, Any], pusher: dict[str, Any] | None = None, **more: Any) -> Simulation:
    """Return a row pusher along y at y = 5, on a floor with friction."""
    given = {"from": [-0.1, 5.0], "to": [0.4, 5.0], "direction": "90 deg", "stroke": STROKE, **MOVES, "zone": "row"}
    fields: dict[str, Any] = {"pushers": {"row": {**given, **(pusher or {})}}, "diverters": {}, "gates": {},
                              "zones": {"row": ROW_ZONE}, "floor": {"friction": 0.2}, **more}  # fmt: skip
    return plant(*bottles, **fields)


def signals(sim: Simulation, device: str) -> dict[str, float]:
    """Return the signals of a device by their last name."""
    named = zip(sim.process_image.signal_names, sim.signals().tolist(), strict=True)
    return {name.rpartition("/")[2]: value for name, value in named if name.startswith(f"{device}/")}


def test_it_pushes_a_complete_row_once_and_returns() -> None:
    sim = line(*row())
    sim.advance(60)
    assert signals(sim, "pushers/row")["position"] > 0.1
    sim.advance(200)
    pusher = signals(sim, "pushers/row")
    assert (pusher["retracted"], pusher["strokes"]) == (1.0, 1.0)
    assert signals(sim, "zones/row")["bottles"] == 0.0


def test_it_waits_for_a_complete_row_that_has_settled() -> None:
    last = {"bottle": "bottle", "position": [PITCH * (ROW - 1), 5.0 + RADIUS + 0.002], "count": 1}
    sim = line(*row(ROW - 1), spills={"last": last}, pusher={"settle": 0.5})
    sim.advance(100)
    assert signals(sim, "pushers/row")["retracted"] == 1.0
    sim.inject("spills/last/drop", 1)
    sim.advance(48)
    assert signals(sim, "pushers/row")["position"] == 0.0
    sim.advance(10)
    assert signals(sim, "pushers/row")["position"] > 0.0


@pytest.mark.parametrize("number", [1, ROW])
def test_a_row_gets_the_speed_of_the_pusher_and_slides_on(number: int) -> None:
    """Pushed from rest without a gap, it has the speed of the pusher within 2 a / omega.

    The pusher brakes faster than friction does. From there the row goes v^2 / (2 mu g).
    """
    mu, brake = 0.1, 2.0
    spread = 2.0 * brake / math.sqrt(8e3 / MASS)
    sim = line(*(bottle(PITCH * k, 5.0 + RADIUS + 1e-9) for k in range(number)), floor={"friction": mu},
               zones={"row": {**ROW_ZONE, "full_at": number}}, pusher={"acceleration": brake})  # fmt: skip
    speeds, start = [], sim.bottles().y[:number].copy()
    for _ in range(60):
        sim.advance(1)
        speeds.append(sim.bottles().vy[:number].copy())
    cruise = round(100 * TOP / brake) + 2
    assert np.abs(np.array(speeds)[cruise:] - TOP).max() < spread
    assert np.abs(np.array(speeds)[: cruise // 2] - TOP).min() > spread
    sim.advance(240)
    way = STROKE - TOP**2 / (2.0 * brake) + TOP**2 / (2.0 * mu * 9.81)
    np.testing.assert_allclose(sim.bottles().y[:number] - start, way, atol=TOP * spread / (mu * 9.81))
    # All bottles of the row go equally far.
    assert np.ptp(sim.bottles().y[:number]) < 1e-6


def test_by_hand_it_pushes_and_stays() -> None:
    sim = line()
    sim.command(["pushers/row/auto", "pushers/row/push"], [0, 1])
    sim.advance(200)
    assert signals(sim, "pushers/row")["extended"] == 1.0
    sim.command(["pushers/row/push"], [0])
    sim.advance(200)
    assert signals(sim, "pushers/row")["retracted"] == 1.0


def test_a_jammed_row_pusher_ends_its_stroke_when_it_is_free() -> None:
    sim = line(*row())
    sim.advance(30)
    sim.inject("pushers/row/jammed", 1)
    sim.advance(100)
    assert 0.0 < signals(sim, "pushers/row")["position"] < 1.0
    sim.inject("pushers/row/jammed", 0)
    sim.advance(300)
    assert (signals(sim, "pushers/row")["retracted"], signals(sim, "pushers/row")["strokes"]) == (1.0, 1.0)


def test_a_packer_takes_a_case_at_once_when_it_is_complete() -> None:
    """Two rows of four, pushed one after the other, are a case of eight: one cycle of 8 / rate."""
    case = {"kind": "sink", "region": [[-0.1, 5.15], [0.4, 5.15], [0.4, 5.6], [-0.1, 5.6]], "rate": 8.0, "at_once": 8}
    spill = {f"s{k}": {"bottle": "bottle", "position": [PITCH * k, 5.0 + RADIUS + 0.002], "count": 1} for k in range(4)}
    sim = line(*row(), machines={"packer": case}, spills=spill)
    sim.advance(200)
    packer = signals(sim, "machines/packer")
    assert (packer["taken"], packer["starved"]) == (0.0, 1.0)
    for name in spill:
        sim.inject(f"spills/{name}/drop", 1)
    taken = set()
    for _ in range(300):
        sim.advance(1)
        taken.add(signals(sim, "machines/packer")["taken"])
    assert taken == {0.0, 8.0}
    assert signals(sim, "machines/packer")["processed"] == 8.0
    assert sim.counts.removed == 8


def depalletiser(rows: int = 3, pattern: str = "square", rate: float = 12.0) -> Simulation:
    """Return a depalletiser of layers of 4 bottles a row, which the row pusher sweeps along y."""
    layer = {"rows": rows, "columns": ROW, "pitch": PITCH, "pattern": pattern, "pusher": "row"}
    source = {"kind": "source", "bottle": "bottle", "position": [0.0, 5.0 + RADIUS + 0.002], "direction": 0.0,
              "speed": 0.0, "rate": rate, "layer": layer}  # fmt: skip
    zone = {"region": [[-0.1, 5.0], [0.5, 5.0], [0.5, 5.4], [-0.1, 5.4]], "full_at": ROW * rows}
    out = {"region": [[-0.1, 5.45], [0.5, 5.45], [0.5, 5.95], [-0.1, 5.95]]}
    return line(machines={"depalletiser": source}, zones={"row": zone}, outfeeds={"table": out}, pusher={"stroke": 0.4})


def test_a_depalletiser_sets_down_layers_that_the_pusher_sweeps_off() -> None:
    sim = depalletiser()
    counts = []
    for _ in range(900):
        sim.advance(1)
        counts.append(int(signals(sim, "machines/depalletiser")["produced"]))
    assert set(counts) == {0, 12, 24, 36, 48}
    # A layer comes after the pusher has returned: a stroke and back take 2 (0.4 / 0.4 + 0.4 / 4) s.
    second, third = counts.index(24), counts.index(36)
    assert third - second == pytest.approx(100 * 2.0 * (0.4 / TOP + TOP / ACCELERATION), abs=2)
    assert signals(sim, "outfeeds/table")["removed"] >= 24
    assert signals(sim, "machines/depalletiser")["blocked_time"] > 0.0


@pytest.mark.parametrize(("pattern", "step", "shift"), [("square", 1.0, 0.0), ("hexagonal", math.sqrt(0.75), 0.5)])
def test_a_layer_has_its_rows_to_the_left(pattern: str, step: float, shift: float) -> None:
    sim = depalletiser(rows=2, pattern=pattern)
    while sim.counts.fed == 0:
        sim.advance(1)
    x, y = sim.bottles().x, sim.bottles().y
    layer = x < 10.0
    expected = [[PITCH * (k + shift * r), 5.0 + RADIUS + 0.002 + PITCH * step * r] for r in range(2) for k in range(4)]
    np.testing.assert_allclose(np.column_stack([x[layer], y[layer]]), expected, atol=1e-12)


def test_a_run_with_them_goes_on_from_a_checkpoint(tmp_path: Any) -> None:
    sim = depalletiser()
    sim.advance(150)
    sim.save(tmp_path / "state")
    again = Simulation.load(tmp_path / "state")
    for one in (sim, again):
        one.advance(200)
    assert sim.full_state_hash() == again.full_state_hash()
