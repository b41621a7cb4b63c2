"""Random sequences of commands: valid, refused, NaN, unknown names, bursts, and silence that trips watchdogs."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from hypothesis import strategies as st


@dataclass(frozen=True)
class Command:
    """Setpoints that are queued after so many ticks."""

    tick: int
    names: tuple[str, ...]
    values: tuple[float, ...]


@st.composite
def commands(draw: st.DrawFn, scene: dict[str, Any], ticks: int) -> list[Command]:
    """Commands for a scene, in order of the ticks."""
    bursts = draw(st.lists(_bursts(scene, ticks), max_size=6))
    return sorted((command for burst in bursts for command in burst), key=_tick)


def _tick(command: Command) -> int:
    return command.tick


@st.composite
def _bursts(draw: st.DrawFn, scene: dict[str, Any], ticks: int) -> list[Command]:
    tick = draw(st.integers(0, ticks - 1))
    return [draw(_command(scene, tick)) for _ in range(draw(st.sampled_from([1, 1, 1, 8])))]


@st.composite
def _command(draw: st.DrawFn, scene: dict[str, Any], tick: int) -> Command:
    known = [f"belts/{name}/cmd_speed" for name in scene["belts"]]
    limit = max((belt["speed_limits"][1] for belt in scene["belts"].values()), default=1.0)
    valid = st.sampled_from([0.0, 1.0, -1.0, 0.5, 0.25]).map(lambda share: share * limit)
    wrong = st.sampled_from([math.nan, math.inf, -math.inf, 1.0001 * limit + 1e-9, -1e300, 1e-320])
    value = st.one_of(valid, valid, valid, wrong)
    odd = st.sampled_from(["belts/nowhere/cmd_speed", "", "belts//cmd_speed", "belts/belt_0", "übel\n"])
    name = st.one_of(st.sampled_from(known), st.sampled_from(known), st.sampled_from(known), odd) if known else odd
    names = draw(st.lists(name, min_size=draw(st.sampled_from([1, 1, 1, 0])), max_size=3))
    missing = draw(st.sampled_from([0, 0, 0, 0, 1]))
    return Command(tick, tuple(names), tuple(draw(value) for _ in range(max(0, len(names) - missing))))
