"""The house stands: imports point down only, and the heavy libraries stay in the rooms that are meant for them."""

import ast
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parent.parent / "conveyor_sim"

FLOORS = [
    ["errors", "version"],
    ["support"],
    ["engine", "scene", "control"],
    ["laws", "observe", "line.process_image", "line.commands", "line.watchdog"],
    ["timestep"],
    ["effects"],
    ["model"],
    ["state", "elastic"],
    ["guard", "line", "energy_account", "damage_account"],
    ["integration"],
    ["simulation"],
    ["compilation"],
    ["bag", "price", "accuracy", "achieved", "stopped"],
    ["summary", "plot", "explain"],
    ["runner", "report"],
    ["ros"],
    ["cli", "testing"],
]
FLOOR_OF = {room: floor for floor, rooms in enumerate(FLOORS) for room in rooms}
ONLY_IN = {"rclpy": "ros", "matplotlib": "plot", "numba": "engine"}
SOURCES = sorted(PACKAGE.rglob("*.py"))


def room_of(module: str) -> str | None:
    """The longest known room that a dotted module below the package lies in."""
    parts = module.split(".")
    for length in range(len(parts), 0, -1):
        if ".".join(parts[:length]) in FLOOR_OF:
            return ".".join(parts[:length])
    return None


def imports_of(source: Path) -> Iterator[str]:
    """Absolute names of all that a file imports, wherever in it."""
    package = ["conveyor_sim", *source.relative_to(PACKAGE).parent.parts]
    for node in ast.walk(ast.parse(source.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level + 1] if node.level else []
            base = [*base, *(node.module.split(".") if node.module else [])]
            yield from (".".join([*base, alias.name]) for alias in node.names)


def module_of(source: Path) -> str:
    return ".".join(source.relative_to(PACKAGE).with_suffix("").parts).removesuffix(".__init__")


@pytest.mark.parametrize("source", [path for path in SOURCES if path != PACKAGE / "__init__.py"], ids=module_of)
def test_imports_point_down(source: Path) -> None:
    own = room_of(module_of(source))
    assert own is not None, f"{source.name} is on no floor: add its room to FLOORS"
    for name in imports_of(source):
        if name.startswith("conveyor_sim."):
            other = room_of(name.removeprefix("conveyor_sim."))
            if other is not None and other.split(".")[0] != own.split(".")[0]:
                assert FLOOR_OF[other] < FLOOR_OF[own], f"{own} imports {name}, which is not below it"


@pytest.mark.parametrize("source", SOURCES, ids=module_of)
def test_heavy_libraries_stay_in_their_rooms(source: Path) -> None:
    for name in imports_of(source):
        home = ONLY_IN.get(name.split(".")[0])
        assert home is None or module_of(source).split(".")[0] == home, f"only {home}/ may import {name}"


def test_engine_knows_nothing_of_the_project() -> None:
    allowed = {"numpy", "numba"}
    for source in (PACKAGE / "engine").rglob("*.py"):
        for name in imports_of(source):
            top = name.split(".")[0]
            if top == "conveyor_sim":
                assert name.startswith("conveyor_sim.engine"), f"{source.name} imports {name}"
            elif top in {"scipy", "pydantic", "rosbags", "mcap", "rclpy", "matplotlib", "click", "rich", "ruamel"}:
                assert top in allowed, f"{source.name} imports {name}"


def test_control_knows_nothing_of_the_project() -> None:
    """What a PLC programmer reads: the standard library, and no way to the simulation but the process image."""
    for source in (PACKAGE / "control").rglob("*.py"):
        for name in imports_of(source):
            own = name.startswith("conveyor_sim.control")
            assert own or name.split(".")[0] in sys.stdlib_module_names, f"{source.name} imports {name}"
