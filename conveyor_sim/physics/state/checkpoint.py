# SPDX-License-Identifier: Apache-2.0
"""The checkpoint file: a NumPy .npz with the arrays of a run, a JSON header with everything else, and a checksum.

The checksum is the comment at the end of the archive (`unzip -z`), so the file is an ordinary .npz to other programs.
It detects damage but is no signature, so the content is checked before it is used.
"""

import hashlib
import io
import json
import math
import os
import re
import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, BinaryIO

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray
from pydantic import BaseModel, Field, ValidationError

from conveyor_sim.engine.compiler.compile import ENGINE_HASH
from conveyor_sim.errors import CheckpointError, SceneError
from conveyor_sim.physics.model.model import versions_here
from conveyor_sim.physics.state.snapshot import wrong
from conveyor_sim.physics.state.world_arrays import Arrays
from conveyor_sim.scene import Scene, parse_again, parse_overrides
from conveyor_sim.scene.difference import scene_difference
from conveyor_sim.scene.recorded import recorded_source
from conveyor_sim.support.files import MB, FileError, in_mb, read_file, write_file
from conveyor_sim.support.printable import printable

FORMAT = 2
"""Version of the file layout."""

FREE = frozenset({"description", "duration", "start_time", "where"})
"""Fields of a scene that may differ from those of the checkpoint."""

MOST = 512 * MB
"""Largest file, bytes. A bottle takes 0.5 to 5 kB, depending on effects and integrator.
The file is read into memory twice.
"""

_HEADER = "header"
_MAGIC = b"PK\x03\x04"
_CHECKSUM, _DIGITS = b"sha256:", 64
_LOCAL, _NAMES = 30, slice(26, 30)
"""Bytes of the fixed part of a .zip entry, and the place of the lengths of its name and extra field."""
_BEGINNING = re.compile(rb'\x93NUMPY.{1,400}\n\{"format": \d{1,9}, "versions": \["engine=', re.DOTALL)
"""Beginning of the header in every format so far: a NumPy array that holds JSON."""


@dataclass(frozen=True)
class Checkpoint:
    """Content of a checkpoint of this version."""

    path: Path
    scene: Scene
    memory: dict[str, Any]
    """State of the run beside its arrays, as plain data; not checked."""
    arrays: Arrays
    """Changing arrays by name (`world_arrays.py`); not checked."""
    controller: dict[str, Any] | None = None
    """State of the line's controller, if saved; not checked."""


class _Source(BaseModel, strict=True, extra="forbid"):
    text: str
    name: str
    overrides: str


_Version = Annotated[str, Field(pattern=r"^[ -~]{1,200}$")]


class _Header(BaseModel, strict=True, extra="forbid"):
    format: Annotated[int, Field(ge=0, le=1_000_000)]
    versions: Annotated[list[_Version], Field(max_length=100)]
    scene: _Source
    memory: dict[str, Any]
    controller: dict[str, Any] | None = None


def write_checkpoint(
    path: Path,
    scene: Scene,
    memory: dict[str, Any],
    arrays: Arrays,
    folder: Path | None = None,
    controller: dict[str, Any] | None = None,
) -> None:
    """Write a checkpoint atomically: after an error the previous file is unchanged.

    memory, controller: data that JSON can hold. folder: the path must lie inside. Raise CheckpointError on failure, and
    if the path names a file that is not a checkpoint (of any format, damaged ones included).
    """
    text, overrides = recorded_source(scene)
    source = {"text": text, "name": scene.source_name, "overrides": overrides}
    header = {"format": FORMAT, "versions": versions(), "scene": source, "memory": memory, "controller": controller}
    size = sum(array.nbytes for array in arrays.values())
    if size > MOST - MB:
        raise CheckpointError(f"{path}: would have {in_mb(size)}, expected a state of less than {in_mb(MOST - MB)}")
    try:
        write_file(path, to_bytes(json.dumps(header), arrays), folder, _objection)
    except FileError as error:
        raise CheckpointError(f"{path}: {error}, expected {_place(path, folder)}") from error


def _objection(stream: BinaryIO) -> str:
    """Return why a file may not be replaced by a checkpoint, "" for a file that begins with a checkpoint's header."""
    entry = stream.read(_LOCAL)
    name, extra = entry[_NAMES][:2], entry[_NAMES][2:]
    path = stream.read(int.from_bytes(name, "little"))
    stream.seek(int.from_bytes(extra, "little"), os.SEEK_CUR)
    is_one = entry.startswith(_MAGIC) and path == f"{_HEADER}.npy".encode() and _BEGINNING.match(stream.read(1000))
    return "" if is_one else "is not a checkpoint and is not replaced"


def to_bytes(header: str, arrays: Arrays) -> bytes:
    """Return the content of a checkpoint file, with its checksum."""
    buffer = io.BytesIO()
    np.savez(buffer, **{_HEADER: np.frombuffer(header.encode(), np.uint8)}, **arrays)  # type: ignore[arg-type]
    with zipfile.ZipFile(buffer, "a") as archive:
        archive.comment = _CHECKSUM + b"0" * _DIGITS
    content = buffer.getvalue()[:-_DIGITS]
    return content + hashlib.sha256(content).hexdigest().encode()


def read_checkpoint(path: Path, scene: Scene | None = None, folder: Path | None = None) -> Checkpoint:
    """Read a checkpoint. A scene must equal that of the file except for the FREE fields.

    folder: the path must lie inside. Raise CheckpointError, in one sentence, for a file that is no checkpoint, damaged,
    of another version or of another scene. The receivers check the content of memory and arrays.
    """
    header, arrays = _read(path, folder)
    then, now = header.versions, versions()
    if then != now:
        raise CheckpointError(
            f"{path}: saved with {', '.join(entry for entry in then if entry not in now) or 'nothing'}, "
            f"expected {', '.join(entry for entry in now if entry not in then) or 'no more'}: "
            "no other version goes on to the same bits"
        )
    saved = _scene(path, header.scene)
    difference = None if scene is None else scene_difference(saved, scene, FREE)
    if difference is not None:
        field, here, there = difference
        raise CheckpointError(
            f"{path}: saved from a scene with {field}: {here}, which is {there} in the scene given; "
            "expected the same scene"
        )
    return Checkpoint(path, saved if scene is None else scene, header.memory, arrays, header.controller)


def damaged(path: Path, reason: object) -> CheckpointError:
    """Return the error for a file with inconsistent content."""
    text = printable(" ".join(str(reason).split())) or type(reason).__name__
    return CheckpointError(f"{path}: is damaged or cut short ({text}), expected a complete checkpoint")


def versions() -> list[str]:
    """Return the versions that decide how a run continues, as "name=version"."""
    return [f"engine={ENGINE_HASH}", *versions_here()]


def _read(path: Path, folder: Path | None) -> tuple[_Header, Arrays]:
    """Return header and arrays of a file of this format."""
    try:
        content = read_file(path, MOST, folder)
    except FileError as error:
        raise CheckpointError(f"{path}: {error}, expected {_expected(folder)}") from error
    if not content.startswith(_MAGIC):
        raise CheckpointError(f"{path}: not a checkpoint, expected a file that was saved as one")
    has_checksum = content[-_DIGITS - len(_CHECKSUM) : -_DIGITS] == _CHECKSUM
    if has_checksum and hashlib.sha256(content[:-_DIGITS]).hexdigest().encode() != content[-_DIGITS:]:
        raise damaged(path, "its checksum does not fit")
    try:
        header, arrays = _unpacked(content)
    except CheckpointError as error:
        raise CheckpointError(f"{path}: {error}") from None
    # Libraries raise various exceptions for forged archives.
    except Exception as error:
        raise damaged(path, error) from error
    number = header.get("format")
    if type(number) is int and number != FORMAT and 0 <= number < 1000:
        raise CheckpointError(f"{path}: format {number} of checkpoints, expected {FORMAT}")
    if not has_checksum:
        raise damaged(path, "it ends without a checksum")
    try:
        return _Header.model_validate(header), arrays
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        raise damaged(path, f"header.{'.'.join(map(str, first['loc']))} {wrong(first['type'])}") from error


def _unpacked(content: bytes) -> tuple[dict[str, Any], Arrays]:
    """Return header and arrays of an archive; they take no more memory than its bytes. Raise any exception."""
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        entries = archive.infolist()
        if any(entry.compress_type != zipfile.ZIP_STORED for entry in entries):
            raise ValueError("it is compressed")
        if sum(entry.file_size for entry in entries) > len(content):
            raise ValueError("its parts overlap")
        arrays: Arrays = {}
        for entry in entries:
            name = entry.filename.removesuffix(".npy")
            if name in arrays:
                raise ValueError("it has two arrays of one name")
            arrays[name] = _array(archive.read(entry))
    if _HEADER not in arrays:
        raise CheckpointError("a .npz without a header, expected a checkpoint")
    return dict(json.loads(arrays.pop(_HEADER).tobytes())), arrays


def _array(content: bytes) -> NDArray[Any]:
    """Return the array of a .npy file of numbers in C order. It takes no more memory than the file has bytes."""
    stream = io.BytesIO(content)
    if npy.read_magic(stream) != (1, 0):
        raise ValueError("an array of another version of .npy")
    shape, fortran_order, dtype = npy.read_array_header_1_0(stream)
    if dtype.kind not in "biuf" or fortran_order:
        raise ValueError(f"an array of {dtype}, not of numbers in C order")
    data = content[stream.tell() :]
    if math.prod(shape) * dtype.itemsize != len(data) or min(shape, default=0) < 0:
        raise ValueError(f"an array of shape {shape} in {len(data)} bytes")
    return np.frombuffer(data, dtype).reshape(shape).copy()


def _scene(path: Path, source: _Source) -> Scene:
    try:
        return parse_again(source.text, source.name, parse_overrides(source.overrides))
    except SceneError as error:
        raise damaged(path, f"its scene is refused: {str(error).splitlines()[0]}") from error


def _expected(folder: Path | None) -> str:
    return "a checkpoint" if folder is None else f"a checkpoint in {folder}"


def _place(path: Path, folder: Path | None) -> str:
    if folder is not None:
        return f"a new name or a checkpoint in {folder}, and room for it"
    if not os.path.isdir(path.parent):
        return f"the folder {path.parent} to be there"
    return "a new name or a checkpoint, and room for it"
