"""The house stands: each room imports what its line below allows and nothing else; no circles; no file too long."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from collections.abc import Iterator, Mapping
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
PACKAGE = ROOT / "conveyor_sim"
PAGE = ROOT / "docs" / "architecture.md"

MAY_IMPORT: Mapping[str, str] = {
    "__init__": "scene simulation",
    "errors": "",
    "engine": "| llvmlite numba numpy",
    "support": "errors | numpy rich",
    "control": "",
    "scene": "errors support | annotated_types numpy pydantic pydantic_core ruamel yaml",
    "laws": "engine scene | numpy",
    "timestep": "laws scene",
    "effects": "engine errors laws scene timestep | numpy",
    "observe": "| numpy",
    "statistics": "| numpy scipy",
    "model": "effects engine errors laws scene timestep | llvmlite numpy",
    "state": "engine errors model scene support | numpy pydantic",
    "accounts": "engine model observe scene state | numpy",
    "line": "engine errors model observe scene state support | numpy",
    "stepping": "accounts engine errors model scene state | numpy",
    "simulation": "accounts engine line model observe scene state stepping | numpy",
    "bag": "errors line observe scene simulation stepping support | lz4 mcap numpy rosbags ruamel zstandard",
    "accuracy": "accounts effects engine errors laws line model observe scene simulation statistics stepping support "
    "timestep | numpy rich ruamel scipy",
    "explain": "effects errors model scene simulation support timestep | rich",
    "plot": "accuracy bag errors line observe scene support | matplotlib numpy",
    "view": "bag errors observe scene simulation support | numpy",
    "runs": "bag control engine errors line model observe plot scene simulation support timestep view "
    "| click numpy rich",
    "live": "bag errors line observe runs simulation support",
    "scada": "bag control errors line live observe runs scene simulation support view | aiohttp asyncua cryptography "
    "foxglove google numpy paho pymodbus",
    "st": "control support | lark",
    "studies": "bag control engine errors line model observe plot runs scene simulation statistics st support "
    "| SALib annotated_types distributed numpy optuna pyarrow pydantic rich scipy",
    "ros": "bag control errors explain line live model observe runs scada scene simulation st support | "
    "builtin_interfaces click conveyor_msgs diagnostic_msgs numpy rcl_interfaces rclpy rosgraph_msgs std_msgs std_srvs",
    "testing": "bag control engine errors line plot ros scada scene simulation state support view | numpy pytest",
    "cli": "accuracy bag control errors explain line model plot ros runs scada scene st studies support view | click rich",
}
"""By room, from the lowest up: the rooms of the project, then the packages of others that it imports."""

LONGEST = 400
"""Lines of a file."""

SOURCES = sorted(PACKAGE.rglob("*.py"))


def room_of(source: Path) -> str:
    return source.relative_to(PACKAGE).parts[0].removesuffix(".py")


def module_of(source: Path) -> str:
    return ".".join(source.relative_to(PACKAGE).with_suffix("").parts).removesuffix(".__init__")


def imports_of(source: Path) -> Iterator[str]:
    """Absolute names of all that a file imports, wherever in it and for whatever reason."""
    package = ["conveyor_sim", *source.relative_to(PACKAGE).parent.parts]
    for node in ast.walk(ast.parse(source.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level + 1] if node.level else []
            base = [*base, *(node.module.split(".") if node.module else [])]
            names = (".".join([*base, alias.name]) for alias in node.names)
            yield from (name for name in names if name != "conveyor_sim.__version__")


def test_the_list_has_every_room() -> None:
    assert list(MAY_IMPORT) == sorted({room_of(source) for source in SOURCES}, key=list(MAY_IMPORT).index)
    assert set(MAY_IMPORT) == {room_of(source) for source in SOURCES}


def test_rooms_import_downwards_only() -> None:
    below: set[str] = {"scene", "simulation"}  # imported by the package itself on first use
    for room, allowed in MAY_IMPORT.items():
        assert set(allowed.partition("|")[0].split()) <= below, room
        below.add(room)


@pytest.mark.parametrize("source", SOURCES, ids=module_of)
def test_a_room_imports_what_it_may(source: Path) -> None:
    own = room_of(source)
    rooms, _, packages = MAY_IMPORT[own].partition("|")
    for name in imports_of(source):
        top, _, rest = name.partition(".")
        if top == "conveyor_sim":
            assert rest.split(".")[0] in {own, *rooms.split()}, f"{own} imports {name}"
        else:
            assert top in sys.stdlib_module_names or top in packages.split(), f"{own} imports {name}"


def test_no_list_allows_what_nobody_uses() -> None:
    used: dict[str, set[str]] = {room: set() for room in MAY_IMPORT}
    for source in SOURCES:
        for name in imports_of(source):
            top, _, rest = name.partition(".")
            used[room_of(source)].add(rest.split(".")[0] if top == "conveyor_sim" else top)
    for room, allowed in MAY_IMPORT.items():
        assert set(allowed.replace("|", " ").split()) <= used[room], room


def test_no_files_import_each_other_in_a_circle() -> None:
    """Not inside a room either, nor for the sake of types."""
    modules = {module_of(source): source for source in SOURCES}
    graph: dict[str, set[str]] = {}
    for module, source in modules.items():
        named = {name.removeprefix("conveyor_sim.") for name in imports_of(source) if name.startswith("conveyor_sim.")}
        found = {name if name in modules else name.rpartition(".")[0] for name in named}
        graph[module] = (found & set(modules)) - {module}
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        pytest.fail(f"these import each other: {' -> '.join(error.args[1])}")


@pytest.mark.parametrize(
    "module", ["bag.recorder", "bag.reader", "plot.aside", "ros.controller_node", "scada.scene_source", "scada.serving"]
)
def test_what_reads_draws_or_controls_does_without_the_compiler(module: str) -> None:
    """Numba takes half a second to import, in processes that never step anything."""
    name = f"conveyor_sim.{module}"
    pytest.importorskip({"plot": "matplotlib", "ros": "rclpy"}.get(module.partition(".")[0], "numpy"))
    code = f"import sys, {name}; sys.exit('numba' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code]).returncode == 0


@pytest.mark.parametrize("source", SOURCES, ids=module_of)
def test_no_file_is_too_long(source: Path) -> None:
    assert len(source.read_text().splitlines()) <= LONGEST


def test_the_diagram_shows_every_room_and_no_other() -> None:
    diagram = PAGE.read_text().partition("```mermaid")[2].partition("```")[0]
    shown = re.findall(r"^ *(\w+)\[\"(\w+)(?:/|\.py)", diagram, re.MULTILINE)
    assert {name for name, _ in shown} == {label for _, label in shown} == set(MAY_IMPORT) - {"__init__"}


def test_the_diagram_points_as_imports_do() -> None:
    diagram = PAGE.read_text().partition("```mermaid")[2].partition("```")[0]
    for start, end in re.findall(r"^ *(\w+) --> (\w+)$", diagram, re.MULTILINE):
        assert end in MAY_IMPORT[start].partition("|")[0].split(), f"{start} --> {end}"
