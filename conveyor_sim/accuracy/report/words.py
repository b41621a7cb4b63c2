# SPDX-License-Identifier: Apache-2.0
"""Numbers and settings as people read them: three digits, a fitting unit, no exponent where it can be helped."""

from __future__ import annotations

import math

from conveyor_sim.accuracy.measure.observables import OBSERVABLES
from conveyor_sim.accuracy.setting import Setting
from conveyor_sim.physics.timestep.prediction import without_rounding


def digits(value: float | None) -> str:
    """Three digits: 40, 0.812, 1230, 1.2e-9; a dash for what is not known, not a number or infinite."""
    if value is None or not math.isfinite(value):
        return "-"
    rounded = float(f"{value:.3g}")
    if rounded == 0.0 or 1e-4 <= abs(rounded) < 1e6:
        return f"{rounded:.7f}".rstrip("0").rstrip(".")
    mantissa, exponent = f"{rounded:.1e}".split("e")
    return f"{mantissa.removesuffix('.0')}e{int(exponent)}"


def percent(fraction: float | None) -> str:
    """`0.812 %`."""
    return "-" if fraction is None or not math.isfinite(fraction) else f"{hundredths(fraction)} %"


def hundredths(fraction: float | None) -> str:
    """Return a relative error in percent without its unit: 0.812."""
    return digits(None if fraction is None else 100.0 * without_rounding(fraction))


def duration(seconds: float) -> str:
    """`40 us`, `2.5 ms`."""
    scale, unit = (1e6, "us") if seconds < 1e-3 else (1e3, "ms") if seconds < 1.0 else (1.0, "s")
    return f"{digits(seconds * scale)} {unit}"


def spread(mean: float, error: float) -> str:
    """`6.021 +- 0.013`: a standard error of two digits, and a mean that ends where it does."""
    if not math.isfinite(error) or error <= 0.0:
        return digits(mean)
    if error < 1e-4 or abs(mean) >= 1e6:
        return f"{digits(mean)} +- {digits(float(f'{error:.2g}'))}"
    decimals = 1 - math.floor(math.log10(float(f"{error:.1e}")))
    shown = max(0, decimals)
    return f"{round(mean, decimals):.{shown}f} +- {round(error, decimals):.{shown}f}"


def setting_name(setting: Setting, tick: float) -> str:
    """`velocity_verlet, 40 us, stiffness x 0.1`: as a scene spells them; tick in s."""
    parts = [setting.integrator, duration(tick / setting.per_tick)]
    parts += [f"{digits(setting.error)} m/s a step"] if setting.error is not None else []
    parts += [f"{setting.sweeps} sweeps"] if setting.sweeps is not None else []
    parts += [f"stiffness x {digits(setting.stiffness)}"] if setting.stiffness != 1.0 else []
    return ", ".join(parts)


def unit_of(observable: str) -> str:
    """Its unit; empty if it is not known here."""
    return {known.name: known.unit for known in OBSERVABLES}.get(observable, "")


def with_unit(observable: str) -> str:
    """`spacing, m`: an observable and its unit."""
    return ", ".join(filter(None, (observable, unit_of(observable))))
