# SPDX-License-Identifier: Apache-2.0
"""Accuracy of a simulation: a preset, a tolerance, or an integrator with its time step."""

from collections.abc import Mapping
from typing import Annotated, Any, Literal, get_args

from annotated_types import Ge, Le
from pydantic import Strict, model_validator

from conveyor_sim.scene.part import Part
from conveyor_sim.scene.types import Positive, Says, Tolerance, quantity

Preset = Literal["draft", "standard", "fine"]
PresetName = Literal["draft", "standard", "fine", "fast"]
IntegratorName = Literal[
    "leapfrog", "semi_implicit_euler", "velocity_verlet", "rk4", "dormand_prince", "linearly_implicit", "impulses"
]
INTEGRATOR_NAMES: tuple[IntegratorName, ...] = get_args(IntegratorName)[:-1]
"""Integrators of forces, whose errors follow from the time step. The method of impulses is none."""

FAST: Mapping[str, Any] = {"integrator": "impulses", "per_tick": 8, "sweeps": 2}
"""Fields of the preset `fast`."""

MOST_SWEEPS = 100
"""Largest number of sweeps in a substep."""

MOST_STEPS = 1_000_000
"""Largest number of steps in a tick. With 100 bottles (3 us per step) such a tick takes 3 s, a simulated second 5 min.

The stiffest shipped scene needs fewer, even at the preset `fine` and in steps ten times shorter still.
"""

MANY_STEPS = 20_000
"""Steps in a tick from which a scene is reported as slow: 100 bottles take a minute for ten simulated seconds."""

StepCount = Annotated[int, Strict(), Ge(1), Le(MOST_STEPS), Says(f"a whole number from 1 to {MOST_STEPS}")]

SweepCount = Annotated[int, Strict(), Ge(1), Le(MOST_SWEEPS), Says(f"a whole number from 1 to {MOST_SWEEPS}")]

CHOICES = ("preset", "tolerance", "dt", "per_tick")
"""Fields that choose the time step. At most one may be given."""


class Accuracy(Part):
    """Accuracy of the integration of a tick. A word alone is a preset: `accuracy: fine` is `accuracy: {preset: fine}`.

    At most one of `preset`, `tolerance`, `dt` and `per_tick`; without one it is the preset `standard`. `fast` alone is
    `{integrator: impulses, per_tick: 8, sweeps: 2}`.
    """

    preset: PresetName | None = quantity(
        "A row of the table of presets in docs/accuracy.md; or fast, for flow and counts.", default=None
    )
    tolerance: Tolerance | None = quantity(
        "Largest relative error in contact force; the time step is derived from it.", "1", default=None
    )
    integrator: IntegratorName = quantity(
        "Integration method; semi_implicit_euler is the paper's, (5)-(6). docs/accuracy.md helps to choose. impulses: "
        "implicit contacts in few steps per tick, for flow and counts; single forces in a crowd are inaccurate.",
        default="leapfrog",
    )
    dt: Positive | None = quantity(
        "Longest time step. A tick is divided into the smallest number of equal steps within it.", "s", default=None
    )
    per_tick: StepCount | None = quantity("Number of steps per tick, instead of `dt`.", "1", default=None)
    error: Positive | None = quantity(
        "Largest error per step, for dormand_prince only, which divides steps of dt by itself. Left out: 1e-6.",
        "m/s",
        default=None,
    )
    sweeps: SweepCount | None = quantity(
        "Sweeps over all contacts in a step, for impulses only. Left out: 2.", "1", default=None
    )

    @model_validator(mode="before")
    @classmethod
    def _from_word(cls, data: Any) -> Any:
        data = {"preset": data} if isinstance(data, str) else data
        if not isinstance(data, Mapping):
            return data
        given = {name: value for name, value in data.items() if value is not None}
        if given == {"preset": "fast"}:
            return dict(FAST)
        if given.get("integrator") == "impulses" and "sweeps" not in given:
            return {**data, "sweeps": FAST["sweeps"]}
        return data


def explicit(
    integrator: str, per_tick: int, error: float | None = None, sweeps: int | None = None
) -> Mapping[str, Any]:
    """Return `accuracy` as an override that replaces all fields of the scene."""
    return {
        "preset": None,
        "tolerance": None,
        "integrator": integrator,
        "dt": None,
        "per_tick": per_tick,
        "error": error,
        "sweeps": sweeps,
    }
