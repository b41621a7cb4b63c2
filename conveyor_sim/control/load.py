# SPDX-License-Identifier: Apache-2.0
"""Controllers by name: "module:factory" or "file.py:factory", with parameters."""

from __future__ import annotations

import importlib
import importlib.util
import inspect
import sys
from collections.abc import Mapping
from pathlib import Path
from types import ModuleType

from conveyor_sim.control.scan import ControlError, Controller


def load(reference: str, parameters: Mapping[str, object] | None = None) -> Controller:
    """Return the controller that a factory (a class or function) builds from parameters by name.

    Raise ControlError for an invalid reference, a module or file that can't be imported or has no such factory,
    parameters that the factory does not take, or a result without `scan`.
    """
    where, colon, name = reference.rpartition(":")
    if not (colon and where and name):
        raise ControlError(f"controller {reference!r}: expected module:factory or file.py:factory")
    module = _from_file(reference, Path(where)) if where.endswith(".py") else _from_module(reference, where)
    factory = getattr(module, name, None)
    if factory is None:
        raise ControlError(f"controller {reference!r}: {where} has no {name!r}")
    if not callable(factory):
        raise ControlError(f"controller {reference!r}: {name} is {factory!r}, expected a class or a function")
    parameters = parameters or {}
    try:
        inspect.signature(factory).bind(**parameters)
    except TypeError as error:
        expected = ", ".join(map(str, inspect.signature(factory).parameters.values())) or "none"
        raise ControlError(f"controller {reference!r}: {error}; its parameters are {expected}") from None
    try:
        controller: Controller = factory(**parameters)
    except (TypeError, ValueError) as error:
        raise ControlError(f"controller {reference!r}: {error}; its parameters were {dict(parameters)}") from error
    if not callable(getattr(controller, "scan", None)):
        kind = type(controller).__name__
        raise ControlError(f"controller {reference!r}: made a {kind}, expected an object with scan(inputs)")
    return controller


def _from_module(reference: str, name: str) -> ModuleType:
    try:
        return importlib.import_module(name)
    except ImportError as error:
        raise ControlError(f"controller {reference!r}: {error}") from error


def _from_file(reference: str, path: Path) -> ModuleType:
    if not path.is_file():
        raise ControlError(f"controller {reference!r}: no file {path}")
    name = f"conveyor_controller_{path.stem}"
    spec = importlib.util.spec_from_file_location(name, path)
    assert spec is not None and spec.loader is not None  # for a name that ends in .py there is a loader
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # dataclasses look their module up by name
    try:
        spec.loader.exec_module(module)
    except (ImportError, SyntaxError) as error:
        raise ControlError(f"controller {reference!r}: {error}") from error
    return module
