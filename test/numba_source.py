# SPDX-License-Identifier: Apache-2.0
"""Names of definitions in numba's sources on which the engine's compiler relies."""

import ast
import functools
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba
import pytest

ROOT = Path(numba.__file__).parent


def relies_on(*definitions: str) -> Callable[[Any], Any]:
    """Name the definitions that a test is about, as `core/codegen.py: CPUCodeLibrary.finalize`.

    The test fails if one of them is missing from the installed numba.
    """

    def decorate(test: Any) -> Any:
        @functools.wraps(test)
        def checked(*args: Any, **kwargs: Any) -> None:
            missing = [definition for definition in definitions if not is_defined(definition)]
            if missing:
                pytest.fail(f"numba {numba.__version__} lacks {', '.join(missing)}: {test.__doc__}")
            test(*args, **kwargs)

        return checked

    return decorate


def is_defined(definition: str) -> bool:
    """Return True if a file of numba defines a class, function or name, as `file: Class.method`."""
    file, _, name = definition.partition(": ")
    if not (ROOT / file).exists():
        return False
    scope = _tree(ROOT / file).body
    for part in name.split("."):
        matches = [node for node in scope if part in _names(node)]
        if not matches:
            return False
        scope = getattr(matches[-1], "body", [])
    return True


@functools.cache
def _tree(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"))


def _names(node: ast.stmt) -> set[str]:
    if isinstance(node, ast.ClassDef | ast.FunctionDef):
        return {node.name}
    if isinstance(node, ast.Assign):
        return {target.id for target in node.targets if isinstance(target, ast.Name)}
    return set()
