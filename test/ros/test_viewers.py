# SPDX-License-Identifier: Apache-2.0
"""Files for RViz2 and Foxglove show existing topics, with the offered quality of service."""

from __future__ import annotations

import json
import re
from pathlib import Path

from ruamel.yaml import YAML

from conveyor_sim.bag.messages.qos import LATCHED
from conveyor_sim.bag.messages.topics import TOPICS

VIEWERS = Path(__file__).resolve().parents[2] / "config" / "viewers"
DISPLAYS = {
    "rviz_default_plugins/MarkerArray": "visualization_msgs/msg/MarkerArray",
    "rviz_default_plugins/PoseArray": "geometry_msgs/msg/PoseArray",
}


def test_rviz_is_shown_topics_of_its_displays_types_with_a_quality_of_service_that_fits() -> None:
    manager = YAML(typ="safe").load(VIEWERS / "line.rviz")["Visualization Manager"]
    assert manager["Global Options"]["Fixed Frame"] == "world"
    *displays, frames = manager["Displays"]
    assert (len(displays), frames["Class"]) == (3, "rviz_default_plugins/TF")
    for display in displays:
        asked = display["Topic"]
        topic = TOPICS[asked["Value"].removeprefix("/")]
        assert topic.type == DISPLAYS[display["Class"]]
        assert (asked["Durability Policy"] == "Transient Local") == (topic.qos is LATCHED)
        assert asked["Reliability Policy"] == "Best Effort" or topic.qos.reliability == "reliable"


def test_panels_of_foxglove_are_all_laid_out_and_read_fields_that_there_are() -> None:
    layout = json.loads((VIEWERS / "foxglove_layout.json").read_text())
    panels = layout["configById"]
    assert set(re.findall(r'"(\w+!\w+)"', json.dumps(layout["layout"]))) == panels.keys()
    drawn = [topic.removeprefix("/") for topic in panels["3D!line"]["topics"]]
    assert [TOPICS[topic].type for topic in drawn] == ["visualization_msgs/msg/MarkerArray"] * 2
    paths = [path["value"] for path in panels["Plot!belts"]["paths"]]
    paths += [panel["topicPath"] for panel in panels.values() if "topicPath" in panel]
    for path in paths:
        topic, _, field = path.removeprefix("/").partition(".")
        assert not field or field.partition("[")[0] in TOPICS[topic].fields
