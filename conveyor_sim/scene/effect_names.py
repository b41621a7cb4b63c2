# SPDX-License-Identifier: Apache-2.0
"""Names of the effects in a scene file. `conveyor_sim/physics/effects/` declares them."""

from typing import Annotated, Literal, get_args

from conveyor_sim.scene.contacts import DampingEffect
from conveyor_sim.scene.types import Says
from conveyor_sim.scene.words import listed

EffectName = Literal[
    "bottle_contact",
    "segment_rails",
    "arc_rails",
    "moving_rails",
    "unequal_radii",
    "linear",
    "hertz",
    "table",
    DampingEffect,
    "contact_friction",
    "base_friction",
    "atan_friction",
    "implicit_friction",
    "tangential_spring",
    "static_friction",
    "ring_base",
    "belts",
    "curved_belts",
    "vibration",
    "rotation",
    "infeed",
    "outfeed",
    "peaks",
    "contact_arrays",
    "energy_ledger",
    "scuffing",
    "crushing",
    "impacts",
    "tipping",
    "riding",
    "sleeping",
]

EFFECT_NAMES: tuple[EffectName, ...] = get_args(EffectName)

Forced = dict[
    Annotated[EffectName, Says(f"the name of an effect: {listed(list(EFFECT_NAMES))}")],
    Annotated[Literal["on", "off"], Says('"on" or "off"')],
]
