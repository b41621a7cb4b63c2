# SPDX-License-Identifier: Apache-2.0
"""Metrics of a run, by their names in a study."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from conveyor_sim.columns.counters import LINE
from conveyor_sim.errors import StudyError
from conveyor_sim.scene.words import shown
from conveyor_sim.simulation import Simulation
from conveyor_sim.studies import gauges
from conveyor_sim.studies.code import function
from conveyor_sim.studies.gauges import Gauge

Needs = Callable[[Mapping[str, Any]], dict[str, Any]]
"""From the plain data of a scene to what is to be laid over it."""

BOTTLES_RATE = 50.0
"""Hz, about, at which bottles are output where a scene has no rate: peaks are the largest since the last output."""


@dataclass(frozen=True)
class Metric:
    """One number that is kept of each run."""

    make: Callable[[Simulation], Gauge]
    """Called as the warm-up ends. Raises StudyError on a line that has not what it is of."""
    unit: str
    """"1": it has no dimension; "": as the tag has it."""
    needs: Needs
    series: Callable[[Simulation], Gauge] | None = None
    """Made anew for each part of a pilot run: its values are the series by which the end of a warm-up is seen. None: it
    is no mean or rate that settles.
    """


@dataclass(frozen=True)
class _Word:
    description: str
    unit: str
    make: Callable[[Simulation, str], Gauge]
    of: str
    """Argument that may or must follow: "" none, "[device]", "[machine]", "tag"."""
    needs: Needs = lambda _data: {}
    series: Callable[[Simulation, str], Gauge] | None = None


def _peaks(data: Mapping[str, Any]) -> dict[str, Any]:
    needed: dict[str, Any] = {"effects": {"peaks": "on"}}
    tick, outputs = float(data.get("tick", 0.01)), data.get("outputs") or {}
    if outputs.get("bottles") == 0.0:
        needed["outputs"] = {"bottles": 1.0 / (tick * max(1, round(1.0 / (BOTTLES_RATE * tick))))}
    return needed


def _scuffing(data: Mapping[str, Any]) -> dict[str, Any]:
    return {"effects": {"scuffing": "on"}}


def _counter(column: str) -> Callable[[Simulation, str], Gauge]:
    return lambda simulation, device: gauges.Counted(simulation, device or LINE, column)


def _mean(simulation: Simulation, tag: str) -> Gauge:
    return gauges.MeanOfTag(simulation, tag)


def _tag(take: str) -> Callable[[Simulation, str], Gauge]:
    return lambda simulation, tag: gauges.OfTag(simulation, tag, take)


WORDS: Mapping[str, _Word] = {
    "efficiency": _Word(
        "OEE of the line, or of a device",
        "1",
        _counter("oee"),
        "[device]",
        series=gauges.Throughput,  # OEE is none where nothing is made
    ),
    "availability": _Word("time running / planned busy time", "1", _counter("availability"), "[device]"),
    "effectiveness": _Word(
        "completed cycles / (fastest permitted rate x time running)", "1", _counter("effectiveness"), "[device]"
    ),
    "quality": _Word("good / processed bottles", "1", _counter("quality"), "[device]"),
    "throughput": _Word(
        "bottles a minute that leave the line by a sink or an outfeed, or that a device processes",
        "1/min",
        gauges.Throughput,
        "[device]",
        series=gauges.Throughput,
    ),
    "failures": _Word("failures of the bottleneck, or of a machine", "1", _counter("failures"), "[machine]"),
    "stops": _Word(
        "number of stops of all machines, or of one machine, for any reason", "1", gauges.Stops, "[machine]"
    ),
    "peak_force": _Word(
        "largest normal contact force", "N", lambda simulation, _of: gauges.PeakForce(simulation), "", _peaks
    ),
    "scuffing": _Word(
        "sliding work at the wall of a bottle, mean over bottles that have left the line; on a line that none leaves, "
        "what those on it have taken",
        "J",
        lambda simulation, _of: gauges.Scuffing(simulation),
        "",
        _scuffing,
    ),
    "mean": _Word("mean of a tag over all ticks", "", _mean, "tag", series=_mean),
    "maximum": _Word("its largest value", "", _tag("maximum"), "tag"),
    "minimum": _Word("its smallest value", "", _tag("minimum"), "tag"),
    "last": _Word("its value at the end", "", _tag("last"), "tag"),
    "change": _Word("its value at the end less that at the end of the warm-up", "", _tag("change"), "tag"),
    "quantile": _Word(
        "its quantile over all ticks, such as `quantile 0.95 <tag>`",
        "",
        gauges.Quantile,
        "number tag",
        series=gauges.Quantile,
    ),
}
"""By the first word."""


def metric_of(what: str) -> Metric:
    """Return the metric of a text: a word of WORDS with its argument, or a function. Raise StudyError."""
    first, _, rest = what.strip().partition(" ")
    rest = rest.strip()
    if ":" in first and not rest:
        made = function(first)
        return Metric(
            lambda simulation: gauges.OfFunction(simulation, made), str(getattr(made, "unit", "1")), lambda _data: {}
        )
    word = WORDS.get(first)
    if word is None:
        raise StudyError(f"{shown(what)} given, expected {', '.join(WORDS)} or file.py:function")
    if word.of.endswith("tag") and not rest:
        raise StudyError(f"{shown(what)} given, expected {first} <{word.of}>")
    if not word.of and rest:
        raise StudyError(f"{shown(what)} given, expected {first} with nothing behind it")
    if first == "quantile":
        gauges.share_of(rest)
    series = word.series
    return Metric(
        lambda simulation: word.make(simulation, rest),
        word.unit,
        word.needs,
        None if series is None else lambda simulation: series(simulation, rest),
    )
