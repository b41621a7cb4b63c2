# SPDX-License-Identifier: Apache-2.0
"""A line of two machines that takes a hundredth of a second to simulate, and studies of it."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from conveyor_sim.studies.load import load_study
from conveyor_sim.studies.setup import Setup
from conveyor_sim.support.worker_pool import DiedError

CODE = '''
"""For studies under test."""
import os, signal, time
from pathlib import Path

from conveyor_sim.scene import parse_scene

LINE = """
name: line
duration: 1.0
accuracy: draft
bottle_types: {bottle: {radius: 0.03, mass: 0.1, material: glass}}
contacts:
  - {between: [glass, glass], stiffness: 5000.0, damping: {law: normal, restitution: 0.3}}
  - {between: [glass, steel], stiffness: 5000.0, damping: {law: normal, restitution: 0.3}}
base: [{between: [glass, chain], friction: 0.3}]
belts:
  conveyor: {kind: straight, start: [-0.2, -0.05], angle: 0.0, length: 0.9, width: 0.1, speed: 0.5, material: chain}
rails:
  end: {kind: segment, from: [0.7, 0.04], to: [0.7, -0.04], material: steel}
machines:
  first: {kind: source, bottle: bottle, position: [0.0, 0.0], direction: 0.0, speed: 0.5, rate: RATE,
          failures: {breakdown: {between: {kind: exponential, mean: 0.4}, repair: {kind: exponential, mean: 0.1}}}}
  second: {kind: sink, region: [[0.62, -0.05], [0.7, -0.05], [0.7, 0.05], [0.62, 0.05]], rate: 8.0}
outputs: {bottles: 0.0, poses: 0.0, contacts: 0.0, belts: 0.0, signals: 0.0}
"""


def line(rate=6.0):
    return parse_scene(LINE.replace("RATE", str(rate)))


def gated(rate, folder):
    """From a rate of 5 on: says that it runs, and goes on once it may. Not in the process that only looks it over."""
    folder = Path(folder)
    if rate < 5.0 or os.getpid() == int((folder / "main").read_text()):
        return line(rate)
    (folder / f"running_{os.getpid()}").touch()
    until = time.monotonic() + 120.0
    while not (folder / "go").exists() and time.monotonic() < until:
        time.sleep(0.01)
    return line(rate)


def deadly(rate, folder, deaths):
    """Kills its process so many times at the rate 7."""
    died = len(list(Path(folder).glob("died_*")))
    if rate == 7.0 and died < deaths:
        (Path(folder) / f"died_{died}").touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return line(rate)


class Feeder:
    """Runs the belt at a speed; counts its scans."""

    def __init__(self, speed, until=1e9):
        self.speed, self.until, self.scans = speed, until, 0

    def scan(self, inputs):
        self.scans += 1
        if inputs.time >= self.until:
            raise ValueError("the feeder is worn out")
        return {"belts/conveyor/cmd_speed": self.speed}


def fed(simulation):
    """Bottles so far."""
    return simulation.counts.fed


class Busiest:
    """Most bottles at a time."""
    unit = "bottles"

    def __init__(self, simulation):
        self.simulation, self.most = simulation, 0

    def after_tick(self):
        self.most = max(self.most, self.simulation.counts.present)

    def value(self):
        return self.most
'''

STUDY: Mapping[str, Any] = {
    "name": "small",
    "function": "code.py:line",
    "parameters": {"rate": {"argument": "rate", "values": [4.0, 6.0], "unit": "1/s"}},
    "seeds": 2,
    "metrics": ["throughput", "stops", {"queue": "mean belts/conveyor/bottles"}],
}


def text_of(**changes: Any) -> str:
    """The study with other fields, as JSON, which is YAML; None leaves one out."""
    return json.dumps({name: value for name, value in {**STUDY, **changes}.items() if value is not None}, indent=1)


def write_study(folder: Path, **changes: Any) -> Path:
    """The study and its code as files."""
    (folder / "code.py").write_text(CODE)
    path = folder / "study.yaml"
    path.write_text(text_of(**changes))
    return path


def setup_of(folder: Path, **changes: Any) -> Setup:
    """The study, read."""
    return load_study(write_study(folder, **changes))


class Here:
    """An engine without processes, which makes runs in the order that it is told."""

    processes = 1
    is_here = True

    def __init__(self, backwards: bool = False) -> None:
        self.backwards, self.made = backwards, 0

    def each(self, function: Any, tasks: Any) -> Iterator[tuple[Any, Any | DiedError]]:
        for task in [*tasks][:: -1 if self.backwards else 1]:
            self.made += 1
            yield task, function(task)

    def __enter__(self) -> Here:
        return self

    def __exit__(self, *_: object) -> None:
        return
