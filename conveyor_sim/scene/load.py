"""Reading a scene: YAML and overrides to a validated Scene, or an error with file, line, field and value."""

import io
from collections.abc import Mapping
from contextlib import suppress
from functools import lru_cache
from os import PathLike
from pathlib import Path as FilePath
from typing import Any

from ruamel.yaml import YAML

from conveyor_sim.errors import SceneError
from conveyor_sim.scene.checks import problems_of
from conveyor_sim.scene.part import validated
from conveyor_sim.scene.problem_count import MOST_SAID
from conveyor_sim.scene.problems import Path, Problem, dotted
from conveyor_sim.scene.schema import Origin, Scene
from conveyor_sim.scene.tables import Beside, with_tables
from conveyor_sim.scene.yaml_lines import LONGEST_TEXT, Document
from conveyor_sim.support.files import FileError, in_mb, read_file

_CACHED_TEXT = 200_000
"""Largest cached text, characters. A run reads its scene some ten times, in 3 ms each."""
_MOST_PROBLEMS = 50  # listed; more would scroll the first off the screen


def load_scene(
    path: str | PathLike[str], overrides: Mapping[str, Any] | None = None, outside_tables: bool = False
) -> Scene:
    """Read a scene file. `overrides` change it before it is validated: mappings merge, other values replace.

    outside_tables: True allows tables outside the scene's folder.
    Raise SceneError with one line for each problem of the file.
    """
    file = FilePath(path)
    try:
        text = read_file(file, LONGEST_TEXT).decode("utf-8")
    except FileError as error:
        raise SceneError(f"{path}: {error}, expected a scene file") from None
    except UnicodeDecodeError as error:
        line = error.object.count(b"\n", 0, error.start) + 1
        raise SceneError(f"{path}:{line}: not UTF-8 text, expected a scene file in UTF-8") from None
    return parse_scene(text, str(path), overrides, Beside(file.parent, outside_tables))


def parse_scene(
    text: str,
    name: str = "<text>",
    overrides: Mapping[str, Any] | None = None,
    beside: Beside | None = None,
) -> Scene:
    """Read a scene from YAML text; `name` stands for the file in errors. beside: place of the files that it names.

    See `load_scene`.
    """
    document = _document(text, name)
    changes = plain(overrides or {}, name)
    laid_over = merged(document.data, changes) if changes else document.data
    data, unread = with_tables(laid_over, beside)
    if unread:
        raise refused(unread, document, name, changes)
    scene = validated(Scene, data)
    if isinstance(scene, tuple):
        raise refused(scene[0], document, name, changes, scene[1])
    problems = problems_of(scene)
    if problems:
        raise refused(problems, document, name, changes)
    # Recordings store the text and the overrides. With the tables among them, they need no file.
    changes_text = _yaml_text(changes)
    stored_text = changes_text if data is laid_over else _yaml_text({**changes, "contacts": data["contacts"]})
    if len(stored_text) > LONGEST_TEXT:
        most = in_mb(LONGEST_TEXT)
        raise SceneError(f"{name}: tables and overrides of {in_mb(len(stored_text))} as YAML, expected at most {most}")
    scene._source = Origin(text, name, changes_text, stored_text)
    return scene


def _document(text: str, name: str) -> Document:
    """Read YAML, or return the cached Document of the text, which must not be changed. Raise SceneError."""
    if len(text) <= _CACHED_TEXT:
        with suppress(SceneError):  # raised again below, with the name
            return _read(text)
    return Document(text, name)


@lru_cache(maxsize=4)
def _read(text: str) -> Document:
    return Document(text, "")


def parse_overrides(text: str) -> dict[str, Any]:
    """Return overrides from the YAML of `Scene.overrides_text` ("": none). Raise SceneError if it is not a mapping."""
    if not text.strip():
        return {}
    data = Document(text, "overrides").data
    if not isinstance(data, dict):
        raise SceneError("overrides: expected a mapping of fields of the scene")
    return data


def plain(value: Any, name: str) -> Any:
    """Return overrides as plain data. Raise SceneError for values that YAML can't represent."""
    if isinstance(value, Mapping):
        return {str(key): plain(item, name) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(item, name) for item in value]
    for kind in (bool, int, float, str):
        if isinstance(value, kind):
            return kind(value)
    if value is None:
        return None
    raise SceneError(f"{name} (override): a value of type {type(value).__name__} given, expected what YAML can hold")


def merged(data: Any, changes: Any) -> Any:
    """Return plain data with changes: mappings merge, other values replace."""
    if not (isinstance(data, dict) and isinstance(changes, dict)):
        return changes
    return {**data, **{key: merged(data.get(key), change) for key, change in changes.items()}}


def refused(problems: list[Problem], document: Document, name: str, changes: Any, more: int = 0) -> SceneError:
    """Return the error for the problems of a file, one line per problem, in the order of the file.

    more: number of problems that were only counted. A list of more than MOST_SAID problems may be incomplete.
    """
    lines = []
    for problem in problems:
        overridden = holds(changes, problem.path)
        place = f"{name} (override)" if overridden else f"{name}:{document.line_of(problem.path)}"
        path = f" {dotted(problem.path)}:" if problem.path else ""
        lines.append((0 if overridden else document.line_of(problem.path), f"{place}:{path} {problem.text}"))
    texts = [text for _, text in sorted(lines, key=lambda line: line[0])]
    rest = len(texts) - _MOST_PROBLEMS + more
    if rest > 0:
        at_least = "at least " if len(problems) > MOST_SAID else ""
        texts[_MOST_PROBLEMS:] = [f"{name}: and {at_least}{rest} more problems"]
    return SceneError("\n".join(texts))


def holds(changes: Any, path: Path) -> bool:
    """Return True if the value at a path, or one above it, comes from the overrides."""
    for part in path:
        if not isinstance(changes, dict):
            return True
        if part not in changes:
            return False
        changes = changes[part]
    return bool(path)


def _yaml_text(changes: Any) -> str:
    if not changes:
        return ""
    stream = io.StringIO()
    yaml = YAML(typ="safe", pure=True)
    yaml.default_flow_style = False
    yaml.dump(changes, stream)
    return stream.getvalue()
