# SPDX-License-Identifier: Apache-2.0
"""Topic /tf_static: a frame for each belt and each device with a place, named as in the scene (`photo_eyes/exit`)."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

from geometry_msgs.msg import TransformStamped
from rclpy.node import Node

from conveyor_sim.bag.messages.topics import TOPICS
from conveyor_sim.ros.publishers import NO_EVENTS, message_class
from conveyor_sim.ros.qos_overrides import publisher_qos
from conveyor_sim.scene import Scene
from conveyor_sim.scene.geometry import BeltShape, belt_shapes
from conveyor_sim.scene.parts.device_part import Mark

TF_STATIC = "/tf_static"


class StaticFrame(NamedTuple):
    """Frame at the height of the belts: its origin in m, and the direction of its x axis in rad."""

    name: str
    x: float
    y: float
    direction: float


def static_frames(scene: Scene) -> Iterator[StaticFrame]:
    """Yield the frames of belts and devices.

    The frame of a belt lies in the middle of its start, and x is the direction of positive speed there. That of a
    photo-eye, counter or inspection lies at `from`, and x points to `to`. That of an entry or a station lies where
    bottles appear, and x is their direction. That of a region lies in the middle of its corners, and is not rotated.
    """
    belts = set[str]()
    for shape in belt_shapes(scene):
        if shape.belt_name not in belts:  # the first surface of a belt of several
            belts.add(shape.belt_name)
            yield _belt(f"belts/{shape.belt_name}", shape)
    for (place, name), part in scene.devices():
        marks = sorted(part.marks(name), key=lambda mark: mark.look != "entry")
        if marks:
            yield _device(f"{place}/{name}", marks[0])


def _belt(name: str, shape: BeltShape) -> StaticFrame:
    right, left = (edge[0] for edge in shape.edges(2))
    (x, y), (across_x, across_y) = (right + left) / 2.0, left - right
    return StaticFrame(name, float(x), float(y), math.atan2(-across_x, across_y))


def _device(name: str, mark: Mark) -> StaticFrame:
    if mark.look == "entry":
        (x, y), direction = mark.points[0], mark.direction
    elif mark.look in ("region", "exit"):
        (x, y), direction = mark.points.mean(axis=0), 0.0
    else:
        (x, y), (to_x, to_y) = mark.points
        direction = math.atan2(to_y - y, to_x - x)
    return StaticFrame(name, float(x), float(y), direction)


def publish_frames(node: Node, scene: Scene, frame_id: str) -> None:
    """Publish the frames of a scene in `frame_id`, latched. In a namespace, their names begin with it (`cell_1/`).

    Log a sentence instead if tf2_msgs is not installed.
    """
    row = TOPICS[TF_STATIC]
    try:
        kind = message_class(row.type)
    except ImportError:
        node.get_logger().info(f"no frames on {TF_STATIC}, because tf2_msgs is not installed")
        return
    prefix = f"{node.get_namespace()}/".lstrip("/")
    publisher = node.create_publisher(
        kind, TF_STATIC, publisher_qos(node, TF_STATIC, row.qos), event_callbacks=NO_EVENTS
    )
    frames = static_frames(scene)
    publisher.publish(kind(transforms=[_transform(frame, f"{prefix}{frame.name}", frame_id) for frame in frames]))


def _transform(frame: StaticFrame, name: str, frame_id: str) -> TransformStamped:
    message = TransformStamped(child_frame_id=name)
    message.header.frame_id = frame_id
    message.transform.translation.x, message.transform.translation.y = frame.x, frame.y
    half = frame.direction / 2.0
    message.transform.rotation.z, message.transform.rotation.w = math.sin(half), math.cos(half)
    return message
