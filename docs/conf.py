# SPDX-License-Identifier: Apache-2.0
"""The docs site: Sphinx over the Markdown pages of the checkout, README.md first (`make site`).

Pages stay plain Markdown that a forge shows as well: what only the site needs, its navigation and captions, is added
here as each page is read.
"""

from __future__ import annotations

import re
import shutil
from pathlib import Path

from sphinx.application import Sphinx

ROOT = Path(__file__).resolve().parents[1]
VERSION = ROOT / "conveyor_sim" / "__init__.py"

project = "conveyor_sim"
release = re.search(r'^__version__ = "(.+)"$', VERSION.read_text(encoding="utf-8"), re.MULTILINE).group(1)
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinxcontrib.mermaid"]
root_doc = "README"
include_patterns = ["*.md", "docs/**.md"]
exclude_patterns = [folder.name for folder in ROOT.iterdir() if folder.is_dir() and folder.name != "docs"]

html_theme = "furo"
html_title = f"conveyor_sim {release}"
html_copy_source = False
html_theme_options = {"navigation_with_keys": True}
smartquotes = False  # options such as --price stay as they are typed

myst_heading_anchors = 4
myst_fence_as_directive = ["mermaid"]
mermaid_height = "auto"
mermaid_fullscreen = False

autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_default_options = {"members": True, "undoc-members": True}
default_role = "code"  # docstrings are Markdown in this

RECIPES = sorted(page.stem for page in ROOT.glob("docs/cookbook/*.md") if page.stem != "index")
PARTS = sorted(page.stem for page in ROOT.glob("docs/parts/*.md"))
MEASURED = sorted(page.stem for page in ROOT.glob("docs/performance/*.md"))
STUDIES = sorted(ROOT.glob("docs/accuracy/*/tables.md"))
NAVIGATION = {
    "README": {
        "Tutorials": [
            "docs/build_a_line",
            "docs/tutorial_line",
            "docs/tutorial_plc",
            "docs/tutorial_scada",
            "docs/tutorial_ros",
            "docs/filler_block",
            "docs/brewery",
            "docs/cookbook/index",
            "docs/troubleshooting",
            "docs/gallery",
        ],
        "Control and protocols": [
            *("docs/testing_control_logic", "docs/structured_text", "docs/plc"),
            *("docs/scada", "docs/opcua", "docs/ros"),
        ],
        "A line": [
            *("docs/index", "docs/scene", "docs/layout", "docs/conveyors", "docs/placement", "docs/check", "docs/line"),
            *(
                "docs/cli",
                "docs/recordings",
                "docs/alarms",
                "docs/report",
                "docs/studies",
                "docs/view",
                "docs/drawings",
            ),
            *("docs/effects", "docs/calibration", "docs/base", "docs/energy_and_damage", "docs/glossary"),
        ],
        "What to rely on": [
            "docs/validation",
            "docs/limits",
            "docs/accuracy",
            "docs/stability",
            "docs/reliability",
            "docs/performance",
            "docs/paper",
        ],
        "Inside": ["docs/architecture", "docs/extending", "docs/api/index", "CONTRIBUTING", "CHANGELOG"],
    },
    "docs/plc": {"PLCs": [f"plc/{page.stem}" for page in sorted(ROOT.glob("docs/plc/*.md"))]},
    "docs/cookbook/index": {"Recipes": RECIPES},
    "docs/structured_text": {"Studies": ["studies/structured_text"]},
    "docs/ros": {"Pages": [f"ros/{page.stem}" for page in sorted(ROOT.glob("docs/ros/*.md"))]},
    "docs/scene": {"Parts": [f"parts/{page}" for page in PARTS]},
    "docs/performance": {"Tables": [*(f"performance/{page}" for page in MEASURED), "studies/performance_history"]},
    "docs/accuracy": {
        "Tables": [
            "accuracy/promises",
            "accuracy/defaults",
            *(f"accuracy/{page.parent.name}/tables" for page in STUDIES),
        ]
    },
    "docs/stability": {"Tables": ["stability/cases", "stability/fuzz"]},
    "docs/api/index": {"Modules": ["simulation", "observations", "testing", "control", "recordings", "errors"]},
}


def add_navigation(app: Sphinx, page: str, source: list[str]) -> None:
    """Put the pages that come after a page into it, unseen: the sidebar shows them."""
    for caption, pages in NAVIGATION.get(page, {}).items():
        source[0] += "\n".join(["", "", "```{toctree}", ":hidden:", f":caption: {caption}", "", *pages, "```", ""])


def show_titles(app: Sphinx, page: str, source: list[str]) -> None:
    """Turn the title of a code block, a file's path, into its caption; plain Markdown doesn't show it."""
    source[0] = re.sub(r'^```(\w+) title="(.+)"$', r"```{code-block} \1\n:caption: \2\n", source[0], flags=re.MULTILINE)


def from_markdown(app: Sphinx, kind: str, name: str, thing: object, options: object, lines: list[str]) -> None:
    """Docstrings are Markdown: an indented example is code, and `for_` in a sentence is no link."""
    for number, line in enumerate(lines):
        lines[number] = re.sub(r"(?<=\w)_(?!\w)", r"\_", line)
        if line.endswith(":") and lines[number + 1 : number + 2] == [""] and lines[number + 2].startswith("    "):
            lines[number] += ":"


def write_start(app: Sphinx, problem: Exception | None) -> None:
    """Let the address of the site show the README."""
    if problem is None and app.builder.name == "html":
        shutil.copy(app.outdir / "README.html", app.outdir / "index.html")


def setup(app: Sphinx) -> None:
    """Register the handlers; called by Sphinx."""
    app.connect("source-read", add_navigation)
    app.connect("source-read", show_titles)
    app.connect("autodoc-process-docstring", from_markdown)
    app.connect("build-finished", write_start)
