# SPDX-License-Identifier: Apache-2.0
"""The long run: `make fuzz ARGS="--minutes 60"`. The targets in turn, each portion in a process of its own."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from itertools import count
from pathlib import Path
from typing import Any

from conveyor_sim.support.interrupt import one_line, while_importing

with while_importing():
    import click
    from fuzz.attack import TARGETS, attack_of
    from fuzz.case import load_case
    from fuzz.play import play
    from fuzz.report import Figures
    from fuzz.worker import CURRENT, RESULT
    from rich.console import Console

    from conveyor_sim.bag.recorder import new_run_folder
    from conveyor_sim.support.progress import ProgressBar

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs" / "stability"

SCENES = "scenes"
"""The target that draws scenes and commands with Hypothesis; the others are those of `targets/`."""
SHARE = 150.0
"""s for one portion, what it takes to compile its kernels included."""
BUSY, SILENCE = 300.0, 1800.0
"""s of a core, and of wall time, without a new case after which a process is taken to hang. A mixture compiles in a
third of the former; the latter is for what waits for ever, on a machine however busy."""


@click.command()
@one_line()
@click.option("--minutes", default=10.0, show_default=True, help="How long, wall time.")
@click.option("--seed", default=0, show_default=True, help="Of the first portion; the next has the next seed.")
@click.option(
    "--target",
    "targets",
    type=click.Choice([SCENES, *TARGETS]),
    multiple=True,
    help="What to attack; repeatable (default: everything in turn).",
)
@click.option("--jobs", type=click.IntRange(1), default=1, show_default=True, help="Processes side by side.")
@click.option("--again", help="Play one case again: a scene file, or TARGET:SEED as a failure names it.")
@click.option("--docs", is_flag=True, help="Renew docs/stability/fuzz.json and fuzz.md.")
def main(minutes: float, seed: int, targets: tuple[str, ...], jobs: int, again: str | None, docs: bool) -> None:
    """Play random cases, look for what must never happen, and keep each kind of failure with a way to play it again."""
    if again is not None:
        click.echo(_again(again))
        return
    folder, figures = new_run_folder(ROOT / "runs" / "fuzz"), Figures(seed)
    console = Console(file=sys.stderr, markup=False, highlight=False)
    hunt = _Hunt(targets or (SCENES, *TARGETS), seed, folder, figures, console, until=time.monotonic() + 60.0 * minutes)
    begin = time.monotonic()
    with ThreadPoolExecutor(jobs) as pool, ProgressBar("fuzzing", minutes, console, counted="minutes") as bar:
        running = [pool.submit(hunt.run) for _ in range(jobs)]
        try:
            while not all(one.done() for one in running):
                time.sleep(0.5)
                past = time.monotonic() - begin
                bar.update(past / 60.0, left=max(60.0 * minutes - past, 0.0))
        finally:
            hunt.stop()
    for one in running:
        one.result()
    figures.minutes = (time.monotonic() - begin) / 60.0
    figures.write(folder)
    if docs:
        figures.write(DOCS)
    click.echo(figures.markdown())
    click.echo(f"{folder}: figures, and each failure with the way to play it again")
    sys.exit(1 if figures.failures else 0)


def _again(case: str) -> str:
    target, colon, number = case.rpartition(":")
    if colon and target in TARGETS and number.isdigit():
        with tempfile.TemporaryDirectory() as folder:
            return attack_of(target)(int(number), Path(folder))
    if not Path(case).is_file():
        raise click.BadParameter(f"{case!r} given, expected a scene file or one of {', '.join(TARGETS)} with :SEED")
    return str(play(load_case(Path(case))))


class _Hunt:
    """The portions of a long run; several threads may take them at once."""

    def __init__(
        self, targets: tuple[str, ...], seed: int, folder: Path, figures: Figures, console: Console, until: float
    ) -> None:
        self._folder, self._figures, self._console, self._until = folder, figures, console, until
        self._portions = ((target, number) for number in count(seed) for target in targets)
        self._lock = threading.Lock()  # of the portions and the figures
        self._stopped = False

    def stop(self) -> None:
        """Ends the processes under way, for an interrupt."""
        self._stopped = True

    def run(self) -> None:
        """Plays portion after portion until the time is over."""
        while (left := self._until - time.monotonic()) > 0.0 and not self._stopped:
            with self._lock:
                target, number = next(self._portions)
                known = json.dumps(sorted(self._figures.files))
            self._portion(target, number, min(SHARE, left), known)

    def _portion(self, target: str, number: int, seconds: float, known: str) -> None:
        """Runs the process of a portion; what it found goes into the figures, and new failures are shown."""
        place = self._folder / f"{target}_{number}"
        place.mkdir()
        worker = ["fuzz.worker"] if target == SCENES else ["fuzz.attack", target]
        arguments = [sys.executable, "-m", *worker, str(number), str(seconds), str(place), known]
        with (place / "output.txt").open("w") as output:
            process = subprocess.Popen(arguments, stdout=output, stderr=subprocess.STDOUT)
            try:
                hanging = self._wait(process, place)
            finally:
                process.kill()
                process.wait()
        if self._stopped:
            return
        with self._lock:
            before = set(self._figures.files)
            if (result := place / RESULT).exists():
                tally: dict[str, Any] = json.loads(result.read_text(encoding="utf-8"))
                self._figures.add(tally)
            if hanging or process.returncode != 0:
                kind = f"{target}: {'hang' if hanging else f'crash, exit status {process.returncode}'}"
                self._figures.crashed(kind, self._keep(place, f"{kind} of {number}"))
            for kind, file in self._figures.files.items():
                if kind not in before:
                    self._console.print(f"{target} {number}: {kind}: {file}")

    def _wait(self, process: subprocess.Popen[bytes], place: Path) -> bool:
        """Waits for the end of a process; whether it came to no new case for too long instead."""
        current = place / f"{CURRENT}.yaml"
        case, since, used = 0.0, time.monotonic(), 0.0
        while process.poll() is None and not self._stopped:
            time.sleep(0.5)
            began = current.stat().st_mtime if current.exists() else 0.0
            if began != case:
                case, since, used = began, time.monotonic(), _core_seconds(process.pid)
            elif time.monotonic() - since > SILENCE or _core_seconds(process.pid) - used > BUSY:
                return True
        return False

    def _keep(self, place: Path, name: str) -> Path:
        """Keeps the case that a process was at when it ended."""
        stem = "_".join("".join(c if c.isalnum() else " " for c in name).split())
        for suffix in (".yaml", ".script.yaml"):
            if (file := place / f"{CURRENT}{suffix}").exists():
                (self._folder / f"{stem}{suffix}").write_bytes(file.read_bytes())
        return self._folder / f"{stem}.yaml"


def _core_seconds(process: int) -> float:
    """CPU time of a process, s; 0 if it has ended."""
    try:
        fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return 0.0
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")  # utime and stime, proc(5)


if __name__ == "__main__":
    main()
