# SPDX-License-Identifier: Apache-2.0
"""Columns become messages that rosbags and ROS decode to the same values."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from bag.hand_made import HEADER, bottles, contacts
from bag.ros_decode import assert_same, deserialize

from conveyor_sim.bag.messages import encode
from conveyor_sim.bag.messages.topics import TOPICS
from conveyor_sim.bag.messages.typestore import typestore
from conveyor_sim.columns.alarms import AlarmColumns
from conveyor_sim.columns.bottles import BeltColumns, BottleColumns
from conveyor_sim.columns.damage import DamageColumns, DamageEvent, RailWearColumns
from conveyor_sim.columns.events import Event, event_columns
from conveyor_sim.columns.image import NOTHING_FORCED, Image
from conveyor_sim.columns.ledger import balance
from conveyor_sim.line.commands.authority import MODES
from conveyor_sim.line.commands.inputs import SPAWN, CommandOutcome, Input
from conveyor_sim.scene import Scene
from conveyor_sim.scene.recorded import recorded_source
from conveyor_sim.simulation import Simulation

LEDGER = balance(
    stored=np.array([3.0, 0.5, 0.25, 0.0]),
    fed=1.0,
    removed=0.125,
    belt_work=np.array([5.0, -1.5, 0.0]),
    rail_work=np.array([0.75, -0.25]),
    base_friction=0.5,
    contact_friction=0.25,
    damping=0.125,
)
BORNE = DamageColumns(
    np.arange(4, dtype=np.uint64), np.zeros(4, np.uint16), *np.append(np.arange(31.0), math.nan).reshape(8, 4)
)
WEAR = RailWearColumns(np.arange(3, dtype=np.uint32), *np.arange(15.0).reshape(5, 3))
IMAGE = Image(np.array([1.0, math.nan]), np.array([1], dtype=np.uint32), np.array([-0.5]))
ALARM_STATES = AlarmColumns(
    number=np.array([1, 2], dtype=np.uint64),
    id=["a", "ü"],
    text=["A", "B"],
    alarm_class=["error", "message"],
    priority=np.array([800, 1], dtype=np.uint16),
    tag=["", "belts/a/speed"],
    group=["g", ""],
    suppressed_by=[(), ("a", "b c")],
    latching=np.array([True, False]),
    declared_by=["line", "plc"],
    state=np.array([0, 8], dtype=np.uint8),
    active=np.array([False, True]),
    first_out=np.array([True, False]),
    shelved_until=np.array([-1, 70]),
    since=np.array([0, 5], dtype=np.uint64),
    changed_by=["", "anna"],
)
CASES: dict[str, tuple[str, Callable[[], bytes]]] = {
    "bottles": (TOPICS["bottles"].type, lambda: TOPICS["bottles"].pack(bottles(5), HEADER)),
    "no bottles": (TOPICS["bottles"].type, lambda: TOPICS["bottles"].pack(bottles(0), HEADER)),
    "contacts": (TOPICS["contacts"].type, lambda: TOPICS["contacts"].pack(contacts(3), HEADER)),
    "no contacts": (TOPICS["contacts"].type, lambda: TOPICS["contacts"].pack(contacts(0), HEADER)),
    "belts": (TOPICS["belts"].type, lambda: TOPICS["belts"].pack(BeltColumns(np.arange(2.0), np.arange(2.0)), HEADER)),
    "signals": (TOPICS["signals"].type, lambda: TOPICS["signals"].pack(IMAGE, HEADER)),
    "ledger": (TOPICS["ledger"].type, lambda: TOPICS["ledger"].pack(LEDGER, HEADER)),
    "alarm states": (TOPICS["alarm_states"].type, lambda: TOPICS["alarm_states"].pack(ALARM_STATES, HEADER)),
    "spawned": (
        TOPICS["outcomes"].type,
        lambda: TOPICS["outcomes"].pack(
            CommandOutcome(
                9, Input("commands", "a", "test", SPAWN, ("glass",), (0.5,) * 6), True, "", bottles=(7, 2**63)
            ),
            HEADER,
        ),
    ),
    "bool": (encode.BOOL, lambda: encode.bool_message(True, HEADER)),
    "damage": (TOPICS["damage"].type, lambda: TOPICS["damage"].pack(BORNE, HEADER)),
    "rail wear": (TOPICS["rail_wear"].type, lambda: TOPICS["rail_wear"].pack(WEAR, HEADER)),
    "damage event": (
        TOPICS["damage_events"].type,
        lambda: TOPICS["damage_events"].pack(DamageEvent(9, "tipping", 3, 0.5, -0.25, 1.5, 1.0, "it tips"), HEADER),
    ),
    "events": (
        TOPICS["events"].type,
        lambda: TOPICS["events"].pack(
            event_columns(
                [Event(9, "bottle_fed", "infeeds/a", 3, 4.0, ""), Event(8, "alarm_raised", "alarms/ü", -1, 1.0, "é")], 7
            ),
            HEADER,
        ),
    ),
    "poses": (TOPICS["poses"].type, lambda: TOPICS["poses"].pack(bottles(7), HEADER)),
    "no poses": (TOPICS["poses"].type, lambda: TOPICS["poses"].pack(bottles(0), HEADER)),
    "outcome": (
        TOPICS["outcomes"].type,
        lambda: TOPICS["outcomes"].pack(
            CommandOutcome(
                9,
                Input("commands", "plc é", "operator", "shelve", ("belts/a/cmd_speed",), (math.inf,), ("why", "ü")),
                False,
                "not a number — really",
            ),
            HEADER,
        ),
    ),
}


@pytest.mark.parametrize("case", CASES)
def test_ros_reads_what_rosbags_reads(case: str) -> None:
    type_name, make = CASES[case]
    data = make()
    assert_same(deserialize(type_name, data), typestore().deserialize_cdr(data, type_name))


def decode(case: str) -> Any:
    """A case, decoded by rosbags."""
    type_name, make = CASES[case]
    return typestore().deserialize_cdr(make(), type_name)


def test_bottles_keep_every_bit() -> None:
    message, columns = decode("bottles"), bottles(5)
    for name in BottleColumns.__dataclass_fields__:
        sent, received = getattr(columns, name), getattr(message, name)
        assert received.dtype == sent.dtype
        assert received.tobytes() == sent.tobytes()


def test_header_tells_simulated_time_tick_and_frame() -> None:
    message = decode("contacts")
    stamp = message.header.stamp
    assert (stamp.sec, stamp.nanosec, message.tick, message.header.frame_id) == (12, 340_000_007, 1234, "hall")


def test_a_ledger_tells_what_does_not_close() -> None:
    """1 + 3.5 + 0.5 J came and 1 J went, 3.75 J are held: 0.25 J are lost, of 9.5 J."""
    message = decode("ledger")
    assert (message.kinetic, message.elastic, message.springs) == (3.0, 0.5, 0.25)
    assert message.belt_work.tolist() == [5.0, -1.5, 0.0]
    assert message.rail_work.tolist() == [0.75, -0.25]
    assert (message.residual, message.turnover) == (-0.25, 9.5)


def test_pose_is_position_and_turn_about_the_vertical() -> None:
    columns = bottles(7)
    for index, pose in enumerate(decode("poses").poses):
        assert (pose.position.x, pose.position.y, pose.position.z) == (columns.x[index], columns.y[index], 0.0)
        turn = 2.0 * math.atan2(pose.orientation.z, pose.orientation.w)
        assert math.remainder(turn - columns.theta[index], 2.0 * math.pi) == pytest.approx(0.0, abs=1e-12)
        assert pose.orientation.x == pose.orientation.y == 0.0


def test_columns_of_another_type_or_layout_are_converted() -> None:
    """rosbags alone would copy an int64 array's bytes as if they were doubles, and refuse a strided one."""
    data = TOPICS["signals"].pack(Image(np.arange(6)[::2], *NOTHING_FORCED), HEADER)  # type: ignore[arg-type]
    assert typestore().deserialize_cdr(data, TOPICS["signals"].type).values.tolist() == [0.0, 2.0, 4.0]  # type: ignore[attr-defined]


def test_line_holds_all_that_a_replay_needs(scene: Scene) -> None:
    simulation = Simulation(scene)
    data = encode.line_message(simulation, "run-1", HEADER)
    line: Any = typestore().deserialize_cdr(data, TOPICS["line"].type)
    assert_same(deserialize(TOPICS["line"].type, data), line)
    assert (line.run_id, line.scene_name, line.seed) == ("run-1", "small_line", 7)
    assert (line.scene_text, line.overrides) == recorded_source(scene)
    assert line.belts == ["straight", "turn"]
    assert line.rails == ["right", "left", "stop", "turn_inner", "turn_outer"]
    assert dict(zip(line.bottle_types, line.type_radius.tolist(), strict=True)) == {"small": 0.03, "large": 0.05}
    assert dict(zip(line.bottle_types, line.type_mass.tolist(), strict=True)) == {"small": 0.1, "large": 0.3}
    assert line.dt == pytest.approx(line.tick_ns * 1e-9 / line.steps_per_tick)
    tags = {tag.name: tag for tag in line.tags}
    assert len(line.signal_names) == len(simulation.signals())
    assert line.command_names == ["belts/straight/cmd_speed", "belts/turn/cmd_speed"]
    assert [(tags[name].unit, tags[name].unit_code, tags[name].max) for name in line.command_names] == [
        ("m/s", "MTS", 3.0)
    ] * 2
    modes = tags["belts/turn/mode"]
    assert dict(zip(modes.state_values.tolist(), modes.state_texts, strict=True)) == MODES
    assert line.format == encode.FORMAT
    assert "curved_belts" in line.effects
    assert "normal_damping" not in line.effects
    assert any(version.startswith("numba=") for version in line.versions)
    assert line.engine_hash
    assert line.machine
