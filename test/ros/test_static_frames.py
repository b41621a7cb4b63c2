# SPDX-License-Identifier: Apache-2.0
"""Frames of belts and devices on /tf_static: places by hand, and what a subscriber of a node and of a playback gets."""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest
import rclpy
from rclpy.signals import SignalHandlerOptions
from ros.conftest import SMALL_LINE
from ros.line_client import LineClient
from ros.recording import record
from ros.warm_child import WarmProcess

from conveyor_sim.bag.reader import open_bag
from conveyor_sim.ros.child import Child, arguments_of
from conveyor_sim.ros.replay_job import ReplayNode
from conveyor_sim.ros.static_frames import static_frames
from conveyor_sim.scene import load_scene, parse_scene

PLACES = """
name: places
duration: 1
contacts: [{between: [glass, glass], stiffness: 5000}]
base: [{between: [glass, chain], friction: 0.4}]
bottle_types: {bottle: {radius: 0.03, mass: 0.2, material: glass}}
belts:
  up: {kind: straight, start: [1, 2], angle: 90 deg, length: 1, width: 0.2, speed: 0.5, material: chain}
  left:
    {kind: curved, centre: [0, 0], inner_radius: 0.9, width: 0.2, start_angle: 0, span: 90 deg, speed: 0.5,
     material: chain}
  right:
    {kind: curved, centre: [0, 0], inner_radius: 1.9, width: 0.2, start_angle: 0, span: 90 deg, speed: 0.5,
     material: chain, turn: right}
infeeds:
  feed: {bottle: bottle, position: [1, 2.5], direction: 180 deg, speed: 0.5, count: 1, gap: 0.1}
photo_eyes:
  eye: {from: [1, 2.5], to: [1, 2.4]}
zones:
  area: {region: [[0, 0], [2, 0], [2, 1], [0, 1]]}
"""


def test_frames_lie_where_the_scene_puts_its_parts() -> None:
    frames = {frame.name: frame[1:] for frame in static_frames(parse_scene(PLACES, "places.yaml"))}
    quarter = math.pi / 2
    expected = {
        "belts/up": (0.9, 2.0, quarter),
        "belts/left": (1.0, 0.0, quarter),
        "belts/right": (0.0, 2.0, 0.0),
        "infeeds/feed": (1.0, 2.5, math.pi),
        "photo_eyes/eye": (1.0, 2.5, -quarter),
        "zones/area": (1.0, 0.5, 0.0),
    }
    assert frames.keys() == expected.keys()
    for name, place in expected.items():
        assert frames[name] == pytest.approx(place, abs=1e-12), name


def heard(client: LineClient, frames: set[str]) -> dict[str, Any]:
    """The transforms of a latched message, by child frame, once those of `frames` are there."""
    kind = pytest.importorskip("tf2_msgs.msg").TFMessage
    with client.listen(kind, "/tf_static") as listener:
        transforms = {one.child_frame_id: one for one in listener.first().transforms}
    assert transforms.keys() >= frames
    return transforms


def test_a_late_subscriber_gets_the_frames_of_a_node(start_node: Callable[..., Child], client: LineClient) -> None:
    node = start_node(frame_id="hall")
    scene = load_scene(SMALL_LINE)
    transforms = heard(client, {"belts/feeder", "belts/table", "photo_eyes/entry", "infeeds/infeed"})
    assert {one.header.frame_id for one in transforms.values()} == {"hall"}
    for frame in static_frames(scene):
        pose = transforms[frame.name].transform
        assert (pose.translation.x, pose.translation.y, pose.translation.z) == (frame.x, frame.y, 0.0)
        assert 2.0 * math.atan2(pose.rotation.z, pose.rotation.w) == pytest.approx(frame.direction)
    node.stop()


def test_frames_in_a_namespace_have_its_name(domain: int, client: LineClient, tmp_path: Path) -> None:
    arguments = [*arguments_of("sim_node", {"scene": SMALL_LINE, "start_paused": True}), "-r", "__ns:=/hall/cell_1"]
    node = WarmProcess("sim_node", arguments, {**os.environ, "ROS_LOG_DIR": str(tmp_path)}, tmp_path)
    assert set(heard(client, {"hall/cell_1/belts/feeder"})) == {
        f"hall/cell_1/{frame.name}" for frame in static_frames(load_scene(SMALL_LINE))
    }
    node.stop()


def test_a_playback_publishes_the_frames_of_its_scene(domain: int, client: LineClient, tmp_path: Path) -> None:
    record(tmp_path / "bag")
    context = rclpy.Context()
    rclpy.init(context=context, signal_handler_options=SignalHandlerOptions.NO)
    with open_bag(tmp_path / "bag") as bag, closing(ReplayNode(bag, 1.0, None, True, lambda: None, context=context)):
        transforms = heard(client, {"belts/straight", "photo_eyes/entry"})
    rclpy.shutdown(context=context)
    assert {one.header.frame_id for one in transforms.values()} == {"hall"}
