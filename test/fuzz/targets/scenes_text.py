# SPDX-License-Identifier: Apache-2.0
"""Scene files of any bytes, and tables of any kind: read or refused in words, in bounded time and memory.

What is wrong with the values of a scene is attacked in `wrong.py`; here it is the text, its structure and the files.
"""

from __future__ import annotations

import os
import resource
import time
from functools import cache
from pathlib import Path

import numpy as np
from fuzz.invariants import Violation
from fuzz.play import check_sentence

from conveyor_sim.errors import SceneError
from conveyor_sim.physics.model import build_model
from conveyor_sim.scene import load_scene

ROOT = Path(__file__).resolve().parents[3]
SCENES = ("config/paper_plant.yaml", "config/funnel.yaml", "config/scenarios/zoned_line.yaml", "test/scene/good.yaml")
SECRET = "root:x:0:0:somebody's secret"
"""In files outside the scene's folder; no message may show it."""
LONGEST = 60.0
"""s of CPU time; the largest texts take half of it."""
MOST = 1_500_000
"""kB that memory may grow by."""

PIECES = (
    "&a ", "*a", "<<: *a", "<<: [*a, *a]", "!!python/object:os.system x", "!!binary AAAA", "!!int x", "!!float ''",
    "!!set {a, b}", "!!timestamp 2001-12-14", "? ", "- ", ": ", "{", "}", "[", "]", "|\n", ">\n", "'", '"', "\t", "%",
    "---\n", "...\n", "\x00", "\x85", "\u2028", "\ufeff", "\ud7ff", "0x" + "f" * 300, "9" * 5000, "0x" + "f" * 20000,
    "1e400", "-.inf", ".nan", "~", "1:1:1:1:1", "0o777", "0b11", "1_000", "on", "=", "<<", "!", "@", "`",
    "[" * 200, "{a: " * 200, "- " * 200, "? " * 200, "&a [*a]", "{<<: {<<: {a: 1}}}", "x" * 100_000, "\n" * 1000,
)  # fmt: skip


@cache
def texts() -> tuple[str, ...]:
    """Of good scenes."""
    return tuple((ROOT / name).read_text(encoding="utf-8") for name in SCENES)


def attack(seed: int, folder: Path) -> str:
    """One scene file, with the tables that it may name around it."""
    draw = np.random.default_rng(seed)
    place = folder / "scenes"
    place.mkdir()
    file = place / "scene.yaml"
    _put_files(folder, place)
    kind = str(draw.choice(["bytes", "pieces", "pieces", "lines", "table", "table", "large", "odd file"]))
    match kind:
        case "bytes":
            file.write_bytes(_bytes(draw))
        case "pieces":
            file.write_text(_pieces(draw), encoding="utf-8", errors="surrogatepass")
        case "lines":
            file.write_text(_lines(draw), encoding="utf-8")
        case "table":
            file.write_text(_table(draw, folder), encoding="utf-8")
        case "large":
            file.write_text(_large(draw), encoding="utf-8")
        case _:
            file = place / str(draw.choice(["pipe", "zero", "huge", "round", "inner", "nowhere", "binary", "no/where"]))
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    begun = time.process_time()
    said = _play(file, outside=bool(draw.integers(2)))
    if time.process_time() - begun > LONGEST:
        raise Violation("slow scene", f"{kind}: {time.process_time() - begun:.0f} s")
    if (grown := resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) > MOST:
        raise Violation("large scene", f"{kind}: {grown} kB")
    return said


def _play(file: Path, outside: bool) -> str:
    try:
        build_model(load_scene(file, outside_tables=outside))
    except SceneError as error:
        text = str(error)
        check_sentence(text)
        if SECRET[:6] in text:
            raise Violation("a secret is shown", text[:1000]) from error
        if max(map(len, text.splitlines())) > 2000 or len(text) > 100_000:
            raise Violation("long words of a refusal", text[:1000]) from error
        return "refused"
    return "read"


def _put_files(folder: Path, place: Path) -> None:
    """What a table, or the scene itself, may turn out to be."""
    (folder / "secret").write_text(f"{SECRET}\n")
    (folder / "law.csv").write_text("0,0\n0.001,5\n")
    (place / "inner").mkdir()
    (place / "inner" / "law.csv").write_text("0,0\n0.001,5\n0.002,15.5\n")
    (place / "link").symlink_to(place / "inner" / "law.csv")
    (place / "out").symlink_to(folder / "secret")
    (place / "zero").symlink_to("/dev/zero")
    (place / "round").symlink_to(place / "round")
    (place / "binary").write_bytes(bytes(range(256)))
    (place / "words").write_text("a,b\nc,d\n")
    with (place / "huge").open("wb") as stream:
        stream.truncate(10**12)
    os.mkfifo(place / "pipe")


def _table(draw: np.random.Generator, folder: Path) -> str:
    names = [
        "inner/law.csv", "link", "out", "zero", "round", "binary", "words", "huge", "pipe", "inner", "", ".", "..",
        "../law.csv", "../secret", f"{folder}/secret", f"{folder}/scenes/inner/law.csv", "inner/../inner/law.csv",
        "/dev/zero", "/dev/stdin", "/etc/passwd", "../../../../../../etc/passwd", "/proc/kmsg", "a\\0b", "x" * 5000,
        "~/law.csv", "inner/law.csv/x", "nowhere", "/dev/tty", "\\uD800", "/proc/self/mem", "/dev/fd/0",
    ]  # fmt: skip
    name = names[int(draw.integers(len(names)))]
    return texts()[3].replace("stiffness: 10000}", f'table: "{name}"}}')


def _bytes(draw: np.random.Generator) -> bytes:
    content = bytearray(texts()[int(draw.integers(len(SCENES)))].encode())
    for _ in range(int(draw.integers(1, 6))):
        place, length = int(draw.integers(len(content))), int(draw.integers(1, 100))
        match draw.choice(["flip", "flip", "gone", "more", "cut"]):
            case "flip":
                content[place] ^= 1 << int(draw.integers(8))
            case "gone":
                del content[place : place + length]
            case "more":
                content[place:place] = draw.bytes(length)
            case _:
                del content[place + 1 :]
        if not content:
            break
    return bytes(content)


def _pieces(draw: np.random.Generator) -> str:
    text = texts()[int(draw.integers(len(SCENES)))]
    for _ in range(int(draw.integers(1, 4))):
        piece = PIECES[int(draw.integers(len(PIECES)))]
        # Behind a colon a piece is a value, elsewhere most are not even YAML.
        places = [place for place, letter in enumerate(text) if letter in ":,["] or [0]
        place = places[int(draw.integers(len(places)))] + 1
        end = place + int(draw.choice([0, 0, 3, 10]))
        text = f"{text[:place]} {piece}{text[end:]}"
    return text


def _lines(draw: np.random.Generator) -> str:
    lines = texts()[int(draw.integers(len(SCENES)))].splitlines(keepends=True)
    for _ in range(int(draw.integers(1, 5))):
        one, other = int(draw.integers(len(lines))), int(draw.integers(len(lines)))
        match draw.choice(["gone", "twice", "swapped", "deeper", "joined"]):
            case "gone" if len(lines) > 1:
                del lines[one]
            case "twice":
                lines.insert(other, lines[one])
            case "swapped":
                lines[one], lines[other] = lines[other], lines[one]
            case "deeper":
                lines[one] = " " * int(draw.integers(1, 9)) + lines[one]
            case _:
                lines[one] = lines[one].rstrip("\n") + " "
    return "".join(lines)


def _large(draw: np.random.Generator) -> str:
    """Texts that grow: in size, in depth, by aliases that name aliases, by merges."""
    size = int(10 ** draw.uniform(1, 3.5))
    rows = int(10 ** draw.uniform(0, 6))
    aliases = "a0: &a0 [x, x, x]\n" + "".join(
        f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 9)}]\n" for n in range(1, min(size, 40))
    )
    many = ", ".join(f"k{n}: 1" for n in range(300))
    merges = f"a: &a {{{many}}}\n" + "".join(f"m{n}: {{<<: [{', '.join(['*a'] * 30)}]}}\n" for n in range(size % 50))
    grid = f"  - grid: {{type: jar, origin: [20, 30], rows: {rows}, columns: {size}, pitch: 0.1}}\n"
    one = "  - {type: jar, position: [0.4, 0.4]}\n"
    good = texts()[3]
    grown = [
        "[" * size, "{a: " * size, "- " * size, "a: " + "9" * size, "a: 0x" + "f" * size, "a: " + "1:" * size, aliases,
        merges, good.replace("bottles:\n", f"bottles:\n{grid}"), good.replace("bottles:\n", "bottles:\n" + one * size),
        "\n" * size * 100, "# " + "x" * size * 100, "a: " + "x" * size * 100, "{" + "a," * size + "}", "x" * 9_000_000,
    ]  # fmt: skip
    return grown[int(draw.integers(len(grown)))]
