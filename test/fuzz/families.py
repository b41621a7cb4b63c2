# SPDX-License-Identifier: Apache-2.0
"""Families of scenes: one mixture of effects and one integrator each, for every new mixture is compiled."""

from __future__ import annotations

import random
from dataclasses import dataclass, replace
from typing import Any

INTEGRATORS = (
    "leapfrog",
    "semi_implicit_euler",
    "velocity_verlet",
    "rk4",
    "dormand_prince",
    "linearly_implicit",
    "impulses",
)
MOVING = INTEGRATORS[:3]
"""Those that move rails, and take springs under bases."""
STEPPED = INTEGRATORS[:4]
"""Those with tangential springs and implicit friction."""
ELASTIC = ("linear", "hertz", "table")
DAMPING = ("none", "paper", "normal", "tsuji", "onset", "viscoelastic")
FORCED = (
    {},
    {"peaks": "on", "contact_arrays": "on"},
    {"peaks": "off", "contact_arrays": "off"},
    {"unequal_radii": "on"},
    {"rotation": "on"},
    {"bottle_contact": "off"},
    {"segment_rails": "off"},
    {"arc_rails": "off"},
    {"base_friction": "off"},
    {"belts": "off"},
    {"infeed": "off"},
    {"outfeed": "off"},
    {"rotation": "off", "contact_friction": "off", "paper_damping": "off", "tangential_spring": "off"},
)
"""What a scene may force, one of them a family."""


@dataclass(frozen=True)
class Family:
    """One mixture of effects; a scene of it has at least one of everything named."""

    integrator: str = "leapfrog"
    implicit_friction: bool = False
    atan: bool = False
    elastic: tuple[str, ...] = ("linear",)
    damping: tuple[str, ...] = ("normal",)
    friction: bool = True
    springs: bool = False
    base_friction: bool = True
    base_springs: bool = False
    ring: bool = False
    belts: tuple[str, ...] = ("straight",)
    rails: tuple[str, ...] = ("segment",)
    types: int = 1
    infeeds: bool = False
    outfeeds: bool = False
    drives: bool = False
    movers: bool = False
    lifts: bool = False
    """One of the movers leaves the plane."""
    machines: bool = False
    sensors: bool = False
    ledger: bool = False
    vibration: bool = False
    axes: bool = False
    wheels: bool = False
    """Star wheels with carousels, screws, side belts, and the axes that turn them."""
    side_belts: bool = True
    """Side belts are among the wheels."""
    alike: bool = False
    """All scenes have the same effects: one of each kind of wheel, and a limit of force for the first mover."""
    panel: bool = False
    effects: tuple[tuple[str, str], ...] = ()

    def __str__(self) -> str:
        parts = [self.integrator, *self.elastic, *(f"{law} damping" for law in self.damping)]
        parts += [
            name
            for name in ("implicit_friction", "atan", "friction", "springs", "base_springs", "ring")
            if getattr(self, name)
        ]
        parts += [
            name
            for name in (
                "drives",
                "movers",
                "lifts",
                "machines",
                "sensors",
                "ledger",
                "vibration",
                "axes",
                "wheels",
                "panel",
            )
            if getattr(self, name)
        ]
        parts += [*(f"{kind} belts" for kind in self.belts), *(f"{kind}s" for kind in self.rails)]
        parts += [f"{self.types} types", *(f"{name} {value}" for name, value in self.effects)]
        return ", ".join(parts)


def random_family(seed: int) -> Family:
    """The family of a seed; integrators take turns, everything else is drawn."""
    draw = random.Random(seed)
    integrator = INTEGRATORS[seed % len(INTEGRATORS)]
    stepped = integrator in STEPPED
    friction = draw.random() < 0.8
    family = Family(
        integrator=integrator,
        implicit_friction=stepped and draw.random() < 0.3,
        atan=draw.random() < 0.25,
        elastic=_some(draw, ELASTIC),
        damping=_some(draw, DAMPING),
        friction=friction,
        springs=stepped and friction and draw.random() < 0.4,
        base_friction=draw.random() < 0.85,
        ring=draw.random() < 0.3,
        belts=_some(draw, ("straight", "curved"), least=0),
        rails=_some(draw, ("segment", "arc"), least=0),
        types=draw.choice((1, 1, 2, 3)),
        infeeds=draw.random() < 0.6,
        outfeeds=draw.random() < 0.4,
        effects=tuple(draw.choice(FORCED if draw.random() < 0.5 else FORCED[:1]).items()),
    )
    move = integrator in MOVING
    family = replace(
        family,
        base_springs=move and family.base_friction and not family.ring and draw.random() < 0.4,
        drives=draw.random() < 0.5,
        movers=move and draw.random() < 0.6,
        machines=draw.random() < 0.5,
        sensors=draw.random() < 0.5,
        ledger=draw.random() < 0.3,
        vibration=move and draw.random() < 0.3,
        axes=draw.random() < 0.3,
    )
    family = replace(family, lifts=family.movers and draw.random() < 0.3)
    family = replace(family, panel=draw.random() < 0.4)
    family = replace(family, wheels=move and draw.random() < 0.3)
    return _of_impulses(family, draw) if integrator == "impulses" else family


def _of_impulses(family: Family, draw: random.Random) -> Family:
    """Return a family without the laws that integrator impulses refuses; in one of eight as it is, to be refused."""
    if draw.random() < 0.125:
        return family
    damping = draw.choice((("none",), ("normal",), ("none", "normal")))
    family = replace(family, elastic=("linear",), damping=damping, atan=False, ring=False)
    movers, wheels = draw.random() < 0.6, draw.random() < 0.3
    return replace(family, movers=movers, lifts=movers and draw.random() < 0.3, wheels=wheels)


def _some(draw: random.Random, names: tuple[str, ...], least: int = 1) -> tuple[str, ...]:
    """A few of the names, in their order."""
    chosen: Any = draw.sample(names, draw.randint(least, min(2, len(names))))
    return tuple(name for name in names if name in chosen)


_PLAIN = Family(
    elastic=("linear",),
    damping=("paper", "normal"),
    belts=("straight", "curved"),
    rails=("segment", "arc"),
    types=2,
    infeeds=True,
    outfeeds=True,
)

_IMPULSES = replace(_PLAIN, integrator="impulses", damping=("normal",), drives=True, alike=True)

CI_FAMILIES = (
    replace(_PLAIN, drives=True, machines=True, sensors=True, axes=True, panel=True),
    Family(
        types=2,
        drives=True,
        movers=True,
        lifts=True,
        machines=True,
        sensors=True,
        ledger=True,
        vibration=True,
        alike=True,
    ),
    Family(rails=("segment", "arc"), wheels=True, alike=True, panel=True, infeeds=True, ledger=True),
    # The step of config/brewery.yaml: it takes longest to compile.
    replace(_IMPULSES, belts=("straight",), movers=True, wheels=True, side_belts=False),
    replace(_IMPULSES, wheels=True, ledger=True),
)
"""Few mixtures of effects, so that CI compiles few kernels: devices call for none but rails that move."""
