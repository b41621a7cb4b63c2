# SPDX-License-Identifier: Apache-2.0
"""Python code of a study: functions in files or modules, located relative to its folder, and optional packages."""

from __future__ import annotations

import ast
import importlib
import importlib.util
import inspect
import sys
import sysconfig
from collections.abc import Iterator, Mapping
from contextlib import suppress
from functools import lru_cache
from hashlib import blake2b
from pathlib import Path
from types import ModuleType
from typing import Any

from conveyor_sim.errors import StudyError

PYTHON = ".py"


def located(reference: str, folder: Path) -> str:
    """Return a reference (`file.py:name`, `module:name`, `program.st`) with the path of its file, if it names one."""
    where, colon, name = reference.rpartition(":") if PYTHON in reference or ":" in reference else (reference, "", "")
    is_file = where.endswith(PYTHON) or not colon
    return f"{folder / where}{colon}{name}" if is_file else reference


def file_of(reference: str) -> Path | None:
    """Return the file that defines a located reference; None for a module that doesn't exist."""
    where, colon, _ = reference.rpartition(":")
    if not colon or where.endswith(PYTHON):
        return Path(where if colon else reference)
    try:
        spec = importlib.util.find_spec(where)
    except (ImportError, ValueError):
        return None
    return None if spec is None or spec.origin is None else Path(spec.origin)


def files_of(reference: str) -> list[Path]:
    """Return the files that define a located reference: its file, and those of the modules that it imports.

    Installed packages and this package are excluded. Modules are searched on the present path.
    """
    first = file_of(reference)
    module = "" if first is None or reference.startswith(str(first)) else reference.partition(":")[0]
    todo = [] if first is None else [(first, module)]
    found: dict[Path, None] = {}
    while todo:
        file, module = todo.pop()
        if file not in found:
            found[file] = None
            todo += [*_imported(file, module)] if file.suffix == PYTHON else []
    return list(found)


def function(reference: str, arguments: Mapping[str, Any] | None = None) -> Any:
    """Return the function or class of a located reference.

    Raise StudyError if it doesn't exist, or if it doesn't accept the arguments.
    """
    where, colon, name = reference.rpartition(":")
    if not (colon and where and name):
        raise StudyError(f"{reference}: given as a function, expected file.py:function or module:function")
    found = getattr(_module(where), name, None)
    if not callable(found):
        raise StudyError(f"{reference}: {where} has no function {name}")
    if arguments is not None:
        try:
            inspect.signature(found).bind(**arguments)
        except TypeError as error:
            expected = ", ".join(map(str, inspect.signature(found).parameters.values())) or "none"
            raise StudyError(f"{reference}: {error}; its arguments are {expected}") from None
    return found


def require_package(package: str, subject: str) -> None:
    """Raise StudyError unless an optional package is installed. subject: what needs it."""
    if importlib.util.find_spec(package) is None:
        raise StudyError(f"{subject}: {package} is not installed, expected it (pip install 'conveyor_sim[studies]')")


def digest_of(file: Path) -> str:
    """Return a hash of a file's contents; "" if it can't be read."""
    try:
        return blake2b(file.read_bytes(), digest_size=8).hexdigest()
    except OSError:
        return ""


_INSTALLED = {"site-packages", "dist-packages"}
_ELSEWHERE = (Path(sysconfig.get_path("stdlib")), Path(__file__).parent.parent)
"""Folders of modules whose versions are checked by other means."""


def _imported(file: Path, module: str) -> Iterator[tuple[Path, str]]:
    """Files and names of modules that a file imports, wherever in it. module: its own name; "": it is in no package."""
    with suppress(OSError, SyntaxError, ValueError):
        for node in ast.walk(ast.parse(file.read_bytes())):
            if isinstance(node, ast.Import):
                names = [alias.name for alias in node.names]
            elif isinstance(node, ast.ImportFrom):
                package = module if file.name == "__init__.py" else module.rpartition(".")[0]
                base = package.rsplit(".", node.level - 1)[0] if node.level > 1 else package
                parts = [base, node.module or ""] if node.level else [node.module or ""]
                start = ".".join(filter(None, parts))
                names = [start, *(f"{start}.{alias.name}" for alias in node.names)]
            else:
                continue
            for name in names:
                if (origin := _origin(name)) is not None:
                    yield origin, name


def _origin(module: str) -> Path | None:
    """Return the file of a module; None if it doesn't exist, is installed, or belongs to this package."""
    place: Path | None = None
    parts = module.split(".")
    for count in range(1, len(parts) + 1):  # from the outside, for what finds an inner one imports the outer ones
        with suppress(ImportError, ValueError, AttributeError):
            spec = importlib.util.find_spec(".".join(parts[:count]))
            if spec is None or spec.origin is None:
                return None
            place = Path(spec.origin)
            if not place.is_file() or _INSTALLED & {*place.parts} or any(map(place.is_relative_to, _ELSEWHERE)):
                return None
            continue
        return None
    return place


def _module(where: str) -> ModuleType:
    try:
        if not where.endswith(PYTHON):
            return importlib.import_module(where)
        path = Path(where)
        return _from_file(path, path.stat().st_mtime_ns)
    except OSError as error:
        raise StudyError(f"{where}: {error.strerror}, expected a Python file") from None
    except (ImportError, SyntaxError) as error:
        raise StudyError(f"{where}: {error}") from error


@lru_cache(maxsize=16)
def _from_file(path: Path, _changed: int) -> ModuleType:
    """Execute a file once per process, because a study calls its functions many times."""
    name = f"conveyor_study_{path.stem}_{blake2b(str(path).encode(), digest_size=4).hexdigest()}"
    spec = importlib.util.spec_from_file_location(name, path)
    assert spec is not None and spec.loader is not None  # for a name that ends in .py there is a loader
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # dataclasses look their module up by name
    spec.loader.exec_module(module)
    return module
