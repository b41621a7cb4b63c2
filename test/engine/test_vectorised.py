# SPDX-License-Identifier: Apache-2.0
"""Loops over the laws are vectorised: several pairs per instruction, which gives most of the engine's speed.

LLVM gives up silently at a branch, a call, or too many arrays. A vectorised loop has a block that LLVM names
`vector.body`, and packed instructions.
"""

import platform
import re
from typing import Any

import numba
import numpy as np
import pytest
from numba import uint64

from conveyor_sim.engine.arrays.contacts import ContactLaw
from conveyor_sim.engine.compiler.numba_internals.pipelines import KernelCompiler
from conveyor_sim.engine.contact.contact import contact_force, spring_after
from conveyor_sim.engine.contact.friction import implicit_regularisation, regularisation
from conveyor_sim.engine.support.ring import ring_means, ring_share

pytestmark = pytest.mark.skipif(
    platform.machine().lower() not in ("x86_64", "amd64"), reason="packed instructions go by other names"
)

COUNT = 64


def compiled(function: Any) -> Any:
    """Compile like a kernel, but without a cache, because numba shows only code that it has compiled itself."""
    return numba.njit(nogil=True, error_model="numpy", _nrt=False, pipeline_class=KernelCompiler)(function)


def assert_vectorised(loop: Any) -> None:
    """Assert that the only loop of a function that was called once is vectorised."""
    (ir,) = loop.inspect_llvm().values()
    (assembly,) = loop.inspect_asm().values()
    assert "vector.body" in ir
    assert re.search(r"\bv?(mul|sqrt|div)pd\b", assembly)


def column(value: float = 0.1) -> Any:
    return np.full(COUNT, value)


LINEAR = ["stiffness", "friction"]
SPRING = [*LINEAR, "damping_normal", "tangential_stiffness", "tangential_damping"]
ALL = [name for name in ContactLaw._fields if name != "curve"]


@pytest.mark.parametrize(
    ("names", "atan", "spring", "implicit"),
    [
        (["stiffness", "damping_paper"], False, False, False),
        ([*LINEAR, "damping_paper"], False, False, False),
        ([*LINEAR, "damping_normal"], False, False, False),
        ([*LINEAR, "damping_onset"], False, False, False),
        (["hertz", "damping_tsuji", "friction"], False, False, False),
        (["hertz", "damping_viscoelastic", "friction"], False, False, False),
        ([*LINEAR, "damping_paper"], True, False, False),
        ([*LINEAR, "damping_paper"], False, False, True),
        ([*LINEAR, "damping_paper"], True, False, True),
        (SPRING, False, True, False),
        (ALL, False, True, False),
        (ALL, False, True, True),
        (ALL, True, True, True),
    ],
)
def test_contacts(names: list[str], atan: bool, spring: bool, implicit: bool) -> None:
    """Every law except the table, which needs a search."""

    @compiled
    def loop(
        count: int,
        law: Any,
        atan: Any,
        overlap: Any,
        closing: Any,
        slip: Any,
        elongation: Any,
        compliance: Any,
        results: Any,
    ) -> None:
        for c in range(uint64(count)):
            normal, tangential = contact_force(
                law, c, None, 0.01, atan, overlap[c], 1.0, closing[c], slip[c], at(elongation, c), both(compliance, c)
            )
            results[c] = normal
            results[c + uint64(COUNT)] = tangential

    law = ContactLaw(**{name: column() if name in names else None for name in ContactLaw._fields})  # type: ignore[arg-type]
    loop(
        COUNT,
        law,
        1 if atan else None,
        column(),
        column(),
        column(),
        column() if spring else None,
        column() if implicit else None,
        np.zeros(2 * COUNT),
    )
    assert_vectorised(loop)


@compiled
def at(values: Any, c: int) -> Any:
    if values is None:
        return None
    return values[c]


@compiled
def both(compliance: Any, c: int) -> Any:
    if compliance is None:
        return None
    return compliance[c], 0.5, 0.01 * compliance[c]


def test_tangential_springs() -> None:
    """Their elongation by the slip."""

    @compiled
    def loop(count: int, law: Any, spring: Any, overlap: Any, slip: Any, normal: Any) -> None:
        for c in range(uint64(count)):
            spring[c] = spring_after(law, c, spring[c], overlap[c], slip[c], 1e-4, normal[c], 1.0)

    law = ContactLaw(friction=column(), tangential_stiffness=column(), tangential_mindlin=column())
    loop(COUNT, law, column(), column(), column(), column())
    assert_vectorised(loop)


@pytest.mark.parametrize("atan", [None, 1])
def test_friction_of_points(atan: Any) -> None:
    """Explicit and implicit quotients, on both curves."""

    @compiled
    def loop(count: int, atan: Any, slip: Any, b: Any, results: Any) -> None:
        for c in range(uint64(count)):
            results[c] = regularisation(slip[c], 0.01, atan) - implicit_regularisation(slip[c], b[c], 0.01, atan)

    loop(COUNT, atan, column(), column(), column())
    assert_vectorised(loop)


def test_friction_of_rings() -> None:
    """Force and moment of a ring on one belt."""

    @compiled
    def loop(count: int, slide: Any, spin: Any, force: Any, moment: Any) -> None:
        for c in range(uint64(count)):
            limit, first, rest = ring_means(slide[c], spin[c], 0.01)
            force[c] = ring_share(slide[c], spin[c], limit, first, rest)
            moment[c] = ring_share(spin[c], slide[c], limit, first, rest)

    loop(COUNT, column(), column(), column(), column())
    assert_vectorised(loop)
