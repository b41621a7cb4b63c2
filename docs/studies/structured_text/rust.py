# SPDX-License-Identifier: Apache-2.0
"""Programs with expected values in tests of compilers that are written in Rust."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from pathlib import Path

from units import Check, Part, Unit, decoded

_STRING = r'r#"(?P<raw>.*?)"#|r"(?P<plain>[^"]*)"|"(?P<text>(?:[^"\\]|\\.)*)"'
_E2E = re.compile(
    rf"e2e_(?P<kind>\w+)!\(\s*(?:///[^\n]*\n\s*)*(?P<name>\w+),\s*(?P<before>[^\"]*?)(?:{_STRING})", re.DOTALL
)
_PAIRS = re.compile(r"\(\s*(\d+)\s*,\s*([^()]+?|[^()]*\([^()]*\)[^()]*?)\s*\)")
_TEST = re.compile(r"#\[test\]\s*(?P<marks>(?:#\[[^\]]*\]\s*)*)fn (?P<name>\w+)\(\)[^{]*\{")
_STRUCT = re.compile(r"struct (?P<name>\w+)(?:<[^>]*>)?[^{;]*\{(?P<fields>[^}]*)\}")
_FIELD = re.compile(r"(?:pub )?(\w+)\s*:\s*[^,]+")
_SOURCE = re.compile(rf"let (?:src|prog|source|st_source)\s*=\s*(?:{_STRING})", re.DOTALL)
_EQUAL = re.compile(r"assert_eq!\(\s*maintype\.(\w+)(\.abs\(\))?\s*,\s*([^;]*?),?\s*\);")
_BOOL = re.compile(r"assert!\(\s*(!?)maintype\.(\w+)\s*\);")
_NEAR = re.compile(r"assert_almost_eq!\(\s*([^,]+),\s*maintype\.(\w+)\s*,\s*([^)]+)\);")
_LET = re.compile(r"let (\w+)(?:: \w+)?\s*=\s*([^;\"]+);")
_NUMBER = re.compile(r"0[xbo][0-9a-fA-F_]+|\d[\d_]*(?:\.[\d_]*)?(?:e[+-]?\d+)?")
_MADE = re.compile(r"let mut maintype(?:: \w+)?\s*=\s*(\w+)")
_SUFFIX = re.compile(r"(?<=[0-9a-fA-F.])_?(?:[iu](?:8|16|32|64|128|size)|f32|f64)\b")


def number(text: str, names: dict[str, float | bool] | None = None) -> float | bool | None:
    """Return the value of an expression in Rust; None if it is none of constant numbers."""
    plain = _SUFFIX.sub("", text.strip().rstrip(","))
    plain = re.sub(r"\bas [iuf]\d+\b", "", plain)
    for kind, bits in (("i8", 8), ("i16", 16), ("i32", 32), ("i64", 64)):
        plain = plain.replace(f"{kind}::MAX", str(2 ** (bits - 1) - 1)).replace(f"{kind}::MIN", str(-(2 ** (bits - 1))))
        plain = plain.replace(f"u{bits}::MAX", str(2**bits - 1)).replace(f"u{bits}::MIN", "0")
    plain = (
        plain.replace("true", "True")
        .replace("false", "False")
        .replace("std::f32::consts::", "")
        .replace("std::f64::consts::", "")
    )
    known = {"PI": math.pi, "E": math.e, **(names or {})}
    known |= {f"FRAC_PI_{part}": math.pi / part for part in (2, 3, 4, 6)}
    if set(re.findall(r"[A-Za-z_]\w*", _NUMBER.sub("", plain))) - {*known, "True", "False"}:
        return None
    try:
        value = eval(plain, {"__builtins__": {}}, known)
    except (SyntaxError, ArithmeticError, TypeError, NameError, AttributeError):
        return None
    return value if isinstance(value, (int, float)) else None


def _unescaped(match: re.Match[str]) -> str:
    if (raw := match["raw"] if match["raw"] is not None else match["plain"]) is not None:
        return raw
    return re.sub(r"\\(.)", lambda one: {"n": "\n", "t": "\t", "r": "\r"}.get(one[1], one[1]), match["text"])


def ironplc(folder: Path) -> Iterator[Unit]:
    """Yield the programs of the macros e2e_*."""
    for path in sorted((folder / "compiler" / "codegen" / "tests" / "it").glob("end_to_end*.rs")):
        text = decoded(path)
        for match in _E2E.finditer(text):
            rest = text[match.end() : text.index(");\n", match.end())]
            tolerance = number(match["before"].strip().rstrip(",")) if "near" in match["kind"] else None
            exact = 1e-6 if match["kind"].startswith("f32") else 0.0
            checks = [
                Check(int(index), value, float(tolerance or 0.0) or exact)
                for index, written in _PAIRS.findall(rest)
                if (value := number(written)) is not None
            ]
            if checks:
                part = Part(f"{path.name}:{match['name']}", _unescaped(match))
                yield Unit(part.name, (part,), tuple(checks), unit=1e6, before=2 * ("Rusty" in match["before"]))


def standard_functions(folder: Path) -> Iterator[Unit]:
    """Yield the programs that run once, with their values in `maintype`."""
    for path in sorted((folder / "tests").glob("*.rs")):
        text = decoded(path)
        shared = list(_STRUCT.finditer(text))
        starts = list(_TEST.finditer(text))
        for match, after in zip(starts, [*starts[1:], None], strict=True):
            body = text[match.end() : after.start() if after else len(text)]
            source = _SOURCE.search(body)
            if "ignore" in match["marks"] or "should_panic" in match["marks"] or source is None:
                continue
            made = _MADE.search(body)
            wanted = made[1] if made is not None else "MainType"
            struct = next((one for one in [*_STRUCT.finditer(body), *shared] if one["name"] == wanted), None)
            order = _FIELD.findall(struct["fields"]) if struct is not None else []
            names: dict[str, float | bool] = {}
            for name, written in _LET.findall(body):
                if (value := number(written, names)) is not None:
                    names[name] = value
            checks = []
            for name, _, written in _EQUAL.findall(body):
                if name in order and (value := number(written, names)) is not None:
                    checks.append(Check(order.index(name), value, name=name.lower()))
            for negated, name in _BOOL.findall(body):
                if name in order:
                    checks.append(Check(order.index(name), not negated, name=name.lower()))
            for written, name, limit in _NEAR.findall(body):
                value, tolerance = number(written, names), number(limit)
                if name in order and value is not None and tolerance is not None:
                    checks.append(Check(order.index(name), value, tolerance, name.lower()))
            if checks and body.count("compile_and_run(") == 1:
                part = Part(f"{path.name}:{match['name']}", _unescaped(source))
                yield Unit(part.name, (part,), tuple(checks))
