"""The checkpoint file: a NumPy .npz with the arrays of a run and a JSON header with all else."""

import json
import os
import zipfile
import zlib
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from conveyor_sim.engine.compile import ENGINE_HASH
from conveyor_sim.errors import CheckpointError, SceneError
from conveyor_sim.model import versions_here
from conveyor_sim.scene import Scene, parse_overrides, parse_scene
from conveyor_sim.scene.difference import scene_difference
from conveyor_sim.world_arrays import Arrays

FORMAT = 1
"""Raised by one whenever the layout of the file changes."""

FREE = frozenset({"description", "duration"})
"""Fields of a scene that may differ from those of the checkpoint."""

_HEADER = "header"
_MAGIC = b"PK\x03\x04"
# zipfile raises RuntimeError for what says that it is encrypted, or packed in a way not known.
_DAMAGES = (ValueError, KeyError, TypeError, EOFError, MemoryError, RuntimeError, zipfile.BadZipFile, zlib.error)


@dataclass(frozen=True)
class Checkpoint:
    """What a file of this version holds."""

    path: Path
    scene: Scene
    memory: dict[str, Any]
    """What the run remembers beside its arrays, as plain data."""
    arrays: Arrays
    """Those that change, by name (`world_arrays.py`)."""


def write_checkpoint(path: Path, scene: Scene, memory: dict[str, Any], arrays: Arrays) -> None:
    """Write a file in one go: it is whole, or what was there before is untouched.

    memory: as JSON can hold it. Raises CheckpointError.
    """
    if os.path.isdir(path):
        raise CheckpointError(f"{path}: is a folder, expected a file to write a checkpoint to")
    header = {
        "format": FORMAT,
        "versions": versions(),
        "scene": {"text": scene.source_text, "name": scene.source_name, "overrides": scene.overrides_text},
        "memory": memory,
    }
    text = np.frombuffer(json.dumps(header).encode(), np.uint8)
    unfinished = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        with unfinished.open("wb") as stream:
            np.savez(stream, **{_HEADER: text}, **arrays)  # type: ignore[arg-type]
            stream.flush()
            os.fsync(stream.fileno())
        unfinished.replace(path)
    except OSError as error:
        raise CheckpointError(f"{path}: can't be written ({error.strerror}), expected {_place(path)}") from error
    finally:
        with suppress(OSError):
            unfinished.unlink()


def read_checkpoint(path: Path, scene: Scene | None = None) -> Checkpoint:
    """Read a file; where a scene is given, it must be the one of the file but for the FREE fields.

    Raises CheckpointError for what is no checkpoint, not whole, of another version, or of another scene.
    """
    header, arrays = _read(path)
    if header.get("format") != FORMAT:
        raise CheckpointError(f"{path}: format {header.get('format')} of checkpoints, expected {FORMAT}")
    then, now = [str(entry) for entry in header["versions"]], versions()
    if then != now:
        raise CheckpointError(
            f"{path}: saved with {', '.join(entry for entry in then if entry not in now)}, "
            f"expected {', '.join(entry for entry in now if entry not in then)}: "
            "no other version goes on to the same bits"
        )
    saved = _scene(path, header["scene"])
    difference = None if scene is None else scene_difference(saved, scene, FREE)
    if difference is not None:
        field, here, given = difference
        raise CheckpointError(
            f"{path}: saved from a scene with {field}: {here}, which is {given} in the scene given; "
            "expected the same scene"
        )
    return Checkpoint(path, saved if scene is None else scene, header["memory"], arrays)


def damaged(path: Path, reason: object) -> CheckpointError:
    """The error for a file whose contents do not fit together."""
    return CheckpointError(f"{path}: is damaged or cut short ({reason}), expected a whole checkpoint")


def versions() -> list[str]:
    """All that decides how a run goes on, "what=version"."""
    return [f"engine={ENGINE_HASH}", *versions_here()]


def _read(path: Path) -> tuple[dict[str, Any], Arrays]:
    """Header and arrays of a file of any version."""
    try:
        with path.open("rb") as stream:
            if stream.read(len(_MAGIC)) != _MAGIC:
                raise CheckpointError(f"{path}: not a checkpoint, expected a file that was saved as one")
            stream.seek(0)
            with np.load(stream, allow_pickle=False) as file:
                if _HEADER not in file:
                    raise CheckpointError(f"{path}: a .npz without a header, expected a checkpoint")
                header = dict(json.loads(file[_HEADER].tobytes()))
                arrays = {name: file[name] for name in file.files if name != _HEADER}
    except FileNotFoundError:
        raise CheckpointError(f"{path}: no such file, expected a checkpoint") from None
    except IsADirectoryError:
        raise CheckpointError(f"{path}: is a folder, expected a checkpoint") from None
    except OSError as error:
        raise CheckpointError(f"{path}: can't be read ({error.strerror}), expected a checkpoint") from error
    except _DAMAGES as error:
        raise damaged(path, error) from error
    return header, arrays


def _scene(path: Path, source: dict[str, str]) -> Scene:
    try:
        return parse_scene(source["text"], source["name"], parse_overrides(source["overrides"]))
    except SceneError as error:
        raise CheckpointError(f"{path}: the scene in it is refused by this version:\n{error}") from error


def _place(path: Path) -> str:
    if not os.path.isdir(path.parent):
        return f"the folder {path.parent} to be there"
    return "a file that can be written, and room for it"
