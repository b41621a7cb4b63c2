# SPDX-License-Identifier: Apache-2.0
"""Lockstep by two tags: writes before a target act as one set at the previous target."""

from __future__ import annotations

import pytest

from conveyor_sim.line.commands.inputs import SET, Input
from conveyor_sim.protocols.tags.handshake import FURTHEST, HandshakeTagProvider
from conveyor_sim.scene import load_scene
from conveyor_sim.simulation import Simulation

SETPOINT = "belts/zone1/cmd_speed"


def written(value: float) -> Input:
    return Input("modbus", "plc", "controller", SET, (SETPOINT,), (value,))


@pytest.fixture
def source() -> HandshakeTagProvider:
    return HandshakeTagProvider(Simulation(load_scene("config/scenarios/zoned_line.yaml"), threads=1))


def advance(source: HandshakeTagProvider) -> list[float]:
    """Step one tick, and return its inputs; the target must be set."""
    taken = source.take(0.0)
    assert taken is not None
    for given in taken:
        source._simulation.give(given)
    source._simulation.advance()
    source.after_tick()
    return [given.values[0] for given in taken]


def test_nothing_passes_before_there_is_a_target(source: HandshakeTagProvider) -> None:
    assert source.give(written(0.1)) == ""
    assert source.take(0.0) is None
    assert source.control("target", 1, "plc") == ""
    assert advance(source) == [0.1]
    assert source.take(0.0) is None


def test_sets_act_at_the_ticks_between_targets_however_early_they_come(source: HandshakeTagProvider) -> None:
    for value, target in ((0.1, 2), (0.2, 3)):
        source.give(written(value))
        source.control("target", target, "plc")
    source.give(written(0.3))  # without a target behind it
    assert [advance(source) for _ in range(3)] == [[0.1], [], [0.2]]
    assert source.take(0.0) is None


def test_a_target_once_more_does_nothing(source: HandshakeTagProvider) -> None:
    source.control("target", 2, "plc")
    source.give(written(0.1))
    assert source.control("target", 2, "plc") == source.control("target", 0, "plc") == ""
    assert [advance(source) for _ in range(2)] == [[], []]
    source.control("target", 3, "plc")
    assert advance(source) == [0.1]


def test_no_tick_is_seen_before_the_target(source: HandshakeTagProvider) -> None:
    seen = []
    source.listen(lambda: seen.append(source.snapshot.tick))
    source.control("target", 3, "plc")
    for _ in range(3):
        advance(source)
    assert seen == [3]


@pytest.mark.parametrize("target", [0.5, -1, FURTHEST + 1, float("inf"), float("nan")])
def test_a_target_that_can_t_be_is_refused(source: HandshakeTagProvider, target: float) -> None:
    assert "expected a whole number from 0 to" in source.control("target", target, "plc")
    assert source.take(0.0) is None


def test_nothing_else_is_asked_of_the_run(source: HandshakeTagProvider) -> None:
    assert "expected only run/target_tick" in source.control("pause", 0, "plc")
