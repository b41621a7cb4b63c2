# SPDX-License-Identifier: Apache-2.0
"""Alarms that a controller adds to the tags of a line."""

from __future__ import annotations

from conveyor_sim.control.scan import ControlError, bind, known_alarms
from conveyor_sim.errors import ConveyorError
from conveyor_sim.line.line import image_of
from conveyor_sim.line.tag import Tag, switch
from conveyor_sim.run.controller_source import ControllerSource
from conveyor_sim.run.scan_loop import tags_for_control
from conveyor_sim.scene import Scene


def controller_tags(scene: Scene, source: ControllerSource) -> list[Tag]:
    """Return the alarms that a controller adds to those of a scene's line.

    Alarms that a Python controller reports without a declaration are unknown before it runs. Raise ConveyorError for a
    controller that can't be loaded, or does not fit the line.
    """
    image, controller = image_of(scene), source.load()
    try:
        bind(controller, tags_for_control(image))
        alarms = known_alarms(controller)
    except ControlError as error:
        raise ConveyorError(str(error)) from error
    own = {tag.name for tag in image.tags}
    return [switch(name, "alarm", f"Of the controller: {text}.") for name, text in alarms.items() if name not in own]
