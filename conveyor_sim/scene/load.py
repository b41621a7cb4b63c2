"""Reads a scene: YAML and overrides in, a validated Scene out, or an error that names file, line, field and value."""

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

_KEPT_TEXT = 200_000
"""Letters of a text that is kept once it was read: a run asks for its scene some ten times, in 3 ms each."""
_MOST_PROBLEMS = 50  # listed; more would scroll the first ones away


def load_scene(
    path: str | PathLike[str], overrides: Mapping[str, Any] | None = None, outside_tables: bool = False
) -> Scene:
    """Read a scene file. `overrides` is laid over it before it is validated: mappings merge, all else replaces.

    outside_tables: whether tables that the scene names by path may lie outside its own folder.
    Raises SceneError with one line for each problem of the file.
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
    """Read a scene from YAML text; `name` stands for the file in errors. beside: where files that it names may lie.

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
    # A recording keeps the text and the overrides: with the tables among them, it needs no file.
    changes_text = _yaml_text(changes)
    kept_text = changes_text if data is laid_over else _yaml_text({**changes, "contacts": data["contacts"]})
    if len(kept_text) > LONGEST_TEXT:
        most = in_mb(LONGEST_TEXT)
        raise SceneError(f"{name}: tables and overrides of {in_mb(len(kept_text))} as YAML, expected at most {most}")
    scene._source = Origin(text, name, changes_text, kept_text)
    return scene


def _document(text: str, name: str) -> Document:
    """Read YAML, or what was read of the same text before: not to be changed. Raises SceneError."""
    if len(text) <= _KEPT_TEXT:
        with suppress(SceneError):  # which is to have the name
            return _read(text)
    return Document(text, name)


@lru_cache(maxsize=4)
def _read(text: str) -> Document:
    return Document(text, "")


def parse_overrides(text: str) -> dict[str, Any]:
    """Overrides from the YAML that `Scene.overrides_text` holds ("" is none). SceneError if it is not a mapping."""
    if not text.strip():
        return {}
    data = Document(text, "overrides").data
    if not isinstance(data, dict):
        raise SceneError("overrides: expected a mapping of fields of the scene")
    return data


def plain(value: Any, name: str) -> Any:
    """Overrides as plain data. SceneError if there is something in them that YAML has no form for."""
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
    """Changes laid over plain data: mappings merge, all else replaces."""
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
    """Whether the value at a path, or one above it, comes from the overrides."""
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
