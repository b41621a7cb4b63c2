# SPDX-License-Identifier: Apache-2.0
"""Figures of a long run, as JSON and as a table."""

from __future__ import annotations

import json
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from conveyor_sim import __version__

BEGIN, END = "<!-- figures -->\n", "<!-- end: figures -->"


@dataclass
class Figures:
    """Sums over the families of a run."""

    seed: int
    minutes: float = 0.0
    families: int = 0
    simulated: float = 0.0
    """s, all runs of all cases together."""
    largest: int = 0
    """Bottles in one case."""
    counts: Counter[str] = field(default_factory=Counter)
    integrators: Counter[str] = field(default_factory=Counter)
    """Cases that ran, by integrator."""
    stopped: Counter[str] = field(default_factory=Counter)
    """Cases that ended with a SimulationError, by kind of sentence."""
    failures: Counter[str] = field(default_factory=Counter)
    """By kind."""
    files: dict[str, str] = field(default_factory=dict)
    """The smallest case of each kind of failure."""
    attacks: dict[str, Counter[str]] = field(default_factory=dict)
    """Cases by what came of them, for each target of `targets/`."""

    def add(self, tally: dict[str, Any]) -> None:
        """Adds what one portion came to: a family of scenes, or seeds of a target."""
        self.failures += Counter(tally["failures"])
        self.files |= tally["shrunk"]
        if (target := tally.get("target")) is not None:
            self.attacks[target] = self.attacks.get(target, Counter()) + Counter(tally["counts"])
            return
        self.families += 1
        self.simulated += tally["simulated"]
        self.largest = max(self.largest, tally["largest"])
        self.counts += Counter(tally["counts"])
        self.integrators[tally["integrator"]] += tally["counts"].get("run", 0)
        self.stopped += Counter(tally["stopped"])

    def crashed(self, kind: str, file: Path) -> None:
        """Adds a process that ended before its time."""
        self.failures[kind] += 1
        self.files.setdefault(kind, str(file))

    def markdown(self) -> str:
        """A table, and the failures by kind."""
        counts = self.counts
        tried = sum(counts[how] for how in ("run", "refused", "stopped", "too long", "failed"))
        rows = [("wall time", f"{self.minutes:.0f} min")]
        scenes = [
            ("seeds", f"{self.seed} to {self.seed + max(self.families, 1) - 1}"),
            ("mixtures of effects and integrator", f"{self.families}"),
            ("scenes tried", f"{tried:,}"),
            ("run as they should", f"{counts['run']:,}"),
            ("refused by SceneError", f"{counts['refused']:,}"),
            ("stopped by SimulationError", f"{counts['stopped']:,}"),
            ("left out, a tick being too long", f"{counts['too long']:,}"),
            ("failed", f"{counts['failed']:,}"),
            ("scene files put wrong", f"{counts['texts refused'] + counts['texts taken']:,}, "
             f"{counts['texts refused']:,} of them refused in words"),
            ("simulated time, replays included", f"{self.simulated:,.0f} s"),
            ("ticks", f"{counts['ticks']:,}"),
            ("bottles", f"{counts['bottles']:,}, at most {self.largest} in one scene"),
            ("bottles x ticks checked", f"{counts['bottle_ticks']:,}"),
            ("bags replayed", f"{counts['replayed']:,}"),
        ]  # fmt: skip
        if self.families:
            rows += scenes
        lines = ["| | |", "| --- | --- |", *(f"| {name} | {value} |" for name, value in rows), ""]
        lines += [f"- {target}: {_said(counts)}" for target, counts in sorted(self.attacks.items())]
        lines += [f"- {number} stopped: {kind}" for kind, number in self.stopped.most_common()]
        lines += [f"- {number} **failed**: {kind}" for kind, number in self.failures.most_common()]
        return "\n".join(lines).rstrip() + "\n"

    def write(self, folder: Path) -> None:
        """Writes fuzz.json, and renews the table of fuzz.md, which is begun where there is none."""
        folder.mkdir(parents=True, exist_ok=True)
        kept = {name: value for name, value in self.__dict__.items() if name != "files"}
        data = {
            "version": __version__,
            **kept,
            "minutes": round(self.minutes, 1),
            "simulated": round(self.simulated, 1),
        }
        (folder / "fuzz.json").write_text(json.dumps(data, indent=1) + "\n", encoding="utf-8")
        page = folder / "fuzz.md"
        before, _, rest = (page.read_text(encoding="utf-8") if page.exists() else f"{BEGIN}{END}\n").partition(BEGIN)
        page.write_text(f"{before}{BEGIN}\n{self.markdown()}\n{END}{rest.partition(END)[2]}", encoding="utf-8")


def _said(counts: Counter[str]) -> str:
    kinds = ", ".join(f"{number:,} {kind}" for kind, number in counts.most_common())
    return f"{counts.total():,} cases: {kinds}"
