# SPDX-License-Identifier: Apache-2.0
"""Checkpoints that were damaged, or made up with a checksum that fits: refused in a sentence, and nothing changes.

A loaded state with the `full_state_hash` of the saved one has the same future.
"""

from __future__ import annotations

import copy
import hashlib
import json
import math
import resource
import time
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from fuzz.invariants import Violation
from fuzz.play import check_sentence

from conveyor_sim.errors import CheckpointError, SimulationError
from conveyor_sim.physics.state.checkpoint import to_bytes
from conveyor_sim.scene import Scene, load_scene
from conveyor_sim.simulation import Simulation

SMALL_LINE = Path(__file__).resolve().parents[2] / "bag" / "small_line.yaml"
TICKS = 3
"""For which a file that is accepted is played on."""
LONGEST = 30.0
"""s of CPU time for a file; each takes some hundredths."""
MOST = 300_000
"""kB that memory may grow by; a file has some tens of them."""
ODD: tuple[Any, ...] = (
    None, True, False, 0, 1, -1, 2, 1.5, -0.0, 1e308, 5e-324, math.nan, math.inf, -math.inf, 2**31, 2**63, 10**40,
    "", "a", "\x00", "\x1b[2J", "ü" * 300, [], {}, [[]], [1], {"a": 1}, [None] * 50, [math.nan] * 2,
)  # fmt: skip


@dataclass(frozen=True)
class Base:
    """A good file, and what it goes on to."""

    scene: Scene
    content: bytes
    header: dict[str, Any]
    arrays: dict[str, Any]
    hash: int
    """Full, at the tick that was saved."""
    end: int
    """Full, TICKS later."""


@cache
def base() -> Base:
    """Of the small line at tick 30."""
    scene = load_scene(SMALL_LINE)
    simulation = Simulation(scene, threads=1)
    simulation.advance(30)
    with TemporaryDirectory() as folder:
        simulation.save(Path(folder) / "good")
        content = (Path(folder) / "good").read_bytes()
    with np.load(BytesIO(content)) as file:
        arrays = dict(file)
    hashed = simulation.full_state_hash()
    simulation.advance(TICKS)
    header = json.loads(arrays.pop("header").tobytes())
    return Base(scene, content, header, arrays, hashed, simulation.full_state_hash())


def attack(seed: int, folder: Path) -> str:
    """One file: damaged bytes, or with a checksum that fits other bytes, another header, other arrays."""
    draw, good = np.random.default_rng(seed), base()
    kind = str(draw.choice(["bytes", "bytes", "archive", "header", "header", "arrays", "arrays"]))
    content = {"bytes": _bytes, "archive": _archive, "header": _header, "arrays": _arrays}[kind](draw, good)
    file = folder / "file"
    file.write_bytes(content)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    begun = time.process_time()
    said = _play(file, good, forged=kind != "bytes")
    if time.process_time() - begun > LONGEST:
        raise Violation("slow checkpoint", f"{time.process_time() - begun:.0f} s")
    if (grown := resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) > MOST:
        raise Violation("large checkpoint", f"{grown} kB for a file of {len(content)} bytes")
    return said


def _play(file: Path, good: Base, forged: bool) -> str:
    try:
        simulation = Simulation.load(file, threads=1, scene=good.scene)
    except CheckpointError as error:
        text = str(error)
        check_sentence(text)
        if "\n" in text or not text.startswith(f"{file}: ") or len(text) > 1000 or not text.isprintable():
            raise Violation("words of a refusal", text[:1000]) from error
        return "refused"
    same = _is_same(file, good)
    if not same and not forged:
        raise Violation("damage is loaded", "the file is not the one that was saved")
    alike = simulation.full_state_hash() == good.hash
    if same and not alike:
        raise Violation("other state", "the content is that which was saved")
    try:
        simulation.advance(TICKS)
        simulation.bottles()
        simulation.contacts()
        simulation.signals()
    except SimulationError:
        if not alike:
            return "stopped"
        raise
    if alike and simulation.full_state_hash() != good.end:
        raise Violation("other future", "its full_state_hash is that of the state that was saved")
    return "the same" if same else "what only looks on" if alike else "another state"


def _is_same(file: Path, good: Base) -> bool:
    """Whether header and arrays are those that were saved."""
    with np.load(file) as found:
        arrays = dict(found)
    header = json.loads(arrays.pop("header").tobytes())
    return (
        json.dumps(header) == json.dumps(good.header)
        and arrays.keys() == good.arrays.keys()
        and all(_bits(arrays[name]) == _bits(array) for name, array in good.arrays.items())
    )


def _bits(array: np.ndarray) -> tuple[str, tuple[int, ...], bytes]:
    """Return type, shape and content; -0.0 is not 0.0, and a NaN is itself."""
    return array.dtype.str, array.shape, array.tobytes()


def _bytes(draw: np.random.Generator, good: Base) -> bytes:
    content = bytearray(good.content)
    for _ in range(int(draw.integers(1, 4))):
        place, length = int(draw.integers(len(content))), int(draw.integers(1, 200))
        match draw.choice(["flip", "flip", "flip", "cut", "gone", "more", "zeros", "twice", "none"]):
            case "flip":
                content[place] ^= 1 << int(draw.integers(8))
            case "cut":
                del content[place + 1 :]
            case "gone":
                del content[place : place + length]
            case "more":
                content[place:place] = draw.bytes(length)
            case "zeros":
                content[place : place + length] = bytes(len(content[place : place + length]))
            case "twice":
                content += content[place:]
        if not content:
            break
    return bytes(content)


def _archive(draw: np.random.Generator, good: Base) -> bytes:
    """Bytes of the archive's own structure, and of the arrays' headers."""
    content = bytearray(good.content)
    marks = [b"PK\x01\x02", b"PK\x03\x04", b"PK\x05\x06", b"\x93NUMPY", b"'shape'", b"'descr'"]
    for _ in range(int(draw.integers(1, 4))):
        mark = marks[int(draw.integers(len(marks)))]
        places = [place for place in range(len(content)) if content.startswith(mark, place)]
        if not places:
            continue
        place = places[int(draw.integers(len(places)))] + int(draw.integers(64))
        if place < len(content) - 71:
            content[place] = int(draw.choice([0, 1, 8, 255, int(draw.integers(256)), content[place] ^ 1]))
    return _resealed(bytes(content))


def _header(draw: np.random.Generator, good: Base) -> bytes:
    header = copy.deepcopy(good.header)
    for _ in range(int(draw.integers(1, 4))):
        places = list(_places(header))
        above, key = places[int(draw.integers(len(places)))]
        odd = copy.deepcopy(ODD[int(draw.integers(len(ODD)))])
        match draw.choice(["odd", "odd", "odd", "gone", "more", "near"]):
            case "gone":
                del above[key]
            case "more" if isinstance(above, dict):
                above[str(draw.choice(["a", "tick", "0", "_line"]))] = odd
            case "near" if type(above[key]) in (int, float):
                above[key] += int(draw.choice([-1, 1, 1000]))
            case _:
                above[key] = odd
    return to_bytes(json.dumps(header), good.arrays)


def _places(data: Any) -> Iterator[tuple[Any, Any]]:
    """Every value below a mapping or a list, by what holds it and the key."""
    for key, value in list(data.items() if isinstance(data, dict) else enumerate(data)):
        yield data, key
        if isinstance(value, (dict, list)):
            yield from _places(value)


def _arrays(draw: np.random.Generator, good: Base) -> bytes:
    arrays = dict(good.arrays)
    for _ in range(int(draw.integers(1, 3))):
        name, other = (str(one) for one in draw.choice(sorted(arrays), 2))
        array = np.array(arrays[name])
        size = max(1, array.size)
        match draw.choice(["resized", "swapped", "value", "value", "kind", "gone", "more", "shape", "empty"]):
            case "resized":
                array = np.resize(array, int(draw.integers(0, 3 * size)))
            case "swapped":
                arrays[name], arrays[other] = arrays[other], arrays[name]
                continue
            case "value" if array.size and array.dtype.kind in "fiu":
                values = [math.nan, math.inf, 1e308, -1e300, 0.0] if array.dtype.kind == "f" else _limits(array.dtype)
                array.reshape(-1)[int(draw.integers(array.size))] = values[int(draw.integers(len(values)))]
            case "kind":
                array = array.astype(str(draw.choice(["<f4", ">f8", "<i8", "|b1", "<u2", "<c16", "<M8[s]", "<U3"])))
            case "gone":
                del arrays[name]
                continue
            case "more":
                name = str(draw.choice(["x", "bottles.z", "../x", "header", "bottles"]))
            case "shape":
                array = array.reshape([(1, -1), (-1, 1), (-1, 1, 1)][int(draw.integers(3))])
            case "empty":
                array = array[:0]
        arrays[name] = array
    if "header" in arrays:
        return _resealed(good.content[:-200] + draw.bytes(10) + good.content[-190:])
    return to_bytes(json.dumps(good.header), arrays)


def _limits(kind: Any) -> list[int]:
    info = np.iinfo(kind)
    return [int(info.max), int(info.min), max(int(info.min), -1), 1, 100]


def _resealed(content: bytes) -> bytes:
    """With the checksum of what it holds now."""
    body = content[:-64]
    return body + hashlib.sha256(body).hexdigest().encode()
