# SPDX-License-Identifier: Apache-2.0
"""Tags of shipped lines have no empty fields, and their statements are true."""

from collections.abc import Sequence
from pathlib import Path

import pytest
from scenes import SHIPPED, base, belt, bottle, shipped_name, simulation

from conveyor_sim.line.device import Device, ScanContext
from conveyor_sim.line.device_kinds import DEVICES, build_devices
from conveyor_sim.line.tag import MOST_COUNT, UNITS, ProcessImage, Tag, choice, count, number, seconds, switch
from conveyor_sim.physics.model import build_model
from conveyor_sim.scene import load_scene


def tags_of(path: Path) -> list[Tag]:
    scene = load_scene(path)
    return [tag for device in build_devices(scene, build_model(scene)) for tag in device.tags]


@pytest.mark.parametrize("path", SHIPPED, ids=shipped_name)
def test_nothing_is_left_empty_of_any_shipped_line(path: Path) -> None:
    tags = tags_of(path)
    assert len({tag.name for tag in tags}) == len(tags)
    for tag in tags:
        assert tag.name.startswith(f"{tag.device}/") and tag.device_class in DEVICES, tag
        assert tag.description.endswith(".") and tag.description[0].isupper() and len(tag.description) < 80, tag
        assert tag.unit in UNITS and (tag.unit == "1" or tag.kind == "number"), tag
        assert tag.low <= tag.initial <= tag.high, tag
        assert bool(tag.texts) == (tag.kind == "enumeration"), tag
        assert (tag.low, tag.high) == (0.0, 1.0) if tag.kind == "bool" else True, tag
        assert tag.nominal is None or tag.low <= tag.nominal <= tag.high, tag


def test_codes_of_units_are_those_of_unece_recommendation_20() -> None:
    """The list is that of the OPC Foundation (UNECE_to_OPCUA.csv)."""
    assert {unit: entry.code for unit, entry in UNITS.items()} == {
        "1": "C62", "m": "MTR", "m/s": "MTS", "s": "SEC", "Hz": "HTZ", "1/s": "C97", "1/min": "C94", "1/h": "H10",
        "1/m^2": "C93", "N": "NEW", "N m": "NU", "J": "JOU", "rad": "C81", "rad/s": "2A", "%": "P1",
    }  # fmt: skip
    assert switch("a/b", "status", "On.").unece == ("C62", "one")


def test_roles_say_what_is_read_written_and_injected() -> None:
    """The order is that of the device, for any mixture of roles."""
    texts = {0: "stopped", 4: "idle", 6: "execute"}
    tags = (
        switch("m/run", "command", "Runs.", 1.0),
        choice("m/state", "status", "What it does.", texts, 4),
        number("m/rate", "setpoint", "Bottles per second.", "1/s", 0.0, 2.0, 1.5, nominal=1.5),
        count("m/made", "counter", "Bottles."),
        switch("m/stop", "fault", "Stops."),
        seconds("m/time", "actual", "When."),
        switch("m/jam", "alarm", "Jams."),
    )
    image = ProcessImage(tags)
    assert image.signal_names == ("m/state", "m/made", "m/time", "m/jam")
    assert image.command_names == ("m/run", "m/rate")
    assert image.fault_names == ("m/stop",)
    assert image.signals[0] == Tag(
        "m/state", "enumeration", "status", "What it does.", low=0.0, high=6.0, initial=4.0, texts=texts
    )
    assert image.signals[1].high == MOST_COUNT


def test_initial_values_are_those_of_a_line_without_bottles() -> None:
    """Initial values of signals are those at the start, of commands those in force then."""
    source = {"kind": "source", "bottle": "bottle", "position": [0.2, 0.5], "direction": 0.0, "speed": 0.0, "rate": 0.5}
    gate = {
        "from": [1.0, 0.0], "to": [1.0, 1.0], "kind": "slide", "direction": 1.5, "stroke": 0.5, "max_speed": 1.0,
        "acceleration": 5.0, "material": "glass",
    }  # fmt: skip
    sim = simulation(
        base=base(0.4),
        contacts=[{"between": ["glass", "glass"], "stiffness": 1e4}],
        belts={
            "one": belt(0.2, (0.0, 0.0), 1.0, 1.0, drive={"acceleration": 1.0}),
            "two": belt(-0.3, (2.0, 0.0), 1.0, 1.0, speed_limits=[-1.0, -0.1]),
        },
        gates={"closed": gate, "open": {**gate, "open": True, "from": [2.0, 0.0], "to": [2.0, 1.0]}},
        zones={"z": {"region": [[0, 0], [1, 0], [1, 1]], "full_at": 3}},
        machines={"m": {**source, "rate": 0.5, "rate_limit": 1.0}},
        bottles=[bottle(5.0, 5.0)],
    )
    image = sim.process_image
    shown = dict(zip(image.signal_names, sim.signals().tolist(), strict=True))
    assert {tag.name: tag.initial for tag in image.signals} == shown
    sim.command(image.command_names, [tag.initial for tag in image.commands])
    sim.advance()
    assert sim.take_outcomes()[0].accepted
    assert sim.belts().commanded.tolist() == [0.2, -0.3]
    assert sim.signals()[image.signal_names.index("gates/open/is_open")] == 1.0


class Lamp(Device):
    """Device with one signal that is an attribute, and one that is computed."""

    def __init__(self, name: str, *more: Tag) -> None:
        super().__init__(
            name, [*more, switch(f"{name}/on", "status", "It shines."), switch(f"{name}/go", "command", "Shines.")]
        )
        self.lit, self.hours = True, 7

    def values(self, now: ScanContext) -> Sequence[float]:
        return (self.lit,)


def test_a_tag_that_is_an_attribute_costs_one_line() -> None:
    """It follows the signals that the device computes, at any place in the list."""
    now = simulation().line.now
    plain, one = Lamp("lamps/a"), Lamp("lamps/a", count("lamps/a/hours", "counter", "Hours.").of("hours"))
    assert (names(plain), list(plain.read(now))) == (["lamps/a/on"], [True])
    assert (names(one), list(one.read(now))) == (["lamps/a/on", "lamps/a/hours"], [True, 7])
    two = Lamp("lamps/a", *(count(f"lamps/a/{what}", "counter", "Hours.").of("hours") for what in "xy"))
    two.classify("lamp")
    assert (names(two), list(two.read(now))) == (["lamps/a/on", "lamps/a/x", "lamps/a/y"], [True, 7, 7])
    assert ProcessImage(two.tags).signals == two.signals


def names(device: Device) -> list[str]:
    return [tag.name for tag in device.signals]
