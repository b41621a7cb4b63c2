# SPDX-License-Identifier: Apache-2.0
"""Tightest bound on the steps of a scene, and changes of the scene that lower the number of steps.

A remedy is a change of the scene file. Each candidate is tried: the steps of the changed scene are chosen, and only
changes that make a tick cheaper by enough are reported, with the resulting steps and speed.

`tick_cost.py` estimates the time of a tick.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from conveyor_sim.engine.integrators import WARM
from conveyor_sim.errors import SceneError
from conveyor_sim.physics.model.step_choice import StepChoice, choose_steps
from conveyor_sim.physics.model.tick_cost import LineSize, line_size, tick_seconds
from conveyor_sim.physics.plant import Plant
from conveyor_sim.physics.timestep.bounds import Bound, fewest_steps
from conveyor_sim.physics.timestep.presets import DEFAULT
from conveyor_sim.scene.accuracy import MANY_STEPS, MOST_STEPS
from conveyor_sim.scene.contacts import DAMPING_CHOICES
from conveyor_sim.scene.load import parse_again
from conveyor_sim.scene.overrides import parse_overrides
from conveyor_sim.scene.schema import Scene

WORTH = 0.8
"""A remedy is reported if steps and time per tick fall to this share or less."""

NAMED = 2
"""Largest number of reported remedies, the cheapest first."""

NEAR = 2.0
"""Largest cost of the second remedy over that of the first."""

STEP_COST: Mapping[str, int] = {
    "leapfrog": 1,
    "semi_implicit_euler": 1,
    "velocity_verlet": 1,
    "rk4": 4,
    "dormand_prince": 12,
    "linearly_implicit": 6,
    "impulses": 3,
}
"""Cost of a step, or of one sweep with impulses, in evaluations of all forces or equal work."""

IMPLICIT_COST = 2.5
"""Cost of a step with the implicit friction solver over that of a step without it, in queues: 2.4 to 2.5 measured."""

OTHERS = ("leapfrog", "velocity_verlet")
"""Integrators that a remedy may choose."""

MANY = 100
"""Assumed number of bottles of a scene with an endless infeed, unless more are present at the start."""

COARSER = {"fine": "standard", "standard": "draft"}


@dataclass(frozen=True)
class Remedy:
    """A change of a scene that lowers its number of steps."""

    words: str
    """The change as in a scene file, and its side effects."""
    overrides: Mapping[str, Any]
    """Overrides of the scene."""
    steps: int
    """Steps per tick with the remedy."""
    faster: float
    """Estimated time of a tick without the remedy over that with it, for the scene's number of bottles."""

    @property
    def sentence(self) -> str:
        """The remedy in words."""
        return f"{self.words}: {_steps(self.steps)}, about {_times(self.faster)} as fast"


@dataclass(frozen=True)
class StepLimit:
    """Limit on the time step of a scene, and remedies."""

    steps: int
    given: bool
    """True if the scene gives the steps, False if the bounds set them."""
    bounds: tuple[Bound, ...]
    """All bounds, the tightest first."""
    step_cost: float
    """Relative cost of a step."""
    tick: float
    """s"""
    bottles: int
    """Number of bottles on the line that costs are estimated for."""
    line: LineSize
    remedies: tuple[Remedy, ...]

    @property
    def ratio(self) -> float:
        """Next bound over the tightest one."""
        return self.bounds[1].dt / self.bounds[0].dt if len(self.bounds) > 1 else 1.0

    @property
    def lines(self) -> list[str]:
        """Lines of a report: the bound, the remedies, and a warning for slow scenes."""
        lines = [self.bound, self.change]
        if self.steps >= MANY_STEPS:
            lines.append(self._warning())
        return [line for line in lines if line]

    @property
    def bound(self) -> str:
        """The tightest bound and its distance to the next one; empty without bounds."""
        if not self.bounds:
            return ""
        first, *others = self.bounds
        needs = fewest_steps(self.tick, first.dt)
        text = f"{first.name} needs {_steps(needs)}"
        if others:
            text += f", {_times(self.ratio)} the next bound, {others[0].name} ({fewest_steps(self.tick, others[0].dt)})"
        return f"{_steps(self.steps)} are given in the scene; {text}" if self.given else text

    @property
    def change(self) -> str:
        """The remedies; empty without remedies unless the steps are many."""
        if not self.remedies:
            return "" if self.steps < MANY_STEPS else "no single change of the scene that is known to help lowers it"
        return "fewer steps: " + "; or ".join(remedy.sentence for remedy in self.remedies)

    @property
    def seconds(self) -> float:
        """Estimated computing time (s) on one core for a simulated second of `bottles` bottles."""
        return tick_seconds(self.steps * self.step_cost, self.bottles, self.line) / self.tick

    def _warning(self) -> str:
        text = f"{self.seconds:.2g}" if self.seconds < 100.0 else f"{self.seconds:.0f}"
        return f"slow: a simulated second of {self.bottles} bottles will take about {text} s of computing on one core"


def step_cost(integrator: str, friction_solver: str, sweeps: int | None = None) -> float:
    """Return the relative cost of a step."""
    return STEP_COST[integrator] * (sweeps or 1) * (IMPLICIT_COST if friction_solver == "implicit" else 1.0)


def step_limit(scene: Scene, choice: StepChoice | None = None, bottles: int | None = None) -> StepLimit:
    """Return the limit on the steps of a valid scene with remedies.

    choice: of this scene, if known. bottles: on the line, for the expected speed. By default they are the most in a
    run, or with an endless infeed those at the start, but at least MANY.
    """
    choice = choose_steps(Plant.of(scene)) if choice is None else choice
    plant = choice.terms.plant
    most = plant.most_bottles if bottles is None else bottles
    bottles = max(MANY, len(plant.bottles)) if most is None else max(1, most)
    cost = step_cost(scene.accuracy.integrator, scene.friction_solver, scene.accuracy.sweeps)
    line = line_size(scene)
    before = tick_seconds(choice.steps * cost, bottles, line)
    tried = (_tried(scene, *candidate, before, bottles, line) for candidate in _candidates(scene, choice))
    least = 1.0 / WORTH
    helpful = [one for one in tried if one and one.faster >= least and one.steps <= WORTH * choice.steps]
    helpful.sort(key=lambda remedy: -remedy.faster)
    return StepLimit(
        steps=choice.steps,
        given=choice.given is not None,
        bounds=tuple(sorted(choice.bounds, key=lambda bound: bound.dt)),
        tick=scene.tick,
        step_cost=cost,
        bottles=bottles,
        line=line,
        remedies=tuple(remedy for remedy in helpful[:NAMED] if NEAR * remedy.faster >= helpful[0].faster),
    )


def with_remedy(scene: Scene, overrides: Mapping[str, Any]) -> Scene:
    """Return the scene with overrides. Raise SceneError if they are not valid for it."""
    return parse_again(scene.source_text, scene.source_name, {**parse_overrides(scene.overrides_text), **overrides})


def too_many(scene: Scene, choice: StepChoice) -> str:
    """Return why a scene of more than MOST_STEPS steps is refused, with a remedy."""
    remedies = step_limit(scene, choice).remedies
    helps = f", as with {remedies[0].sentence}" if remedies else ""
    return f"{choice.reason}; expected at most {MOST_STEPS} steps a tick{helps}"


def _candidates(scene: Scene, choice: StepChoice) -> Iterator[tuple[str, Mapping[str, Any]]]:
    """Yield candidates: words and overrides."""
    accuracy = scene.accuracy.model_dump()
    if choice.given is not None:
        free = accuracy | {"per_tick": None, "dt": None}
        yield f"without accuracy.{'dt' if accuracy['dt'] else 'per_tick'}", {"accuracy": free}
    # Without a warm start, implicit friction lets pressed contacts creep too fast: it is no cheaper equal.
    if scene.friction_solver != "implicit" and scene.accuracy.integrator in WARM:
        yield "friction_solver: implicit", {"friction_solver": "implicit"}
    for integrator in OTHERS:
        if accuracy["integrator"] != integrator:
            changed = {"accuracy": accuracy | {"integrator": integrator, "error": None}}
            yield f"accuracy: {{integrator: {integrator}}}", changed
    impact_speed = choice.terms.plant.impact_speed
    onset = _onset(scene, impact_speed)
    if onset is not None:
        words = f"damping: {{law: onset, speed: {impact_speed:g}}} where a restitution is given"
        yield words, {"contacts": onset}
        if scene.accuracy.integrator in ("leapfrog", "semi_implicit_euler"):
            both = {"contacts": onset, "accuracy": accuracy | {"integrator": "velocity_verlet"}}
            yield f"{words}, with accuracy: {{integrator: velocity_verlet}}", both
    coarser = COARSER.get(scene.accuracy.preset or DEFAULT)
    if coarser is not None and choice.given is None and scene.accuracy.tolerance is None:
        yield f"accuracy: {{preset: {coarser}}}, less exact", {"accuracy": accuracy | {"preset": coarser}}


def _onset(scene: Scene, speed: float) -> list[dict[str, Any]] | None:
    """Return the contacts with Hunt and Crossley's damping, which has no jump, instead of dashpots by restitution.

    Return None if no contact has such a dashpot.
    """
    contacts: list[dict[str, Any]] = []
    changed = False
    for contact in scene.contacts:
        data = contact.model_dump(mode="json", exclude_none=True)
        choice = DAMPING_CHOICES.get(contact.damping.law)
        if choice is not None and not choice.at_speed and contact.damping.restitution:
            data["damping"] = {"law": "onset", "restitution": contact.damping.restitution, "speed": speed}
            changed = True
        contacts.append(data)
    return contacts if changed else None


def _tried(
    scene: Scene, words: str, overrides: Mapping[str, Any], before: float, bottles: int, line: LineSize
) -> Remedy | None:
    """Return a candidate with steps and speed; None if it is not valid for the scene. before: s per tick without it."""
    try:
        changed = with_remedy(scene, overrides)
        steps = choose_steps(Plant.of(changed)).steps
    except SceneError:
        return None
    cost = step_cost(changed.accuracy.integrator, changed.friction_solver, changed.accuracy.sweeps)
    faster = before / tick_seconds(steps * cost, bottles, line)
    return Remedy(words, overrides, steps, faster) if steps <= MOST_STEPS else None


def _times(ratio: float) -> str:
    return f"{ratio:.2g} times" if ratio < 100.0 else f"{ratio:.0f} times"


def _steps(steps: int) -> str:
    return "1 step a tick" if steps == 1 else f"{steps} steps a tick"
