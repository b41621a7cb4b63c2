"""The worst that any bottle of a run has borne, from outputs of damage over time."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np

from conveyor_sim.columns.damage import DamageColumns

WORDS = {
    "scuffing_work": "{:.3g} J of sliding work",
    "crushing_force": "pressed with {:.3g} N from all sides",
    "opposed_force": "squeezed with {:.3g} N",
    "impact_speed": "hit at {:.3g} m/s",
    "impact_force": "pushed with {:.3g} N in one contact",
    "tipping": "index of tipping {:.2f}",
}


@dataclass(frozen=True)
class Worst:
    """A largest value, and the bottle whose it was."""

    value: float
    bottle: int


@dataclass(frozen=True)
class LoadHistory:
    """The worst of each quantity (`DamageColumns`) over bottles and time; None: not looked at."""

    scuffing_work: Worst | None = None
    crushing_force: Worst | None = None
    opposed_force: Worst | None = None
    impact_speed: Worst | None = None
    impact_force: Worst | None = None
    tipping: Worst | None = None

    def with_more(self, damage: DamageColumns) -> LoadHistory:
        """With another output of damage taken in."""
        found = {}
        for field in fields(LoadHistory):
            values, before = getattr(damage, field.name), getattr(self, field.name)
            if np.isfinite(values).any():
                index = int(np.nanargmax(values))
                if before is None or values[index] > before.value:
                    found[field.name] = Worst(float(values[index]), int(damage.id[index]))
        return replace(self, **found)

    @property
    def sentence(self) -> str:
        """Return one sentence with these values."""
        there = {field.name: worst for field in fields(LoadHistory) if (worst := getattr(self, field.name)) is not None}
        return "at most " + "; ".join(
            f"{WORDS[name].format(worst.value)} (bottle {worst.bottle})" for name, worst in there.items()
        )
