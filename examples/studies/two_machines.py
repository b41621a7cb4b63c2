"""A line of two machines that fail, and a conveyor of any length between them: for the study beside it."""

from __future__ import annotations

from conveyor_sim.scene import Scene, parse_scene

RADIUS = 0.03  # m
SPEED = 0.5  # m/s

LINE = """
name: two_machines
duration: 300.0
accuracy: draft
bottle_types: {{bottle: {{radius: {radius}, mass: 0.1, material: glass}}}}
contacts:
  - {{between: [glass, glass], stiffness: 5000.0, damping: {{law: normal, restitution: 0.3}}}}
  - {{between: [glass, steel], stiffness: 5000.0, damping: {{law: normal, restitution: 0.3}}}}
base: [{{between: [glass, chain], friction: 0.3}}]
belts:
  conveyor:
    {{kind: straight, start: [-0.2, -0.05], angle: 0.0, length: {whole}, width: 0.1, speed: {speed}, material: chain}}
rails:
  left: {{kind: segment, from: [-0.2, 0.032], to: [{length}, 0.032], material: steel}}
  end: {{kind: segment, from: [{length}, 0.032], to: [{length}, -0.032], material: steel}}
  right: {{kind: segment, from: [{length}, -0.032], to: [-0.2, -0.032], material: steel}}
machines:
  first:
    {{kind: source, bottle: bottle, position: [0.0, 0.0], direction: 0.0, speed: {speed}, rate: {rate},
      failures: {{breakdown: {failures}}}}}
  second:
    {{kind: sink, region: [[{reach}, -0.05], [{length}, -0.05], [{length}, 0.05], [{reach}, 0.05]], rate: {rate},
      failures: {{breakdown: {failures}}}}}
outputs: {{bottles: 0.0, poses: 0.0, contacts: 0.0, belts: 0.0, signals: 0.0}}
"""


def line(length: float, rate: float = 4.0, between: float = 4.0, repair: float = 1.0) -> Scene:
    """length: of the conveyor, m. rate: of both machines, 1/s. between, repair: mean times, s."""
    failures = f"{{between: {{kind: exponential, mean: {between}}}, repair: {{kind: exponential, mean: {repair}}}}}"
    places = {"length": length, "whole": length + 0.2, "reach": length - 0.05, "radius": RADIUS, "speed": SPEED}
    return parse_scene(LINE.format(rate=rate, failures=failures, **places))
