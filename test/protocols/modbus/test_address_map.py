# SPDX-License-Identifier: Apache-2.0
"""The Modbus map: each tag has a separate address, a stored map only grows, and words match other libraries."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from facts import missing, stating
from hypothesis import given
from hypothesis import strategies as st

from conveyor_sim.cli import main
from conveyor_sim.line.line import image_of
from conveyor_sim.line.tag import Tag, choice, count, number, seconds, switch
from conveyor_sim.protocols.modbus.address_map import modbus_map
from conveyor_sim.scene import load_scene
from conveyor_sim.support.modbus_rows import GONE, MapError, Row, decode, encode, read_map, to_csv

SPEED = number("belts/a/speed", "actual", "Speed of the belt.", "m/s", -2.0, 2.0)
SETPOINT = number("belts/a/cmd_speed", "setpoint", "Speed that is wanted.", "m/s", -2.0, 2.0)
RUN = switch("belts/a/run", "command", "Run.")
RUNNING = switch("belts/a/running", "status", "Runs.")
COUNT = count("zones/z/bottles", "actual", "Bottles inside.")
ROSE = seconds("photo_eyes/e/rose", "actual", "When it was blocked last.")
STATE = choice("machines/m/state", "status", "State.", {0: "off", 9: "aborted"})
TRIP = switch("belts/a/trip", "fault", "Trips.")
PULSES = count("belts/a/pulses", "counter", "Pulses of the encoder.", low=-(2.0**53))
TAGS = [SPEED, SETPOINT, RUN, RUNNING, COUNT, ROSE, STATE, TRIP, PULSES]


def row_of(rows: list[Row], tag: Tag) -> Row:
    (row,) = [row for row in rows if row.name == tag.name]
    return row


def test_each_kind_of_tag_has_its_table_and_type() -> None:
    rows = modbus_map(TAGS)
    placed = {row.name: (row.table, row.address, row.type, row.access) for row in rows}
    assert placed == {
        RUN.name: ("coil", 0, "bool", "read and write"),
        RUNNING.name: ("discrete input", 0, "bool", "read"),
        SPEED.name: ("input register", 0, "float32", "read"),
        COUNT.name: ("input register", 2, "uint32", "read"),
        ROSE.name: ("input register", 4, "float64", "read"),
        STATE.name: ("input register", 8, "uint16", "read"),
        PULSES.name: ("input register", 9, "int32", "read"),
        SETPOINT.name: ("holding register", 0, "float32", "read and write"),
        "run/tick": ("input register", 65534, "uint32", "read"),
        "run/target_tick": ("holding register", 65534, "uint32", "read and write"),
    }  # and no fault: Modbus knows no users


def test_the_map_holds_ranges_of_its_types_and_the_texts_of_values() -> None:
    """A SCADA system that imports the map refuses a range beyond the type, and knows no other names of values."""
    steps = number("belts/a/rate", "setpoint", "Rate.", "1/s", 0.1, 1.6)
    mode = choice("belts/a/mode", "status", "Control mode.", {1: "Automatic", 3: "Manual"}, 1)
    lines = {line.split(",")[0]: line for line in to_csv(modbus_map([*TAGS, steps, mode])).splitlines()}
    assert ",0.1,1.6,Rate." in lines[steps.name]
    assert ",0,4294967295,Bottles inside." in lines[COUNT.name]
    assert ",-2147483648,2147483647,Pulses of the encoder." in lines[PULSES.name]
    assert '"State. 0 off, 9 aborted."' in lines[STATE.name]
    assert "1 Automatic, 3 Manual." in lines[mode.name]


def test_no_two_tags_share_an_address() -> None:
    rows = modbus_map(TAGS * 1 + [replace(SPEED, name=f"belts/b{i}/speed") for i in range(300)])
    taken = [(row.table, address) for row in rows for address in row.addresses]
    assert len(taken) == len(set(taken))


def test_a_kept_map_only_grows(tmp_path: Path) -> None:
    """A tag that comes is put behind all others, one that goes leaves its address empty, and comes back to it."""
    path = tmp_path / "map.csv"
    path.write_text(to_csv(modbus_map(TAGS)))
    kept = read_map(path)
    assert kept == modbus_map(TAGS)
    other = replace(SPEED, name="belts/0/speed")
    grown = modbus_map([other, *(tag for tag in TAGS if tag is not COUNT)], kept, word_order="little")
    assert row_of(grown, other).address == 11
    assert (row_of(grown, other).word_order, row_of(grown, SPEED).word_order) == ("little", "big")
    gone = row_of(grown, COUNT)
    assert (gone.address, gone.description) == (2, GONE)
    assert [row_of(grown, tag).address for tag in (SPEED, ROSE, STATE)] == [0, 4, 8]
    path.write_text(to_csv(grown))
    back = modbus_map([other, *TAGS], read_map(path))
    assert row_of(back, COUNT) == row_of(kept, COUNT)
    assert row_of(back, other) == row_of(grown, other)


def test_the_command_keeps_a_map(tmp_path: Path) -> None:
    """Written when it is new, grown when the line is, left alone when there is nothing to add or it is damaged."""
    path, scene = tmp_path / "map.csv", "config/scenarios/reject_line.yaml"
    ask = ["tags", scene, "--modbus", "--map", str(path)]
    first = CliRunner().invoke(main, ask)
    assert first.exit_code == 0, first.output
    assert path.read_text() == first.output == to_csv(modbus_map(image_of(load_scene(scene)).tags))
    before = path.stat()
    assert CliRunner().invoke(main, ask).output == first.output
    assert path.stat().st_ino == before.st_ino
    other = CliRunner().invoke(main, ["tags", "config/scenarios/zoned_line.yaml", *ask[2:]])
    assert {row.name for row in read_map(path)} > {row.name for row in modbus_map(image_of(load_scene(scene)).tags)}
    assert other.output == path.read_text()
    path.write_text("no map")
    refused = CliRunner().invoke(main, ask)
    assert refused.exit_code == 1
    assert missing(refused.output, ["map.csv", "line 1", "no map", "name,table"]) == []
    assert path.read_text() == "no map"


def test_a_tag_of_another_type_is_refused() -> None:
    with pytest.raises(MapError, match=stating("zones/z/bottles", "float32", "input registers")):
        modbus_map([replace(COUNT, kind="number", unit="m")], modbus_map([COUNT]))


def test_a_full_table_is_refused() -> None:
    with pytest.raises(MapError, match=stating("no address", "at most", "65534")):
        modbus_map(replace(ROSE, name=f"eyes/{i}") for i in range(16385))


def test_the_handshake_keeps_the_last_addresses_as_a_map_grows() -> None:
    grown = modbus_map([*TAGS, replace(COUNT, name="zones/y/bottles")], modbus_map(TAGS))
    assert row_of(grown, replace(COUNT, name="zones/y/bottles")).address == 11
    assert row_of(grown, replace(COUNT, name="run/tick")).address == 65534
    taken = [replace(row, address=65533) if row.name == COUNT.name else row for row in modbus_map(TAGS)]
    with pytest.raises(MapError, match=stating("zones/z/bottles", "address 65533", "below 65534")):
        modbus_map(TAGS, taken)


@pytest.mark.parametrize("order", ["big", "little"])
def test_words_are_those_of_another_library(order: str) -> None:
    client = pytest.importorskip("pymodbus.client", reason="pymodbus is not installed: pip install conveyor-sim[scada]")
    convert, types = client.ModbusTcpClient.convert_to_registers, client.ModbusTcpClient.DATATYPE
    rows = modbus_map(TAGS, word_order=order)  # type: ignore[arg-type]
    for tag, value, kind in (
        (SPEED, 123.45, types.FLOAT32),
        (ROSE, 86400.000125, types.FLOAT64),
        (COUNT, 70000, types.UINT32),
        (STATE, 9, types.UINT16),
        (PULSES, -70000, types.INT32),
    ):
        assert encode(row_of(rows, tag), value) == convert(value, kind, word_order=order)


def test_123_45_has_the_words_that_manuals_print() -> None:
    big, little = (row_of(modbus_map(TAGS, word_order=order), SPEED) for order in ("big", "little"))  # type: ignore[arg-type]
    assert encode(big, 123.45) == [0x42F6, 0xE666]
    assert encode(little, 123.45) == [0xE666, 0x42F6]


@given(st.floats(allow_nan=False, width=32))
def test_a_number_comes_back(value: float) -> None:
    for order in ("big", "little"):
        row = row_of(modbus_map(TAGS, word_order=order), SPEED)  # type: ignore[arg-type]
        assert np.float32(decode(row, encode(row, value))) == value


def test_a_number_is_read_as_it_was_typed() -> None:
    """Else 0.1 would be beyond a limit of 0.1."""
    row = row_of(modbus_map(TAGS), SETPOINT)
    assert [decode(row, encode(row, value)) for value in (0.1, -0.3, 1e-7, 16777216.0)] == [0.1, -0.3, 1e-7, 16777216.0]


def test_what_a_type_cannot_hold_becomes_the_nearest() -> None:
    rows = modbus_map(TAGS)
    assert decode(row_of(rows, COUNT), encode(row_of(rows, COUNT), 2.0**53)) == 2**32 - 1
    assert decode(row_of(rows, COUNT), encode(row_of(rows, COUNT), math.nan)) == 0.0
    assert decode(row_of(rows, STATE), encode(row_of(rows, STATE), -1.0)) == 0.0
    assert decode(row_of(rows, SPEED), encode(row_of(rows, SPEED), 1e300)) == pytest.approx(3.4028235e38)
    assert decode(row_of(rows, SPEED), encode(row_of(rows, SPEED), -math.inf)) == -math.inf
    assert decode(row_of(rows, PULSES), encode(row_of(rows, PULSES), -1e10)) == -(2**31)
    assert decode(row_of(rows, PULSES), encode(row_of(rows, PULSES), -7.0)) == -7.0
    assert math.isnan(decode(row_of(rows, SPEED), encode(row_of(rows, SPEED), math.nan)))


GOOD = to_csv(modbus_map([SPEED, RUN]))


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("coil,0", "coil,-1", "line 2: address -1 given, expected a whole number from 0 to 65535"),
        ("coil,0", "coil,65536", "line 2: address 65536 given, expected a whole number from 0 to 65535"),
        ("input register,0", "input register,65535", "line 3: address 65535 given, expected a whole number from 0 to"),
        ("coil,0,bool", "coil,0,uint16", "line 2: type uint16 given, expected bool: a coil"),
        (
            "input register,0,float32",
            "input register,0,bool",
            "line 3: type bool given, expected one of uint16, uint32, int32,",
        ),
        ("input register,0,float32", "input register,0,float16", "line 3: type float16 given, expected one of bool,"),
        ("coil", "coils", "line 2: table coils given, expected one of coil, discrete input"),
        ("float32,big", "float32,middle", "line 3: word_order middle given, expected one of big, little"),
        ("m/s,read,-2", "m/s,read,fast", "line 3: low fast given, expected a number"),
        ("belts/a/speed", "belts/a/run", "line 3: name belts/a/run given twice"),
        ("belts/a/speed", "", "line 3: name is empty, expected that of a tag"),
        ("name,table", "tag,table", "line 1: tag,table,address"),
        ("Speed of the belt.", "Speed, of the belt.", "line 3: 11 columns given, expected 10"),
        ("Speed of the belt.", '"Speed', "expected a Modbus map, as CSV"),
    ],
)
def test_a_damaged_map_is_refused_with_line_and_field(tmp_path: Path, old: str, new: str, message: str) -> None:
    assert old in GOOD
    path = tmp_path / "map.csv"
    path.write_text(GOOD.replace(old, new, 1))
    with pytest.raises(MapError, match=re.escape(message)) as raised:
        read_map(path)
    assert str(raised.value).startswith(str(path))
    assert "\n" not in str(raised.value)


def test_overlapping_addresses_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "map.csv"
    rows = modbus_map([SPEED, COUNT])
    path.write_text(to_csv([rows[0], replace(rows[1], address=1)]))
    with pytest.raises(MapError, match=stating("line 3", "address 1", "belts/a/speed", "input register 1")):
        read_map(path)


def test_no_file_and_no_text_are_refused(tmp_path: Path) -> None:
    with pytest.raises(MapError, match="expected a Modbus map"):
        read_map(tmp_path / "none.csv")
    (tmp_path / "bytes.csv").write_bytes(b"\xff\xfe")
    with pytest.raises(MapError, match=stating("bytes.csv", "not UTF-8", "Modbus map")):
        read_map(tmp_path / "bytes.csv")
    (tmp_path / "empty.csv").write_text("")
    with pytest.raises(MapError, match=stating("empty.csv", "no tag", "Modbus map")):
        read_map(tmp_path / "empty.csv")


@pytest.mark.parametrize("high", [0.123456789, 0.6, 1 / 3])
def test_a_float_at_a_limit_is_the_limit(high: float) -> None:
    row = modbus_map([replace(SPEED, high=high)])[0]
    assert decode(row, encode(row, high)) == high
    above = float(np.nextafter(np.float32(high), np.float32(1.0)))
    assert decode(row, encode(row, above)) > high
    assert decode(row, encode(row, 0.1)) == 0.1
