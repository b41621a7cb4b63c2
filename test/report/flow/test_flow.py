# SPDX-License-Identifier: Apache-2.0
"""Routes, transit times, capacities and the bottleneck of a line."""

import math
from pathlib import Path

import pytest
from click.testing import CliRunner
from scenes import ROOT, SHIPPED, shipped_name

from conveyor_sim.cli import main
from conveyor_sim.report.flow.flow import flow_of
from conveyor_sim.report.labelled import MOST_LINES
from conveyor_sim.scene import load_scene

STATIONS = ROOT / "config" / "scenarios" / "two_stations.yaml"


def test_a_route_leads_through_stations_to_the_exit() -> None:
    (route,) = flow_of(load_scene(STATIONS)).routes
    assert [stop[-1] for stop in route.stops] == ["filler", "capper", "checkweigher", "packer"]
    # Three times from a position to the region, at 0.5 m/s, and a cycle in each of two stations.
    assert route.length == pytest.approx(1.84 + 1.84 + 1.84, abs=0.1)
    assert route.seconds == pytest.approx(route.length / 0.5 + 1 / 2.0 + 1 / 2.4, abs=0.05)


def test_the_slowest_machine_or_belt_is_the_bottleneck() -> None:
    flow = flow_of(load_scene(STATIONS))
    assert flow.bottleneck is not None
    assert (flow.bottleneck.path, flow.bottleneck.rate) == (("machines", "capper"), 2.0)
    glass = flow_of(load_scene(ROOT / "config" / "glass_line.yaml")).bottleneck
    assert glass is not None
    assert glass.path == ("belts", "slow")
    assert glass.rate == pytest.approx(0.22 / 0.066)


def test_capacity_is_length_over_diameter_in_single_file_else_by_area() -> None:
    stretches = flow_of(load_scene(ROOT / "config" / "glass_line.yaml")).stretches
    assert [stretch.name for stretch in stretches] == ["feeder", "slow", "away"]
    assert all(stretch.single for stretch in stretches)
    assert stretches[1].capacity == pytest.approx(1.2 / 0.066, rel=0.03)
    (table,) = flow_of(load_scene(ROOT / "config" / "accumulation_table.yaml")).stretches
    assert not table.single
    assert table.width == pytest.approx(1.75)
    density = 0.9 / (2.0 * math.sqrt(3.0) * 0.065**2)
    assert table.capacity == pytest.approx(density * table.length * 1.75)


def test_the_same_scene_has_the_same_flow() -> None:
    one, other = (flow_of(load_scene(ROOT / "config" / "funnel.yaml")) for _ in range(2))
    assert [route.seconds for route in one.routes] == [route.seconds for route in other.routes]
    assert one.stretches == other.stretches


def test_a_loop_is_a_circulation() -> None:
    (route,) = flow_of(load_scene(ROOT / "config" / "paper_plant.yaml")).routes
    assert route.last.end == "circulates"


@pytest.mark.parametrize("path", SHIPPED, ids=shipped_name)
def test_the_overview_has_at_most_twelve_lines(path: Path, tmp_path: Path) -> None:
    result = CliRunner().invoke(main, ["check", str(path), "--out", str(tmp_path)])
    assert result.exit_code == 0, result.output
    lines = result.output.splitlines()
    assert len(lines) <= MOST_LINES
    assert lines[0].startswith(f"{load_scene(path).name}: valid. ")
    assert "--details" in lines[-1]


def test_more_findings_than_lines_are_counted(tmp_path: Path) -> None:
    eyes = ", ".join(f"e{n}: {{from: [9, {n}], to: [9, {n}.5]}}" for n in range(20))
    scene = tmp_path / "eyes.yaml"
    scene.write_text(STATIONS.read_text() + f"photo_eyes: {{{eyes}}}\n")
    runner = CliRunner()
    short = runner.invoke(main, ["check", str(scene), "--out", str(tmp_path)]).output.splitlines()
    warnings = sum(line.startswith("warning") for line in short)
    assert len(short) == MOST_LINES
    assert any(line.strip().startswith(f"{21 - warnings} more") for line in short)
    full = runner.invoke(main, ["check", str(scene), "--details", "--out", str(tmp_path)]).output.splitlines()
    assert sum(line.startswith("warning") for line in full) == 21  # the eyes, and soft contacts


def test_a_long_line_is_estimated_by_the_speeds_of_its_belts() -> None:
    overrides = {"conveyors": {"lane": {"path": [{"straight": 300.0}]}}}
    (route,) = flow_of(load_scene(ROOT / "config" / "scenarios" / "buffer_lane.yaml", overrides)).routes
    assert route.last.end == "exit"
    assert route.traced is not None
    assert 50.0 < route.traced < 299.0
    assert route.seconds == pytest.approx((299.9 - 0.06) / 0.5, rel=0.001)
