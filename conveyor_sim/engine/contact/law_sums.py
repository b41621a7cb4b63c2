# SPDX-License-Identifier: Apache-2.0
"""Sums of the laws of a contact, written out for kernels from the list of laws.

The laws of a pair of materials are added up. The column of a law holds 0 (tables: -1) for a pair without it. If no
pair of the scene has a law, its column is None and its code is omitted. Numba can't loop over a list of functions.
"""

from collections.abc import Callable, Sequence
from typing import Any

from conveyor_sim.engine.compiler.compile import part, written
from conveyor_sim.engine.contact.laws import DAMPING, ELASTIC

_ALONG = [law for law in DAMPING if not law.isotropic]
_ISOTROPIC = [law for law in DAMPING if law.isotropic]


def _sum(columns: Sequence[str], functions: Sequence[Callable[..., float]], inputs: str) -> Any:
    """Return a part (law, e, total, args...) that adds functions of entry e of the columns to the total."""
    places = range(len(columns))
    arguments = "".join(f"column_{n}, " for n in places)
    # Columns are passed as arguments, so that numba prunes the branches of absent ones.
    body = [f"    if column_{n} is not None: total += force_{n}(column_{n}[e], {inputs})" for n in places]
    head = f"def function(total, {arguments}e, {inputs}):"
    forces = {f"force_{n}": part(function) for n, function in enumerate(functions)}
    inner = written("\n".join([head, *body, "    return total"]), **forces)
    passed = "".join(f"law.{column}, " for column in columns)
    text = f"def function(law, e, total, {inputs}): return inner(total, {passed}e, {inputs})"
    return written(text, inner=inner)


def _clamp(columns: Sequence[str]) -> Any:
    """Return a part (law, total) that raises a negative total to 0 if any of the columns is present."""
    arguments = ", ".join(f"column_{n}" for n in range(len(columns)))
    tests = [f"{'    ' * (n + 1)}if column_{n} is None:" for n in range(len(columns))]
    body = [*tests, f"{'    ' * (len(columns) + 1)}return total", "    return 0.0 if total < 0.0 else total"]
    inner = written("\n".join([f"def function(total, {arguments}):", *body]))
    passed = ", ".join(f"law.{column}" for column in columns)
    return written(f"def function(law, total): return inner(total, {passed})", inner=inner)


_columns = [law.column for law in ELASTIC]
add_elastic_force: Any = _sum(_columns, [law.force for law in ELASTIC], "depth, curves")
"""(law, e, total, depth, curves): total plus the elastic force, N, at an overlap (m, not negative)."""

add_elastic_energy: Any = _sum(_columns, [law.energy for law in ELASTIC], "depth, curves")
"""(law, e, total, depth, curves): total plus the energy stored, J."""

_inputs = "elastic, depth, velocity"
add_damping: Any = _sum([law.column for law in _ALONG], [law.force for law in _ALONG], _inputs)
"""(law, e, total, elastic, depth, velocity): total plus damping along the normal, N, at a force (N) and speed (m/s)."""

never_pull: Any = _clamp([law.column for law in _ALONG])
"""(law, total): total, at least 0 if the contact has such damping, so that it never pulls."""

add_drag: Any = _sum([law.column for law in _ISOTROPIC], [law.force for law in _ISOTROPIC], _inputs)
"""(law, e, total, elastic, depth, velocity): total plus isotropic damping, N, along the velocity (m/s)."""
