# SPDX-License-Identifier: Apache-2.0
"""Generate the pages of docs/ that programs write, or check that they are current.

    make docs-check                 # prints the pages that are not current; fails if there are any
    make docs                       # writes them

Measurements are not repeated: pages are generated from the stored figures.
"""

from __future__ import annotations

import importlib
import sys
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
DOCS = ROOT / "docs"
_TABLES = (
    "bag.messages.reference",
    "line.reference",
    "scene.reference",
    "studies.calibration.reference",
    "control.st.dialect",
    "control.st.attributes",
)
"""Modules with tables that are parts of pages."""


def pages() -> Iterator[tuple[Path, str]]:
    """Each page, and its text as it should be."""
    for name, package in (("effects", "physics.effects"), ("cli", "cli")):
        yield DOCS / f"{name}.md", importlib.import_module(f"conveyor_sim.{package}.reference").reference()
    yield DOCS / "limits.md", importlib.import_module("conveyor_sim.physics.effects.limits").limits_page()
    sys.path[:0] = [str(DOCS / "studies"), str(ROOT / "test"), str(ROOT / "tools")]
    rules = importlib.import_module("import_rules")
    yield rules.PAGE, rules.page(rules.PAGE.read_text(encoding="utf-8"))
    with_parts = importlib.import_module("page_parts").with_parts
    tables: dict[str, dict[str, str]] = {}
    for package in _TABLES:
        for name, parts in importlib.import_module(f"conveyor_sim.{package}").tables().items():
            tables[name] = {**tables.get(name, {}), **parts}
    for name, parts in tables.items():
        page = DOCS / f"{name}.md"
        yield page, with_parts(page, page.read_text(encoding="utf-8"), parts)
    accuracy, promises, stability = (importlib.import_module(name) for name in ("accuracy", "promises", "stability"))
    defaults = importlib.import_module("defaults")
    yield defaults.PAGE, defaults.page()
    text = (DOCS / "accuracy.md").read_text(encoding="utf-8")
    yield DOCS / "accuracy.md", accuracy.page(importlib.import_module("stepped").page(text))
    yield promises.PAGE, promises.page()
    yield from accuracy.tables().items()
    text = stability.PAGE.read_text(encoding="utf-8")
    yield stability.PAGE, stability.page(text, stability.FOLDER)
    yield stability.CASES, stability.cases(stability.FOLDER)
    settings = importlib.import_module("cookbook_settings")
    yield settings.INDEX, settings.page()
    validation = importlib.import_module("validation.page")
    yield validation.PAGE, validation.page()


def main() -> None:
    """Compare all pages, or write them."""
    stale = [(path, text) for path, text in pages() if not path.exists() or path.read_text(encoding="utf-8") != text]
    if "--write" in sys.argv[1:]:
        for path, text in stale:
            path.write_text(text, encoding="utf-8")
            print(f"{path.relative_to(ROOT)}: written")
    elif stale:
        names = ", ".join(str(path.relative_to(ROOT)) for path, _ in stale)
        sys.exit(f"{names}: not what its program writes now; `make docs` writes it anew")


if __name__ == "__main__":
    main()
