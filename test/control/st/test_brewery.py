# SPDX-License-Identifier: Apache-2.0
"""The project in config/brewery/plc gives the commands of control/brewery.py on the same inputs; its mutants do not."""

from __future__ import annotations

import random
from collections.abc import Iterator, Mapping
from operator import ne
from pathlib import Path

import pytest

from conveyor_sim.control.brewery import brewery
from conveyor_sim.control.scan import Controller, Inputs, LineTags, bind
from conveyor_sim.control.st.controller import StructuredText
from conveyor_sim.support.resources import config_dir
from conveyor_sim.testing import Scenario

PROJECT = config_dir() / "brewery" / "plc"
SCANS = 6000
LENGTH = 0.01  # s
LEVELS = {
    "zones/supply/bottles": 2200,
    "zones/filled/bottles": 850,
    "zones/cold/bottles": 1250,
    "zones/packing/bottles": 850,
}
"""Largest numbers of bottles in the zones of the V-curve."""


class FirstScan:
    """Controller that keeps the line's tags and its first inputs."""

    tags: LineTags
    inputs: Mapping[str, float]

    def bind(self, tags: LineTags) -> None:
        self.tags = tags

    def scan(self, inputs: Inputs) -> Mapping[str, float]:
        self.inputs = dict(inputs)
        return {}


@pytest.fixture(scope="module")
def line() -> FirstScan:
    """Return the tags of the line, and its inputs at standstill."""
    found = FirstScan()
    plant = Scenario("brewery", {"bottles": []})
    plant.attach(found)
    plant.run_for(LENGTH)
    return found


def script(first: Mapping[str, float]) -> Iterator[Mapping[str, float]]:
    """Yield the inputs of all scans: buttons by a script; photo-eyes, faults, states and levels at random."""
    chance = random.Random(1)
    signals = dict(first)
    eyes = [name for name in signals if name.startswith("photo_eyes/") and name.endswith("/blocked")]
    geared = [name for name in signals if name.endswith("/in_gear")]
    faults = [name for name in signals if name.startswith("axes/") and name.endswith("/fault")]
    states = [f"machines/{name}/state" for name in ("depalletiser", "rinser", "pasteuriser", "labeller", "packer")]
    buttons = {
        # button: scans in which it differs from its first value
        "panel/start/contact": [(50, 60), (900, 910), (1000, 1005), (1300, 1310), (5300, 5310), (5700, 5710)],
        "panel/stop/contact": [(700, 720), (5200, 5210)],
        "panel/estop/contact": [(950, 990), (5500, 5550)],
        "panel/reset/contact": [(1200, 1210), (1500, 1510), (5600, 5610)],
        "panel/format/position": [(1900, 5650)],
    }
    for scan in range(SCANS):
        for name, spans in buttons.items():
            pressed = any(begin <= scan < end for begin, end in spans)
            signals[name] = 1.0 - first[name] if pressed else first[name]
        for name in eyes:
            if chance.random() < 0.02:
                signals[name] = 1.0 - signals[name]
        if 2200 <= scan < 2700:  # bottles have wedged in a combiner
            signals.update({f"photo_eyes/single_{eye}/blocked": 0.0 for eye in ("entered", "backed", "full")})
            signals["photo_eyes/single_standing/blocked"] = 1.0
        if 5300 <= scan < 5500:  # a start of the block without a queue, while the line empties
            signals["photo_eyes/block_queued/blocked"] = 0.0
        for name in geared:
            signals[name] = float(chance.random() < 0.9)
        for name in faults:
            signals[name] = float(1400 <= scan < 1450 and name == faults[(scan // 10) % len(faults)])
        for name in states:
            signals[name] = 9.0 if 950 <= scan < 1250 and chance.random() < 0.9 else 6.0
        for name, most in LEVELS.items():
            signals[name] = min(max(signals[name] + chance.randint(-60, 60), 0), most)
        signals["belts/label_lane/speed"] = 1.3
        signals["belts/label_lane/pulses"] = float(26 * scan)
        if chance.random() < 0.01:
            signals["machines/camera/bad"] += 1.0
            signals["machines/camera/bad_time"] = (scan - chance.random()) * LENGTH
        signals["panel/rate/value"] = (40_000.0, 25_000.0)[scan // 1000 % 2]
        signals["carousels/block_valves/good"] = float(scan)
        # The supply is full, and has room again.
        signals["belts/supply/bottles"] = 2100.0 + 5.0 * abs((scan - 160) % 140 - 70) if 160 <= scan < 700 else 0.0
        # Few enough bottles from scan 2400 on, but for one that comes out of a wheel.
        signals["belts/spread/bottles"] = 30.0 if scan < 2400 else 23.0
        signals["belts/block_discharge/bottles"] = float(scan == 2600)
        yield dict(signals)


def commands(controller: Controller, line: FirstScan) -> Iterator[Mapping[str, float]]:
    """Yield the commands of all scans."""
    bind(controller, line.tags)
    for scan, signals in enumerate(script(line.inputs)):
        answer = controller.scan(Inputs(signals, scan * LENGTH, scan, LENGTH))
        yield {name: float(value) for name, value in answer.items()}


@pytest.fixture(scope="module")
def expected(line: FirstScan) -> list[Mapping[str, float]]:
    """Return the commands of the controller in Python."""
    return list(commands(brewery(), line))


def test_the_project_is_its_twin(line: FirstScan, expected: list[Mapping[str, float]]) -> None:
    # The script reaches the steps of the sequence, both formats and all rates of the V-curve.
    machines = ("depalletiser/run", "depalletiser/cmd_bottle", "reject/fire")
    for name in ("panel/horn/on", "panel/empties/on", *(f"machines/{name}" for name in machines)):
        assert {answer[name] for answer in expected} == {0.0, 1.0}
    assert len({answer["machines/packer/rate"] for answer in expected}) >= 8
    assert list(commands(StructuredText(PROJECT), line)) == expected


@pytest.mark.parametrize(
    ("file", "right", "wrong"),
    [
        ("line.st", "waited > SETTLE_TIME", "waited >= SETTLE_TIME"),
        ("line.st", "powered AND (ready OR reset_button)", "powered"),
        ("line.st", "bottles > REMAINDER", "bottles >= REMAINDER"),
        ("line.st", "on_supply > SUPPLY_ROOM", "on_supply >= SUPPLY_ROOM"),
        ("combiner.st", "waited > STUCK", "waited >= STUCK"),
        ("combiner.st", "NOT full AND left = 0", "NOT full"),
        ("block.st", "queued OR empties", "queued"),
        ("reject.st", "1.5 * SCAN", "SCAN"),
        ("rates.st", "nearer := labeller.rate", "nearer := nominal"),
    ],
)
def test_a_mutant_is_not(
    file: str, right: str, wrong: str, line: FirstScan, expected: list[Mapping[str, float]], tmp_path: Path
) -> None:
    for path in PROJECT.glob("*.st"):
        text = path.read_text()
        assert text.count(right) == (path.name == file)
        (tmp_path / path.name).write_text(text.replace(right, wrong))
    # The first difference ends the comparison.
    assert any(map(ne, commands(StructuredText(tmp_path), line), expected))
