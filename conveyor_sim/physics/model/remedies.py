"""Tightest bound on the steps of a scene, and changes of the scene that lower the number of steps.

A remedy is a change of the scene file. Each candidate is tried: the steps of the changed scene are chosen, and only
changes that lower them by enough are reported, with the resulting number.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from conveyor_sim.errors import SceneError
from conveyor_sim.physics.model.step_choice import StepChoice, choose_steps
from conveyor_sim.physics.plant import Plant
from conveyor_sim.physics.timestep.bounds import Bound, fewest_steps
from conveyor_sim.physics.timestep.presets import DEFAULT
from conveyor_sim.scene.accuracy import MANY_STEPS, MOST_STEPS
from conveyor_sim.scene.contacts import DAMPING_CHOICES
from conveyor_sim.scene.load import parse_again
from conveyor_sim.scene.overrides import parse_overrides
from conveyor_sim.scene.schema import Scene

WORTH = 0.8
"""A remedy is reported if steps and cost per tick fall to this share or less."""

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
}
"""Cost of a step in evaluations of all forces or equal work."""

OTHERS = ("leapfrog", "velocity_verlet")
"""Integrators that a remedy may choose."""

BOTTLE_STEP = 3e-8
"""s per bottle and step on one core of the 2020s, rounded."""

BESIDE = 10
"""Cost of a step that does not depend on the number of bottles, in units of the cost of one bottle."""

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
    cost: float
    """Cost of a step with the remedy over that without it."""

    @property
    def price(self) -> float:
        """Cost of a tick with the remedy, in steps of the scene without it."""
        return self.steps * self.cost

    def sentence(self, before: int) -> str:
        """Return the remedy in words. before: steps without it."""
        return f"{self.words}: {_steps(self.steps)}, {_times(before / self.steps)} fewer"


@dataclass(frozen=True)
class StepLimit:
    """Limit on the time step of a scene, and remedies."""

    steps: int
    given: bool
    """True if the scene gives the steps, False if the bounds set them."""
    bounds: tuple[Bound, ...]
    """All bounds, the tightest first."""
    tick: float
    """s"""
    bottles: int | None
    """Largest number of bottles in a run; None without limit."""
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
        return "fewer steps: " + "; or ".join(remedy.sentence(self.steps) for remedy in self.remedies)

    def seconds(self, bottles: int) -> float:
        """Return the estimated computing time (s) on one core for a simulated second of `bottles` bottles."""
        return self.steps / self.tick * (bottles + BESIDE) * BOTTLE_STEP

    def _warning(self) -> str:
        bottles = 100 if self.bottles is None else max(1, self.bottles)
        seconds = self.seconds(bottles)
        text = f"{seconds:.2g}" if seconds < 100.0 else f"{seconds:.0f}"
        return f"slow: a simulated second of {bottles} bottles will take about {text} s of computing on one core"


def step_limit(scene: Scene, choice: StepChoice | None = None) -> StepLimit:
    """Return the limit on the steps of a valid scene with remedies. choice: of this scene, if known."""
    choice = choose_steps(Plant.of(scene)) if choice is None else choice
    tried = (_tried(scene, *candidate) for candidate in _candidates(scene, choice))
    helpful = [remedy for remedy in tried if remedy and max(remedy.price, remedy.steps) <= WORTH * choice.steps]
    helpful.sort(key=lambda remedy: remedy.price)
    return StepLimit(
        steps=choice.steps,
        given=choice.given is not None,
        bounds=tuple(sorted(choice.bounds, key=lambda bound: bound.dt)),
        tick=scene.tick,
        bottles=choice.terms.plant.most_bottles,
        remedies=tuple(remedy for remedy in helpful[:NAMED] if remedy.price <= NEAR * helpful[0].price),
    )


def with_remedy(scene: Scene, overrides: Mapping[str, Any]) -> Scene:
    """Return the scene with overrides. Raise SceneError if they are not valid for it."""
    return parse_again(scene.source_text, scene.source_name, {**parse_overrides(scene.overrides_text), **overrides})


def too_many(scene: Scene, choice: StepChoice) -> str:
    """Return why a scene of more than MOST_STEPS steps is refused, with a remedy."""
    remedies = step_limit(scene, choice).remedies
    helps = f", as with {remedies[0].sentence(choice.steps)}" if remedies else ""
    return f"{choice.reason}; expected at most {MOST_STEPS} steps a tick{helps}"


def _candidates(scene: Scene, choice: StepChoice) -> Iterator[tuple[str, Mapping[str, Any], float]]:
    """Yield candidates: words, overrides, cost of a step."""
    accuracy = scene.accuracy.model_dump()
    if choice.given is not None:
        free = accuracy | {"per_tick": None, "dt": None}
        yield f"without accuracy.{'dt' if accuracy['dt'] else 'per_tick'}", {"accuracy": free}, 1
    if scene.friction_solver != "implicit":
        yield "friction_solver: implicit", {"friction_solver": "implicit"}, 1
    for integrator in OTHERS:
        if accuracy["integrator"] != integrator:
            cost = STEP_COST[integrator] / STEP_COST[accuracy["integrator"]]
            extra = "" if cost <= 1.0 else f", at about {cost:g} times the cost of a step"
            changed = {"accuracy": accuracy | {"integrator": integrator, "error": None}}
            yield f"accuracy: {{integrator: {integrator}}}{extra}", changed, cost
    impact_speed = choice.terms.plant.impact_speed
    onset = _onset(scene, impact_speed)
    if onset is not None:
        words = f"damping: {{law: onset, speed: {impact_speed:g}}} where a restitution is given"
        yield words, {"contacts": onset}, 1
        if scene.accuracy.integrator in ("leapfrog", "semi_implicit_euler"):
            both = {"contacts": onset, "accuracy": accuracy | {"integrator": "velocity_verlet"}}
            yield f"{words}, with accuracy: {{integrator: velocity_verlet}}", both, 1
    coarser = COARSER.get(scene.accuracy.preset or DEFAULT)
    if coarser is not None and choice.given is None and scene.accuracy.tolerance is None:
        yield f"accuracy: {{preset: {coarser}}}, less exact", {"accuracy": accuracy | {"preset": coarser}}, 1


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


def _tried(scene: Scene, words: str, overrides: Mapping[str, Any], cost: float) -> Remedy | None:
    """Return a candidate with its steps; None if it is not valid for the scene."""
    try:
        steps = choose_steps(Plant.of(with_remedy(scene, overrides))).steps
    except SceneError:
        return None
    return Remedy(words, overrides, steps, cost) if steps <= MOST_STEPS else None


def _times(ratio: float) -> str:
    return f"{ratio:.2g} times" if ratio < 100.0 else f"{ratio:.0f} times"


def _steps(steps: int) -> str:
    return "1 step a tick" if steps == 1 else f"{steps} steps a tick"
