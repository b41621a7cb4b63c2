# SPDX-License-Identifier: Apache-2.0
"""Recordings that are killed (SIGKILL), at full speed and at real time: what is lost, and whether the rest replays.

python docs/studies/stability_kills.py        # the study alone, into docs/stability/kills.csv: some minutes
"""

from __future__ import annotations

import csv
import os
import random
import signal
import struct
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

from conveyor_sim.bag.reader import open_bag  # noqa: E402
from conveyor_sim.bag.recover import recover  # noqa: E402
from conveyor_sim.bag.replay import replay  # noqa: E402
from conveyor_sim.errors import BagError  # noqa: E402
from conveyor_sim.run.runner import run_scene  # noqa: E402
from conveyor_sim.scene import load_scene  # noqa: E402
from conveyor_sim.support.resources import scene_path  # noqa: E402

SCENE = "paper_plant"
KILLS = 20
"""Every other one at real time."""
PACES = ("full speed", "real time")
LONGEST = 5.0
"""s of wall time from the first tick to the kill, at most."""
STARTED = 300.0
"""s of wall time for the first tick to come, kernels compiled."""
COLUMNS = ("kill", "pace", "ran", "simulated", "lost_wall", "lost_simulated", "replay")
ENTRY = struct.Struct("<dd")
"""Wall time (CLOCK_MONOTONIC) and simulated time after a tick, s."""


def measure(path: Path, kills: int = KILLS) -> None:
    """Kills so many recordings; a line each into a CSV file."""
    chance = random.Random(0)
    with path.open("w", newline="", encoding="utf-8") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(COLUMNS)
        for number in range(kills):
            with tempfile.TemporaryDirectory() as folder:
                pace = PACES[number % len(PACES)]
                table.writerow((number, pace, *_kill(Path(folder), pace, chance.uniform(0.7, LONGEST))))
            file.flush()


def _kill(folder: Path, pace: str, wall: float) -> tuple[str, ...]:
    """Start a recording, kill it after some wall time, repair and replay it."""
    log, bag = folder / "ticks", folder / "bag"
    process = subprocess.Popen([sys.executable, __file__, "--record", str(bag), str(log), pace])
    try:
        began = time.monotonic()
        while not (log.exists() and log.stat().st_size) and time.monotonic() < began + STARTED:
            time.sleep(0.01)
        time.sleep(wall)
        killed = time.monotonic()
        process.send_signal(signal.SIGKILL)
    finally:
        process.kill()
        process.wait()
    ticks = list(ENTRY.iter_unpack(log.read_bytes()))
    ran = f"{killed - ticks[0][0]:.2f}"
    try:
        recover(bag)
        with open_bag(bag) as opened:
            last = max(frame.time for frame in opened.signals())
    except BagError:
        return ran, f"{ticks[-1][1]:.2f}", f"{killed - ticks[0][0]:.3f}", f"{ticks[-1][1]:.2f}", "none left"
    # The log is written after the tick, so that one message may be in the bag that it does not know.
    missing = [when for when, simulated in ticks if simulated > last + 1e-9]
    lost = killed - missing[0] if missing else 0.0
    difference = replay(bag).difference
    return (
        ran,
        f"{ticks[-1][1]:.2f}",
        f"{lost:.3f}",
        f"{max(0.0, ticks[-1][1] - last):.2f}",
        "same bits" if difference is None else f"differs at {difference.time:.2f} s",
    )


def _record(bag: Path, log: Path, pace: str) -> None:
    """Record until killed: a run as in `conveyor-sim run`, which logs every tick."""
    scene = load_scene(scene_path(SCENE), {"duration": 3600.0})
    file = os.open(log, os.O_WRONLY | os.O_CREAT | os.O_APPEND)
    first: float | None = None

    def note(simulated: float) -> None:
        nonlocal first
        now = time.monotonic()
        first = now - simulated if first is None else first
        os.write(file, ENTRY.pack(now, simulated))
        if pace == "real time":
            time.sleep(max(0.0, first + simulated - time.monotonic()))

    run_scene(scene, bag, note, threads=1)


if __name__ == "__main__":
    if len(sys.argv) > 1:
        _record(Path(sys.argv[2]), Path(sys.argv[3]), sys.argv[4])
    else:
        measure(ROOT / "docs" / "stability" / "kills.csv")
