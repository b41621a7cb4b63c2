# SPDX-License-Identifier: Apache-2.0
"""Sources of docs/validation.md, by name. The package of studies is found beside the other studies, not installed."""

from __future__ import annotations

import importlib
import sys
from types import ModuleType
from typing import Any

from study_page import STUDIES


def module(name: str) -> ModuleType:
    """Return a module of docs/studies/validation/."""
    before = list(sys.path)
    sys.path.insert(0, str(STUDIES))
    try:
        return importlib.import_module(f"validation.{name}")
    finally:
        sys.path[:] = before


SOURCES = module("sources")
NAMES: tuple[str, ...] = SOURCES.MODULES


def source(name: str) -> Any:
    """Return the source of a module."""
    return SOURCES.source(name)
