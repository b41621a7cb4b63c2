# SPDX-License-Identifier: Apache-2.0
"""Presets of `accuracy`: tolerances, and the numbers that follow from them."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from conveyor_sim.physics.laws.coefficients import DAMPING_BY_NAME
from conveyor_sim.physics.timestep.bounds import least_steps
from conveyor_sim.physics.timestep.methods import METHODS, Method
from conveyor_sim.physics.timestep.prediction import Impact, percent
from conveyor_sim.scene.accuracy import Accuracy, Preset

PRESETS: Mapping[Preset, float] = {"draft": 0.05, "standard": 0.01, "fine": 0.001}
"""Largest relative error in contact force by preset. All other numbers follow from it."""

DEFAULT: Preset = "standard"
"""Preset of a scene without `accuracy`, and of the bounds for a scene that sets the time step."""

RESTITUTIONS = (1.0, 0.9, 0.5)
"""Restitutions of the impacts in the table of steps."""


@dataclass(frozen=True)
class Target:
    """Target of the bounds on the time step."""

    tolerance: float
    """Relative error in contact force."""
    words: str


def target(accuracy: Accuracy) -> Target:
    """Return the target of a scene; the default if it chooses none, or sets the time step."""
    if accuracy.tolerance is not None:
        return Target(accuracy.tolerance, f"tolerance {percent(accuracy.tolerance)} in contact force")
    # `fast` is read as an integrator and its steps.
    preset = DEFAULT if accuracy.preset is None or accuracy.preset == "fast" else accuracy.preset
    return Target(PRESETS[preset], f"{preset} ({percent(PRESETS[preset])} in contact force)")


def table() -> str:
    """Return two Markdown tables: presets and their numbers."""
    numbers: list[tuple[str, Callable[[float], str]]] = [
        ("largest relative error in contact force", percent),
        ("smallest number n of steps per contact", lambda tolerance: f"{least_steps(tolerance):.3g}"),
        (
            "error of a force peak between two of n steps, (π/n)²/8",
            lambda tolerance: percent((math.pi / least_steps(tolerance)) ** 2 / 8.0),
        ),
        (
            "steps per v_lim/(μ g), leapfrog and semi-implicit Euler",
            lambda tolerance: f"{least_steps(tolerance):.3g}",
        ),
        (
            "number m of steps per v_lim/(μ g), semi-implicit Euler with curved belts: the error of creep and resting "
            "load is 1/m",
            lambda tolerance: f"{1.0 / tolerance:.0f}",
        ),
    ]
    presets = [(name, *(number(tolerance) for tolerance in PRESETS.values())) for name, number in numbers]
    contacts = [
        (
            f"`{integrator}`, {f'e = {e:g}' if e < 1.0 else 'undamped'}",
            *(f"{math.pi / _impact(method, e).bound(tolerance).dt:.0f}" for tolerance in PRESETS.values()),
        )
        for integrator, method in METHODS.items()
        for e in RESTITUTIONS
    ]
    return "\n".join(
        [*_markdown("preset", presets), "", *_markdown("steps per contact, linear, `paper` damping", contacts), ""]
    )


def _impact(method: Method, restitution: float) -> Impact:
    """Return the impact of a linear contact with unit mass, stiffness and speed, and a linear dashpot."""
    shares = [method.between_steps(1.0)]
    if restitution < 1.0:
        c = DAMPING_BY_NAME["paper"].coefficient(restitution, 1.0, 1.0, 1.0)
        shares += method.first_touch(c, 1.0 / c)
    return Impact("", "", math.pi, tuple(shares), 0.0, 1.0, 1.0, lambda force: force)


def _markdown(title: str, rows: Sequence[Sequence[str]]) -> list[str]:
    head = [(title, *PRESETS), ("---", *("---:" for _ in PRESETS))]
    return [f"| {' | '.join(row)} |" for row in [*head, *rows]]
