# SPDX-License-Identifier: Apache-2.0
"""Every part of a scene has a device class, is drawn, and is counted by the roles of its signals."""

from collections.abc import Iterator

import pytest

from conveyor_sim.line.device_kinds import DEVICES, build_devices
from conveyor_sim.physics.model import build_model
from conveyor_sim.scene import Scene, load_scene
from conveyor_sim.scene.marks import marks_of
from conveyor_sim.scene.parts.device_part import DevicePart, Entry, Exit
from conveyor_sim.support.resources import scene_path

BY_SHAPE = {
    "belt",
    "gate",
    "pusher",
    "diverter",
    "divider",
    "adjustable",
    "clamp",
    "star",
    "screw",
    "side_belt",
    "carousel",
}
"""Kinds that are drawn as belts and rails, or along them."""
ON_PANEL = {"button", "selector", "emergency_stop", "lamp", "horn", "stack_light", "numeric"}
PLACELESS = {"axis", "drive", "indicator", *ON_PANEL}
"""Kinds without a place. A drive and an axis move others, an indicator uses a counter and a zone, which are drawn. The
panel stands beside the line."""


def kinds(part: type[DevicePart] = DevicePart) -> Iterator[str]:
    if part.KIND:
        yield part.KIND
    for below in part.__subclasses__():
        yield from kinds(below)


@pytest.fixture(scope="module", params=["buffer_lane", "reject_line", "watched_eyes", "zoned_line"])
def scene(request: pytest.FixtureRequest) -> Scene:
    return load_scene(scene_path(f"scenarios/{request.param}"))


def test_every_kind_of_part_has_a_device() -> None:
    assert set(kinds()) == set(DEVICES)


def test_every_kind_of_device_is_drawn() -> None:
    drawn = {part.KIND for part in every_part() if part.mark.__func__ is not DevicePart.mark}
    assert drawn == set(DEVICES) - BY_SHAPE - PLACELESS


def every_part() -> Iterator[DevicePart]:
    """Yield one part of each kind, without its fields."""
    todo: list[type[DevicePart]] = [DevicePart]
    for part in todo:
        todo += part.__subclasses__()
        if part.KIND:
            yield part.model_construct()


def test_marks_are_those_of_the_scene(scene: Scene) -> None:
    marked = {(part.KIND, name) for (_, name), part in scene.devices() if part.KIND not in BY_SHAPE | PLACELESS}
    assert {(mark.kind, mark.name) for mark in marks_of(scene)} == marked


def test_devices_act_in_the_order_of_the_scenes_fields(scene: Scene) -> None:
    parts = [f"{field}/{name}" for (field, name), _ in scene.devices()]
    devices = [device.name for device in build_devices(scene, build_model(scene))]
    assert [name for name in devices if "/" in name] == parts


def test_what_bottles_come_from_and_leave_by_counts_them(scene: Scene) -> None:
    """Sums depend on `adds_to` of signals. They would miss an entry or exit without such a signal."""
    devices = {device.name: device for device in build_devices(scene, build_model(scene))}
    for (field, name), part in scene.devices():
        adds = {signal.adds_to for signal in devices[f"{field}/{name}"].signals} - {"", "state"}
        assert adds <= {"fed"} if isinstance(part, Entry) else True
        assert bool(adds) == isinstance(part, (Entry, Exit))
