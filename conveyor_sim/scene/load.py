# SPDX-License-Identifier: Apache-2.0
"""Reading a scene: YAML and overrides to a validated Scene, or an error with file, line, field and value."""

from collections.abc import Mapping
from contextlib import suppress
from functools import lru_cache
from os import PathLike
from pathlib import Path as FilePath
from typing import Any

from conveyor_sim.errors import SceneError
from conveyor_sim.scene.beside import Beside
from conveyor_sim.scene.checks import problems_of
from conveyor_sim.scene.conversion import any_angle, noting_texts
from conveyor_sim.scene.layout.compose import chosen, compose
from conveyor_sim.scene.overrides import FILES, in_quotes, parse_overrides, plain, yaml_text
from conveyor_sim.scene.part import validated
from conveyor_sim.scene.reading import Reading
from conveyor_sim.scene.refusal import refused
from conveyor_sim.scene.schema import Origin, Scene
from conveyor_sim.scene.tables import with_tables
from conveyor_sim.scene.underlay import read_underlay
from conveyor_sim.scene.words import shown
from conveyor_sim.scene.yaml_lines import LONGEST_TEXT, Document
from conveyor_sim.support.files import FileError, in_mb, read_file

_CACHED_TEXT = 200_000
"""Largest cached text, characters. A run reads its scene some ten times, in 3 ms each."""


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
    beside = _with_stored(beside, changes.pop(FILES, {}))
    composition = compose(document, name, changes, beside)
    data, unread = with_tables(composition.data, beside)
    if unread:
        raise refused(unread, composition.sources.place_of, name)
    reading = Reading(composition, data)
    if reading.expansion.problems:
        raise refused(reading.expansion.problems, composition.sources.place_of, name, reading.expansion.more)
    with noting_texts() as texts:
        scene = validated(Scene, reading.expansion.data)
    if isinstance(scene, tuple):
        raise reading.refused(*scene)
    problems = problems_of(scene)
    if problems:
        raise reading.refused(problems)
    # Recordings store the text and the overrides. With the content of other files among them, they need no file.
    changes_text = yaml_text(changes)
    is_expanded = composition.is_composed or reading.expansion.plan is not None or bool(texts)
    files = {path: content.decode("utf-8-sig") for path, content in beside.used.items()} if is_expanded else {}
    if scene.underlay is not None:
        scene._underlay = read_underlay(scene.underlay, beside)
        if scene.underlay_url:
            files = {**files, scene.underlay.file: scene.underlay_url}
    is_in_files = is_expanded or data is composition.data
    stored_text = changes_text if is_in_files else yaml_text({**changes, "contacts": data["contacts"]})
    if files:
        stored_text += f"{FILES}: {in_quotes(files)}\n"
    if len(stored_text) > LONGEST_TEXT:
        most = in_mb(LONGEST_TEXT)
        text = f"tables, other files and overrides of {in_mb(len(stored_text))} as YAML, expected at most {most}"
        raise SceneError(f"{name}: {text}")
    scene._source = Origin(text, name, changes_text, stored_text, files=files, is_expanded=is_expanded)
    scene._layout = reading.expansion.plan
    return scene


def parse_again(text: str, name: str, overrides: Mapping[str, Any]) -> Scene:
    """Read a scene from the text and the overrides of a recording, a checkpoint or a loaded scene. Raise SceneError."""
    with any_angle():
        return parse_scene(text, name, overrides)


def _with_stored(beside: Beside | None, stored: Any) -> Beside:
    """Return the place of the files of one scene. stored: text of files by path, from the overrides of a recording."""
    if not isinstance(stored, dict) or not all(isinstance(text, str) for text in stored.values()):
        raise SceneError(f"{FILES}: {shown(stored)} given in overrides, expected a mapping of paths to texts")
    return Beside(None, stored=stored) if beside is None else Beside(beside.folder, beside.outside, stored)


def chosen_data(text: str, name: str, overrides: Mapping[str, Any]) -> dict[str, Any]:
    """Return the plain data of a scene with includes, variant, format and overrides: fields that overrides can name.

    Other files are taken from the overrides of a read scene. Raise SceneError.
    """
    changes = plain(overrides, name)
    beside = _with_stored(None, changes.pop(FILES, {}))
    data = chosen(_document(text, name), name, changes, beside)
    if not isinstance(data, dict):
        raise SceneError(f"{name}:1: expected a scene, a mapping of fields")
    return data


def reread(scene: Scene) -> Reading:
    """Return the data of a scene from its text again, because scenes do not store places of fields."""
    changes = parse_overrides(scene.given_overrides)
    document = _document(scene.source_text or "{}", scene.source_name)
    composition = compose(document, scene.source_name, changes, Beside(None, stored=scene.source_files))
    return Reading(composition, composition.data)


def _document(text: str, name: str) -> Document:
    """Read YAML, or return the cached Document of the text, which must not be changed. Raise SceneError."""
    if len(text) <= _CACHED_TEXT:
        with suppress(SceneError):  # raised again below, with the name
            return _read(text)
    return Document(text, name)


@lru_cache(maxsize=4)
def _read(text: str) -> Document:
    return Document(text, "")
