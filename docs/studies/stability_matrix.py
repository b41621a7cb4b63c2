# SPDX-License-Identifier: Apache-2.0
"""The matrix of docs/stability.md: every row of the table of hard cases, by set of effects, integrator and preset.

A run may do so much work and no more: what would take longer ends early, and is listed with the time that it reached.
Every run is repeated on two threads, as far as a share of that work goes, and its state compared bit for bit. Each is
in the file as soon as it is finished; runs that are there, of the present sources, are not made again.
"""

from __future__ import annotations

import csv
import hashlib
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from multiprocessing import active_children, get_context
from pathlib import Path
from typing import Any

from hard_cases.case import IMPULSES, Case, read_table
from hard_cases.measures import Outcome, run

from conveyor_sim.engine.compiler.compile import ENGINE_HASH
from conveyor_sim.errors import ConveyorError
from conveyor_sim.physics.model import Model, build_model
from conveyor_sim.physics.model.remedies import STEP_COST
from conveyor_sim.physics.sources_hash import sources_hash
from conveyor_sim.physics.timestep.presets import PRESETS
from conveyor_sim.scene import Scene
from conveyor_sim.scene.accuracy import INTEGRATOR_NAMES
from conveyor_sim.support.progress import ProgressBar

WORK = 1.5e7
"""Work of one run, about a second: ticks times TICK, and steps times (bottles + BESIDE) times STEP_COST."""
TICK, BESIDE = 3000, 20
AT_ALL = 20.0
"""Limit of the work of a single tick, as a multiple of WORK; a run above it is left out."""
AGAIN = 0.1
"""Share of a run's work that is repeated on two threads."""

SAFE = ("overlap", "speed", "lost", "tunnelled")
"""Observables that a run must keep below their limits, however early it ended."""

COLUMNS = (
    "row", "effects", "integrator", "preset", "verdict", "steps_per_tick", "simulated", "of", "overlap", "residual",
    "drift", "speed", "chatter", "tunnelled", "lost", "shortened_ticks", "said", "hash_at", "hash", "two_threads",
    "wall", "sources",
)  # fmt: skip
"""`verdict`: kept, kept so far, broken, limit, refused, not run; `said`: why; `two_threads`: same, differs."""

SOURCES = f"{ENGINE_HASH}+{sources_hash()}"
"""Versions that decide a run, beside its row."""


@dataclass(frozen=True)
class Job:
    """One run of the matrix."""

    row: str
    effects: str
    integrator: str
    preset: str

    @property
    def key(self) -> tuple[str, str, str, str]:
        """Return the key of this job."""
        return self.row, self.effects, self.integrator, self.preset


def jobs(cases: Sequence[Case]) -> Iterator[Job]:
    """Yield all jobs in the order of the table."""
    for case in cases:
        for effects in case.variants:
            for integrator in case.integrators or _integrators(case):
                for preset in tuple(IMPULSES) if integrator == "impulses" else case.presets or tuple(PRESETS):
                    yield Job(case.name, effects, integrator, preset)


def _integrators(case: Case) -> Sequence[str]:
    """All; semi_implicit_euler where a belt turns only, for elsewhere leapfrog gives the same bits."""
    belts = case.given.get("belts", {}).values()
    turns = "file" in case.given or any(belt.get("kind") == "curved" for belt in belts)
    names = [name for name in INTEGRATOR_NAMES if turns or name != "semi_implicit_euler"]
    return [*names, "impulses"]


def make(job: Job) -> dict[str, Any]:
    """Run it on one thread; its line."""
    began = time.perf_counter()
    case = _cases()[job.row]
    line: dict[str, Any] = dict.fromkeys(COLUMNS, "")
    line |= {"row": job.row, "effects": job.effects, "integrator": job.integrator, "preset": job.preset}
    line["sources"] = stamp(job.row)
    try:
        scene = case.scene(job.integrator, job.preset, job.effects, short=False)  # type: ignore[arg-type]
    except ConveyorError as error:
        verdict = "kept" if case.refused else "refused"
        return {**line, "verdict": verdict, "said": str(error).splitlines()[0].partition(": ")[2]}
    model = build_model(scene)
    tick_work = _tick_work(model, scene)
    line |= {"steps_per_tick": model.steps_per_tick, "of": scene.duration}
    if tick_work > AT_ALL * WORK:
        said = f"a tick takes {model.steps_per_tick} steps: {model.dt_reason}"
        return {**line, "verdict": "not run", "said": said}
    ticks = max(1, min(scene.duration_ticks, int(case.work * WORK / tick_work)))
    hash_at = max(1, min(ticks, int(AGAIN * WORK / tick_work)))
    outcome = run(case, scene, threads=1, most_ticks=ticks, hash_at=hash_at)
    line |= {name: f"{value:.4g}" for name, value in outcome.measures.items() if name in COLUMNS and value == value}
    line |= {"hash_at": hash_at if outcome.hash else "", "hash": f"{outcome.hash:016x}" if outcome.hash else ""}
    line["verdict"], line["said"] = _verdict(case, outcome, job, ticks < scene.duration_ticks)
    return {**line, "wall": f"{time.perf_counter() - began:.2f}"}


def again(line: dict[str, Any]) -> str:
    """Repeat the beginning of a run on two threads: `same`, `differs`, or empty if there is none."""
    if not line["hash"]:
        return ""
    case, ticks = _cases()[line["row"]], int(line["hash_at"])
    scene = case.scene(line["integrator"], line["preset"], line["effects"], short=False)
    outcome = run(case, scene, threads=2, most_ticks=ticks, hash_at=ticks)
    return "same" if f"{outcome.hash:016x}" == line["hash"] else "differs"


def _tick_work(model: Model, scene: Scene) -> float:
    bottles = sum(
        entry.grid.rows * entry.grid.columns if hasattr(entry, "grid") else 1 for entry in scene.bottles
    ) + sum(min(feed.count or 100, 100) for feed in scene.infeeds.values())
    cost = STEP_COST[model.integrator] * (scene.accuracy.sweeps or 1)
    return float(TICK + model.steps_per_tick * (bottles + BESIDE) * cost)


def _verdict(case: Case, outcome: Outcome, job: Job, early: bool) -> tuple[str, str]:
    if early and not outcome.sentence:
        wrong = [] if case.stops else case.broken(outcome.measures, "", job.preset, only=SAFE)
    else:
        wrong = case.broken(outcome.measures, outcome.sentence, job.preset)
    if not wrong:
        return ("kept so far" if early and not outcome.sentence else "kept"), outcome.sentence
    limit = case.limits.get(f"{job.integrator} {job.preset}", case.limits.get(job.integrator))
    if limit is not None:
        return "limit", limit
    return "broken", "; ".join(wrong)


_CASES: dict[str, Case] = {}


def _cases() -> dict[str, Case]:
    if not _CASES:
        _CASES.update({case.name: case for case in read_table()})
    return _CASES


def stamp(row: str) -> str:
    """Return a hash of the present sources and of the table's row; empty for an unknown row."""
    case = _cases().get(row)
    return "" if case is None else f"{SOURCES}+{hashlib.blake2b(repr(case).encode(), digest_size=4).hexdigest()}"


def read(path: Path) -> list[dict[str, Any]]:
    """Return the lines of the present sources and rows; none without a file."""
    return [line for line in _stored(path) if line["sources"] == stamp(line["row"])]


def _stored(path: Path) -> list[dict[str, Any]]:
    """Return the lines of all sources; none without a file."""
    if not path.exists():
        return []
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def _key(line: Mapping[str, Any]) -> tuple[str, str, str, str]:
    return line["row"], line["effects"], line["integrator"], line["preset"]


def write(path: Path, lines: Sequence[dict[str, Any]]) -> None:
    """Write the lines in the order of the table. Stored lines of older sources stay until they are measured again."""
    place = {job.key: index for index, job in enumerate(jobs(list(_cases().values())))}
    newest = {_key(line): line for line in [*_stored(path), *lines]}
    ordered = [newest[key] for key in sorted(newest.keys() & place.keys(), key=place.__getitem__)]
    with path.open("w", newline="", encoding="utf-8") as file:
        table = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        table.writeheader()
        table.writerows(ordered)


def measure(path: Path, processes: int, some: Sequence[str] = (), beside: Callable[[], None] | None = None) -> None:
    """Make all runs that are not in the file, then all repeats on two threads; those of some rows only, if named.

    beside: something else to be done in one of the processes.
    """
    wanted = [job for job in jobs(list(_cases().values())) if not some or job.row in some]
    lines = read(path)
    found = {_key(line) for line in lines}
    todo = [job for job in wanted if job.key not in found]
    try:
        _in_processes(todo, lines, path, processes, beside)
        _on_two_threads(lines, path)
    finally:
        write(path, lines)


def _in_processes(
    todo: Sequence[Job], lines: list[dict[str, Any]], path: Path, processes: int, beside: Callable[[], None] | None
) -> None:
    # One run of each combination of effects compiles for all others, and two at a time never the same.
    first: dict[tuple[str, str, str], Job] = {}
    for job in todo:
        special = job.row in ("glass_impact_hertz", "paper_plant")
        first.setdefault((job.effects, job.integrator, job.row if special else ""), job)
    ordered = [*first.values(), *(job for job in todo if job not in set(first.values()))]
    with (
        ProgressBar("stability", len(todo), counted="runs") as bar,
        ProcessPoolExecutor(processes, get_context("spawn")) as pool,
    ):
        other = [pool.submit(beside)] if beside is not None else []
        pending = [pool.submit(make, job) for job in ordered]
        try:
            bar.update(0)
            for done, finished in enumerate(as_completed(pending), 1):
                lines.append(finished.result())
                if done % 20 == 0:
                    write(path, lines)
                bar.update(done)
            for future in other:
                future.result()
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            for child in active_children():
                child.terminate()
            raise


def _on_two_threads(lines: list[dict[str, Any]], path: Path) -> None:
    todo = [line for line in lines if line["hash"] and not line["two_threads"]]
    with ProgressBar("on two threads", len(todo), counted="runs") as bar:
        for done, line in enumerate(todo):
            bar.update(done)
            line["two_threads"] = again(line)
            if done % 20 == 19:
                write(path, lines)
        bar.update(len(todo))
