# SPDX-License-Identifier: Apache-2.0
"""A line of two machines that fail, and a conveyor of any length between them: for the study beside it."""

from __future__ import annotations

from conveyor_sim.scene import Scene, parse_scene

LINE = """
name: two_machines
duration: 300.0
accuracy: draft
parameters: {length: 2.4 m, rate: 4 /s, between: 4 s, repair: 1 s}
bottle_types: {bottle: {radius: 0.03, mass: 0.1, material: glass}}
contacts:
  - {between: [glass, glass], stiffness: 5000.0, damping: {law: normal, restitution: 0.3}}
  - {between: [glass, steel], stiffness: 5000.0, damping: {law: normal, restitution: 0.3}}
base: [{between: [glass, chain], friction: 0.3}]
conveyors:
  conveyor: {start: [-0.2, 0], heading: 0 deg, path: [{straight: length + 0.2 m}], width: 0.1, speed: 0.5,
    material: chain, guides: {clearance: 64 mm, material: steel}}
rails: {end: {along: conveyor, at: end, material: steel}}
machines:
  first: {kind: source, bottle: bottle, along: conveyor, at: 0.2, rate: rate, failures: {breakdown: &failures
    {between: {kind: exponential, mean: between}, repair: {kind: exponential, mean: repair}}}}
  second: {kind: sink, along: conveyor, at: end, length: 50 mm, rate: rate, failures: {breakdown: *failures}}
outputs: {bottles: 0.0, poses: 0.0, contacts: 0.0, belts: 0.0, signals: 0.0}
"""


def line(length: float, rate: float = 4.0, between: float = 4.0, repair: float = 1.0) -> Scene:
    """length: of the conveyor, m. rate: of both machines, 1/s. between, repair: mean times, s."""
    values = {"length": length, "rate": rate, "between": between, "repair": repair}
    return parse_scene(LINE, overrides={"parameters": values})
