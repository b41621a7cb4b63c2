# SPDX-License-Identifier: Apache-2.0
"""Published messages: equal to those of the engine, only with subscribers, in the stated quality of service."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from conveyor_msgs.msg import Belts, Bottles, Contacts, Ledger, Line, Signals
from facts import stating
from geometry_msgs.msg import PoseArray
from rclpy.qos import DurabilityPolicy, ReliabilityPolicy
from ros.conftest import SMALL_LINE
from ros.line_client import LineClient, until
from std_msgs.msg import Bool, Float64
from visualization_msgs.msg import Marker, MarkerArray

from conveyor_sim.bag.messages.topics import OUTPUTS, TOPICS
from conveyor_sim.bag.messages.typestore import default_distro
from conveyor_sim.errors import ConveyorError
from conveyor_sim.ros.child import Child
from conveyor_sim.ros.publishers import check_type, require_same_definition
from conveyor_sim.scene import load_scene
from conveyor_sim.simulation import Simulation

FEEDER = "belts/feeder/cmd_speed"


@pytest.fixture(scope="module")
def engine() -> Simulation:
    """The small line after 300 ticks, when there are contacts of both kinds; commanded as `at_tick_300` is."""
    simulation = Simulation(load_scene(SMALL_LINE))
    simulation.command([FEEDER], [0.75])
    simulation.advance(300)
    return simulation


def at_tick_300(line: LineClient, kind: Any, topic: str) -> Any:
    """The message of tick 300, by lockstep in four scans."""
    with line.listen(kind, topic) as heard:
        line.reset_until(heard)
        line.lockstep(1, names=[FEEDER], values=[0.75])
        for target in (17, 298, 300):
            assert line.lockstep(target).accepted
        return heard.at_tick(300)


def assert_same_columns(message: Any, columns: Any) -> None:
    for name, expected in vars(columns).items():
        assert np.array_equal(np.asarray(getattr(message, name), dtype=expected.dtype), expected), name


def test_bottles_are_the_engines_bit_for_bit(line: LineClient, engine: Simulation) -> None:
    message = at_tick_300(line, Bottles, "bottles")
    assert_same_columns(message, engine.bottles())
    assert max(message.peak_force) > 0.0


def test_contacts_are_the_engines_bit_for_bit(line: LineClient, engine: Simulation) -> None:
    message = at_tick_300(line, Contacts, "contacts")
    assert_same_columns(message, engine.contacts())
    assert set(message.kind) == {Contacts.BOTTLE_BOTTLE, Contacts.BOTTLE_RAIL}


def test_belts_and_signals_are_the_engines(line: LineClient, engine: Simulation) -> None:
    assert_same_columns(at_tick_300(line, Belts, "belts"), engine.belts())
    assert np.array_equal(at_tick_300(line, Signals, "signals").values, engine.signals())


def test_headers_carry_simulated_time_and_the_frame(line: LineClient) -> None:
    header = at_tick_300(line, Bottles, "bottles").header
    assert (header.stamp.sec, header.stamp.nanosec) == (3, 0)
    assert header.frame_id == "world"


def test_poses_stand_where_the_bottles_do(line: LineClient, engine: Simulation) -> None:
    with line.listen(PoseArray, "poses") as heard:
        line.reset_until(heard)
        line.lockstep(300, names=[FEEDER], values=[0.75])
        poses = until(lambda: [m for m in heard.messages if m.header.stamp.sec == 3], "poses of tick 300")[0].poses
    bottles = engine.bottles()
    assert [pose.position.x for pose in poses] == bottles.x.tolist()
    assert [pose.position.y for pose in poses] == bottles.y.tolist()
    turned = [2.0 * np.arctan2(pose.orientation.z, pose.orientation.w) for pose in poses]
    assert np.allclose(np.exp(1j * np.array(turned)), np.exp(1j * bottles.theta), atol=1e-12)


def test_the_line_and_the_plant_reach_whoever_joins_late(line: LineClient) -> None:
    line.step(10)
    with line.listen(Line, "line") as lines, line.listen(MarkerArray, "plant") as plants:
        told, plant = lines.first(), plants.first()
    assert told.scene_text == SMALL_LINE.read_text()
    assert told.overrides == "duration: 1000.0\n"
    assert list(told.belts) == ["feeder", "table"]
    assert list(told.command_names) == [FEEDER, "belts/table/cmd_speed"]
    assert plant.markers[0].action == Marker.DELETEALL  # of an earlier scene, in a viewer that stays open
    assert {marker.action for marker in plant.markers[1:]} == {Marker.ADD}


def test_a_photo_eye_has_a_topic_that_tells_changes_and_reaches_who_joins_late(line: LineClient) -> None:
    simulation, levels = Simulation(load_scene(SMALL_LINE)), [False]
    while simulation.tick < 200:
        simulation.advance()
        levels.append(simulation.line.photo_eyes()["photo_eyes/entry"])
    changes = [tick for tick in range(1, 201) if levels[tick] != levels[tick - 1]]
    assert len(changes) > 3
    now = 0
    with line.listen(Bool, "photo_eyes/entry", "photo_eyes") as heard:
        heard.first()
        for count, tick in enumerate(changes, start=2):
            line.step(tick - now)
            now = tick
            until(lambda count=count: len(heard.messages) >= count, "a change of the photo-eye")
        assert [message.data for message in heard.messages] == [False, *(levels[tick] for tick in changes)]
    with line.listen(Bool, "photo_eyes/entry", "photo_eyes") as late:
        assert late.first().data is levels[now]


def test_markers_show_every_bottle(line: LineClient) -> None:
    with line.listen(MarkerArray, "markers") as heard:
        line.reset_until(heard)
        shown = heard.first().markers
    assert sum(len(marker.points) for marker in shown) == len(Simulation(load_scene(SMALL_LINE)).bottles().id)


def test_topics_offer_the_stated_quality_of_service(line: LineClient) -> None:
    own = [name for name, output in OUTPUTS.items() if not output.by_controller]
    for name in [*own, "/clock", "/diagnostics"]:
        (info,) = line.node.get_publishers_info_by_topic(f"/{name.removeprefix('/')}")
        qos = TOPICS[name].qos
        assert info.qos_profile.reliability == ReliabilityPolicy[qos.reliability.upper()], name
        assert info.qos_profile.durability == DurabilityPolicy[qos.durability.upper()], name
    for name in ("commands", FEEDER):
        (info,) = line.node.get_subscriptions_info_by_topic(f"/{name}")
        assert info.qos_profile.reliability == ReliabilityPolicy.RELIABLE


def test_nothing_is_serialized_that_nobody_listens_to(line: LineClient) -> None:
    def published() -> dict[str, int]:
        values = line.diagnostics()[1]
        return {name.removeprefix("published "): int(count) for name, count in values.items() if "published " in name}

    data = {name for name, output in OUTPUTS.items() if output.rate is not None}
    line.step(100)
    unwatched = published()
    with line.listen(Signals, "signals") as heard:
        line.reset_until(heard)
        line.step(100)
        watched = published()
    changed = {name for name in data if watched.get(name, 0) > unwatched.get(name, 0)}
    assert changed == {"signals"}


def test_a_type_built_from_another_definition_is_told(line: LineClient) -> None:
    publisher = line.node.create_publisher(Float64, "of_another_type", 1)
    check_type(line.node, publisher.topic_name, "std_msgs/msg/Float64", default_distro())
    with pytest.raises(ConveyorError, match="conveyor_msgs/msg/Bottles: the installed message package was built from"):
        check_type(line.node, publisher.topic_name, "conveyor_msgs/msg/Bottles", default_distro())


def test_a_subscriber_names_a_node_with_another_definition(line: LineClient) -> None:
    publisher = line.node.create_publisher(Float64, "published_differently", 1)
    require_same_definition(line.node, publisher.topic_name, "std_msgs/msg/Float64")
    with pytest.raises(ConveyorError, match=stating("/published_differently", line.node.get_name(), "one version")):
        require_same_definition(line.node, publisher.topic_name, "conveyor_msgs/msg/Line")


def test_the_ledger_is_the_engines_where_it_is_asked_for(
    start_node: Callable[..., Child], shared_node: Child, client: LineClient
) -> None:
    """The last test of the shared node, which keeps no ledger."""
    sim = Simulation(load_scene(SMALL_LINE, {"outputs": {"ledger": 10.0}}))  # compiles what the node is to read
    sim.command([FEEDER], [0.75])
    sim.advance(300)
    with client.listen(Ledger, "ledger") as heard:
        client.step(100)
        client.step(100)
        assert heard.messages == []
        shared_node.stop()
        node = start_node(**{"duration": 1000.0, "rates.ledger": 10.0})
        message = at_tick_300(client, Ledger, "ledger")
        assert {message.tick for message in heard.messages} >= {290, 300}
        node.stop()
    books = sim.ledger()
    assert books is not None
    for name, expected in vars(books).items():
        assert np.array_equal(np.asarray(getattr(message, name)), expected), name
    assert books.base_friction > 10.0 * abs(books.residual) > 0.0
