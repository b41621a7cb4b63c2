# SPDX-License-Identifier: Apache-2.0
"""Address space: names, types, units, ranges, texts, and values of the simulation."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest
from asyncua import ua

from conveyor_sim.line.tag import COMMANDS, SIGNALS
from conveyor_sim.protocols.opcua.nodes import NAMESPACE
from conveyor_sim.protocols.opcua.values import unit_of

if TYPE_CHECKING:
    from test.protocols.opcua.conftest import Line, Serve


def properties(line: Line, name: str) -> dict[str, Any]:
    return {node.read_browse_name().Name: node.read_value() for node in line.node(name).get_properties()}


def test_every_signal_and_command_reads_as_the_simulation_shows_it(line: Line) -> None:
    line.advance(400)
    shown = line.source.snapshot.values
    names = [tag.name for tag in line.source.info.tags if tag.role in (*SIGNALS, *COMMANDS)]
    assert set(names) == set(shown) and shown["belts/zone1/speed"] > 0.0
    client = line.client()
    values = client.read_values([client.get_node(f"ns=2;s={name}") for name in names])
    assert values == pytest.approx([shown[name] for name in names])


def test_the_namespace_keeps_its_index(line: Line) -> None:
    assert line.client().get_namespace_array()[2] == NAMESPACE


def test_tags_stand_below_their_device_and_the_place_of_the_line(serve: Serve, tmp_path: Any) -> None:
    scene = tmp_path / "placed.yaml"
    with open("config/scenarios/zoned_line.yaml") as given:
        scene.write_text(f"where: packaging/line_1\n{given.read()}")
    line = serve(scene)
    path = ["2:packaging", "2:line_1", "2:belts", "2:zone1", "2:speed"]
    found = line.client().nodes.objects.get_child(path)
    assert found.nodeid.to_string() == "ns=2;s=belts/zone1/speed"


def test_numbers_have_unit_and_range(line: Line) -> None:
    tag = next(tag for tag in line.source.info.tags if tag.name == "belts/zone1/cmd_speed")
    node = line.node(tag.name)
    assert node.read_type_definition().Identifier == ua.ObjectIds.AnalogUnitRangeType
    assert node.read_data_type_as_variant_type() is ua.VariantType.Double
    assert node.read_description().Text == tag.description
    about = properties(line, tag.name)
    assert (about["EURange"].Low, about["EURange"].High) == (tag.low, tag.high)
    unit = about["EngineeringUnits"]
    assert (unit.UnitId, unit.DisplayName.Text) == (5067859, "m/s")  # UNECE_to_OPCUA.csv
    assert unit.NamespaceUri == "http://www.opcfoundation.org/UA/units/un/cefact"


@pytest.mark.parametrize(
    ("name", "low", "high"),
    [
        ("machines/filler/produced", 0.0, 500_000.0),  # the packer's 2.4 a second for a day: 207 360
        ("photo_eyes/full1/edges", 0.0, 500_000.0),
        ("machines/filler/blocked_time", 0.0, 86_400.0),
        ("belts/zone1/bottles", 0.0, 74.0),
    ],
)
def test_a_counter_spans_a_day_of_production(line: Line, name: str, low: float, high: float) -> None:
    span = properties(line, name)["EURange"]
    assert (span.Low, span.High) == (low, high)


def test_units_have_the_numbers_of_the_opc_foundation(line: Line) -> None:
    """From UNECE_to_OPCUA.csv."""
    expected = {"m/s": 5067859, "1/h": 4731184, "1/min": 4405556, "N": 5129559, "J": 4869973, "%": 20529, "1": 4404786}
    found = {tag.unit: unit_of(tag).UnitId for tag in line.source.info.tags}
    assert {unit: number for unit, number in found.items() if unit in expected}.items() <= expected.items()
    assert len(expected.keys() & found) >= 2


def test_enumerations_have_their_texts(line: Line) -> None:
    state = line.node("machines/filler/state")
    assert state.read_type_definition().Identifier == ua.ObjectIds.MultiStateDiscreteType
    strings = [text.Text for text in properties(line, "machines/filler/state")["EnumStrings"]]
    assert strings[state.read_value()] == "Execute"
    reason = line.node("belts/zone1/mode")  # 1, 2, 3
    assert reason.read_type_definition().Identifier == ua.ObjectIds.MultiStateValueDiscreteType
    about = properties(line, "belts/zone1/mode")
    assert {value.Value: value.DisplayName.Text for value in about["EnumValues"]} == {
        1: "Automatic",
        2: "Maintenance",
        3: "Manual",
    }
    assert about["ValueAsText"].Text == "Automatic"
    assert properties(line, "run/state")["ValueAsText"].Text == "running"


def test_bools_and_counts_have_plain_types(line: Line) -> None:
    assert line.node("belts/zone1/running").read_data_type_as_variant_type() is ua.VariantType.Boolean
    assert line.node("belts/zone1/bottles").read_data_type_as_variant_type() is ua.VariantType.UInt32


def test_only_commands_can_be_written(line: Line) -> None:
    engineer = line.client("engineer")
    writable = ua.AccessLevel.CurrentWrite
    assert writable in line.node("belts/zone1/cmd_speed", engineer).get_user_access_level()
    assert writable not in line.node("belts/zone1/speed", engineer).get_access_level()
    viewer = line.client("viewer")
    assert writable in line.node("belts/zone1/cmd_speed", viewer).get_access_level()
    assert writable not in line.node("belts/zone1/cmd_speed", viewer).get_user_access_level()
