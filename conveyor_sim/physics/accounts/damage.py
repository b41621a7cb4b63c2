# SPDX-License-Identifier: Apache-2.0
"""Damage account: outputs, limits and events of the loads that the engine records in every step."""

from collections.abc import Iterator
from dataclasses import astuple

import numpy as np

from conveyor_sim.columns.damage import DamageColumns, DamageEvent, RailWearColumns
from conveyor_sim.engine.arrays.damage import DamageArrays, Maximum, worst_columns
from conveyor_sim.engine.arrays.types import F8
from conveyor_sim.physics.state import State
from conveyor_sim.physics.state.empty_damage import rail_places
from conveyor_sim.scene.limits import Limits
from conveyor_sim.scene.types import Unchecked

WORDS = {
    "scuffing_work": ("has taken {:.3g} J of sliding work at its wall by the time it is", "J"),
    "crushing_force": ("is pressed from all sides with {:.3g} N", "N"),
    "opposed_force": ("is squeezed with {:.3g} N", "N"),
    "impact_speed": ("hits, or is hit, at {:.3g} m/s", "m/s"),
    "impact_force": ("is pushed with {:.3g} N in one contact", "N"),
    "tipping": ("has an index of tipping of {:.3g}", ""),
}

PLACES = {
    "crushing_force": ("crushing", "total"),
    "opposed_force": ("crushing", "opposed"),
    "impact_speed": ("impacts", "speed"),
    "impact_force": ("impacts", "force"),
    "tipping": ("tipping", "ratio"),
}
"""Group and column of the engine's arrays, by limit."""


class PassedLimits:
    """Events of limits that were passed. Checkpoints hold the public attributes."""

    events: list[tuple[int, str, int, Unchecked, Unchecked, Unchecked, Unchecked, str]]
    """Events that were not taken yet."""

    def __init__(self) -> None:
        self.events = []

    def take_events(self) -> list[DamageEvent]:
        """Return the events since the last call, in order."""
        events, self.events = self.events, []
        return [DamageEvent(*event) for event in events]

    def _since(self, count: int) -> list[DamageEvent]:
        """Return the events that were not taken yet, without the first `count`."""
        return [DamageEvent(*event) for event in self.events[count:]]


class DamageAccount(PassedLimits):
    """Loads on the bottles of a State. Checkpoints hold the public attributes."""

    beyond: dict[str, list[int]]
    """Ids of the bottles beyond each limit at the end of the last tick, by limit."""

    def __init__(self, state: State, limits: Limits) -> None:
        super().__init__()
        self._state = state
        self._limits: dict[str, float] = {
            name: limit for name in Limits.model_fields if (limit := getattr(limits, name)) is not None
        }
        self._places = rail_places(state.model)
        self.beyond = {name: [] for name in WORDS}

    def begin(self, was_output: bool) -> None:
        """Begin a tick. was_output: True if loads were output at its beginning, so that their maxima restart."""
        for worst in self._worst():
            worst.tick[:] = 0.0
            if was_output:
                worst.output[:] = 0.0

    def end(self, tick: int) -> list[DamageEvent]:
        """End a tick, and return an event per load that exceeded a limit."""
        before = len(self.events)
        for worst in self._worst():
            np.maximum(worst.output, worst.tick, out=worst.output)
        damage = self._state.world.damage
        for kind, limit in self._limits.items():
            if damage is not None and (column := _column(damage, kind)) is not None:
                self._compare(tick, kind, column, limit)
        return self._since(before)

    def columns(self, slots: np.ndarray) -> DamageColumns:
        """Return the loads on the bottles in some slots."""
        world, damage = self._state.world, self._state.world.damage
        heights = self._state.model.type_heights[world.bottles.type[slots], 0]

        def output(kind: str) -> F8:
            column = None if damage is None else _column(damage, kind, output=True)
            return np.full(slots.size, np.nan) if column is None else column[slots]

        return DamageColumns(
            id=world.bottles.id[slots].astype(np.uint64),
            type=world.bottles.type[slots].astype(np.uint16),
            x=world.bottles.x[slots],
            y=world.bottles.y[slots],
            scuffing_work=output("scuffing_work"),
            crushing_force=output("crushing_force"),
            opposed_force=output("opposed_force"),
            impact_speed=output("impact_speed"),
            impact_force=output("impact_force"),
            tipping=np.where(np.isfinite(heights), output("tipping"), np.nan),
        )

    def rail_wear(self) -> RailWearColumns:
        """Return the loads on the rails; no bins where they are disabled."""
        damage, places = self._state.world.damage, self._places
        if damage is None or damage.scuffing is None or damage.scuffing.bins is None:
            none = np.zeros(0)
            return RailWearColumns(np.zeros(0, np.uint32), none, none, none, none, none)
        bins = damage.scuffing.bins
        work, impulse = bins.work.sum(axis=0), bins.impulse.sum(axis=0)
        return RailWearColumns(places.rail, places.x, places.y, places.length, work, impulse)

    def _worst(self) -> Iterator[Maximum]:
        damage = self._state.world.damage
        return iter(()) if damage is None else worst_columns(damage)

    def _compare(self, tick: int, kind: str, column: F8, limit: float) -> None:
        bottles = self._state.world.bottles
        slots = np.flatnonzero((column > limit) & (bottles.id >= 0))
        slots = slots[np.argsort(bottles.id[slots])]
        before = self.beyond[kind]
        away = [bottle for bottle in before if bottle in self._state.held]
        self.beyond[kind] = [*bottles.id[slots].tolist(), *away]
        for slot in slots.tolist():
            # A lasting load is reported once, an impact each time.
            if kind == "impact_speed" or int(bottles.id[slot]) not in before:
                what, unit = WORDS[kind]
                self._report(tick, kind, slot, float(column[slot]), limit, what.format(column[slot]), unit)

    def _report(self, tick: int, kind: str, slot: int, value: float, limit: float, what: str, unit: str) -> None:
        bottles = self._state.world.bottles
        bottle, x, y = int(bottles.id[slot]), float(bottles.x[slot]), float(bottles.y[slot])
        time = tick * self._state.model.tick_ns * 1e-9
        text = (
            f"bottle {bottle} {what} at ({x:.4g}, {y:.4g}) m at {time:g} s: limits.{kind} is {limit:g} {unit}".rstrip()
        )
        self.events.append(astuple(DamageEvent(tick, kind, bottle, x, y, value, limit, text)))


def _column(damage: DamageArrays, kind: str, output: bool = False) -> F8 | None:
    """Return the loads of a limit by slot, in the tick or since the last output; None where they are absent."""
    if kind == "scuffing_work":
        return None if damage.scuffing is None else damage.scuffing.work
    if kind not in PLACES:
        return None
    group, name = PLACES[kind]
    worst: Maximum | None = getattr(getattr(damage, group), name, None)
    if worst is None:
        return None
    return worst.output if output else worst.tick
