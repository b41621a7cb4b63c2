# SPDX-License-Identifier: Apache-2.0
"""Performance targets of the engine, beside the measurements."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from bench import (
    accuracy,
    bodies,
    compiling,
    control,
    dense,
    filler_block,
    growth,
    impulses,
    isolation,
    lockstep,
    node,
    plant,
    start,
    structured_text,
    studies,
    view,
    whole,
)
from bench.markdown import table as markdown
from bench.measure import RATE
from bench.rows import Rows, Spread

LEAST, MOST = "at least", "at most"


@dataclass(frozen=True)
class Target:
    """A bound on one figure."""

    what: str
    part: str
    bound: str
    """LEAST or MOST."""
    value: float
    figure: Callable[[Rows], float | None]
    """None if it wasn't measured."""

    def line(self, parts: Mapping[str, Rows]) -> list[str | None]:
        """For the table."""
        found = self.figure(parts[self.part])
        wanted = f"{self.bound} {self.value:g}"
        if found is None:
            return [self.what, wanted, None, "not measured"]
        reached = found >= self.value if self.bound == LEAST else found <= self.value
        return [self.what, wanted, f"{found:.3g}", "reached" if reached else "**not reached**"]


def _ratio(n: float, one: str, other: str) -> Callable[[Rows], float | None]:
    return lambda rows: _middle(rows.ratio(dense.CASE, n, one, other, RATE))


def _plant(contestant: str) -> Callable[[Rows], float | None]:
    return lambda rows: _middle(rows.spread(plant.CASE, 0, contestant, plant.FACTOR))


def _swept(n: float, steps: int, sweeps: int, quantity: str) -> Callable[[Rows], float | None]:
    return lambda rows: _middle(rows.spread(impulses.CASE, n, impulses.name_of(steps, sweeps), quantity))


def _first_step(rows: Rows) -> float | None:
    return _middle(rows.spread(start.CASE, 0, start.CACHED, start.SECONDS))


def _node(rows: Rows) -> float | None:
    return _middle(rows.spread(node.CASE, 1_000, node.REAL_TIME, node.OVERHEAD))


def _control(contestant: str, quantity: str) -> Callable[[Rows], float | None]:
    return lambda rows: _middle(rows.spread(control.CASE, 0, contestant, quantity))


def _eyes(rows: Rows) -> float | None:
    many, few = (control.eyes_name(number) for number in (control.MANY, control.FEW))
    return _middle(rows.ratio(control.CASE, 0, many, few, control.WHOLE))


def _compile(name: str) -> Callable[[Rows], float | None]:
    return lambda rows: compiling.of_before(rows, name)


def _accuracy(scene: str, quantity: str) -> Callable[[Rows], float | None]:
    return lambda rows: _middle(rows.spread(accuracy.CASE, 0, scene, quantity))


def _lockstep(quantity: str) -> Callable[[Rows], float | None]:
    return lambda rows: _middle(rows.spread(lockstep.CASE, 0, lockstep.SCENE, quantity))


def _evidence(rows: Rows) -> float | None:
    ratio = _middle(rows.ratio(control.CASE, 0, control.WITH_EVIDENCE, control.DOWNSTREAM_STOP, control.WHOLE))
    return None if ratio is None else ratio - 1.0


def _whole(command: str) -> Callable[[Rows], float | None]:
    return lambda rows: _middle(rows.spread(whole.CASE, 0, command, whole.WALL))


def _view(case: str, n: float, contestant: str, quantity: str) -> Callable[[Rows], float | None]:
    return lambda rows: _middle(rows.spread(case, n, contestant, quantity))


def _two_processes(rows: Rows) -> float | None:
    return _middle(rows.ratio(studies.SCALING, 0.0, studies.TWO, studies.ONE, studies.RATE))


def _beside(rows: Rows) -> float | None:
    return _middle(rows.spread(studies.BESIDE, 0.0, studies.ONE, studies.OVERHEAD))


def _attacked(quantity: str) -> Callable[[Rows], float | None]:
    """Return a function that gives the greatest value over all attacks and all measured servers."""

    def figure(rows: Rows) -> float | None:
        attacks = {row.contestant for row in rows.all} - {isolation.NONE}
        names = [f"{name}: {quantity}" for name in isolation.SERVED]
        values = [_middle(rows.spread(isolation.CASE, 0, attack, name)) for attack in attacks for name in names]
        return max((value for value in values if value is not None), default=None)

    return figure


def _scan(rows: Rows) -> float | None:
    return _middle(rows.spread(structured_text.CASE, structured_text.STATEMENTS, "program", structured_text.SCAN))


def _compiling(rows: Rows) -> float | None:
    spread = rows.spread(structured_text.COMPILED, structured_text.LARGE, "program", structured_text.COMPILE)
    return _middle(spread)


def _middle(spread: Spread | None) -> float | None:
    return None if spread is None else spread.middle


def _rise(case: str, least: float, most: float) -> Callable[[Rows], float | None]:
    """Return the most expensive over the cheapest bottle-step within a range, minus one."""

    def figure(rows: Rows) -> float | None:
        found = [growth.nanoseconds(rows, case, n) for n in rows.ns(case) if least <= n <= most]
        costs = [cost.middle for cost in found if cost is not None]
        return max(costs) / min(costs) - 1.0 if len(costs) > 1 else None

    return figure


def _same_bits(rows: Rows) -> float | None:
    found = [row.value for row in rows.all if row.quantity == dense.SAME_BITS]
    return min(found) if found else None


PAPER, PAPER_2 = dense.name_of("paper", 1), dense.name_of("paper", 2)
EVERYTHING = dense.name_of("everything", 1)

TARGETS = (
    *(
        Target(f"paper's effects over LAMMPS, one thread, N = {n}", "dense", LEAST, v, _ratio(n, PAPER, dense.LAMMPS))
        for n, v in ((100, 5.0), (1_000, 6.0), (10_000, 6.0))
    ),
    *(
        Target(f"everything over LAMMPS, one thread, N = {n}", "dense", LEAST, 3.0, _ratio(n, EVERYTHING, dense.LAMMPS))
        for n in (100, 1_000, 10_000)
    ),
    *(
        Target(f"paper's effects over NumPy all pairs, N = {n}", "dense", LEAST, v, _ratio(n, PAPER, dense.ALL_PAIRS))
        for n, v in ((100, 80.0), (1_000, 500.0))
    ),
    *(
        Target(f"second thread, paper's effects, N = {n}", "dense", LEAST, v, _ratio(n, PAPER_2, PAPER))
        for n, v in ((1_000, 1.5), (10_000, 1.6))
    ),
    Target("the same bits on two threads (1: yes)", "dense", LEAST, 1.0, _same_bits),
    Target("paper's plant, times real time", "plant", LEAST, 25.0, _plant(plant.PAPER)),
    Target(
        "plant of glass, 1e8 N/m, 20 steps, times real time", "plant", LEAST, 3.0, _plant(plant.glass_name(1e8, 20))
    ),
    *(
        Target(
            f"glass by impulses, {steps} x {sweeps}, N = {n}, {quantity}",
            "impulses",
            bound,
            value,
            _swept(n, steps, sweeps, quantity),
        )
        for n, steps, sweeps, quantity, bound, value in (
            (1_000, 8, 2, impulses.SPEED, LEAST, 8_000.0),
            (1_000, 8, 1, impulses.SPEED, LEAST, 15_000.0),
            (1_000, 8, 2, impulses.OVERLAP, MOST, 0.3),
            (10_000, 8, 2, impulses.SPEED, LEAST, 7_000.0),
            (10_000, 8, 2, impulses.TWO, LEAST, 1.5),
            (1_000, 8, 2, impulses.CHOSEN, LEAST, 1.0),
            (10_000, 8, 2, impulses.CHOSEN, LEAST, 1.0),
        )
    ),
    Target("rise of the cost from N = 100 to 10 000", "growth", MOST, 0.25, _rise(growth.BOTTLES, 100, 10_000)),
    Target("rise of the cost from 1 to 1 000 belts", "growth", MOST, 0.15, _rise(growth.BELTS, 1, 1_000)),
    Target("rise of the cost from 1 to 1 000 rails", "growth", MOST, 0.15, _rise(growth.RAILS, 1, 1_000)),
    Target("rise of the cost from 1 to 160 closed gates at a distance", "bodies", MOST, 0.05, bodies.rise),
    Target("us that a turning star wheel adds to a tick of 12 bottles", "bodies", MOST, 40.0, bodies.wheel_cost),
    Target(
        "filler block at 24 000 bottles an hour, slowest period, times real time",
        "filler_block",
        LEAST,
        1.0,
        filler_block.slowest,
    ),
    Target("s to the first step, cached", "start", MOST, 1.0, _first_step),
    *(
        Target(f"first tick from an empty cache, {name}, of that before", "compile", MOST, v, _compile(name))
        for name, v in (
            *((first, 0.5) for first in compiling.FIRST),
            *((later, 0.25) for later in (compiling.SECOND, compiling.THIRD)),
        )
    ),
    Target("cores of the node beside the kernels, N = 1 000, 50 Hz, real time", "node", MOST, 0.1, _node),
    *(
        Target(f"{line}, {quantity}", "control", bound, value, _control(line, quantity))
        for quantity, bound, riding, values in (
            (control.FACTOR, LEAST, True, (150.0, 150.0, 85.0, 150.0)),
            (control.FACTOR, LEAST, False, (105.0, 150.0, 85.0, 150.0)),
            (control.OUTSIDE, MOST, False, (30.0, 30.0, 30.0, 30.0)),
        )
        for name, value in zip(control.LINES, values, strict=True)
        for line in (control.line_name(name, riding),)
    ),
    Target(f"{control.MANY} photo-eyes that see nothing, over {control.FEW}", "control", MOST, 2.0, _eyes),
    *(
        Target(
            f"a {control.DOWNSTREAM_STOP}, {quantity}", "control", bound, v, _control(control.DOWNSTREAM_STOP, quantity)
        )
        for quantity, bound, v in ((control.FACTOR, LEAST, 60.0), (control.BESIDE, MOST, 60.0))
    ),
    Target("what evidence adds to it", "control", MOST, 0.2, _evidence),
    Target("scans a second in lockstep over DDS", "lockstep", LEAST, 1500.0, _lockstep(lockstep.RATE)),
    Target("s from the start of both nodes to the first scans", "lockstep", MOST, 2.0, _lockstep(lockstep.START)),
    *(
        Target(f"s of wall time, {command}", "whole", MOST, most, _whole(command))
        for command, most in ((whole.RUN, 4.0), (whole.MAKE_RUN, 7.0))
    ),
    *(
        Target(f"{quantity}, conveyor-sim accuracy {scene}", "accuracy", MOST, most, _accuracy(scene, quantity))
        for scene in accuracy.SCENES
        for quantity, most in ((accuracy.PREDICTED, 10.0), (accuracy.PRELIMINARY, 60.0), (accuracy.ANSWER, 300.0))
    ),
    *(
        Target(f"ms of CPU a frame of the page, N = {n}", "view", MOST, v, _view(view.FRAME, n, "page", view.CPU))
        for n, v in ((1_000, 1e3 / 60.0), (10_000, 1e3 / 20.0))
    ),
    *(
        Target(
            f"{quantity}, of Modbus and the page while OPC UA is attacked", "isolation", MOST, 50.0, _attacked(quantity)
        )
        for quantity in (isolation.P99, isolation.WORST)
    ),
    Target("us a scan of a program of 200 statements", "st", MOST, 100.0, _scan),
    Target("s to compile a program of 10 000 statements", "st", MOST, 2.0, _compiling),
    Target("s to open an hour on the page", "view", MOST, 2.0, _view(view.LONG, view.HOUR, "server", view.OPEN)),
    Target("ms to go to a time of it", "view", MOST, 100.0, _view(view.LONG, view.HOUR, "server", view.SEEK)),
    Target("runs of a study by two processes, times one", "studies", LEAST, 1.8, _two_processes),
    Target("ms a run of a study beside its simulation", "studies", MOST, 50.0, _beside),
)


def tables(parts: Mapping[str, Rows]) -> str:
    """One line a target; figures are medians."""
    return markdown(["", "wanted", "measured", ""], [target.line(parts) for target in TARGETS])
