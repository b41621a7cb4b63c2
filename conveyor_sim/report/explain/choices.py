# SPDX-License-Identifier: Apache-2.0
"""Why a scene is simulated as it is: its effects, its time step, its expected errors, what each effect costs."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.box import SIMPLE
from rich.console import Group
from rich.padding import Padding
from rich.table import Table

from conveyor_sim.physics.effects.choice import EFFECTS
from conveyor_sim.physics.effects.notes import notes
from conveyor_sim.physics.effects.sprung_walls import sprung_walls
from conveyor_sim.physics.model import Model
from conveyor_sim.physics.model.remedies import step_limit
from conveyor_sim.physics.model.slow_drag import slow_drag
from conveyor_sim.physics.timestep.bounds import fewest_steps
from conveyor_sim.physics.timestep.prediction import percent
from conveyor_sim.scene import Scene
from conveyor_sim.scene.places import Places

if TYPE_CHECKING:
    from conveyor_sim.report.explain.effect_cost import Price, PriceList


def explanation(scene: Scene, model: Model) -> Group:
    """Effects on and off with the lines that decide, bounds on dt with the one that rules, steps, expected errors."""
    steps = Table.grid(padding=(0, 2))
    steps.add_row("scene", f"{model.name} ({scene.source_name})")
    for name, text in [*accuracy_rows(model), *step_rows(scene)]:
        steps.add_row(name, text)
    for name, text in note_rows(model):
        steps.add_row(name, text)
    return Group(_effects(scene, model), _bounds(scene, model), steps)


def note_rows(model: Model) -> list[tuple[str, str]]:
    """Return warnings and notes on the set-up of a scene, each with its name; empty without any."""
    on = {choice.name for choice in model.effects if choice.on}
    return [
        *(("warning", text) for text in scene_warnings(model)),
        *(("note", text) for text in notes(model.plant, on)),
    ]


def scene_warnings(model: Model) -> list[str]:
    """Return sentences on settings of a scene that make results wrong from the start; empty without any."""
    on = {choice.name for choice in model.effects if choice.on}
    return [
        found.sentence for found in (slow_drag(model.plant, on), sprung_walls(model.plant, on)) if found is not None
    ]


def accuracy_rows(model: Model) -> list[tuple[str, str]]:
    """Return the accuracy settings, their consequences and the expected errors, each with its name."""
    prediction = model.prediction
    force = prediction.reason
    if prediction.value is not None:
        force = f"{percent(prediction.value)} in the peak force of impacts: {prediction.reason}"
    resting = prediction.resting_reason
    if prediction.resting:
        resting = f"{percent(prediction.resting)} in resting load: {prediction.resting_reason}"
    return [
        ("accuracy", model.accuracy),
        ("time step", f"{_time(model.dt)}: {model.dt_reason}"),
        ("integrator", model.integrator),
        ("predicted error", force),
        ("", resting),
        *(("", f"{percent(term.value)} in {term.quantity}: {term.reason}") for term in prediction.terms),
        *([] if model.settling is None else [("settling", model.settling.sentence)]),
    ]


def step_rows(scene: Scene) -> list[tuple[str, str]]:
    """Return the bound that sets the number of steps and the changes that would lower it, each with its name."""
    return [("" if index else "steps", line) for index, line in enumerate(step_limit(scene).lines)]


def setting_line(model: Model) -> str:
    """Integrator, time step and why, and the errors to expect, in one line."""
    return (
        f"{model.integrator}, dt = {_time(model.dt)} ({model.dt_reason}); predicted error: {model.prediction.sentence}"
    )


def price_table(prices: PriceList) -> Group:
    """Return a table of the measured costs, the most expensive effect first."""
    table = Table(box=SIMPLE)
    for heading in ("effect", "with", "without", "cost", f"{prices.confidence:.0%} within", ""):
        left = heading in ("effect", "")
        table.add_column(heading, justify="left" if left else "right", no_wrap=heading != "", overflow="fold")
    for price in prices.prices:
        table.add_row(price.effect, *_numbers(price), "" if price.certain else "noise")
    if prices.together is not None:
        table.add_section()
        table.add_row(prices.together.effect, *_numbers(prices.together), "not the sum")
    lines = [
        f"In ns per bottle and step, of {prices.full:.1f} with all effects: {prices.bottles} bottles "
        f"at {prices.time:g} s, on one thread, each effect with and without, in turn, from the same state and at the "
        "same time step. Costs overlap; noise is a cost that does not differ from 0."
    ]
    lines += [
        f"{price.effect} takes along {', '.join(price.takes_along)}" for price in prices.prices if price.takes_along
    ]
    supply = [price.effect for price in prices.prices if price.effect in ("infeed", "outfeed")]
    if supply:
        lines.append(f"{', '.join(supply)}: without, there are other bottles, among whom a step's fixed cost is shared")
    lines += [f"{name}: not measured, the scene does not run without it: {why}" for name, why in prices.failed.items()]
    if prices.fixed:
        lines.append(f"not measured, as they can't be forced off: {', '.join(prices.fixed)}")
    return Group(table, *lines)


def _effects(scene: Scene, model: Model) -> Table:
    places = Places(scene)
    declared = {effect.name: effect for effect in EFFECTS}
    table = Table(box=SIMPLE)
    table.add_column("effect", no_wrap=True)
    table.add_column("", no_wrap=True)
    table.add_column("line", justify="right", no_wrap=True)
    table.add_column("why, and for what is on: law; source", overflow="fold")
    for choice in model.effects:
        line = None if choice.path is None else places.line_of(choice.path)
        why = choice.why
        if choice.path is not None and line is None:
            why += f" ({places.unwritten(choice.path)})"
        elif choice.path is not None and (elsewhere := places.elsewhere(choice.path)):
            why, line = f"{why} ({elsewhere})", None
        law = f"{declared[choice.name].law}; {declared[choice.name].source}"
        table.add_row(
            choice.name,
            "on" if choice.on else "off",
            "" if line is None else str(line),
            Group(why, Padding(law, (0, 0, 0, 2))) if choice.on else why,
            style=None if choice.on else "dim",
        )
    return table


def _bounds(scene: Scene, model: Model) -> Table | str:
    if not model.bounds:
        return "nothing in the scene bounds the time step\n"
    table = Table(box=SIMPLE)
    table.add_column("bound on the\ntime step", no_wrap=True)
    table.add_column("at most", justify="right", no_wrap=True)
    table.add_column("steps\na tick", justify="right")
    table.add_column("why", overflow="fold")
    for bound in sorted(model.bounds, key=lambda bound: bound.dt):
        rules = bound is min(model.bounds, key=lambda bound: bound.dt)
        table.add_row(
            bound.name,
            _time(bound.dt),
            str(fewest_steps(scene.tick, bound.dt)),
            f"{bound.reason}{', for stability' if bound.stability else ''}{' (sets the step)' if rules else ''}",
        )
    return table


def _time(seconds: float) -> str:
    """Return a time with four digits, in a unit without exponent."""
    scale, unit = (1e6, "us") if seconds < 1e-3 else (1e3, "ms") if seconds < 1.0 else (1.0, "s")
    return f"{seconds * scale:.4g} {unit}"


def _numbers(price: Price) -> tuple[str, str, str, str]:
    return f"{price.on:.1f}", f"{price.off:.1f}", f"{price.cost:+.1f}", f"{price.low:+.1f} .. {price.high:+.1f}"
