# SPDX-License-Identifier: Apache-2.0
"""One row of the table of hard cases: its scene, what is done to it, and what is expected of it."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from conveyor_sim.physics.timestep.presets import PRESETS
from conveyor_sim.scene import Scene, load_scene, parse_scene
from conveyor_sim.scene.yaml_lines import Document

ROOT = Path(__file__).resolve().parents[2]
TABLE = Path(__file__).with_name("table.yaml")

VARIANTS = ("plain", "implicit", "spring", "ring")
"""Sets of effects: as the row says; friction solved implicitly; contacts with tangential springs; ring bases."""

IMPULSES: Mapping[str, Mapping[str, Any]] = {
    "4x1": {"per_tick": 4, "sweeps": 1},
    "8x2": {"per_tick": 8, "sweeps": 2},
    "16x2": {"per_tick": 16, "sweeps": 2},
}
"""Settings of integrator impulses, which take the place of presets."""

PROMISED = 0.01
"""Error of such a setting in what a row expects as a multiple of the promise of a preset: impacts are exact."""

SPRING, SPRING_DAMPING = 0.5, 1.0
"""Tangential stiffness over the normal one, and its damping (kg/s), in the variant `spring`."""

RING = 0.85
"""Base radius over the radius, in the variant `ring`."""

RAILS = ("rails", "stars", "screws")
"""Fields of parts that touch bottles, with a material."""

UNMEASURED = ("chatter", "residual")
"""What can't be measured on every run (`measures.py`)."""


@dataclass(frozen=True)
class Case:
    """A row. Times in s of simulated time."""

    name: str
    family: str
    """The heading it stands under."""
    hard: str
    """What is hard, in a line."""
    given: Mapping[str, Any]
    """Fields of the scene, or `file`: a scene of the project."""
    expect: Mapping[str, Any]
    """By measure: [least, greatest], {is, within} or {is, promise}; see `broken`."""
    duration: float
    """In the matrix."""
    short: float | None = None
    """In `make test`, where the whole takes too long; None: the same."""
    why_short: str = ""
    settled: float = 0.0
    """From when on drift, travel and means are taken; of the short run where there is one."""
    commands: Sequence[Mapping[str, float]] = ()
    """`at`, and belts with their speeds (m/s), or whole names of commands or faults with their values."""
    ramp: Mapping[str, Any] = field(default_factory=dict)
    """`belt`, `from`, `to` (m/s) and `acceleration` (m/s^2): a command every tick."""
    put: Sequence[Mapping[str, Any]] = ()
    """`at`, `bottle`, and `by` (m) or `push` (m/s): a bottle displaced from outside. `taken`: it is removed."""
    saved: float | None = None
    """When the run is saved and goes on from its checkpoint."""
    stiffness: float | None = None
    """N/m, in place of that of all contacts of glass."""
    variants: Sequence[str] = ("plain",)
    stops: str = ""
    """The sentence that the run must end with, as a regular expression."""
    refused: str = ""
    """What the scene must be refused with."""
    command_refused: str = ""
    """What every command must be refused with."""
    integrators: Sequence[str] = ()
    """In the matrix; none: all."""
    presets: Sequence[str] = ()
    """In the matrix; none: all."""
    work: float = 1.0
    """How many times as long as other rows a run may take in the matrix."""
    limits: Mapping[str, str] = field(default_factory=dict)
    """By integrator and preset, or integrator alone: a known limit, in a sentence; that run need not keep what is
    expected."""

    def __post_init__(self) -> None:
        unknown = set(self.variants) - set(VARIANTS)
        if unknown:
            raise ValueError(f"{self.name}: variants {sorted(unknown)} given, expected some of {VARIANTS}")

    def seconds(self, short: bool) -> float:
        """Duration, s."""
        return self.short if short and self.short is not None else self.duration

    def scene(
        self,
        integrator: str = "leapfrog",
        preset: str = "standard",
        variant: str = "",
        short: bool = True,
        ledger: bool = True,
    ) -> Scene:
        """The scene as it is run. Raises SceneError where it is refused.

        preset: or, with impulses, one of IMPULSES. ledger: whether the ledger of energy is kept, from which the
        residual is measured.
        """
        variant = variant or self.variants[0]
        given = dict(self.given)
        tick = given.get("tick", 0.01)
        accuracy: dict[str, Any] = {"preset": preset, "integrator": integrator}
        if integrator == "impulses":
            given.pop("accuracy", None)
            accuracy = {"preset": None, "integrator": integrator, **IMPULSES[preset]}
            ledger = False
        elif "accuracy" in given:
            accuracy = {**given["accuracy"], "integrator": integrator}
        common: dict[str, Any] = {
            "duration": self.seconds(short),
            "accuracy": accuracy,
            "outputs": {**dict.fromkeys(Scene.TOPICS, 0), "ledger": 1.0 / tick if ledger else 0},
            "effects": {"peaks": "on"},
        }
        if "file" in given:
            whole = {**common, "accuracy": {"per_tick": None, "dt": None, **accuracy}}
            return load_scene(ROOT / given["file"], whole)
        fields = {"name": self.name, **common, **given, "accuracy": accuracy}
        fields["effects"] = {**common["effects"], "rotation": "on", "unequal_radii": "on", **given.get("effects", {})}
        if self.stiffness is not None:
            fields["contacts"] = [{**contact, "stiffness": self.stiffness} for contact in fields["contacts"]]
        text = json.dumps(with_annex(_varied(fields, variant)))
        # YAML has other words for what is not a number.
        return parse_scene(
            text.replace(": NaN", ": .nan").replace("[NaN", "[.nan").replace("Infinity", ".inf"), TABLE.name
        )

    def broken(
        self, measures: Mapping[str, float], sentence: str, preset: str = "standard", only: Sequence[str] = ()
    ) -> list[str]:
        """What is not as expected, a sentence each. only: of a run that ended early, what must not grow too large.

        An expectation is [least, greatest]; or {is: value, within: share of it}; or {is: value, promise: so many times
        the error in contact force that the preset promises}.
        """
        if self.stops:
            if not re.search(self.stops, sentence):
                return [f"ended with {sentence!r}, expected a sentence that matches {self.stops!r}"]
        elif sentence:
            return [f"stopped: {sentence}"]
        wrong = []
        for name, wanted in self.expect.items():
            least, greatest = bounds(wanted, preset)
            if only:
                least, greatest = (-math.inf, greatest) if name in only else (-math.inf, math.inf)
            value = measures.get(name, math.nan)
            if math.isnan(value) and (only or name in UNMEASURED):
                continue
            if not least <= value <= greatest:
                wrong.append(f"{name} {value:.6g} measured, expected {least:.6g} to {greatest:.6g}")
        return wrong


def bounds(wanted: Any, preset: str) -> tuple[float, float]:
    """Least and greatest value of an expectation."""
    if isinstance(wanted, Mapping):
        promised = PROMISED if preset in IMPULSES else PRESETS[preset]  # type: ignore[index]
        share = wanted["within"] if "within" in wanted else wanted["promise"] * promised
        value = float(wanted["is"])
        return value - share * abs(value), value + share * abs(value)
    least, greatest = wanted
    return float(least), float(greatest)


def read_table() -> list[Case]:
    """All rows, in order."""
    data = Document(TABLE.read_text(encoding="utf-8"), TABLE.name).data
    return [
        Case(family=family, given=row["scene"], **{key: value for key, value in row.items() if key != "scene"})
        for family, rows in data["cases"].items()
        for row in rows
    ]


def _varied(fields: dict[str, Any], variant: str) -> dict[str, Any]:
    if variant == "implicit":
        return {**fields, "friction_solver": "implicit"}
    if variant == "spring":
        contacts = [
            {**contact, "tangential": {"stiffness": SPRING * contact["stiffness"], "damping": SPRING_DAMPING}}
            for contact in fields["contacts"]
        ]
        return {**fields, "contacts": contacts}
    if variant == "ring":
        types = {name: {**kind, "base_radius": RING * kind["radius"]} for name, kind in fields["bottle_types"].items()}
        return {**fields, "bottle_types": types}
    return fields


def with_annex(fields: dict[str, Any]) -> dict[str, Any]:
    """The scene, and far from where it happens one of everything, so that all rows share their compiled kernels.

    An infeed that never opens, a rail, an arc and two belts of materials of their own, soft enough to bound no step.
    """
    types = fields["bottle_types"].values()
    # The heaviest and the smallest type have a say in time steps and in how lists are made.
    radius, mass = max(kind["radius"] for kind in types), min(kind["mass"] for kind in types)
    kind = {"radius": radius, "mass": mass, "material": "annex"}
    x, y = fields.pop("annex", [3.0, -3.0])
    materials = dict.fromkeys([*(kind["material"] for kind in types), "annex"])
    rails = {rail["material"] for field in RAILS for rail in fields.get(field, {}).values()}
    carriers = {belt["material"] for belt in fields.get("belts", {}).values()}
    law: dict[str, Any] = {"stiffness": 1e-3, "damping": {"law": "normal", "coefficient": 1e-6}, "friction": 1e-6}
    if any("tangential" in contact for contact in fields["contacts"]):
        law["tangential"] = {"stiffness": 1e-3}
    pairs = [*((material, "annex") for material in materials)]
    pairs += [(material, "annex_rail") for material in materials] + [("annex", rail) for rail in rails]
    belt = {"material": "annex_belt", "width": 0.1, "speed": 0.0}
    return {
        **fields,
        "contacts": [*fields["contacts"], *({"between": pair, **law} for pair in pairs)],
        "base": [
            *fields.get("base", []),
            *({"between": ["annex", carrier], "friction": 1e-6} for carrier in sorted(carriers)),
            *({"between": [material, "annex_belt"], "friction": 1e-6} for material in materials),
        ],
        "bottle_types": {**fields["bottle_types"], "annex": kind},
        "belts": {
            **fields.get("belts", {}),
            "annex_belt": {**belt, "kind": "straight", "start": [x, y - 0.6], "angle": 0, "length": 0.1},
            "annex_bend": {**belt, "kind": "curved", "centre": [x, y - 0.9], "inner_radius": 0.1, "start_angle": 0,
                           "span": 1.0},
        },
        "rails": {
            **fields.get("rails", {}),
            "annex_rail": {"kind": "segment", "from": [x, y - 1.2], "to": [x + 0.1, y - 1.2], "material": "annex_rail"},
            "annex_arc": {"kind": "arc", "centre": [x, y - 1.5], "radius": 0.1, "start_angle": 0, "span": 1.0,
                          "material": "annex_rail"},
        },
        "infeeds": {
            **fields.get("infeeds", {}),
            "annex": {"bottle": "annex", "position": [x, y], "direction": 0, "speed": 0, "rate": 1, "count": 1,
                      "start": 1e9},
        },
    }  # fmt: skip
