# SPDX-License-Identifier: Apache-2.0
"""Extensions of numba's compiler: groups by address, pruned absent members, parts compiled for their reads."""

import copy
import pickle
from concurrent.futures import ThreadPoolExecutor
from typing import Any, NamedTuple

import numba
import numpy as np
import pytest
from numba_source import relies_on

from conveyor_sim.engine.compiler.compile import part
from conveyor_sim.engine.compiler.groups import fewer, group
from conveyor_sim.engine.compiler.kernel_folder import KernelFolder
from conveyor_sim.engine.compiler.numba_internals.call_by_address import call
from conveyor_sim.engine.compiler.numba_internals.dispatcher import kernel_dispatcher
from conveyor_sim.engine.compiler.numba_internals.machine_code import address, entry


def kernel(function: Any) -> Any:
    """Compile a kernel without a cache."""
    return kernel_dispatcher(function, KernelFolder(None, ""))


@group
class Inner(NamedTuple):
    values: Any
    factor: float


@group
class Outer(NamedTuple):
    inner: Any
    sums: Any


OUTER = Outer(Inner(np.array([1.0, 2.0, 3.0]), 10.0), np.zeros(3))


@part
def scaled(inner: Any, i: int) -> Any:
    if inner.values is None:
        return 0.5 * inner.factor
    return inner.factor * inner.values[i]


@part
def add(outer: Any, i: int) -> None:
    outer.sums[i] += scaled(outer.inner, i)


@kernel
def add_all(outer: Any) -> float:
    for i in range(outer.sums.size):
        add(outer, i)
    return outer.inner.factor


@relies_on("core/pythonapi.py: PythonAPI.long_as_voidptr", "core/pythonapi.py: unbox")
def test_parts_reach_the_arrays_of_a_group() -> None:
    """Groups within groups, through two calls, and again with other arrays."""
    for _ in range(2):
        assert add_all(OUTER) == 10.0
    assert OUTER.sums.tolist() == [20.0, 40.0, 60.0]
    other = Outer(Inner(np.array([5.0]), 2.0), np.zeros(1))
    assert add_all(other) == 2.0
    assert other.sums.tolist() == [10.0]


def test_a_copy_of_a_group_has_arrays_of_its_own() -> None:
    """The copied group has been laid out before."""
    outer = Outer(Inner(np.array([1.0, 2.0]), 10.0), np.zeros(2))
    add_all(outer)
    for copied in (copy.deepcopy(outer), pickle.loads(pickle.dumps(outer)), outer._replace(sums=outer.sums.copy())):
        add_all(copied)
        assert copied.sums.tolist() == [20.0, 40.0]
    assert outer.sums.tolist() == [10.0, 20.0]


def test_a_group_that_many_threads_take_first_at_once_is_laid_out_once() -> None:
    """Otherwise one of them could have the address of a layout that another has discarded."""
    for _ in range(200):
        outer = Outer(Inner(np.array([1.0]), 1.0), np.zeros(1))
        with ThreadPoolExecutor(4) as threads:
            assert len(set(threads.map(lambda _: outer.address, range(4)))) == 1  # noqa: B023


def test_arrays_of_any_shape_and_order_are_laid_out() -> None:
    """Rows, columns, every other entry, and none."""

    @kernel
    def corner(outer: Any) -> float:
        sums = outer.sums
        return sums[sums.shape[0] - 1, sums.shape[1] - 1] + sums.size

    whole = np.arange(12.0).reshape(3, 4)
    for array in (whole, whole.T, np.asfortranarray(whole), whole[::2, 1:3]):
        assert corner(Outer(None, array)) == array[-1, -1] + array.size
    assert add_all(Outer(Inner(np.zeros(0), 5.0), np.zeros(0))) == 5.0


def test_what_can_not_be_laid_out_is_refused() -> None:
    """A text has no place in a group."""
    with pytest.raises(
        TypeError, match=r"member 'text' of a group, expected an array, a group, an int, a float or None"
    ):
        _ = Outer(None, "text").address  # type: ignore[attr-defined]


def test_a_member_that_is_absent_is_pruned() -> None:
    """Otherwise numba could not compile the branch."""
    outer = Outer(Inner(None, 3.0), np.zeros(2))
    assert add_all(outer) == 3.0
    assert outer.sums.tolist() == [1.5, 1.5]


@relies_on("core/untyped_passes.py: DeadBranchPrune.run_pass", "core/analysis.py: rewrite_semantic_constants")
def test_a_member_of_a_member_is_pruned() -> None:
    """The group is an argument, its members are not."""

    @kernel
    def first(outer: Any) -> float:
        inner = outer.inner
        if inner.values is not None:
            return inner.values[0]
        return -1.0

    assert first(OUTER) == 1.0
    assert first(Outer(Inner(None, 3.0), OUTER.sums)) == -1.0


def test_an_absent_member_among_several_taken_at_once_is_pruned() -> None:
    """Python puts more than three values into a tuple, and takes them out again."""

    @kernel
    def first(outer: Any) -> float:
        inner, sums, factor, values = outer.inner, outer.sums, outer.inner.factor, outer.inner.values
        if values is not None:
            return values[0]
        return sums.size * factor + inner.factor

    assert first(OUTER) == 1.0
    assert first(Outer(Inner(None, 3.0), np.zeros(2))) == 9.0


def test_a_group_without_some_members() -> None:
    """A member that is left out is None in the view, which is made and laid out once."""

    @kernel
    def first(outer: Any) -> float:
        if outer.inner.values is None:
            return outer.inner.factor + outer.sums[0]
        return outer.inner.values[0]

    outer = Outer(Inner(np.array([5.0]), 3.0), np.array([7.0]))
    without = fewer(outer, frozenset({"inner.values"}))
    assert (without.inner.values, without.inner.factor, without.sums) == (None, 3.0, outer.sums)
    assert (first(outer), first(without)) == (5.0, 10.0)
    assert fewer(outer, frozenset({"inner.values"})) is without
    assert fewer(outer, frozenset({"inner"})).inner is None


@relies_on("core/base.py: BaseContext.cast", "core/imputils.py: lower_cast")
def test_a_part_is_compiled_once_for_all_groups_that_differ_in_what_it_does_not_read() -> None:
    """This holds through callees and local names, for members of other types, and for absent members."""

    @part
    def size(inner: Any) -> int:
        return inner.values.size

    @part
    def both(outer: Any) -> int:
        inner, others = outer.inner, outer.inner
        return size(inner) + size(others)

    @part
    def is_there(outer: Any) -> bool:
        return outer.sums is not None

    @kernel
    def inspect_both(outer: Any) -> Any:
        return both(outer), is_there(outer)

    values = np.zeros(2)
    for sums, factor in ((None, 1.0), (3.0, 1), (np.zeros(2), None), (Inner(None, None), Inner(None, 2.0))):
        assert inspect_both(Outer(Inner(values, factor), sums)) == (4, sums is not None)
    assert (len(inspect_both.signatures), len(both.signatures), len(size.signatures)) == (4, 1, 1)
    assert len(is_there.signatures) == 4, "of what kind the member is"
    inspect_both(Outer(Inner(np.zeros(3, np.int64), 1.0), None))
    assert (len(both.signatures), len(size.signatures)) == (2, 2)


def test_a_kernel_is_compiled_once_for_all_groups_that_differ_in_what_it_does_not_read() -> None:
    @kernel
    def last(outer: Any) -> float:
        return scaled(outer.inner, outer.inner.values.size - 1)

    inner = Inner(np.array([1.0, 2.0]), 10.0)
    for sums in (None, 3.0, np.zeros(2), np.zeros((2, 2)), inner):
        outer = Outer(inner, sums)
        assert entry(last, outer)(outer) == last(outer) == last(outer) == 20.0
    assert len(last.signatures) == 1
    other = Outer(Inner(np.array([1, 2]), 10.0), None)
    assert last(other) == entry(last, other)(other) == 20.0
    assert len(last.signatures) == 2


@relies_on(
    "core/typeinfer.py: StaticGetItemConstraint",
    "core/rewrites/static_getitem.py: RewriteConstGetitems",
    "core/lowering.py: Lower.lower_setitem",
    "core/typing/templates.py: AbstractTemplate",
)
def test_a_column_is_indexed_as_an_array_is() -> None:
    """From the end, too, by numbers of any width; stored values get the column's type."""

    @kernel
    def move(outer: Any) -> Any:
        values, sums = outer.inner.values, outer.sums
        for i in range(numba.uint8(2)):
            values[i] += sums[i]
        values[-1] = sums[sums.size - 1] + 0.9
        return sums[-2], values[numba.int16(0)]

    for kind in (np.float64, np.int64, np.uint32):
        values, sums = np.arange(3).astype(kind), np.array([10, 20, 30], np.uint32)
        assert move(Outer(Inner(values, 0.0), sums)) == (20, 10)
        assert values.tolist() == [10, 21, 30.9 if kind is np.float64 else 30]


def test_what_is_only_to_be_read_is_not_written() -> None:
    """Numba refuses it, as for arrays."""
    sums = np.zeros(3)
    sums.flags.writeable = False
    with pytest.raises(numba.TypingError):
        add_all(Outer(Inner(np.ones(3), 1.0), sums))
    assert add_all(Outer(Inner(sums, 1.0), np.zeros(3))) == 1.0


@relies_on("core/datamodel/packer.py: ArgPacker.from_arguments", "core/codegen.py: CodeLibrary.create_ir_module")
def test_a_kernel_calls_another_by_its_address() -> None:
    """The callee gets the caller's original arguments, not its copies."""

    @kernel
    def swap(outer: Any) -> float:
        outer.sums[0], outer.sums[1] = outer.sums[1], outer.sums[0]
        return outer.inner.factor

    @kernel
    def calls(outer: Any, places: Any) -> Any:
        before = outer.sums[0]
        call(places[0], outer, None)
        return before, outer.sums[0]

    outer = Outer(Inner(np.zeros(1), 1.0), np.array([1.0, 2.0]))
    places = np.array([address(swap, outer)])
    assert calls(outer, places) == (1.0, 2.0)
    assert calls(outer, places) == (2.0, 1.0)


def test_a_part_is_linked_whoever_calls_it_first() -> None:
    """LLVM drops the first call, in a branch that is never taken, before all parts are linked."""

    @part
    def twice(x: float) -> float:
        return max(x, 0.0) + max(x, 0.0)

    @part
    def never(x: float, ring: Any) -> float:
        if ring is None:
            return twice(x)
        return x

    @part
    def always(x: float) -> float:
        return twice(x) + 1.0

    @kernel
    def sum_of_both(x: float, ring: Any) -> float:
        return never(x, ring) + always(x)

    assert sum_of_both(3.0, OUTER.sums) == 10.0
    assert sum_of_both(3.0, None) == 13.0


def test_a_wrong_member_is_refused() -> None:
    """Numba refuses it, as any missing attribute."""

    @kernel
    def wrong(outer: Any) -> float:
        return outer.outer

    with pytest.raises(numba.TypingError, match="outer"):
        wrong(OUTER)
