# SPDX-License-Identifier: Apache-2.0
"""Two machines that fail, and the conveyor between them: the simulated line against the closed form.

The model of continuous flow (Zimmern 1956; Wijngaard 1979; Gershwin and Schick 1980; reviewed by Dallery and Gershwin
1992): bottles are a fluid, both machines work at the same rate when they are up, the first one is never starved, the
last one never blocked. Times between failures and to repair are exponential. A machine fails only while it works
(operation-dependent failures). `two_machine_line.py` runs the comparison.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from conveyor_sim import Simulation
from conveyor_sim.scene import Scene, parse_scene

RATE = 4.0  # 1/s, of both machines
SPEED = 0.5  # m/s
RADIUS = 0.03  # m
REGION = 0.05  # m before the end of the conveyor, from which the second machine takes bottles
LENGTHS = (0.7, 1.0, 1.6, 2.4)  # m, from the first machine to the end
DURATION = 500.0  # s, after WARM_UP
WARM_UP = 20.0  # s

LINE = """
name: two_machines
description: Two machines that fail, and a conveyor between them.
duration: 100000.0
seed: {seed}
accuracy: draft
bottle_types: {{bottle: {{radius: {radius}, mass: 0.1, material: glass}}}}
contacts:
  - {{between: [glass, glass], stiffness: 5000.0, damping: {{law: normal, restitution: 0.3}}}}
  - {{between: [glass, steel], stiffness: 5000.0, damping: {{law: normal, restitution: 0.3}}}}
base: [{{between: [glass, chain], friction: 0.3}}]
belts:
  conveyor:
    kind: straight
    start: [-0.2, -0.05]
    angle: 0.0
    length: {whole}
    width: 0.1
    speed: {speed}
    material: chain
rails:
  left: {{kind: segment, from: [-0.2, 0.032], to: [{length}, 0.032], material: steel}}
  end: {{kind: segment, from: [{length}, 0.032], to: [{length}, -0.032], material: steel}}
  right: {{kind: segment, from: [{length}, -0.032], to: [-0.2, -0.032], material: steel}}
machines:
  first:
    kind: source
    bottle: bottle
    position: [0.0, 0.0]
    direction: 0.0
    speed: {speed}
    rate: {rate}
    failures: {{breakdown: {first}}}
  second:
    kind: sink
    region: [[{reach}, -0.05], [{length}, -0.05], [{length}, 0.05], [{reach}, 0.05]]
    rate: {rate}
    failures: {{breakdown: {second}}}
outputs: {{bottles: 0.0, poses: 0.0, contacts: 0.0, belts: 0.0, signals: 0.0}}
"""


class Machine(NamedTuple):
    """Failure rate and repair time of a machine."""

    between_failures: float
    """s of running time, mean."""
    to_repair: float
    """s, mean."""

    @property
    def alone(self) -> float:
        """Efficiency of the machine by itself."""
        return self.between_failures / (self.between_failures + self.to_repair)


class Balance(NamedTuple):
    """Steady state of two machines with a buffer between them, as shares of time."""

    efficiency: float
    """Throughput over the rate of the machines: the share in which the second machine works."""
    starved: float
    """Share in which the second machine is up and the buffer empty."""
    blocked: float
    """Share in which the first machine is up and the buffer full."""


def balance(first: Machine, second: Machine, rate: float, buffer: float) -> Balance:
    """Return the steady state with room for `buffer` bottles between machines of a rate (1/s, of both).

    Derived from the balance of flows in the steady state. l1, l2 are the rates of failure, r1, r2 of repair, l and r
    their sums, u the rate of bottles. While both work or none does, the level x stands. So nothing but "first up,
    second down" moves it up, and "first down, second up" down, and both have the same density g(x). The balances of
    "both up" and "both down" give those densities, g r/l and g l/r. The balance of "first up, second down",

        u g' = (-(r2 + l1) + l2 r/l + r1 l/r) g = (l2 r1 - l1 r2) (1/l + 1/r) g,

    has an exponential for its solution. At x = 0 the second machine starves while the first one is down, and can't
    fail: the balances there are l2 p(both up) = u g(0) and r1 p(starved) = l p(both up). At the full buffer it is the
    other way round.
    """
    l1, l2 = 1.0 / first.between_failures, 1.0 / second.between_failures
    r1, r2 = 1.0 / first.to_repair, 1.0 / second.to_repair
    fails, repairs = l1 + l2, r1 + r2
    growth = (l2 * r1 - l1 * r2) * (1.0 / fails + 1.0 / repairs) / rate
    full = math.exp(growth * buffer)
    inside = math.expm1(growth * buffer) / growth if growth else buffer
    empty_up, full_up = rate / l2, rate * full / l1
    starved, blocked = empty_up * fails / r1, full_up * fails / r2
    second_works = inside * (1.0 + repairs / fails) + empty_up + full_up
    whole = inside * (2.0 + repairs / fails + fails / repairs) + empty_up + full_up + starved + blocked
    return Balance(second_works / whole, starved / whole, blocked / whole)


def efficiency(first: Machine, second: Machine, rate: float, buffer: float) -> float:
    """Return throughput over `rate` (1/s, of both machines) with room for `buffer` bottles between them."""
    return balance(first, second, rate, buffer).efficiency


def conveyor_efficiency(first: Machine, second: Machine, rate: float, holds: float, transport: float) -> float:
    """Return the efficiency for a conveyor as buffer, which holds `holds` bottles and needs `transport` s end to end.

    rate x transport bottles are in transit while the line flows. They buffer nothing: only free room counts. A bottle
    that the second machine takes frees room for the first one only `transport` later. In that time the second one
    takes at most rate x transport bottles, so the value is a lower bound. It deviates only if both machines fail
    within one such time.
    """
    return efficiency(first, second, rate, holds - rate * transport)


def transport(length: float) -> float:
    """From the first machine to where the second one takes bottles, s."""
    return (length - REGION) / SPEED


def line(length: float, first: Machine, second: Machine, seed: int) -> Scene:
    """Build a conveyor of a length (m) between two machines."""
    ways = {name: breakdown(machine) for name, machine in (("first", first), ("second", second))}
    places = {"length": length, "whole": length + 0.2, "reach": length - REGION, "radius": RADIUS}
    return parse_scene(LINE.format(rate=RATE, speed=SPEED, seed=seed, **places, **ways))


def breakdown(machine: Machine) -> str:
    """Return the times of a failure of a scene file."""
    between, repair = (f"{{kind: exponential, mean: {mean}}}" for mean in machine)
    return f"{{between: {between}, repair: {repair}}}"


def holds(length: float) -> int:
    """Bottles on the conveyor while the second machine is down and the first one blocked."""
    never, at_once = Machine(1e6, 1.0), Machine(1e-3, 1e6)
    simulation = Simulation(line(length, never, at_once, 0))
    simulation.advance(round(4.0 * length / (2.0 * RADIUS) / RATE / simulation.scene.tick))
    return simulation.counts.present


def taken(scene: Scene, duration: float) -> int:
    """Bottles that the second machine takes in a duration (s) after WARM_UP."""
    simulation = Simulation(scene, threads=1)
    simulation.advance(round(WARM_UP / scene.tick))
    before = simulation.counts.removed
    simulation.advance(round(duration / scene.tick))
    return simulation.counts.removed - before
