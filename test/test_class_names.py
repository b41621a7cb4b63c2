# SPDX-License-Identifier: Apache-2.0
"""Public class names: each belongs to one class of the package, or is shared on purpose and listed here."""

import ast
from collections import defaultdict
from pathlib import Path

PACKAGE = Path(__file__).parents[1] / "conveyor_sim"

BLOCKS = ("CTU", "F_TRIG", "RS", "R_TRIG", "SR", "TOF", "TON", "TP")
"""Function blocks of IEC 61131-3: once for controllers in Python, once for Structured Text."""

SHARED = {name: {"control/blocks", "control/st/blocks"} for name in BLOCKS}
"""Modules by class name."""


def test_public_class_names_are_unique_or_shared_on_purpose() -> None:
    modules: dict[str, set[str]] = defaultdict(set)
    for source in PACKAGE.rglob("*.py"):
        module = source.relative_to(PACKAGE).with_suffix("").as_posix()
        for node in ast.parse(source.read_text()).body:
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                modules[node.name].add(module)
    assert {name: places for name, places in modules.items() if len(places) > 1} == SHARED
