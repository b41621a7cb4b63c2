# SPDX-License-Identifier: Apache-2.0
"""A node with a scene in the layout language: choices by its parameters, checkpoint, changeover, and recording."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from conveyor_msgs import srv
from conveyor_msgs.msg import Line
from ros.line_client import LineClient

from conveyor_sim.bag.replay import replay
from conveyor_sim.bag.sources import write_sources
from conveyor_sim.line.changeover import changeover
from conveyor_sim.ros.child import Child
from conveyor_sim.scene import load_scene
from conveyor_sim.scene.yaml_lines import Document

SCENE = """\
name: formats
duration: 2
parameters: {speed: 0.3, length: 2 m}
contacts: [{between: [glass, glass], stiffness: 20000}]
base: [{between: [glass, chain], friction: 0.3}]
bottle_types:
  full: {radius: 0.035, mass: 0.4, material: glass}
  half: {radius: 0.025, mass: 0.2, material: glass}
conveyors: {lane: {start: [0, 0], path: [{straight: length}], width: 0.1, material: chain, speed: speed}}
infeeds: {inlet: {along: lane, at: 0.2, bottle: full, types: [full, half], rate: 3, rate_limit: 6}}
formats: {full: {bottle: full}, half: {bottle: half, set: {speed: 0.4}}}
"""


def test_a_layout_is_recorded_saved_and_changed_over(
    start_node: Callable[..., Child], client: LineClient, tmp_path: Path
) -> None:
    path, folder = tmp_path / "line.yaml", tmp_path / "saved"
    path.write_text(SCENE)
    node = start_node(scene=path, record=tmp_path / "bag", set="length=2.5 m", format="full", checkpoint_folder=folder)
    commands = changeover(load_scene(path, {"format": "full"}), "half")
    with client.listen(Line, "line") as lines:
        data = Document(lines.first().scene_text, "line").data
    assert data["belts"]["lane"]["length"] == 2.5
    assert client.lockstep(100).accepted
    assert client.call(srv.SaveCheckpoint, "save_checkpoint", path="half").success
    names, values = list(commands), list(commands.values())
    answers = []
    for _ in range(2):
        answer = client.lockstep(200, names=names, values=values, release=True)
        assert answer.accepted, answer.reason
        answers.append(answer.state_hash)
        loaded = client.call(srv.LoadCheckpoint, "load_checkpoint", path="half")
        assert loaded.success, loaded.message
    assert answers[0] == answers[1]
    node.stop()
    report = replay(tmp_path / "bag")
    assert report.exact and report.difference is None
    assert set(write_sources(tmp_path / "bag", tmp_path / "sources").written) == {"line.yaml", "overrides.yaml"}
