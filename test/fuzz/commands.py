# SPDX-License-Identifier: Apache-2.0
"""Random sequences of commands and faults: valid, refused, NaN, unknown names, bursts, and silence."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from fuzz.checked import checked
from fuzz.inputs import Input, Table, commands_of, faults_of
from hypothesis import strategies as st


@dataclass(frozen=True)
class Command:
    """Setpoints that are queued after so many ticks; or one fault that is injected."""

    tick: int
    names: tuple[str, ...]
    values: tuple[float, ...]
    fault: bool = False


@st.composite
def commands(draw: st.DrawFn, scene: dict[str, Any], ticks: int) -> list[Command]:
    """Commands for a scene, in order of the ticks; faults too where it has devices."""
    known, faults = _tables(scene)
    bursts = draw(st.lists(_bursts(known, faults, ticks), max_size=14 if faults else 6))
    return sorted((command for burst in bursts for command in burst), key=_tick)


def _tables(scene: dict[str, Any]) -> tuple[Table, Table]:
    known = checked(scene)
    return ({}, {}) if known is None else (commands_of(known), faults_of(known))


def _tick(command: Command) -> int:
    return command.tick


@st.composite
def _bursts(draw: st.DrawFn, known: Table, faults: Table, ticks: int) -> list[Command]:
    tick = draw(st.integers(0, ticks - 1))
    if faults and draw(st.integers(0, 2)) == 2:
        return [draw(_fault(faults, tick))]
    return [draw(_command(known, tick)) for _ in range(draw(st.sampled_from([1, 1, 1, 8])))]


@st.composite
def _command(draw: st.DrawFn, known: Table, tick: int) -> Command:
    odd = st.sampled_from(["belts/nowhere/cmd_speed", "", "belts//cmd_speed", "belts/belt_0", "übel\n"])
    some = st.sampled_from(sorted(known)) if known else odd
    name = st.one_of(some, some, some, some, odd)
    names = draw(st.lists(name, min_size=draw(st.sampled_from([1, 1, 1, 0])), max_size=3))
    missing = draw(st.sampled_from([0, 0, 0, 0, 1]))
    values = [draw(_value(known.get(each, Input()))) for each in names]
    return Command(tick, tuple(names), tuple(values[: max(0, len(names) - missing)]))


@st.composite
def _fault(draw: st.DrawFn, faults: Table, tick: int) -> Command:
    name = draw(st.sampled_from([*sorted(faults), *sorted(faults), "zones/nowhere/offset"]))
    return Command(tick, (name,), (draw(_value(faults.get(name, Input()))),), fault=True)


@st.composite
def _value(draw: st.DrawFn, given: Input) -> float:
    if draw(st.integers(0, 7)) == 7:
        wrong = [math.nan, math.inf, -math.inf, 1.0001 * given.high + 1e-9, given.low - 1e-9, -1e300, 1e-320, 0.5]
        return draw(st.sampled_from(wrong))
    if given.kind == "bool":
        return draw(st.sampled_from([0.0, 1.0, 1.0]))
    if given.kind == "count":
        return float(draw(st.sampled_from([0, 1, -1, 3, -1000, 1000])))
    share = draw(st.sampled_from([0.0, 1.0, 0.5, 0.25, 0.001]))
    return draw(st.sampled_from([given.low, given.high, 0.0])) * share
