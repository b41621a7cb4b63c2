# SPDX-License-Identifier: Apache-2.0
"""Files of measurements, damaged: the entries load as a scene, or one line per problem says why there are none."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np
from fuzz.invariants import Violation
from fuzz.play import check_sentence

from conveyor_sim.errors import CalibrationError, SceneError
from conveyor_sim.scene import parse_scene
from conveyor_sim.studies.calibration.calibrate import calibrate
from conveyor_sim.studies.calibration.entries import entries
from conveyor_sim.studies.calibration.example import example
from conveyor_sim.studies.calibration.quantities import COLUMNS

Rng = np.random.Generator
Rows = list[list[str]]
HEAD = "name: pasted\nduration: 1\nbottle_types: {bottle: {radius: 33 mm, mass: 350 g, material: glass}}\n"
ROWS = [line.split(",") for line in example().splitlines() if not line.startswith("#")]
TEXTS = 4
"""First columns, which have texts."""
ODD = ("0", "-1", "1e-300", "1e300", "nan", "inf", "0,5", "1.2.3", "", "\u0663", '"', "#", "1 g")
HEADERS = ("", "force", "mass (kg)", "overlap (um)", "drop_height (1/m)", "x", "quantity")


def attack(seed: int, folder: Path) -> str:
    """Damage the example, calibrate it, and return what came of it in a word."""
    rng = np.random.default_rng(seed)
    rows = [list(row) for row in ROWS]
    body = [rows[1:][index] for index in rng.permutation(len(rows) - 1)[: rng.integers(0, len(rows))]]
    rows = [rows[0], *body]
    for _ in range(int(rng.integers(0, 4))):
        CHANGES[int(rng.integers(len(CHANGES)))](rows, rng)
    content = "\n".join(",".join(row) for row in rows).encode()
    if rng.random() < 0.2:
        content = _flipped(content, rng)
    path = folder / "data.csv"
    path.write_bytes(content)
    return _judged(path)


def _judged(path: Path) -> str:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            result = calibrate(path)
            text = entries(result, path.name)
        except CalibrationError as error:
            check_sentence(str(error))
            if not all(line.startswith(str(path)) for line in str(error).splitlines()):
                raise Violation("a problem without its file", str(error)) from None
            return "refused"
    try:
        scene = parse_scene(HEAD + text)
    except SceneError as error:
        raise Violation("entries that don't load", f"{error}\n{text}") from None
    for estimate in result.base.values():
        if estimate.has_interval and not estimate.low <= estimate.value <= estimate.high:
            raise Violation("a value outside its interval", str(estimate))
    if len(scene.base) != len(result.base):
        raise Violation("missing entries", f"{len(result.base)} values of friction, {len(scene.base)} entries")
    return "calibrated"


def _odd(rows: Rows, rng: Rng) -> None:
    row = rows[int(rng.integers(len(rows)))]
    row[int(rng.integers(len(row)))] = str(rng.choice(ODD))


def _scaled(rows: Rows, rng: Rng) -> None:
    """Multiply a number by a power of ten, as a wrong unit does."""
    row = rows[int(rng.integers(len(rows)))]
    filled = [place for place, cell in enumerate(row) if place >= TEXTS and cell and row is not rows[0]]
    if filled:
        place = int(rng.choice(filled))
        try:
            row[place] = repr(float(row[place]) * 10.0 ** rng.uniform(-6.0, 6.0))
        except ValueError:
            row[place] = ""


def _repeated(rows: Rows, rng: Rng) -> None:
    """Repeat a row with the same sample, so that there is no scatter."""
    if len(rows) > 1:
        row = rows[int(rng.integers(1, len(rows)))]
        rows += [list(row) for _ in range(int(rng.integers(1, 5)))]


def _header(rows: Rows, rng: Rng) -> None:
    rows[0][int(rng.integers(len(rows[0])))] = str(rng.choice([*HEADERS, *COLUMNS]))


def _flipped(content: bytes, rng: Rng) -> bytes:
    damaged = bytearray(content)
    for _ in range(int(rng.integers(1, 5))):
        damaged[int(rng.integers(len(damaged)))] = int(rng.integers(256))
    return bytes(damaged)


CHANGES: tuple[Callable[[Rows, Rng], None], ...] = (_odd, _scaled, _scaled, _repeated, _header)
