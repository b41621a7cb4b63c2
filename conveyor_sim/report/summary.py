# SPDX-License-Identifier: Apache-2.0
"""Summary of a run, equal for the node and for a run without ROS."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path

import numpy as np

from conveyor_sim.columns.damage import DamageColumns
from conveyor_sim.errors import ConveyorError
from conveyor_sim.physics.model.remedies import StepLimit
from conveyor_sim.physics.timestep.prediction import percent
from conveyor_sim.report.alarm_figures import AlarmFigures
from conveyor_sim.report.bottle_counts import BottleCounts
from conveyor_sim.run.force_check import ForceCheck, Pressed
from conveyor_sim.run.queue_check import QueueCheck
from conveyor_sim.run.speed import TopicCount

LOAD_WORDS = {
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
        """Return one sentence with these values; empty without any."""
        there = {field.name: worst for field in fields(LoadHistory) if (worst := getattr(self, field.name)) is not None}
        if not there:
            return ""
        return "at most " + "; ".join(
            f"{LOAD_WORDS[name].format(worst.value)} (bottle {worst.bottle})" for name, worst in there.items()
        )


FILE_NAME = "summary.json"


@dataclass(frozen=True)
class BeltFlow:
    """One belt: what is on it, and how often a bottle came onto it (seen from one recorded Bottles to the next)."""

    bottles: int
    """On it at the end."""
    per_minute: float
    """Bottles that came onto it, per simulated minute, over the whole run."""
    per_minute_second_half: float
    """Rate over the second half, when the line has filled, 1/min."""


@dataclass(frozen=True)
class Loop:
    """A closed loop, seen from the belt to which bottles return most often.

    A bottle has returned when it comes onto a belt that it had left, with at least two other belts in between.
    """

    belt: str
    returns: int
    per_minute: float
    per_minute_second_half: float


@dataclass(frozen=True)
class Energy:
    """The energy ledger at the end (`conveyor_sim.columns.ledger`), J."""

    belts: dict[str, float]
    """Work done by each belt."""
    fed: float
    removed: float
    stored: float
    """In motion, contacts and tangential springs."""
    base_friction: float
    contact_friction: float
    damping: float
    residual: float
    turnover: float
    rails: dict[str, float]
    """Work done by each rail that moves."""

    @property
    def sentence(self) -> str:
        """Return one sentence with these values."""
        share = self.residual / self.turnover if self.turnover else 0.0
        rails = f", {sum(self.rails.values()):.4g} J from rails that move" if self.rails else ""
        return (
            f"{sum(self.belts.values()):.4g} J from belts{rails}; {self.base_friction:.4g} J lost under bottles, "
            f"{self.contact_friction:.4g} J in friction at contacts, {self.damping:.4g} J in damping; "
            f"residual {percent(share)} of a turnover of {self.turnover:.4g} J"
        )


@dataclass(frozen=True)
class Summary:
    """The end-of-run account. Quantities that were not recorded are None."""

    scene: str
    bag: str
    simulated: float
    """s"""
    wall: float | None
    """s"""
    bottles: BottleCounts
    """Numbers of bottles at the end; present alone without recorded events."""
    on_floor: int
    """Number of these bottles that are on no belt."""
    belts: dict[str, BeltFlow]
    loop: Loop | None
    """None if no bottle came back."""
    peak_force: float | None
    """N, the largest normal contact force of the run (accumulated every step); None if the scene has no peaks."""
    peak_force_99: float | None
    """N, 99th percentile over bottles and output intervals with a contact of the peak force in the interval."""
    setting: str
    """Integrator and time step, and why."""
    predicted: str | None
    """The errors to expect; None if this version refuses the recorded scene."""
    limit: StepLimit | None
    """Bound that sets the number of steps, with remedies; None if this version would choose another number."""
    achieved: ForceCheck | None
    """Check of the peak force; None if it or its prediction is unknown."""
    pressed: Pressed | None
    """Largest sustained force; None if unknown, or if no bound on the time step depends on it."""
    queue: QueueCheck | None
    """Longest queue with integrator impulses; None with others, and if bottles were not recorded."""
    warnings: list[str]
    """Sentences on settings of the scene that make results wrong; empty if this version refuses the scene."""
    guard: dict[str, int]
    """Number of guard events by kind (`GuardEvent.kind`)."""
    guard_texts: list[str]
    """Texts of the first guard events."""
    energy: Energy | None
    """None if no energy ledger was recorded."""
    borne: LoadHistory | None
    """Loads on the bottles; None if it was not recorded."""
    from_impulses: bool
    """True if energy, loads and peaks come from impulses, with integrator impulses, and not from forces."""
    damage_events: dict[str, int]
    """Number of passed limits, by limit."""
    damage_texts: list[str]
    """Texts of the first passed limits."""
    alarms: AlarmFigures | None
    """None if events were not recorded."""
    commands: int
    refused: int
    """Number of refused commands."""
    occasions: int | None
    """On how many occasions: what a controller has no control of counts once until hands change, however long it goes
    on commanding it; None if events were not recorded.
    """
    topics: dict[str, TopicCount]

    @property
    def energy_sentence(self) -> str:
        """Return one sentence on the energy ledger; empty without one."""
        return "" if self.energy is None else self.energy.sentence + self.origin

    @property
    def load_sentence(self) -> str:
        """Return one sentence on the loads on bottles; empty without any."""
        loads = "" if self.borne is None else self.borne.sentence
        return loads + self.origin if loads else ""

    @property
    def origin(self) -> str:
        """Return a clause that marks figures from impulses, with the comma before it; empty with forces."""
        return ", from impulses" if self.from_impulses else ""

    @property
    def real_time_factor(self) -> float | None:
        """Simulated over wall time."""
        return self.simulated / self.wall if self.wall else None


def write_summary(summary: Summary, folder: Path) -> Path:
    """Write summary.json into the folder and return its path. Raise ConveyorError if it can't be written."""
    file = folder / FILE_NAME
    content = {**asdict(replace(summary, limit=None)), "real_time_factor": summary.real_time_factor}
    del content["limit"]
    content["steps"] = [] if summary.limit is None else summary.limit.lines
    try:
        file.write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")
    except OSError as error:
        raise ConveyorError(f"{file}: can't be written ({error.strerror})") from error
    return file
