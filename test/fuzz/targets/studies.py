# SPDX-License-Identifier: Apache-2.0
"""Folders of studies, damaged: a study goes on to the table that it had and prints it as it was, or it says why not."""

from __future__ import annotations

import atexit
import json
import shutil
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from accuracy.studies import study as accuracy_study
from fuzz.invariants import Violation
from fuzz.play import check_sentence
from studies.small import Here, setup_of

from conveyor_sim.accuracy.report.files import STUDY, read_study, write_study
from conveyor_sim.errors import ConveyorError
from conveyor_sim.studies.results import PARQUET, Results, read_results, write_parquet
from conveyor_sim.studies.row import RunRow
from conveyor_sim.studies.runs import Runs
from conveyor_sim.studies.setup import Setup
from conveyor_sim.studies.sweep import sweep
from conveyor_sim.support.checked_json import with_checksum

Rng = np.random.Generator
SEEDS = {"seeds": 2, "metrics": ["stops", {"queue": "mean belts/conveyor/bottles"}]}
WARM = {
    "parameters": {"speed": {"controller": "speed", "values": [0.5, 0.3]}},
    "controller": "code.py:Feeder",
    "settings": {"speed": 0.5},
    "warm_start": 0.1,
}
STUDIES: dict[str, dict[str, Any]] = {
    "warm": {**SEEDS, **WARM, "duration": 0.2},
    "plain": {**SEEDS, "duration": 0.2},
    "pilots": {
        "seeds": 1,
        "metrics": [{"queue": "mean belts/conveyor/bottles"}],
        "duration": 40.0,
        "warm_up": "mser",
        "overrides": {"belts": {"conveyor": {"speed": 0.1}}, "tick": 0.02},
    },
}
ODD: tuple[Any, ...] = (
    None, True, -1, 0, 1.5, 10**400, 2**64, "", "x" * 300, "\ud800", "\x1b[2J", [], {}, [[]], {"a": 1}, float("nan"),
    float("inf"), -0.0,
)  # fmt: skip


@dataclass(frozen=True)
class Base:
    """An intact study."""

    setup: Setup
    folder: Path
    rows: list[RunRow]
    results: Results
    files: frozenset[str]
    """Below the folder, without the lock."""


@cache
def place() -> Path:
    """Return the folder of the intact studies, which stays until this process ends."""
    made = Path(tempfile.mkdtemp(prefix="studies"))
    atexit.register(shutil.rmtree, made, ignore_errors=True)
    return made


@cache
def base(name: str) -> Base:
    """One of STUDIES."""
    folder = place() / name
    folder.mkdir()
    setup = setup_of(folder, **STUDIES[name])
    with Runs(setup, folder / "out", Here()) as runs:
        rows = sweep(runs, setup)
    results = read_results(folder / "out")
    write_parquet(results, folder / "out" / PARQUET)
    write_study(accuracy_study(), folder / "accuracy")
    (folder / "out" / ".lock").unlink()
    files = frozenset(str(file.relative_to(folder / "out")) for file in _files(folder / "out"))
    return Base(setup, folder / "out", rows, results, files)


def attack(seed: int, folder: Path) -> str:
    """Damages a copy of a study, prints it, and goes on with it; or damages a table, or a study of accuracy."""
    rng = np.random.default_rng(seed)
    kind = str(rng.choice(["study"] * 6 + ["unsealed", "table", "accuracy"]))
    good = base(str(rng.choice(list(STUDIES), p=[0.45, 0.45, 0.1])))
    copy = folder / "out"
    shutil.copytree(good.folder, copy)
    if kind == "table":
        return _table(good, copy / PARQUET, rng)
    if kind == "accuracy":
        return _accuracy(good, copy / STUDY, rng)
    (copy / PARQUET).unlink()
    if kind == "unsealed":
        _unseal(copy)
    forged = False
    for _ in range(int(rng.choice([1, 2, 3], p=[0.6, 0.25, 0.15]))):
        forged |= _edit(copy, rng)
    unsealed = kind == "unsealed"
    said = _print(good, copy, sure=not forged and not unsealed)
    if unsealed:
        return f"unsealed, {said}"
    return f"{said}, {_go_on(good, copy, sure=not forged)}"


# What must hold


def _print(good: Base, copy: Path, sure: bool) -> str:
    before = _contents(copy)
    try:
        found = read_results(copy)
    except ConveyorError as error:
        _check(error)
        return "refused"
    finally:
        if _contents(copy) != before:
            raise Violation("printing changes files", str(copy))
    if sure:
        rows = {row.key: row for row in good.results.rows}
        if any(_exact(row) != _exact(rows.get(row.key)) for row in found.rows):
            raise Violation("wrong table", "a row is not that of the intact study")
        if (found.units, found.study, found.warm_up) != (good.results.units, good.results.study, good.results.warm_up):
            raise Violation("wrong table", "units, study or warm-up are not those of the intact study")
    return "printed"


def _go_on(good: Base, copy: Path, sure: bool) -> str:
    before, engine, said = _contents(copy), Here(), list[str]()
    foreign = {content for content in before.values() if content in _foreign(good.folder)}
    try:
        with Runs(good.setup, copy, engine, said.append) as runs:
            rows = sweep(runs, good.setup)
    except ConveyorError as error:
        _check(error)
        if not foreign <= set(_contents(copy).values()):
            raise Violation("foreign file lost", str(error)) from error
        return "refused"
    for sentence in said:
        if "\n" in sentence:
            raise Violation("words of a line", sentence)
    if sure and [_exact(row) for row in rows] != [_exact(row) for row in good.rows]:
        raise Violation("wrong rows", f"not those of the intact study, after: {said}")
    if not foreign <= set(_contents(copy).values()):
        raise Violation("foreign file lost", f"after: {said}")
    if _print(good, copy, sure) != "printed":
        raise Violation("not mended", f"refused after the study went on: {said}")
    return f"went on with {'some' if engine.made else 'no'} runs"


def _table(good: Base, file: Path, rng: Rng) -> str:
    _damage(file, rng)
    try:
        found = read_results(file)
    except ConveyorError as error:
        _check(error)
        return "table refused"
    if [_exact(row) for row in found.rows] != [_exact(row) for row in good.results.rows] or not found.verified:
        raise Violation("wrong table", "of a Parquet file")
    return "table as it was"


def _accuracy(good: Base, file: Path, rng: Rng) -> str:
    shutil.copy(good.folder.parent / "accuracy" / STUDY, file)
    forged = _edit(file.parent, rng, file)
    try:
        found = read_study(file) if file.exists() else None
    except ConveyorError as error:
        _check(error)
        return "accuracy refused"
    if not forged and found is not None and found != accuracy_study():
        raise Violation("wrong study", "of accuracy")
    return "accuracy as it was"


def _check(error: ConveyorError) -> None:
    check_sentence(str(error))
    if "\n" in str(error) or "expected" not in str(error):
        raise Violation("words of a refusal", str(error)[:500])


def _exact(row: RunRow | None) -> str:
    """All of a row but its times, for which there is no second truth."""
    if row is None:
        return ""
    return repr(
        (row.key, dict(row.parameters), row.status, row.error, dict(row.metrics), dict(row.half_widths), row.dt)
    )


# Changes of files


def _edit(copy: Path, rng: Rng, only: Path | None = None) -> bool:
    """Change one file. Returns True if it is made up with a checksum that fits: then its content may be read."""
    files = _files(copy) if only is None else [only]
    if not files:
        return False
    file = files[int(rng.integers(len(files)))]
    match str(rng.choice(["bytes", "bytes", "bytes", "other", "other", "shape", "shape", "gone", "kind", "forged"])):
        case "bytes":
            _damage(file, rng)
        case "other":
            _swap(file, copy, rng)
        case "shape":
            file.write_bytes(SHAPES[int(rng.integers(len(SHAPES)))](file.read_bytes()))
        case "gone":
            file.unlink()
        case "kind":
            file.unlink()
            if rng.random() < 0.5:
                file.mkdir()
            else:
                file.symlink_to(str(rng.choice([file.name, "nowhere", "/dev/zero"])))
        case "forged" if file.suffix == ".json":
            data = _data(file.read_bytes())
            _change(data, rng)
            file.write_bytes(with_checksum(data or {"a": 1}))
            return True
    return False


def _damage(file: Path, rng: Rng) -> None:
    content = bytearray(file.read_bytes())
    place, length = int(rng.integers(len(content))) if content else 0, int(rng.integers(1, 60))
    match str(rng.choice(["flip", "flip", "flip", "cut", "gone", "zeros", "more"])):
        case "flip" if content:
            content[place] ^= 1 << int(rng.integers(8))
        case "cut":
            del content[place:]
        case "gone":
            del content[place : place + length]
        case "zeros":
            content[place : place + length] = bytes(len(content[place : place + length]))
        case _:
            content[place:place] = rng.bytes(length)
    file.write_bytes(bytes(content))


def _swap(file: Path, copy: Path, rng: Rng) -> None:
    """Put a file of another study, or another file of this one, in its place."""
    name = file.relative_to(copy)
    others = [base(other).folder / name for other in STUDIES if (base(other).folder / name).is_file()]
    beside = [other for other in file.parent.iterdir() if other.is_file()]
    chosen = others if rng.random() < 0.6 and others else beside
    content = chosen[int(rng.integers(len(chosen)))].read_bytes()
    file.write_bytes(content)


def _data(content: bytes) -> dict[str, Any]:
    """Fields of a file without its checksum; none of one that is damaged already."""
    try:
        data = json.loads(content)
    except (ValueError, RecursionError):
        return {}
    fields = data if isinstance(data, dict) else {}
    return {name: value for name, value in fields.items() if name != "sha256"}


def _change(data: Any, rng: Rng) -> None:
    """Put something odd in place of a value, or leave it out."""
    while isinstance(data, (dict, list)) and data:
        keys = list(data) if isinstance(data, dict) else list(range(len(data)))
        key = keys[int(rng.integers(len(keys)))]
        if isinstance(data[key], (dict, list)) and data[key] and rng.random() < 0.6:
            data = data[key]
        elif rng.random() < 0.2:
            del data[key]
            return
        else:
            data[key] = ODD[int(rng.integers(len(ODD)))]
            return


SHAPES: tuple[Callable[[bytes], bytes], ...] = (
    lambda content: b"",
    lambda content: b"[" * 200_000,
    lambda content: b'{"a":' * 50 + b"1" + b"}" * 50,
    lambda content: b"[]",
    lambda content: b"null",
    lambda content: b'{"a": ' + b"9" * 5000 + b"}",
    lambda content: b'{"point": 1, "point": 1}',
    lambda content: content.replace(b": 0", b": NaN", 1),
    lambda content: content.replace(b": ", b": 1e999, ", 1),
    lambda content: content.replace(b"sha256", b"sha255"),
    lambda content: b" " * 20_000_000,
    lambda content: content + content,
)


def _unseal(copy: Path) -> None:
    """Remove the checksums, as in folders of older versions."""
    for file in _files(copy):
        if file.suffix == ".json":
            data = json.loads(file.read_bytes())
            for name in ("sha256", "made_with", "text"):
                data.pop(name, None)
            file.write_text(json.dumps(data))


@cache
def _foreign(folder: Path) -> frozenset[bytes]:
    """Contents of the JSON files of the other studies."""
    others = [base(name) for name in STUDIES if base(name).folder != folder]
    return frozenset(
        file.read_bytes() for other in others for file in _files(other.folder) if file.suffix in (".json", ".npz")
    )


def _files(folder: Path) -> list[Path]:
    return sorted(
        file for file in folder.rglob("*") if file.is_file() and not file.is_symlink() and file.name[0] != "."
    )


def _contents(folder: Path) -> dict[str, bytes]:
    return {str(file.relative_to(folder)): file.read_bytes() for file in _files(folder)}
