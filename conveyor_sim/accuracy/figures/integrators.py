# SPDX-License-Identifier: Apache-2.0
"""Appearance and names of integrators and settings in figures: colour, marker and line all distinguish them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal

from matplotlib.colors import to_hex, to_rgb

from conveyor_sim.accuracy.report.words import digits, duration
from conveyor_sim.accuracy.setting import Setting
from conveyor_sim.report.figures import style


@dataclass(frozen=True)
class Look:
    """Appearance of one integrator."""

    name: str
    colour: str
    marker: str
    line: Literal["-"] | tuple[float, tuple[float, ...]]


_LOOKS: Final = {
    "leapfrog": Look("leapfrog", style.SERIES[0], "o", "-"),
    "semi_implicit_euler": Look("semi-implicit Euler", style.SERIES[4], "X", (0.0, (2.0, 1.0))),
    "velocity_verlet": Look("velocity Verlet", style.SERIES[1], "s", (0.0, (6.0, 1.5))),
    "rk4": Look("RK4", style.SERIES[2], "^", (0.0, (3.0, 1.2))),
    "dormand_prince": Look("Dormand-Prince", style.SERIES[3], "D", (0.0, (1.0, 1.2))),
    "linearly_implicit": Look("linearly implicit", style.SERIES[5], "v", (0.0, (5.0, 1.5, 1.0, 1.5))),
    "impulses": Look("impulses", style.MUTED, "P", "-"),
}


def look_of(integrator: str) -> Look:
    """Its look; one that is not known here is drawn in grey."""
    return _LOOKS.get(integrator, Look(integrator, style.MUTED, "P", "-"))


def order_of(integrator: str) -> int:
    """Its place in legends."""
    return [*_LOOKS, integrator].index(integrator)


def step_text(seconds: float) -> str:
    """`40 µs`."""
    return duration(seconds).replace("us", "µs")


def setting_text(setting: Setting, tick: float) -> str:
    """`velocity Verlet, 40 µs, stiffness x 0.25`; tick in s."""
    parts = [look_of(setting.integrator).name, step_text(tick / setting.per_tick)]
    parts += [f"{digits(setting.error)} m/s a step"] if setting.error is not None else []
    parts += [f"{setting.sweeps} sweeps"] if setting.sweeps is not None else []
    parts += [f"stiffness x {digits(setting.stiffness)}"] if setting.stiffness != 1.0 else []
    return ", ".join(parts)


def dark(colour: str) -> str:
    """Return a darker colour for small texts, which would be faint in a bright colour."""
    red, green, blue = to_rgb(colour)
    return to_hex((0.72 * red, 0.72 * green, 0.72 * blue))
