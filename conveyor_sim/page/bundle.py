# SPDX-License-Identifier: Apache-2.0
"""The page as one file: modules in one script, styles and data inside, and a policy that forbids other content."""

from __future__ import annotations

import base64
import hashlib
import re
from collections.abc import Mapping
from html import escape
from pathlib import Path

PAGE = Path(__file__).parent / "page"
HEADERS = {
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; "
    "img-src data:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    "X-Content-Type-Options": "nosniff",
    "Cache-Control": "no-store",
}
"""HTTP headers of each answer of a server of the page."""
_TYPES = {".html": "text/html", ".css": "text/css", ".js": "text/javascript"}
_IMPORT = re.compile(r'^import \{[^}]*\} from "\./([\w.]+)";\n', re.MULTILINE)
_EXPORT = re.compile(r"^export (?=(?:async )?(?:function|const|class) (\w+))", re.MULTILINE)
_STYLE = re.compile(r'<link rel="stylesheet" href="([\w./]+)">')
_SCRIPT = re.compile(r'<script( type="module")? src="([\w./]+)"></script>')


def one_file(parts: Mapping[str, bytes], title: str) -> str:
    """Return the page with its data, deflated bytes by name. title: shown until the data are read."""
    scripts: list[str] = []
    styles: list[str] = []

    def style(match: re.Match[str]) -> str:
        styles.append(text(match[1]))
        return f"<style>{styles[-1]}</style>"

    def script(match: re.Match[str]) -> str:
        scripts.append(joined(match[2]) if match[1] else text(match[2]))
        return f"<script{match[1] or ''}>{scripts[-1]}</script>"

    page = _SCRIPT.sub(script, _STYLE.sub(style, text("index.html")))
    policy = (
        f"default-src 'none'; script-src {_hashes(scripts)}; style-src {_hashes(styles)}; img-src data:; "
        "base-uri 'none'; form-action 'none'"
    )
    data = "\n".join(
        f'<script type="text/plain" data-part="{escape(name)}">{base64.b64encode(part).decode()}</script>'
        for name, part in parts.items()
    )
    page = page.replace("<title>Line view</title>", f"<title>{escape(title)}</title>")
    page = page.replace("<!--policy-->", f'<meta http-equiv="Content-Security-Policy" content="{policy}">')
    return page.replace("<!--recording-->", data)


def page_files() -> dict[str, str]:
    """Return the content type of each file of the page, by its path in PAGE."""
    files = (file for file in PAGE.rglob("*") if file.suffix in _TYPES)
    return {file.relative_to(PAGE).as_posix(): _TYPES[file.suffix] for file in files}


def joined(module: str) -> str:
    """Return a module and all that it imports in one script. Each module is a function that returns its exports.

    The names of exports are unique among the modules.
    """
    done: dict[str, str] = {}

    def take(name: str) -> None:
        if name not in done:
            source = text(name)
            done[name] = ""
            for other in _IMPORT.findall(source):
                take(other)
            names = ", ".join(_EXPORT.findall(source))
            body = _EXPORT.sub("", _IMPORT.sub("", source))
            done[name] = done.pop(name) + f"const {{ {names} }} = (() => {{\n{body}return {{ {names} }};\n}})();\n"

    take(module)
    return "".join(done.values())


def text(name: str) -> str:
    """Return the text of a file of the page."""
    return (PAGE / name).read_text(encoding="utf-8")


def _hashes(texts: list[str]) -> str:
    digests = (hashlib.sha256(entry.encode()).digest() for entry in texts)
    return " ".join(f"'sha256-{base64.b64encode(digest).decode()}'" for digest in digests)
