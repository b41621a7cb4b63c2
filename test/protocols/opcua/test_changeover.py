# SPDX-License-Identifier: Apache-2.0
"""Types of new bottles over OPC UA: an enumeration that a controller writes, and a changeover by one write."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from asyncua import ua

from conveyor_sim.line.changeover import changeover
from conveyor_sim.scene import load_scene
from test.protocols.opcua.conftest import refused

if TYPE_CHECKING:
    from pathlib import Path

    from test.protocols.opcua.conftest import Line, Serve

BOTTLE = "infeeds/inlet/cmd_bottle"
LINE = """\
name: formats
duration: 100
parameters: {speed: 0.3}
contacts: [{between: [glass, glass], stiffness: 20000}]
base: [{between: [glass, chain], friction: 0.3}]
bottle_types:
  full: {radius: 0.035, mass: 0.4, material: glass}
  half: {radius: 0.025, mass: 0.2, material: glass}
conveyors: {lane: {start: [0, 0], path: [{straight: 3}], width: 0.1, material: chain, speed: speed}}
infeeds: {inlet: {along: lane, at: 0.2, bottle: full, types: [full, half], rate: 3, rate_limit: 6}}
outfeeds: {end: {along: lane, at: -0.05, length: 0.3}}
formats: {full: {bottle: full}, half: {bottle: half, set: {speed: 0.4}}}
"""


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("formats") / "line.yaml"
    path.write_text(LINE)
    return path


@pytest.fixture(scope="module")
def line(serve: Serve, scene: Path) -> Line:
    return serve(scene)


def test_a_controller_changes_the_format(line: Line, scene: Path) -> None:
    controller = line.client("controller")
    commands = changeover(load_scene(scene), "half")
    assert set(commands) == {BOTTLE, "belts/lane/cmd_speed"}
    for name, value in commands.items():
        node = line.node(name, controller)
        kind = node.read_data_type_as_variant_type()
        number = value if kind == ua.VariantType.Double else int(value)
        node.write_value(ua.DataValue(ua.Variant(number, kind)))
    line.advance(100)
    assert line.read(BOTTLE) == 1
    assert line.read("belts/lane/speed") == pytest.approx(0.4)
    assert line.read(f"{BOTTLE}/written_by") == "controller opcua controller"


def test_a_number_that_is_no_type_is_refused(line: Line) -> None:
    node = line.node(BOTTLE, line.client("controller"))
    with refused(ua.StatusCodes.BadOutOfRange):
        node.write_value(ua.DataValue(ua.Variant(2, node.read_data_type_as_variant_type())))
