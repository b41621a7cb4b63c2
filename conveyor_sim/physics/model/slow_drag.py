# SPDX-License-Identifier: Apache-2.0
"""Warning about belts slower than the slip limit, with the price of a smaller one in steps per tick."""

from collections.abc import Collection
from dataclasses import dataclass

from conveyor_sim.errors import SceneError
from conveyor_sim.physics.effects.slow_belts import SlowBelt, drag_share, slow_belts
from conveyor_sim.physics.model.remedies import with_remedy
from conveyor_sim.physics.model.step_choice import choose_steps
from conveyor_sim.physics.plant import Plant
from conveyor_sim.physics.timestep.bounds import fewest_steps
from conveyor_sim.physics.timestep.prediction import percent
from conveyor_sim.scene.accuracy import MOST_STEPS
from conveyor_sim.scene.schema import Scene


@dataclass(frozen=True)
class SlowDrag:
    """Slowest belt of a scene below the slip limit, and the remedy."""

    belt: SlowBelt
    others: int
    """Number of other belts below the slip limit."""
    slip_limit: float
    """m/s, of the scene."""
    factor: float | None
    """Steps per tick with a slip limit equal to the speed of the belt, over those of the scene; None if not valid."""

    @property
    def text(self) -> str:
        """Warning without the name of the belt."""
        belt, others = self.belt, f" (and {self.others} more)" if self.others else ""
        return (
            f"{belt.speed:.3g} m/s{belt.place}{others} is below slip_limit, {self.slip_limit:g} m/s: bottles that are "
            f"held are dragged with {percent(belt.share)} of mu m g; {self._remedy()}"
        )

    @property
    def sentence(self) -> str:
        """The warning, with the name of the belt."""
        return f"belts.{self.belt.belt}: {self.text}"

    def _remedy(self) -> str:
        speed = self.belt.speed
        if self.factor is None:
            return f"a slip_limit of that speed needs more than {MOST_STEPS} steps per tick"
        share = min(drag_share(speed, speed, curve) for curve in self.belt.curves)
        return f"slip_limit: {speed:.3g} gives {percent(share)} at {_times(self.factor)} the steps per tick"


def slow_drag(plant: Plant, on: Collection[str]) -> SlowDrag | None:
    """Return the warning about slow belts of a scene; None without them. on: enabled effects."""
    belts = slow_belts(plant, on)
    if not belts:
        return None
    slowest = min(belts, key=lambda belt: belt.speed)
    return SlowDrag(slowest, len(belts) - 1, plant.scene.slip_limit, price_of_slip_limit(plant.scene, slowest.speed))


def price_of_slip_limit(scene: Scene, slip_limit: float) -> float | None:
    """Return the steps per tick that the bounds need with a slip limit (m/s), over those that they need now.

    Steps that the scene gives do not count. Return None if it needs more than MOST_STEPS, or is too small for a scene.
    """
    try:
        steps = _needed(with_remedy(scene, {"slip_limit": slip_limit}))
    except SceneError:
        return None
    return None if steps > MOST_STEPS else steps / _needed(scene)


def _needed(scene: Scene) -> int:
    bounds = choose_steps(Plant.of(scene)).bounds
    return fewest_steps(scene.tick, min((bound.dt for bound in bounds), default=scene.tick))


def _times(factor: float) -> str:
    return f"{factor:.3g} times" if factor < 100.0 else f"{factor:.0f} times"
