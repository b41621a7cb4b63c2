"""YAML text to plain data, with the line of every key."""

from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.error import MarkedYAMLError, YAMLError
from ruamel.yaml.nodes import MappingNode, Node, SequenceNode
from ruamel.yaml.reader import ReaderError

from conveyor_sim.errors import SceneError
from conveyor_sim.scene.problems import Path, dotted
from conveyor_sim.scene.words import cut
from conveyor_sim.scene.yaml_nodes import TooManyError, compose
from conveyor_sim.support.files import MB, in_mb

LONGEST_TEXT = 8 * MB
"""Bytes of a file. A bottle that is listed by itself takes 40 of them and 8 values: 0.17 ms and 8 kB to read."""

_DEEPEST = 30  # levels; a scene needs 6, an alias that contains itself has no end
_LARGEST = 1_000_000  # values; nested aliases grow without bound
_TOO_MANY = f"too many values for a scene, expected at most {_LARGEST}: a grid of bottles is one entry, not many"

_MERGE = "tag:yaml.org,2002:merge"


class Document:
    """A parsed YAML text: `data` (plain dicts, lists and scalars) and `line_of` a path in it."""

    def __init__(self, text: str, name: str) -> None:
        """Parse; raises SceneError that names the file and the line if it can't be."""
        self._name = name
        self._lines: dict[Path, int] = {(): 1}
        self._size = 0
        self._value_of = YAML(typ="safe", pure=True).constructor.construct_object
        if len(text) > LONGEST_TEXT:
            raise SceneError(f"{name}: has {in_mb(len(text))}, expected a scene of at most {in_mb(LONGEST_TEXT)}")
        try:
            root = compose(text, _LARGEST)
        except ReaderError as error:
            line = text.count("\n", 0, error.position) + 1
            raise self._error(line, "not valid YAML: a control character that YAML does not allow") from None
        except TooManyError as error:
            raise self._error(error.line, _TOO_MANY) from None
        except MarkedYAMLError as error:
            mark = error.problem_mark or error.context_mark
            raise self._error(mark.line + 1 if mark else 1, f"not valid YAML: {_one_line(error)}") from None
        except YAMLError as error:
            raise self._error(1, f"not valid YAML: {error}") from None
        except RecursionError:
            raise self._error(1, "not a scene: nested too deeply") from None
        if root is None:
            raise SceneError(f"{name}: the file is empty, expected a scene")
        self.data = self._build(root, ())

    def line_of(self, path: Path) -> int:
        """Line (from 1) of the key or list entry at a path, or of the nearest one above it."""
        while path not in self._lines:
            path = path[:-1]
        return self._lines[path]

    def _error(self, line: int, text: str) -> SceneError:
        return SceneError(f"{self._name}:{line}: {text}")

    def _build(self, node: Node, path: Path) -> Any:
        self._size += 1
        if len(path) > _DEEPEST:
            raise self._error(node.start_mark.line + 1, "not a scene: nested too deeply")
        if self._size > _LARGEST:
            raise self._error(node.start_mark.line + 1, _TOO_MANY)
        if isinstance(node, MappingNode):
            return self._mapping(node, path)
        if isinstance(node, SequenceNode):
            for index, child in enumerate(node.value):
                self._lines[(*path, index)] = child.start_mark.line + 1
            return [self._build(child, (*path, index)) for index, child in enumerate(node.value)]
        return self._scalar(node)

    def _mapping(self, node: MappingNode, path: Path) -> dict[Any, Any]:
        taken_in = [self._merged(value, path) for key, value in node.value if key.tag == _MERGE]
        data = _laid_over(taken_in)
        own: dict[Any, int] = {}
        for key_node, value_node in node.value:
            if key_node.tag == _MERGE:
                continue
            line = key_node.start_mark.line + 1
            if isinstance(key_node, (MappingNode, SequenceNode)):
                raise self._error(line, f"{dotted(path)}: a mapping or a list can't be a name")
            key = self._scalar(key_node)
            if key in own:
                raise self._error(line, f"{dotted((*path, key))}: given twice, first in line {own[key]}")
            own[key] = self._lines[(*path, key)] = line
            data[key] = self._build(value_node, (*path, key))
        return data

    def _merged(self, node: Node, path: Path) -> dict[Any, Any]:
        """What `<<` takes in: a mapping, or a list of them of which the first has the say."""
        merged: list[dict[Any, Any]] = []
        for source in node.value if isinstance(node, SequenceNode) else [node]:
            data = self._build(source, (*path, "<<"))
            if not isinstance(data, dict):
                raise self._error(node.start_mark.line + 1, f"{dotted(path)}: << takes in mappings only")
            merged.append(data)
        return _laid_over(merged)

    def _scalar(self, node: Node) -> Any:
        try:
            value = self._value_of(node)
            if isinstance(value, int) and value.bit_length() > 1024:
                raise ValueError("beyond every float")
            if isinstance(value, str):
                value.encode()  # half of a character ("\\ud800") can be neither shown nor recorded
        except Exception:  # ruamel raises what its parts do: KeyError for "!!bool maybe", IndexError for "!!float"
            line = node.start_mark.line + 1
            text = str(node.value).encode(errors="backslashreplace").decode()
            raise self._error(line, f"a value that can't be read: {cut(text)}") from None
        return value if value is None or isinstance(value, (str, int, float)) else str(node.value)


def _laid_over(mappings: list[dict[Any, Any]]) -> dict[Any, Any]:
    """Return mappings as one, in which the first of a key decides; the last mapping's keys come first."""
    data: dict[Any, Any] = {}
    for mapping in reversed(mappings):
        data.update(mapping)
    return data


def _one_line(error: MarkedYAMLError) -> str:
    parts = [text for text in (error.context, error.problem) if text]
    return ", ".join(" ".join(str(text).split()) for text in parts)
