# SPDX-License-Identifier: Apache-2.0
"""Members of groups that functions read: by local names, through callees, and entirely in doubt."""

# These functions are parsed, never run.
from __future__ import annotations

from typing import Any

import pytest

from conveyor_sim.engine.compiler.compile import part, written
from conveyor_sim.engine.compiler.reads import ALL, Path, reads


@part
def size(bottles: Any) -> int:
    return bottles.x.size


@part
def shift(world: Any, by: float) -> None:
    if world.spin is not None:
        world.bottles.x[0] += by


def unknown(group: Any) -> Any:
    return group


def takes_members(world: Any) -> float:
    return world.bottles.x[0] + world.settings.skin


def has_names_of_its_own(world: Any) -> float:
    bottles, spin = world.bottles, world.spin
    x: Any = bottles.x
    return x[0] + spin.omega[0]


def asks_whether_it_is_there(world: Any) -> bool:
    return world.spin is not None


def chooses(world: Any, first: bool) -> float:
    group = world.bottles if first else world.spin
    return group.x[0]


def uses_what_a_loop_ends_with(world: Any) -> float:
    group, total = world.spin, 0.0
    for _ in range(3):
        total += group.omega[0]
        group = world.stage
    return total


def writes(world: Any, i: int) -> None:
    world.load.fx[i] = 0.0
    world.load.fy[i], world.load.moment[i] = 0.0, 0.0


def calls(world: Any) -> int:
    shift(world, world.settings.skin)
    return size(world.bottles)


def calls_by_keyword(world: Any) -> int:
    return size(bottles=world.bottles)


def calls_what_is_not_known(world: Any) -> Any:
    return unknown(world.rails)


def gives_all_of_it(world: Any) -> Any:
    return world


def looks_at_nothing(world: Any) -> int:
    return 1


def nested(world: Any) -> float:
    if world.spin is None:
        while world.bottles.x.size > 2:
            for i in range(world.slots.count[0]):
                return world.pairs.law.friction[i]
    return 0.0


EXPECTED = [
    (takes_members, "bottles.x.* settings.skin.*"),
    (has_names_of_its_own, "bottles.x.* spin.omega.*"),
    (asks_whether_it_is_there, "spin"),
    (chooses, "bottles.x.* spin.x.*"),
    (uses_what_a_loop_ends_with, "spin.omega.* stage.omega.*"),
    (writes, "load.fx.* load.fy.* load.moment.*"),
    (calls, "spin bottles.x.* bottles.x.size.* settings.skin.*"),
    (calls_by_keyword, "bottles.*"),
    (calls_what_is_not_known, "rails.*"),
    (gives_all_of_it, "*"),
    (looks_at_nothing, ""),
    (nested, "spin bottles.x.size.* slots.count.* pairs.law.friction.*"),
]


def paths(text: str) -> set[Path]:
    """Return `a.b.*` with the paths above it: `a`, `a.b`."""
    names = [tuple(one.split(".")) for one in text.split()]
    return {one[:n] for one in names for n in range(1, len(one) + 1) if one[n - 1] != ALL or n == len(one)}


@pytest.mark.parametrize(("function", "expected"), EXPECTED, ids=[function.__name__ for function, _ in EXPECTED])
def test_what_a_function_reads(function: Any, expected: str) -> None:
    assert reads(function)[0] - {()} == paths(expected)


def test_what_a_text_reads() -> None:
    """Two arguments, one through a part that the text calls."""
    function = written("def function(pairs, columns):\n    return size_of(columns.a) + pairs.used[0]", size_of=size)
    assert [one - {()} for one in function.reads] == [paths("used.*"), paths("a.x.size.*")]


def test_a_function_in_a_function_knows_the_names_around_it() -> None:
    inner_size = size

    def inner(world: Any) -> int:
        return inner_size(world.bottles)

    assert reads(inner)[0] - {()} == paths("bottles.x.size.*")
