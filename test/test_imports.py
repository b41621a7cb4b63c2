# SPDX-License-Identifier: Apache-2.0
"""Import rules: each package imports what tools/import_rules.py allows; no cycles; few packages on few levels."""

from __future__ import annotations

import ast
import importlib
import subprocess
import sys
from collections.abc import Iterator
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
PACKAGE = ROOT / "conveyor_sim"
sys.path.insert(0, str(ROOT / "tools"))
import_rules = importlib.import_module("import_rules")
RULES, WITHIN = import_rules.RULES, import_rules.WITHIN

SOURCES = sorted(PACKAGE.rglob("*.py"))

MOST_PACKAGES, MOST_LEVELS, MOST_IMPORTS = 20, 11, 120
"""Limits that keep the design readable; raising one needs a reason."""


def package_of(source: Path) -> str:
    return source.relative_to(PACKAGE).parts[0].removesuffix(".py")


def module_of(source: Path) -> str:
    return ".".join(source.relative_to(PACKAGE).with_suffix("").parts).removesuffix(".__init__")


def imports_of(source: Path) -> Iterator[str]:
    """Yield the absolute names of all imports of a file, those inside functions and for types included."""
    package = ["conveyor_sim", *source.relative_to(PACKAGE).parent.parts]
    for node in ast.walk(ast.parse(source.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level + 1] if node.level else []
            base = [*base, *(node.module.split(".") if node.module else [])]
            names = (".".join([*base, alias.name]) for alias in node.names)
            yield from (name for name in names if name != "conveyor_sim.__version__")


def used_by(package: str) -> dict[str, set[str]]:
    """Return the packages that `package` imports, of this project and others, with the importing modules."""
    used: dict[str, set[str]] = {}
    for source in SOURCES:
        if package_of(source) == package:
            for name in imports_of(source):
                top, _, rest = name.partition(".")
                imported = rest.split(".")[0] if top == "conveyor_sim" else top
                if imported != package and not (imported == top and top in sys.stdlib_module_names):
                    used.setdefault(imported, set()).add(module_of(source))
    return used


def test_rules_name_each_package_once() -> None:
    assert set(RULES) == {package_of(source) for source in SOURCES}
    assert set(import_rules.LABELS) == set(RULES) - {"__init__"}


def test_packages_import_downwards_only() -> None:
    below: set[str] = set()
    for package in RULES:
        assert import_rules.allowed(package) <= below, package
        below.add(package)


@pytest.mark.parametrize("package", RULES)
def test_a_package_imports_what_its_rule_says(package: str) -> None:
    used = used_by(package)
    rule = set(RULES[package].replace("|", " ").split())
    assert {name: sorted(used[name]) for name in set(used) - rule} == {}, "not allowed"
    assert rule - set(used) == set(), "allowed, not used"


def part_of(names: list[str], package: str) -> str:
    """Return the part that a module belongs to: a folder or file with a rule, or "" for the other files."""
    return names[0] if names and names[0] in WITHIN[package] else ""


@pytest.mark.parametrize("package", WITHIN)
def test_parts_of_a_package_import_downwards_only(package: str) -> None:
    rules, folder = WITHIN[package], PACKAGE / package
    folders = {path.name for path in folder.iterdir() if path.is_dir() and path.name != "__pycache__"}
    assert {name for name in folders if list((folder / name).glob("*.py"))} <= set(rules)
    below: set[str] = set()
    for part, rule in rules.items():
        assert set(rule.split()) <= below, part
        below.add(part)
        may = {part, *rule.split(), *({""} & below)}
        for source in folder.rglob("*.py"):
            own = list(source.relative_to(folder).with_suffix("").parts)
            if part_of(own, package) == part and own != ["__init__"]:
                for name in imports_of(source):
                    _, inside, rest = name.partition(f"conveyor_sim.{package}.")
                    assert not inside or part_of(rest.split("."), package) in may, f"{module_of(source)}: {name}"


def test_few_packages_stand_on_few_levels() -> None:
    packages = [name for name in RULES if (PACKAGE / name).is_dir()]
    imports = [(name, lower) for name in RULES if name != "__init__" for lower in import_rules.allowed(name)]
    levels = {name: level for name, level in import_rules.levels().items() if name != "__init__"}
    assert len(packages) <= MOST_PACKAGES
    assert max(levels.values()) <= MOST_LEVELS
    assert len(imports) <= MOST_IMPORTS


def test_no_files_import_each_other_in_a_cycle() -> None:
    """Imports inside a package and imports for type annotations count as well."""
    modules = {module_of(source): source for source in SOURCES}
    graph: dict[str, set[str]] = {}
    for module, source in modules.items():
        named = {name.removeprefix("conveyor_sim.") for name in imports_of(source) if name.startswith("conveyor_sim.")}
        imported = {name if name in modules else name.rpartition(".")[0] for name in named}
        graph[module] = (imported & set(modules)) - {module}
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        pytest.fail(f"these import each other: {' -> '.join(error.args[1])}")


@pytest.mark.parametrize(
    "module",
    [
        "bag.recorder",
        "bag.reader",
        "report.figures.aside",
        "ros.controller_node",
        "protocols.tags.scene_provider",
        "protocols.hosting.serving",
    ],
)
def test_readers_figures_and_controllers_load_no_compiler(module: str) -> None:
    """Numba takes half a second to import, in processes that never step a simulation."""
    pytest.importorskip({"report": "matplotlib", "ros": "rclpy"}.get(module.partition(".")[0], "numpy"))
    code = f"import sys, conveyor_sim.{module}; sys.exit('numba' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code]).returncode == 0


def test_the_diagram_is_that_of_the_rules() -> None:
    text = import_rules.PAGE.read_text()
    assert import_rules.page(text) == text
