# SPDX-License-Identifier: Apache-2.0
"""Assumptions about numba's internals, one per test. Each test names the sources of numba that it is about.

Other tests carry such names too, where the behaviour of kernels shows the assumption: `grep -rn relies_on test`.
"""

import ast
import itertools
import pickle
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import llvmlite.binding as llvm
import numba
import numpy as np
import pytest
from numba.core import event, ir, serialize, types
from numba.core.compiler import CompileResult, run_frontend
from numba.core.datamodel import default_manager
from numba.core.ir_utils import get_definition
from numba_source import is_defined, relies_on

import conveyor_sim.engine
from conveyor_sim.engine.compiler.compile import part
from conveyor_sim.engine.compiler.groups import group
from conveyor_sim.engine.compiler.kernel_folder import KernelFolder
from conveyor_sim.engine.compiler.numba_internals.atomics import add_atomic, load_atomic, sched_yield, store_atomic
from conveyor_sim.engine.compiler.numba_internals.compile_time import CompileTime
from conveyor_sim.engine.compiler.numba_internals.dispatcher import kernel_dispatcher
from conveyor_sim.engine.compiler.numba_internals.group_type import HIDDEN, GroupType, array_struct

ENGINE = Path(conveyor_sim.engine.__file__).parent


def kernel(function: Any) -> Any:
    """Compile a kernel without a cache."""
    return kernel_dispatcher(function, KernelFolder(None, ""))


@group
class Columns(NamedTuple):
    x: Any
    y: Any


COLUMNS = Columns(np.array([1.0, 2.0, 3.0, 4.0]), np.array([10.0, 20.0, 30.0, 40.0]))


def compiled(function: Any) -> Any:
    """Return the CompileResult of a function that has been compiled once."""
    (result,) = function.overloads.values()
    return result


def imports(source: Path) -> set[str]:
    """Return the names of modules that a file imports from numba and llvmlite."""
    names: set[str] = set()
    for node in ast.walk(ast.parse(source.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            names |= {f"{node.module}.{alias.name}" for alias in node.names}
    return {name for name in names if name.split(".")[0] in ("numba", "llvmlite")}


PUBLIC = {"numba.uint64", "numba.typeof", "numba.extending.typeof_impl"}


@pytest.mark.parametrize("source", sorted(ENGINE.rglob("*.py")), ids=lambda source: str(source.relative_to(ENGINE)))
def test_internals_of_numba_are_used_in_one_folder_only(source: Path) -> None:
    if "numba_internals" not in source.parts:
        assert imports(source) <= PUBLIC


def test_a_missing_definition_is_noticed() -> None:
    assert is_defined("core/codegen.py: CPUCodeLibrary.finalize")
    for wrong in ("core/codegen.py: CPUCodeLibrary.finish", "core/codegen.py: Library", "core/code.py: CPUCodeLibrary"):
        assert not is_defined(wrong)


@relies_on(
    "core/compiler.py: DefaultPassBuilder.define_nopython_pipeline",
    "core/untyped_passes.py: RewriteSemanticConstants",
    "core/untyped_passes.py: DeadBranchPrune",
    "core/compiler_machinery.py: PassManager.add_pass_after",
)
def test_passes_run_in_the_order_that_pruning_needs() -> None:
    """Constants are known before AbsentMembers, branches are pruned after it, and both before types are inferred."""

    @part
    def twice(x: float) -> float:
        return 2.0 * x

    @kernel
    def calls(x: float) -> float:
        return twice(x)

    with event.install_recorder("numba:run_pass") as recorder:
        calls(1.0)
    names = [one.data["name"] for _, one in recorder.buffer if one.is_start]
    order = ["rewrite_semantic_constants", "absent_members", "dead_branch_prune", "nopython_type_inference"]
    for function, last in (("twice", ["native_lowering", "part_entry"]), ("calls", ["native_lowering"])):
        passes = [name.partition(" [")[0] for name in names if name.endswith(f"{function}]")]
        expected = [*order, *last]
        assert sorted(expected, key=passes.index) == expected


def assignments(function: Any, op: str) -> Sequence[tuple[Any, Any]]:
    """Return numba's representation of a function, with each assignment of an operation."""
    function_ir = run_frontend(function)
    blocks = function_ir.blocks.values()
    matches = [one for block in blocks for one in block.find_insts(ir.Assign) if getattr(one.value, "op", "") == op]
    return [(function_ir, one) for one in matches]


@relies_on("core/ir.py: FunctionIR.get_definition", "core/ir_utils.py: build_definitions")
def test_definitions_list_the_values_that_are_assigned() -> None:
    """AbsentMembers replaces a value in both places, which it finds by identity."""
    ((function_ir, assignment),) = assignments(lambda world: world.spin, "getattr")
    definitions = function_ir._definitions[assignment.target.name]
    assert [one is assignment.value for one in definitions] == [True]
    assert isinstance(get_definition(function_ir, assignment.value.value), ir.Arg)


@relies_on("core/interpreter.py: Interpreter.op_UNPACK_SEQUENCE", "core/interpreter.py: Interpreter.op_BUILD_TUPLE")
def test_several_members_at_once_are_taken_from_a_tuple() -> None:
    """AbsentMembers follows an entry of the tuple to the member that was put there."""

    def several(world: Any) -> Any:
        a, b, c, d = world.a, world.b, world.c, world.d
        return a, b, c, d

    entries = assignments(several, "static_getitem")
    assert len(entries) == 4
    for place, (function_ir, assignment) in enumerate(entries):
        entry = assignment.value
        unpacked = get_definition(function_ir, entry.value)
        members = get_definition(function_ir, unpacked.value)
        assert (unpacked.op, members.op, entry.index) == ("exhaust_iter", "build_tuple", place)
        assert get_definition(function_ir, members.items[place]).attr == "abcd"[place]


@relies_on(
    "core/codegen.py: CPUCodeLibrary.finalize",
    "core/codegen.py: CPUCodeLibrary.add_linking_library",
    "core/codegen.py: CPUCodeLibrary._get_module_for_linking",
    "core/codegen.py: CPUCodeLibrary._verify_declare_only_symbols",
    "core/codegen.py: JITCodeLibrary",
)
def test_a_library_links_those_it_calls_when_it_is_finalized() -> None:
    """A part's library has its code alone and declares its callees; a kernel's has all of them, inlined."""

    @part
    def inner(x: float) -> float:
        return 2.0 * x

    @part
    def outer(x: float) -> float:
        return inner(x) + 1.0

    @kernel
    def calls(x: float) -> float:
        return outer(x)

    assert calls(1.0) == 3.0
    library, called = compiled(outer).library, compiled(inner).library
    assert library._linking_libraries[0] is called
    assert library._get_module_for_linking() is library._shared_module is library._final_module
    names = {one.name: one.is_declaration for one in library._final_module.functions}
    assert names[compiled(inner).fndesc.llvm_func_name]
    assert not names[compiled(outer).fndesc.llvm_func_name]
    final = compiled(calls).library._final_module
    assert not [one for one in final.functions if one.is_declaration and one.name.startswith("_ZN")]


@relies_on(
    "core/typed_passes.py: BaseNativeLowering.run_pass",
    "core/compiler.py: _LowerResult",
    "core/base.py: BaseContext.insert_user_function",
)
def test_a_part_has_an_entry_by_which_numba_finds_its_code_and_no_machine_code() -> None:
    """With the flag `no_compile` lowering stops, and PartEntry registers the function."""

    @part
    def twice(x: float) -> float:
        return 2.0 * x

    @kernel
    def calls(x: float) -> float:
        return twice(x)

    assert calls(2.0) == 4.0
    result = compiled(twice)
    assert twice.targetctx._defns[result.entry_point].versions  # type: ignore[attr-defined]
    engine = calls.targetctx.codegen()._engine
    names = [one.fndesc.llvm_func_name for one in (compiled(calls), result)]
    assert [engine.is_symbol_defined(name) for name in names] == [True, False]


@relies_on(
    "core/dispatcher.py: _DispatcherBase.get_call_template",
    "core/dispatcher.py: _DispatcherBase.add_overload",
    "core/dispatcher.py: _FunctionCompiler.fold_argument_types",
    "core/types/containers.py: NamedTuple",
)
def test_a_call_compiles_what_its_template_is_made_for() -> None:
    """Types of arguments are replaced there by those with members hidden."""

    @part
    def first(columns: Any) -> float:
        return columns.x[0]

    @kernel
    def calls(columns: Any) -> float:
        return first(columns)

    assert calls(COLUMNS) == 1.0
    ((narrow,),) = first.signatures  # type: ignore[attr-defined]
    full = numba.typeof(COLUMNS)
    assert calls.signatures == [(narrow,)]
    assert isinstance(narrow, GroupType) and isinstance(full, GroupType)
    assert (narrow.fields, narrow.types[1], narrow.types[0]) == (("x", "y"), HIDDEN, full.types[0])
    assert full.types[1] != HIDDEN


@relies_on("core/compiler.py: CompileResult._reduce", "core/compiler.py: CompileResult._rebuild")
def test_machine_code_survives_a_file() -> None:
    """KernelCache stores what `_reduce` returns, and `_rebuild` takes it."""

    @kernel
    def thrice(x: float) -> float:
        return 3.0 * x

    assert thrice(2.0) == 6.0
    content = serialize.dumps(compiled(thrice)._reduce())
    rebuilt = CompileResult._rebuild(thrice.targetctx, *pickle.loads(content))
    assert rebuilt.entry_point is not compiled(thrice).entry_point
    assert rebuilt.entry_point(2.0) == 6.0


@relies_on("core/codegen.py: CPUCodegen.magic_tuple")
def test_the_codegen_names_the_processor() -> None:
    """The key of a cached kernel: code for another processor must not be loaded."""

    @kernel
    def same(x: float) -> float:
        return x

    names = same.targetctx.codegen().magic_tuple()
    assert llvm.get_host_cpu_name() in names
    assert any("+sse2" in name or "+neon" in name for name in names)


@relies_on("core/datamodel/models.py: ArrayModel")
def test_an_array_is_described_by_seven_values() -> None:
    """`array_struct` writes them, the first two as null."""
    array = np.arange(6.0).reshape(2, 3)
    model = default_manager[numba.typeof(array)]
    assert model._fields == ("meminfo", "parent", "nitems", "itemsize", "data", "shape", "strides")
    assert array_struct(array).tolist() == [0, 0, 6, 8, array.ctypes.data, 2, 3, 24, 8]


@relies_on("core/datamodel/models.py: TupleModel", "core/datamodel/models.py: StructModel")
def test_the_model_of_a_group_has_those_of_its_members() -> None:
    """Columns have two values; the group itself is an address."""
    model = default_manager[numba.typeof(COLUMNS)]
    assert [one._fields for one in model._models] == [("data", "size")] * 2
    for kind in (model.get_value_type, model.get_data_type, model.get_argument_type, model.get_return_type):
        assert str(kind()) == "i8*"


@relies_on("core/callconv.py: CPUCallConv.get_function_type", "core/callconv.py: CPUCallConv.return_value")
def test_a_function_returns_a_status_and_writes_its_result() -> None:
    """`call_by_address.py` calls kernels so: room for the result, room for an exception, the arguments."""

    @kernel
    def same(x: float) -> float:
        return x

    kind = numba.typeof(COLUMNS)
    function = same.targetctx.call_conv.get_function_type(types.float64, [kind, kind])
    assert str(function.return_type) == "i32"
    result, raised, *arguments = (str(one) for one in function.args)
    assert (result, raised[-2:], arguments) == ("double*", "**", ["i8*", "i8*"])


@relies_on("core/config.py: _OptLevel", "core/codegen.py: CPUCodegen._module_pass_manager")
def test_settings_of_the_process_reach_llvm() -> None:
    """SLP_VECTORIZE joins neighbouring sums; OPT is the level."""

    @kernel
    def add_pairs(columns: Any) -> None:
        x, y = columns.x, columns.y
        first, second = x[0] + y[0], x[1] + y[1]
        x[0], x[1] = first, second

    add_pairs(Columns(np.ones(2), np.ones(2)))
    (code,) = add_pairs.inspect_llvm().values()
    assert "fadd <2 x double>" in code
    assert numba.config.OPT == 2  # type: ignore[attr-defined]
    assert type(numba.config.OPT).__name__ == "_OptLevel"  # type: ignore[attr-defined]


@relies_on("core/options.py: TargetOptions", "core/options.py: DefaultOptions")
def test_options_of_kernels_are_known() -> None:
    """Functions are inlined by force; nothing counts references; a kernel has no second entry for C."""

    @part
    def first(columns: Any) -> float:
        return columns[0][0]

    @kernel
    def calls(columns: Any) -> float:
        return first(columns)

    assert calls((np.ones(2), np.ones(2))) == 1.0
    assert "alwaysinline" in str(compiled(first).library._final_module)
    code = calls.inspect_llvm(calls.signatures[0])
    assert "NRT_" not in code.replace("NRT_MemInfo", "")
    assert "cfunc." not in code


@relies_on("core/event.py: Listener", "core/event.py: install_recorder", "core/dispatcher.py: Dispatcher.compile")
def test_compiling_is_announced_with_start_and_end() -> None:
    """Nested compilations, here of a part, belong to the outer one."""

    @part
    def inner(x: float) -> float:
        return x

    @kernel
    def outer(x: float) -> float:
        return inner(x)

    ticks = itertools.count()
    measured = CompileTime(lambda: float(next(ticks)))
    measured.begin()
    outer(1.0)
    measured.end()
    outer(1)  # compiled for another type
    assert (measured.spent, next(ticks)) == (1.0, 2)


@relies_on("core/extending.py: intrinsic", "core/types/functions.py: ExternalFunction")
def test_intrinsics_and_external_functions() -> None:
    """The barrier of threads takes atomic access to a column, by their number in the column's model."""

    @kernel
    def uses(columns: Any) -> Any:
        store_atomic(columns.x, 1, 5)
        before = add_atomic(columns.x, 1, 2)
        return before, load_atomic(columns.x, 1), sched_yield()

    columns = Columns(np.zeros(2, np.int64), None)
    assert uses(columns) == (5, 7, 0)
    assert columns.x.tolist() == [0, 7]
