# SPDX-License-Identifier: Apache-2.0
"""YAML text to plain data, with the line of every key.

libyaml parses the text, and values without quotes are read by YAML 1.2 (https://yaml.org/spec/1.2.2): `on` is a text,
`1e3` a number, `12:30` a text. ruamel.yaml, a parser of YAML 1.2 in Python, takes six times as long and reads all
scenes equally. libyaml differs in texts that are rare: it treats U+0085, U+2028 and U+2029 as ends of lines, and it
refuses empty keys and texts in brackets that begin or end with a colon.
"""

import re
from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import Any, NamedTuple

import yaml
from yaml.reader import ReaderError

from conveyor_sim.errors import SceneError
from conveyor_sim.scene.problems import Path, dotted
from conveyor_sim.scene.words import cut
from conveyor_sim.support.files import MB, in_mb

LONGEST_TEXT = 8 * MB
"""Bytes of a file. A bottle that is listed by itself takes 40 of them and 8 values: 0.17 ms and 8 kB to read."""

_DEEPEST = 30  # levels; a scene needs 6, an alias that contains itself has no end
_LARGEST = 1_000_000  # values; nested aliases grow without bound
_TOO_MANY = f"too many values for a scene, expected at most {_LARGEST}: a grid of bottles is one entry, not many"

_LOADER: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
"""libyaml; PyYAML's own parser where it was built without libyaml."""
_STANDARD = "tag:yaml.org,2002:"
_PLAIN = re.compile(
    r"(?P<null>~|null|Null|NULL|)"
    r"|(?P<bool>true|True|TRUE|false|False|FALSE)"
    r"|(?P<float>[-+]?[0-9][0-9_]*(?:\.[0-9_]*(?:[eE][-+]?[0-9]+)?|[eE][-+]?[0-9]+)"
    r"|[-+]?\.[0-9_]+(?:[eE][-+][0-9]+)?|[-+]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN))"
    r"|(?P<int>[-+][0-9_]+|[0-9][0-9_]*|[-+]?(?:0o[0-7_]+|0x[0-9a-fA-F_]+|0b[01_]+))"
    r"|(?P<merge><<)"
)
"""Values without quotes of kinds other than text."""


class _Node(NamedTuple):
    kind: str
    """Kind of a scalar: `null`, `bool`, `float`, `int`, `str`, `merge`, or any other tag; else `map` or `seq`."""
    value: Any
    line: int


class Document:
    """A parsed YAML text: `data` (plain dicts, lists and scalars) and `line_of` a path in it."""

    def __init__(self, text: str, name: str) -> None:
        """Parse a text. Raise SceneError with the file's name and the line if it can't be read."""
        self._name = name
        self._lines: dict[Path, int] = {(): 1}
        self._size = 0
        self._parsed = 0
        self._named: dict[str, _Node] = {}
        if len(text) > LONGEST_TEXT:
            raise SceneError(f"{name}: has {in_mb(len(text))}, expected a scene of at most {in_mb(LONGEST_TEXT)}")
        try:
            self._events = _LOADER(text)
            root = self._root()
        except ReaderError as error:
            line = text.encode(errors="replace").count(b"\n", 0, error.position) + 1
            raise self._error(line, "not valid YAML: a control character that YAML does not allow") from None
        except UnicodeEncodeError as error:
            raise self._error(text.count("\n", 0, error.start) + 1, "not valid YAML: half of a character") from None
        except yaml.MarkedYAMLError as error:
            mark, last = error.problem_mark or error.context_mark, text.count("\n") + (not text.endswith("\n"))
            raise self._error(min(mark.line + 1, last) if mark else 1, f"not valid YAML: {_one_line(error)}") from None
        except RecursionError:
            raise self._error(1, "not a scene: nested too deeply") from None
        if root is None:
            raise SceneError(f"{name}: the file is empty, expected a scene")
        self.data = self._build(root, ())

    def line_of(self, path: Path) -> int:
        """Return the line (from 1) of the key or list entry at a path, or of the nearest one above it."""
        while path not in self._lines:
            path = path[:-1]
        return self._lines[path]

    def _error(self, line: int, text: str) -> SceneError:
        return SceneError(f"{self._name}:{line}: {text}")

    def _root(self) -> _Node | None:
        """Parse one document; return None for an empty text."""
        self._events.get_event()  # the stream begins
        if isinstance(self._events.get_event(), yaml.StreamEndEvent):
            return None
        root = self._node(self._events.get_event())
        self._events.get_event()  # the document ends
        if not isinstance(event := self._events.get_event(), yaml.StreamEndEvent):
            raise self._error(event.start_mark.line + 1, "not valid YAML: expected a single document in the stream")
        return root

    def _node(self, event: Any) -> _Node:
        """Return the value that an event begins, with all values in it. An alias is the value that it names."""
        line = event.start_mark.line + 1
        self._parsed += 1
        if self._parsed > _LARGEST:
            raise self._error(line, _TOO_MANY)
        if isinstance(event, yaml.AliasEvent):
            if event.anchor not in self._named:
                raise self._error(line, f"not valid YAML: found undefined alias {event.anchor!r}")
            return self._named[event.anchor]
        if isinstance(event, yaml.ScalarEvent):
            plain = _kind(event.value) if event.implicit[0] else "str"
            tag = plain if event.tag in (None, "!") else event.tag.removeprefix(_STANDARD)
            return self._named_node(event, _Node(tag, event.value, line))
        if isinstance(event, yaml.SequenceStartEvent):
            node = self._named_node(event, _Node("seq", [], line))
            while not isinstance(event := self._events.get_event(), yaml.SequenceEndEvent):
                node.value.append(self._node(event))
            return node
        node = self._named_node(event, _Node("map", [], line))
        while not isinstance(event := self._events.get_event(), yaml.MappingEndEvent):
            node.value.append((self._node(event), self._node(self._events.get_event())))
        return node

    def _named_node(self, event: Any, node: _Node) -> _Node:
        """Store a node by its anchor before its content is parsed, because an alias in the content may name it."""
        if event.anchor is not None:
            self._named[event.anchor] = node
        return node

    def _build(self, node: _Node, path: Path) -> Any:
        self._size += 1
        if len(path) > _DEEPEST:
            raise self._error(node.line, "not a scene: nested too deeply")
        if self._size > _LARGEST:
            raise self._error(node.line, _TOO_MANY)
        if node.kind == "map":
            return self._mapping(node, path)
        if node.kind == "seq":
            for index, child in enumerate(node.value):
                self._lines[(*path, index)] = child.line
            return [self._build(child, (*path, index)) for index, child in enumerate(node.value)]
        return self._scalar(node)

    def _mapping(self, node: _Node, path: Path) -> dict[Any, Any]:
        data = _laid_over([self._merged(value, path) for key, value in node.value if key.kind == "merge"])
        own: dict[Any, int] = {}
        for key_node, value_node in node.value:
            if key_node.kind == "merge":
                continue
            if key_node.kind in ("map", "seq"):
                raise self._error(key_node.line, f"{dotted(path)}: a mapping or a list can't be a name")
            key = self._scalar(key_node)
            if key in own:
                raise self._error(key_node.line, f"{dotted((*path, key))}: given twice, first in line {own[key]}")
            own[key] = self._lines[(*path, key)] = key_node.line
            data[key] = self._build(value_node, (*path, key))
        return data

    def _merged(self, node: _Node, path: Path) -> dict[Any, Any]:
        """Return the content of `<<`: a mapping, or a list of mappings of which the first with a key decides."""
        merged: list[dict[Any, Any]] = []
        for source in node.value if node.kind == "seq" else [node]:
            data = self._build(source, (*path, "<<"))
            if not isinstance(data, dict):
                raise self._error(node.line, f"{dotted(path)}: << takes in mappings only")
            merged.append(data)
        return _laid_over(merged)

    def _scalar(self, node: _Node) -> Any:
        try:
            value = _READERS[node.kind](node.value)
            if isinstance(value, int) and value.bit_length() > 1024:
                raise ValueError("beyond every float")
        except (KeyError, ValueError):
            raise self._error(node.line, f"a value that can't be read: {cut(node.value)}") from None
        return value


def _int(text: str) -> int:
    digits = text.replace("_", "")
    return int(digits, 0 if digits.lstrip("+-")[1:2] in ("b", "o", "x") else 10)


def _float(text: str) -> float:
    return float(text.replace("_", "").lower().replace(".inf", "inf").replace(".nan", "nan"))


_READERS: Mapping[str, Callable[[str], Any]] = {
    "null": dict.fromkeys(("", "~", "null", "Null", "NULL")).__getitem__,
    "bool": lambda text: {"true": True, "false": False}[text.lower()],
    "float": _float,
    "int": _int,
    "str": str,
    "merge": str,
}
"""Functions that read a value by its kind. Raise KeyError or ValueError if it does not fit."""


@lru_cache(maxsize=4096)
def _kind(text: str) -> str:
    """Return the kind of a value without quotes, by YAML 1.2."""
    match = _PLAIN.fullmatch(text)
    return "str" if match is None or match.lastgroup is None else match.lastgroup


def _laid_over(mappings: list[dict[Any, Any]]) -> dict[Any, Any]:
    """Return mappings as one, in which the first of a key decides; the last mapping's keys come first."""
    data: dict[Any, Any] = {}
    for mapping in reversed(mappings):
        data.update(mapping)
    return data


def _one_line(error: yaml.MarkedYAMLError) -> str:
    parts = [text for text in (error.context, error.problem) if text]
    return ", ".join(" ".join(str(text).split()) for text in parts)
