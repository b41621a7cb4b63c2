# SPDX-License-Identifier: Apache-2.0
"""The page: processor time a frame in software-rendered Chromium; an hour of recording opened and gone about in."""

from __future__ import annotations

import shutil
import tempfile
import time
from pathlib import Path

import numpy as np

from bench.markdown import table as markdown
from bench.measure import Effort, say
from bench.rows import Row, Rows
from conveyor_sim.bag.messages.encode import Header
from conveyor_sim.bag.messages.topics import TOPICS
from conveyor_sim.bag.outputs import OutputWriter
from conveyor_sim.bag.recorder import Recorder
from conveyor_sim.columns.bottles import BottleColumns, ContactColumns
from conveyor_sim.page.one_file import write_page
from conveyor_sim.page.server import RecordingServer
from conveyor_sim.scene import load_scene
from conveyor_sim.simulation import Simulation
from conveyor_sim.support.resources import scene_path

FRAME, LONG = "view", "an hour"
CPU, RATE, OPEN, SEEK = "ms of CPU a frame", "frames/s", "s to open", "ms to go to a time"
CROWDS = (1000, 10000)
BROWSERS = ("chromium-headless-shell", "chromium")
HOUR, BOTTLES, HZ = 3600.0, 300, 50.0
_COUNT = """() => new Promise((done) => {
    const start = performance.now();
    let frames = 0;
    const next = (now) => {
        frames++;
        if (now - start < %d) requestAnimationFrame(next);
        else done([frames, (now - start) / 1000]);
    };
    requestAnimationFrame(next);
})"""


def measure(effort: Effort) -> list[Row]:
    """Played crowds, then jumps in a long recording, both written without a simulation."""
    with tempfile.TemporaryDirectory() as folder:
        return [*_frames(Path(folder), effort), *_long(Path(folder), effort)]


def _frames(folder: Path, effort: Effort) -> list[Row]:
    from playwright.sync_api import sync_playwright

    browser = next(filter(None, map(shutil.which, BROWSERS)))
    rows = []
    for bottles in CROWDS:
        page_file = write_page(_written(folder / str(bottles), 12.0, bottles, 25.0), folder / f"{bottles}.html")
        with sync_playwright() as driver:
            chromium = driver.chromium.launch(executable_path=browser, args=["--no-sandbox"])
            page = chromium.new_page(viewport={"width": 1280, "height": 720})
            page.goto(page_file.as_uri())
            page.wait_for_selector("body[data-ready]")
            page.click("#play")
            page.wait_for_timeout(1000)
            for turn in range(effort.rounds):
                say(f"view, {bottles} bottles, {turn + 1}")
                before = _cpu()
                frames, seconds = page.evaluate(_COUNT % (500 if effort.quick else 1500))
                spent = _cpu() - before
                rows.append(Row(FRAME, float(bottles), "page", CPU, turn, 1e3 * spent / frames))
                rows.append(Row(FRAME, float(bottles), "page", RATE, turn, frames / seconds))
            chromium.close()
    return rows


def _long(folder: Path, effort: Effort) -> list[Row]:
    say("view, an hour is written")
    seconds = HOUR / 60.0 if effort.quick else HOUR
    bag = _written(folder / "hour", seconds, BOTTLES, HZ, with_contacts=False)
    rows = []
    for turn in range(effort.rounds):
        start = time.perf_counter()
        with RecordingServer(bag) as server:
            server.answer("head")
            rows.append(Row(LONG, seconds, "server", OPEN, turn, time.perf_counter() - start))
            start = time.perf_counter()
            server.answer(f"block/{int((turn + 0.5) / effort.rounds * seconds / 2.0)}")
            rows.append(Row(LONG, seconds, "server", SEEK, turn, 1e3 * (time.perf_counter() - start)))
    return rows


def _cpu() -> float:
    """Return the processor time of all processes of the browser, s."""
    ticks = 0
    for place in Path("/proc").glob("[0-9]*"):
        try:
            if b"chromium" in (place / "cmdline").read_bytes():
                fields = (place / "stat").read_text().rpartition(")")[2].split()
                ticks += int(fields[11]) + int(fields[12])
        except OSError:
            continue  # it has ended
    return ticks / 100.0


def _written(folder: Path, seconds: float, bottles: int, rate: float, with_contacts: bool = True) -> Path:
    """Write a recording of a swaying square crowd in which each bottle touches the next."""
    simulation = Simulation(load_scene(scene_path("accumulation_table"), {"bottles": []}))
    ids, zeros, side = np.arange(bottles, dtype=np.uint64), np.zeros(bottles), int(bottles**0.5)
    kinds, belts, pairs = np.zeros(bottles, np.uint16), np.zeros(bottles, np.int32), np.zeros(bottles - 1)
    places = np.arange(bottles, dtype=np.float64)
    every = round(1.0 / rate / simulation.model.tick_ns * 1e9)
    with Recorder(folder) as recorder:
        OutputWriter(simulation, [recorder], run_id="run").start()
        for tick in range(every, round(seconds * 1e9 / simulation.model.tick_ns) + 1, every):
            x = 1.2 / side * (places % side) + 0.05 * np.sin(0.01 * tick)
            y, peak = 0.9 / side * (places // side), 5.0 + 5.0 * np.sin(9.0 * x)
            columns = BottleColumns(ids, kinds, x, y, zeros, zeros, zeros, zeros, belts, peak, zeros)
            header = Header(tick, tick * simulation.model.tick_ns, "world")
            recorder.write("bottles", TOPICS["bottles"].pack(columns, header), header.stamp_ns)
            if not with_contacts:
                continue
            force = 5.0 + 5.0 * np.sin(x[1:] + tick)
            contacts = ContactColumns(
                np.zeros(bottles - 1, np.uint8), ids[:-1], ids[1:], pairs, pairs, pairs, pairs, pairs, force, pairs
            )
            recorder.write("contacts", TOPICS["contacts"].pack(contacts, header), header.stamp_ns)
    return folder


def tables(rows: Rows) -> str:
    """One table of crowds, one of the long recording."""
    crowds = [
        [f"{n:,.0f}".replace(",", " "), *(rows.spread(FRAME, n, "page", what) for what in (CPU, RATE))]
        for n in rows.ns(FRAME)
    ]
    long = [
        [f"{n / 60.0:g} min", *(rows.spread(LONG, n, "server", what) for what in (OPEN, SEEK))] for n in rows.ns(LONG)
    ]
    return "\n\n".join(
        [
            markdown(["bottles", CPU, RATE], crowds),
            markdown([f"recording of {BOTTLES} bottles at {HZ:g} Hz", OPEN, SEEK], long),
        ]
    )
