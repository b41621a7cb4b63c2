# SPDX-License-Identifier: Apache-2.0
"""Cost of each effect of a scene: one state advanced with and without the effect, in turn, in one run."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from statistics import median

from conveyor_sim.errors import ConveyorError, SimulationError
from conveyor_sim.physics.effects.choice import EFFECTS
from conveyor_sim.physics.model import Model
from conveyor_sim.physics.model.remedies import step_limit, with_remedy
from conveyor_sim.scene import Scene, parse_again, parse_overrides
from conveyor_sim.scene.accuracy import explicit
from conveyor_sim.simulation import Simulation

CHUNK = 0.05
"""s that one measurement takes: long against a switch of tasks, short against slow drifts."""

ROUNDS = 15

CONFIDENCE = 0.95

ALL = "all of these"
"""Stands for an effect's name where all that can be are off."""

Progress = Callable[[float, float], None]
"""Called with what is done so far and the whole."""


@dataclass(frozen=True)
class Price:
    """Cost of one effect, ns per bottle and step: the median of the differences of paired measurements."""

    effect: str
    takes_along: tuple[str, ...]
    """Effects that are off without it, too."""
    on: float
    off: float
    cost: float
    low: float
    """The true median lies between `low` and `high` with CONFIDENCE, for any distribution of the noise."""
    high: float

    @property
    def certain(self) -> bool:
        """Return True if the cost is significantly different from zero."""
        return self.low > 0.0 or self.high < 0.0


@dataclass(frozen=True)
class PriceList:
    """Prices of a scene at one moment of its run, the dearest first."""

    time: float
    """s, simulated, of the state that was measured."""
    bottles: int
    full: float
    """ns per bottle and step with every effect that is on."""
    prices: tuple[Price, ...]
    together: Price | None
    """All of them off at once; prices overlap, so it is not their sum. None if there are none."""
    failed: dict[str, str]
    """Effects that the scene does not run without, and what happened."""
    fixed: tuple[str, ...]
    """Effects that are on and can't be forced off."""
    confidence: float = CONFIDENCE


@dataclass(frozen=True)
class Gain:
    """Speed-up by a remedy (`physics/model/remedies.py`): time of one tick without it over time with it."""

    words: str
    steps: int
    """In a tick with it."""
    faster: float
    """Times; the median of paired measurements. Below 1 it is slower."""
    low: float
    """Between `low` and `high` lies the true median with CONFIDENCE."""
    high: float

    @property
    def sentence(self) -> str:
        """All of it."""
        span = f"{CONFIDENCE:.0%} within {self.low:.2g} .. {self.high:.2g}"
        return f"{self.words}: {self.steps} steps a tick, measured {self.faster:.2g} times as fast ({span})"


@dataclass(frozen=True)
class _Variant:
    name: str
    simulation: Simulation
    takes_along: tuple[str, ...]


class Pricing:
    """Runs a scene to a warm state, then prices every effect that is on and can be forced off.

    To be called in this order: `warm_up`, `prepare`, `measure`, `gains`; each reports its progress. Every variant takes
    the steps a tick that the scene has as it is, but those of `gains`. SceneError or SimulationError if the scene does
    not run.
    """

    def __init__(self, scene: Scene, at: float | None = None) -> None:
        """at: simulated time of the warm state, s; None: half of the duration."""
        self._scene = scene
        self._ticks = max(1, round((0.5 * scene.duration if at is None else at) / scene.tick))
        self._warm = Simulation(scene, threads=1, shorten=False)
        self._full = Simulation(_variant(scene, self._warm.model, []), threads=1, shorten=False)
        self._variants: list[_Variant] = []
        self._failed: dict[str, str] = {}

    def warm_up(self, progress: Progress) -> None:
        """Run to the state that is measured; progress in simulated time, s. Raise ConveyorError if it has no bottle."""
        for tick in range(self._ticks):
            self._warm.advance()
            progress((tick + 1) * self._scene.tick, self._ticks * self._scene.tick)
        if self._warm.counts.present == 0:
            raise ConveyorError(f"at {self._warm.time:g} s: no bottle on the line, expected --at a time with bottles")

    def prepare(self, progress: Progress) -> None:
        """Compile the scene without each effect, and without any of them; progress in variants."""
        model = self._warm.model
        removable = _removable(model)
        wanted = [*((name, [name]) for name in removable), (ALL, removable)] if removable else []
        self._full.restore_from(self._warm)
        self._full.advance()
        for done, (name, off) in enumerate(wanted):
            progress(done, len(wanted))
            simulation = Simulation(_variant(self._scene, model, off), threads=1, shorten=False)
            simulation.restore_from(self._warm)
            try:
                simulation.advance()
            except SimulationError as error:
                self._failed[name] = str(error)
                continue
            gone = [choice.name for choice in model.effects if choice.on and not simulation.model.has(choice.name)]
            self._variants.append(_Variant(name, simulation, tuple(other for other in gone if other not in off)))
        progress(len(wanted), len(wanted))

    def measure(self, progress: Progress, rounds: int = ROUNDS) -> PriceList:
        """Measure the costs; `progress` counts measurements."""
        full, warm = self._full, self._warm
        ticks = _ticks_of(full, warm)
        measured: dict[str, list[tuple[float, float]]] = {variant.name: [] for variant in self._variants}
        for count in range(rounds):
            for index, variant in enumerate(self._variants):
                if (count + index) % 2 == 0:
                    with_it, without = _measure(full, warm, ticks), _measure(variant.simulation, warm, ticks)
                else:
                    without, with_it = _measure(variant.simulation, warm, ticks), _measure(full, warm, ticks)
                measured[variant.name].append((with_it, without))
                progress(count * len(self._variants) + index + 1, rounds * len(self._variants))
        prices = [_price(variant, measured[variant.name]) for variant in self._variants]
        return PriceList(
            time=warm.time,
            bottles=warm.counts.present,
            full=median([price.on for price in prices]) if prices else _measure(full, warm, ticks),
            prices=tuple(sorted((price for price in prices if price.effect != ALL), key=lambda price: -price.cost)),
            together=next((price for price in prices if price.effect == ALL), None),
            failed=self._failed,
            fixed=tuple(
                choice.name for choice in warm.model.effects if choice.on and choice.name not in _removable(warm.model)
            ),
        )

    def gains(self, progress: Progress, rounds: int = ROUNDS) -> tuple[Gain, ...]:
        """Measure the gains of the scene's remedies, after `warm_up`; `progress` counts measurements."""
        found, remedies = [], step_limit(self._scene).remedies
        for index, remedy in enumerate(remedies):
            simulation = Simulation(with_remedy(self._scene, remedy.overrides), threads=1, shorten=False)
            ticks = min(_ticks_of(self._full, self._warm), _ticks_of(simulation, self._warm))
            ratios = []
            for count in range(rounds):
                times = [_run(one, self._warm, ticks)[0] for one in (self._full, simulation)[:: 1 if count % 2 else -1]]
                before, after = times if count % 2 else times[::-1]
                ratios.append(before / after)
                progress(index * rounds + count + 1, len(remedies) * rounds)
            ratios.sort()
            rank = _rank(rounds)
            found.append(Gain(remedy.words, remedy.steps, median(ratios), ratios[rank], ratios[-1 - rank]))
        return tuple(found)


def _removable(model: Model) -> list[str]:
    can = {effect.name for effect in EFFECTS if effect.can_force_off}
    return [choice.name for choice in model.effects if choice.on and choice.name in can]


def _variant(scene: Scene, model: Model, off: Sequence[str]) -> Scene:
    """Return the scene without some effects, at the number of steps per tick that it has with them."""
    overrides = parse_overrides(scene.overrides_text)
    overrides["effects"] = {**scene.effects, **dict.fromkeys(off, "off")}
    overrides["accuracy"] = explicit(model.integrator, model.steps_per_tick, scene.accuracy.error)
    return parse_again(scene.source_text, scene.source_name, overrides)


def _ticks_of(simulation: Simulation, warm: Simulation) -> int:
    """Ticks that take about CHUNK, at least one."""
    ticks = 1
    while True:
        spent = _run(simulation, warm, ticks)[0]
        if spent >= 0.5 * CHUNK:
            return max(1, round(ticks * CHUNK / spent))
        ticks *= 2


def _measure(simulation: Simulation, warm: Simulation, ticks: int) -> float:
    """Return the time of some ticks from the warm state, in ns per bottle and step."""
    spent, bottle_ticks = _run(simulation, warm, ticks)
    return spent * 1e9 / (max(1.0, bottle_ticks) * simulation.model.steps_per_tick)


def _run(simulation: Simulation, warm: Simulation, ticks: int) -> tuple[float, float]:
    """Time (s) of some ticks from the warm state with the columns that are output, and the bottles over them.

    Time of this thread, which takes all the steps: another program on the core is not an effect's price.
    """
    simulation.restore_from(warm)
    simulation.advance()  # what a new state costs once, such as lists and cold memory, is not an effect's price
    before = simulation.counts.present
    start = time.thread_time()
    for _ in range(ticks):
        simulation.advance()
        if simulation.due("bottles"):
            simulation.bottles()
        if simulation.due("contacts"):
            simulation.contacts()
    spent = time.thread_time() - start
    return spent, 0.5 * (before + simulation.counts.present) * ticks


def _price(variant: _Variant, pairs: Sequence[tuple[float, float]]) -> Price:
    differences = sorted(with_it - without for with_it, without in pairs)
    rank = _rank(len(differences))
    return Price(
        effect=variant.name,
        takes_along=variant.takes_along,
        on=median([with_it for with_it, _ in pairs]),
        off=median([without for _, without in pairs]),
        cost=median(differences),
        low=differences[rank],
        high=differences[-1 - rank],
    )


def _rank(count: int) -> int:
    """Return how many of `count` sorted values a median interval of CONFIDENCE leaves out at each end (sign test)."""
    rank, outside = 0, 2.0 * 0.5**count
    while rank + 1 < count // 2:
        outside += 2.0 * math.comb(count, rank + 1) * 0.5**count
        if outside > 1.0 - CONFIDENCE:
            break
        rank += 1
    return rank
