# SPDX-License-Identifier: Apache-2.0
"""Copy of a scene file with another accuracy setting; everything else stays as it is written."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML

from conveyor_sim.accuracy.setting import Setting, with_setting
from conveyor_sim.errors import ConveyorError
from conveyor_sim.scene import Scene, load_scene
from conveyor_sim.scene.recorded import expanded_text
from conveyor_sim.scene.underlay import underlay_bytes
from conveyor_sim.support.files import FileError, write_file


def apply(scene: Scene, setting: Setting, copy: Path) -> Scene:
    """Write the scene's file with the setting to `copy`; return the scene that is read back from it.

    Files that the scene names are copied beside it, as are tables that lie elsewhere. A scene with overrides (chosen
    parameters, variant or format) is written expanded, with every value explicit. Raises ValueError for a setting of
    another stiffness, which would change the materials; ConveyorError if the copy can't be written, is the scene's own
    file, or the scene is written in braces, where no line can be put.
    """
    if setting.stiffness != 1.0:
        raise ValueError(f"stiffness {setting.stiffness:g}, expected 1")
    source = Path(scene.source_name)
    if copy.resolve() == source.resolve():
        raise ConveyorError(f"{copy}: is the scene itself, expected another file for the copy")
    if scene.given_overrides:
        _write(copy, _expanded(scene, setting).encode())
        _copy_underlay(scene, copy.parent)
        return load_scene(copy)
    data = YAML().load(scene.source_text)
    if data.fa.flow_style():
        raise ConveyorError(f"{source}: is written in braces, expected one field a line to write a setting into")
    lines = scene.source_text.splitlines(keepends=True)
    _take_tables_along(lines, data, source.parent, copy)
    _put(lines, data, f"{line(setting)}\n")
    for path, text in scene.source_files.items():
        _copy_file(path, text.encode(), copy.parent)
    _write(copy, "".join(lines).encode())
    return load_scene(copy)


def _expanded(scene: Scene, setting: Setting) -> str:
    """Return the text of a scene with overrides and a setting."""
    chosen = "".join(f"# {line}\n" for line in scene.given_overrides.splitlines())
    return f"# {Path(scene.source_name).name} with\n{chosen}{expanded_text(with_setting(scene, setting))}"


def _copy_underlay(scene: Scene, folder: Path) -> None:
    """Write the underlay, the only file that an expanded scene names, to the same path beside the copy."""
    if scene.underlay is not None and scene.underlay_url:
        _copy_file(scene.underlay.file, underlay_bytes(scene.underlay_url), folder)


def line(setting: Setting) -> str:
    """Return a setting as it is written in a scene file."""
    error = "" if setting.error is None else f", error: {setting.error!r}"
    sweeps = "" if setting.sweeps is None else f", sweeps: {setting.sweeps}"
    return f"accuracy: {{integrator: {setting.integrator}, per_tick: {setting.per_tick}{error}{sweeps}}}"


def _put(lines: list[str], data: Any, line: str) -> None:
    """In place of the field `accuracy`, or behind `duration`, which every scene has."""
    keys = list(data)
    field = "accuracy" if "accuracy" in keys else "duration"
    start = data.lc.key(field)[0]
    later = [data.lc.key(key)[0] for key in keys if data.lc.key(key)[0] > start]
    end = min(later, default=len(lines))
    while end > start + 1 and _is_blank(lines[end - 1]):
        end -= 1
    if field == "accuracy":
        lines[start:end] = [line]
    else:
        lines[end - 1] = lines[end - 1].rstrip("\n") + "\n"
        lines.insert(end, line)


def _is_blank(line: str) -> bool:
    return not line.strip() or line.lstrip().startswith("#")


def _take_tables_along(lines: list[str], data: Any, before: Path, copy: Path) -> None:
    for contact in data.get("contacts", ()):
        path = contact.get("table")
        if isinstance(path, str):
            row, column = contact.lc.value("table")
            name = os.path.relpath(before / path, copy.parent)
            if name.startswith(".."):
                # A scene may name what lies in its folder only.
                name = f"{copy.stem}_{Path(path).name}"
                _write(copy.with_name(name), (before / path).read_bytes())
            lines[row] = lines[row][:column] + lines[row][column:].replace(path, name, 1)


def _copy_file(path: str, content: bytes, folder: Path) -> None:
    """Write a file that a scene includes or uses to the same path beside the copy."""
    file = folder / path
    if os.path.isabs(path) or path.startswith(".."):
        raise ConveyorError(f"{file}: lies outside the scene's folder, expected files in it, to copy them")
    if file.is_file() and file.read_bytes() == content:
        return
    file.parent.mkdir(parents=True, exist_ok=True)
    _write(file, content)


def _write(file: Path, content: bytes) -> None:
    """Write the complete file or nothing."""
    try:
        write_file(Path(file.name), content, file.parent)
    except FileError as error:
        raise ConveyorError(f"{file}: {error}, expected a file to write to") from None
