# SPDX-License-Identifier: Apache-2.0
"""Programs of docs/studies/, which are no package, as modules."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

STUDIES = Path(__file__).parents[1] / "docs" / "studies"


def load_study(name: str) -> ModuleType:
    """A program as it would be run, with the modules beside it in reach."""
    specification = importlib.util.spec_from_file_location(f"study_{name}", STUDIES / f"{name}.py")
    assert specification is not None
    assert specification.loader is not None
    module = importlib.util.module_from_spec(specification)
    before = list(sys.path)
    sys.path.insert(0, str(STUDIES))
    try:
        specification.loader.exec_module(module)
    finally:
        sys.path[:] = before
    return module
