# SPDX-License-Identifier: Apache-2.0
"""Entities of simulation_interfaces, over DDS: listed, spawned, deleted; steps by action."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import pytest
from action_msgs.msg import GoalStatus
from facts import missing
from geometry_msgs.msg import Point, Pose, PoseStamped, Quaternion, Vector3
from rclpy.action.client import ActionClient
from ros.line_client import LineClient, until
from simulation_interfaces import msg
from simulation_interfaces import srv as standard_srv
from simulation_interfaces.action import SimulateSteps
from simulation_interfaces.msg import Bounds, EntityCategory, EntityFilters, Result, TagsFilter
from std_msgs.msg import Header
from std_srvs.srv import Trigger

from conveyor_sim.bag.replay import replay
from conveyor_sim.ros.child import Child

FREE = (1.2, 0.1)
"""m, on the feeder, where no bottle is at tick 0."""
SPAWN = standard_srv.SpawnEntity.Response


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("entities") / "bag"


@pytest.fixture(scope="module")
def shared_node(start_node: Callable[..., Child], recording: Path) -> Child:
    return start_node(record=str(recording))


@pytest.fixture
def line(shared_node: Child, client: LineClient) -> Iterator[LineClient]:
    client.call(Trigger, "pause")
    client.reset()
    yield client


def pose(
    x: float = FREE[0], y: float = FREE[1], z: float = 0.0, frame: str = "", turn: Sequence[float] = (0, 0, 0, 1)
) -> PoseStamped:
    orientation = Quaternion(**dict(zip("xyzw", map(float, turn), strict=True)))
    return PoseStamped(header=Header(frame_id=frame), pose=Pose(position=Point(x=x, y=y, z=z), orientation=orientation))


def spawn(line: LineClient, **fields: Any) -> Any:
    request = {"allow_renaming": True, "uri": "bottle", "initial_pose": pose(), **fields}
    return line.call(standard_srv.SpawnEntity, "spawn_entity", **request)


def entities(line: LineClient, **filters: Any) -> list[str]:
    response = line.call(standard_srv.GetEntities, "get_entities", filters=EntityFilters(**filters))
    assert response.result.result == Result.RESULT_OK, response.result.error_message
    return list(response.entities)


def state(line: LineClient, name: str) -> Any:
    return line.call(standard_srv.GetEntityState, "get_entity_state", entity=name)


def delete(line: LineClient, name: str) -> Any:
    return line.call(standard_srv.DeleteEntity, "delete_entity", entity=name).result


def test_every_bottle_is_an_entity_with_its_state(line: LineClient) -> None:
    line.step(30)
    names = entities(line)
    assert names == [f"bottle_{number}" for number in range(len(names))] and len(names) >= 10
    all_of_them = line.call(standard_srv.GetEntitiesStates, "get_entities_states")
    assert list(all_of_them.entities) == names
    one = state(line, names[-1])
    assert one.result.result == Result.RESULT_OK
    assert one.state == all_of_them.states[-1]
    assert (one.state.header.frame_id, one.state.header.stamp.nanosec) == ("world", 300_000_000)
    assert 0.0 < one.state.pose.position.x < 0.5 and one.state.twist.linear.x > 0.1
    info = line.call(standard_srv.GetEntityInfo, "get_entity_info", entity=names[0]).info
    assert (info.category.category, list(info.tags)) == (EntityCategory.CATEGORY_DYNAMIC_OBJECT, ["bottle"])
    bounds = line.call(standard_srv.GetEntityBounds, "get_entity_bounds", entity=names[0]).bounds
    assert (bounds.type, [point.x for point in bounds.points]) == (Bounds.TYPE_BOX, [0.065, -0.065])
    for name in ("bottle_999", "", "belt", "bottle_0\n"):
        assert state(line, name).result.result == Result.RESULT_NOT_FOUND


def test_filters_choose_entities(line: LineClient) -> None:
    everything = entities(line)
    assert entities(line, filter="_[12]$") == ["bottle_1", "bottle_2"]
    assert entities(line, categories=[EntityCategory(category=EntityCategory.CATEGORY_ROBOT)]) == []
    dynamic = EntityCategory(category=EntityCategory.CATEGORY_DYNAMIC_OBJECT)
    assert entities(line, categories=[dynamic]) == everything
    for mode, some in ((TagsFilter.FILTER_MODE_ANY, everything), (TagsFilter.FILTER_MODE_ALL, [])):
        assert entities(line, tags=TagsFilter(tags=["bottle", "red"], filter_mode=mode)) == some
    corner = [Vector3(x=2.95, y=-0.15), Vector3(x=2.9 - 0.066, y=-0.5)]
    near = entities(line, bounds=Bounds(type=Bounds.TYPE_BOX, points=corner))
    assert "bottle_0" in near and len(near) < len(everything)
    at_first = [Vector3(x=2.9, y=-0.2), Vector3(x=0.001)]
    assert entities(line, bounds=Bounds(type=Bounds.TYPE_SPHERE, points=at_first)) == ["bottle_0"]


def test_a_filter_that_would_take_for_ever_is_refused(line: LineClient) -> None:
    assert spawn(line, name="a" * 64).result.result == Result.RESULT_OK
    refused = line.call(standard_srv.GetEntities, "get_entities", filters=EntityFilters(filter="(a|aa)+b")).result
    assert refused.result == Result.RESULT_OPERATION_FAILED
    assert not missing(refused.error_message, "filter", "(a|aa)+b", "0.2 s")
    assert entities(line, filter="^a+$") == ["a" * 64]


@pytest.mark.parametrize(
    ("filters", "code", "reason"),
    [
        ({"filter": "("}, Result.RESULT_OPERATION_FAILED, ["filter", "regular expression"]),
        ({"filter": "a" * 10_000}, Result.RESULT_OPERATION_FAILED, ["10000 characters"]),
        ({"bounds": Bounds(type=Bounds.TYPE_CONVEX_HULL)}, Result.RESULT_FEATURE_UNSUPPORTED, ["bounds.type: 2"]),
        ({"bounds": Bounds(type=Bounds.TYPE_BOX)}, Result.RESULT_OPERATION_FAILED, ["0 given", "2"]),
        (
            {"bounds": Bounds(type=Bounds.TYPE_SPHERE, points=[Vector3(x=math.nan), Vector3(x=1.0)])},
            Result.RESULT_OPERATION_FAILED,
            ["finite"],
        ),
        (
            {"bounds": Bounds(type=Bounds.TYPE_BOX, points=[Vector3(), Vector3(x=1.0)])},
            Result.RESULT_OPERATION_FAILED,
            ["upper right"],
        ),
    ],
)
def test_a_filter_that_cannot_be_is_refused(line: LineClient, filters: Any, code: int, reason: list[str]) -> None:
    result = line.call(standard_srv.GetEntities, "get_entities", filters=EntityFilters(**filters)).result
    assert result.result == code
    assert missing(result.error_message, reason) == []


def test_spawnable_are_the_bottle_types_of_the_scene(line: LineClient) -> None:
    response = line.call(standard_srv.GetSpawnables, "get_spawnables", sources=["models"])
    assert [(one.uri, one.spawn_bounds.points[0].x) for one in response.spawnables] == [("bottle", 0.065)]
    assert response.result.result == Result.RESULT_OK
    assert "models" in response.result.error_message


def test_a_bottle_is_spawned_moves_and_is_deleted(line: LineClient) -> None:
    before = entities(line)
    spawned = spawn(line, name="probe", allow_renaming=False, initial_pose=pose(frame="world"))
    assert (spawned.result.result, spawned.entity_name) == (Result.RESULT_OK, "probe")
    assert entities(line) == [*before, "probe"]  # before a tick has passed
    assert state(line, "probe").state.pose.position.x == FREE[0]
    line.step(20)
    moved = state(line, "probe").state
    assert moved.pose.position.x > FREE[0]
    assert moved.twist.linear.x == pytest.approx(0.5, abs=0.05)
    assert delete(line, "probe").result == Result.RESULT_OK
    assert "probe" not in entities(line)
    assert delete(line, "probe").result == Result.RESULT_NOT_FOUND
    line.step(1)
    assert "probe" not in entities(line)


def test_names_are_generated_where_that_is_allowed(line: LineClient) -> None:
    first = spawn(line)
    assert first.entity_name in entities(line) and first.entity_name.startswith("bottle_")
    named = spawn(line, name="probe", initial_pose=pose(1.0))
    again = spawn(line, name="probe", initial_pose=pose(0.8))
    assert named.entity_name == "probe" and again.entity_name not in ("probe", first.entity_name)
    taken = spawn(line, name="probe", allow_renaming=False, initial_pose=pose(0.6))
    assert taken.result.result == SPAWN.NAME_NOT_UNIQUE
    line.step(1)
    assert {"probe", first.entity_name, again.entity_name} <= set(entities(line))
    line.reset()
    assert "probe" not in entities(line)


@pytest.mark.parametrize(
    ("fields", "code", "reason"),
    [
        ({"uri": "cup"}, Result.RESULT_NOT_FOUND, ["cup", "no such bottle type", "bottle"]),
        ({"uri": ""}, SPAWN.NO_RESOURCE, ["uri"]),
        ({"uri": "", "resource_string": "<sdf/>"}, Result.RESULT_FEATURE_UNSUPPORTED, ["resource_string"]),
        ({"entity_namespace": "a"}, SPAWN.NAMESPACE_INVALID, ["entity_namespace"]),
        ({"name": "", "allow_renaming": False}, SPAWN.NAME_INVALID, ["name"]),
        ({"name": "a b"}, SPAWN.NAME_INVALID, ["a b", "letter"]),
        ({"name": "a" * 65}, SPAWN.NAME_INVALID, ["63"]),
        ({"name": "bottle_7", "allow_renaming": False}, SPAWN.NAME_INVALID, ["bottle_7"]),
        ({"initial_pose": pose(2.9, -0.2)}, Result.RESULT_OPERATION_FAILED, ["overlaps bottle 0"]),
        ({"initial_pose": pose(3.39, 0.4)}, Result.RESULT_OPERATION_FAILED, ["overlaps rail wall"]),
        ({"initial_pose": pose(9.0)}, SPAWN.INVALID_POSE, ["(9, 0.1)", "on no belt"]),
        ({"initial_pose": pose(math.nan)}, SPAWN.INVALID_POSE, ["x nan"]),
        ({"initial_pose": pose(math.inf)}, SPAWN.INVALID_POSE, ["x inf"]),
        ({"initial_pose": pose(z=0.5)}, SPAWN.INVALID_POSE, ["z: 0.5"]),
        ({"initial_pose": pose(z=math.nan)}, SPAWN.INVALID_POSE, ["z: nan"]),
        ({"initial_pose": pose(frame="map")}, SPAWN.INVALID_POSE, ["map", "world"]),
        ({"initial_pose": pose(turn=(0, 0, 0, 0))}, SPAWN.INVALID_POSE, ["orientation"]),
        ({"initial_pose": pose(turn=(0, 0, 0, math.nan))}, SPAWN.INVALID_POSE, ["orientation"]),
        ({"initial_pose": pose(turn=(0.7071068, 0, 0, 0.7071068))}, SPAWN.INVALID_POSE, ["orientation"]),
    ],
)
def test_a_spawn_that_cannot_be_is_refused(line: LineClient, fields: Any, code: int, reason: list[str]) -> None:
    before = entities(line)
    response = spawn(line, **fields)
    assert (response.result.result, response.entity_name) == (code, "")
    assert missing(response.result.error_message, reason) == []
    line.step(1)
    assert entities(line)[: len(before)] == before


def test_several_are_spawned_each_with_its_result(line: LineClient) -> None:
    def request(x: float, uri: str = "bottle") -> Any:
        return msg.SpawnEntity(allow_renaming=True, entity_resource=msg.Resource(uri=uri), initial_pose=pose(x))

    response = line.call(
        standard_srv.SpawnEntities, "spawn_entities", spawn_requests=[request(1.2), request(1.21), request(1.0, "cup")]
    )
    assert response.result.result == response.ENTITIES_SPAWN_FAILED
    assert "2 of 3" in response.result.error_message
    codes = [Result.RESULT_OK, Result.RESULT_OPERATION_FAILED, Result.RESULT_NOT_FOUND]
    assert [one.result.result for one in response.results] == codes
    assert response.results[0].entity_name in entities(line)
    none = line.call(standard_srv.SpawnEntities, "spawn_entities")
    assert (none.result.result, list(none.results)) == (Result.RESULT_OK, [])


def test_spawning_and_deletion_replay_to_the_bit(line: LineClient, recording: Path) -> None:
    """The last run so far, whose recording the next reset completes."""
    line.step(3)
    spawn(line, name="probe")
    line.step(30)
    assert delete(line, "probe").result == Result.RESULT_OK
    assert delete(line, "bottle_1").result == Result.RESULT_OK
    line.step(30)
    line.reset()
    bags = sorted(recording.parent.iterdir(), key=lambda bag: int(bag.name.removeprefix("bag").strip("_") or 0))
    report = replay(bags[-2])
    assert (report.exact, report.difference) == (True, None)
    assert report.compared["outcomes"] == 3


def goal(line: LineClient, steps: int, feedback: Any = None) -> Any:
    client = ActionClient(line.node, SimulateSteps, "conveyor_sim/simulate_steps")
    until(client.server_is_ready, "the action")
    sent = client.send_goal_async(SimulateSteps.Goal(steps=steps), feedback_callback=feedback)
    handle = until(sent.result, "the acceptance of the goal")
    assert handle.accepted
    return handle


def result_of(handle: Any) -> Any:
    future = handle.get_result_async()
    return until(future.result, "the result")


def test_steps_are_taken_by_action_with_feedback(line: LineClient) -> None:
    heard: list[Any] = []
    result = result_of(goal(line, 20, lambda message: heard.append(message.feedback)))
    assert (result.status, result.result.result.result) == (GoalStatus.STATUS_SUCCEEDED, Result.RESULT_OK)
    assert int(line.lockstep(0).tick) == 20
    assert heard and all(one.completed_steps + one.remaining_steps == 20 for one in heard)
    assert [one.completed_steps for one in heard] == sorted({one.completed_steps for one in heard})


def test_steps_by_action_are_refused_unless_paused(line: LineClient) -> None:
    for steps, reason in ((0, "0 given"), (10**6, "1000000 given")):
        result = result_of(goal(line, steps))
        assert (result.status, result.result.result.result) == (
            GoalStatus.STATUS_ABORTED,
            Result.RESULT_OPERATION_FAILED,
        )
        assert reason in result.result.result.error_message
    assert line.call(Trigger, "resume").success
    result = result_of(goal(line, 1))
    assert result.status == GoalStatus.STATUS_ABORTED
    assert "PAUSED" in result.result.result.error_message


def test_steps_by_action_can_be_cancelled(line: LineClient) -> None:
    heard: list[Any] = []
    handle = goal(line, 390, lambda message: heard.append(message.feedback))
    until(lambda: heard, "the first step")
    line.between_callbacks(handle.cancel_goal_async)
    result = result_of(handle)
    tick = int(line.lockstep(0).tick)
    if result.status == GoalStatus.STATUS_CANCELED:
        assert tick < 390
        assert missing(result.result.result.error_message, [f"{tick} of 390"]) == []
    else:  # the last step came first
        assert (result.status, tick) == (GoalStatus.STATUS_SUCCEEDED, 390)
    assert line.state() == 2
    line.step(1)
