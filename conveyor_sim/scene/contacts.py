# SPDX-License-Identifier: Apache-2.0
"""Pairs of materials in a scene file: contacts with their laws, and friction of bottles on belts."""

from collections.abc import Mapping
from typing import Annotated, Any, Literal, NamedTuple

from annotated_types import Len
from pydantic import SerializerFunctionWrapHandler, model_serializer

from conveyor_sim.scene.part import Part
from conveyor_sim.scene.types import Component, NotNegative, OrText, Pair, Positive, Restitution, Says, quantity

ELASTIC = ("stiffness", "hertz_stiffness", "table")
"""Fields of a contact that choose an elastic law."""


class DampingChoice(NamedTuple):
    """Fields that are valid with a damping law."""

    restitution: tuple[str, ...]
    """Elastic laws with which it can be given by a restitution."""
    at_speed: bool = False
    """True if the restitution depends on the impact speed, so that a speed is needed."""
    elastic: tuple[str, ...] = ELASTIC
    """Elastic laws with which it is valid."""


DAMPING_CHOICES: Mapping[str, DampingChoice] = {
    "paper": DampingChoice(("stiffness",)),
    "normal": DampingChoice(("stiffness", "hertz_stiffness")),
    "onset": DampingChoice(ELASTIC, at_speed=True),
    "viscoelastic": DampingChoice(("hertz_stiffness",), at_speed=True, elastic=("hertz_stiffness",)),
}
"""Values of `Damping.law` except none. The laws are in `engine/contact/laws/`."""

DampingEffect = Literal["paper_damping", "normal_damping", "tsuji_damping", "onset_damping", "viscoelastic_damping"]
"""Names of the effects of these laws."""

TablePoints = Annotated[
    tuple[tuple[Component, Component], ...],
    Len(1),
    OrText(),
    Says("the path of a CSV file with columns overlap and force, or a list of points [overlap, force]"),
]


class Damping(Part):
    """Damping of a contact, by a coefficient or by the restitution of a head-on impact.

    A restitution can be given with law `normal` for linear and Hertz contacts, with `paper` for linear ones, with
    `onset`, at a speed, for all, and with `viscoelastic`, at a speed, for Hertz contacts.
    """

    law: Literal["none", "paper", "normal", "onset", "viscoelastic"] = quantity(
        "none; paper: -c v*, v* the relative velocity of the contact points, in all directions (22); "
        "normal: along the normal only, and a contact never pulls; "
        "onset: the elastic force times 1 + c x speed of approach (Hunt and Crossley), so that it sets in at zero; "
        "viscoelastic: c x overlap^0.5 x speed of approach on a Hertz contact, which never pulls (Kuwabara and Kono): "
        "a restitution that falls with the speed, as on glass.",
        default="none",
    )
    coefficient: NotNegative = quantity(
        "Damping coefficient c; for onset in s/m, for viscoelastic in kg/(s m^0.5).",
        "kg/s or s/m or kg/(s m^0.5)",
        default=0.0,
    )
    restitution: Restitution | None = quantity(
        "Speed after a head-on impact divided by the speed before it, instead of the coefficient.", "1", default=None
    )
    speed: Positive | None = quantity(
        "Impact speed at which the restitution holds; needed for onset and viscoelastic, whose restitution "
        "depends on the speed.",
        "m/s",
        default=None,
    )

    @model_serializer(mode="wrap")
    def _without_coefficient(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Leave out the coefficient beside a restitution, so that a scene can be read again from its fields."""
        fields: dict[str, Any] = handler(self)
        return fields if self.restitution is None else {k: v for k, v in fields.items() if k != "coefficient"}


class Tangential(Part):
    """A tangential spring with memory (Cundall and Strack): bottles can rest on it, and form arches.

    One of `stiffness` and `stiffness_ratio` is needed.
    """

    stiffness: Positive | None = quantity("Stiffness of the spring.", "N/m", default=None)
    stiffness_ratio: Positive | None = quantity(
        "For a Hertz contact: tangential over normal stiffness, both growing with the overlap (Mindlin). Of bodies of "
        "one material with Poisson's ratio nu it is 2 (1 - nu) / (2 - nu): 0.88 for glass, 0.82 for steel.",
        "1",
        default=None,
    )
    damping: NotNegative = quantity("Damping coefficient beside the spring.", "kg/s", default=0.0)


class Contact(Part):
    """Contact law of two materials: bottle and bottle, or bottle and rail.

    One of `stiffness`, `hertz_stiffness` and `table` is needed.
    """

    between: Pair = quantity("The two materials, in any order.")
    stiffness: Positive | None = quantity("Stiffness k of a linear contact, N = k x overlap (23).", "N/m", default=None)
    hertz_stiffness: Positive | None = quantity(
        "Stiffness of a Hertz contact, N = k x overlap^1.5.", "N/m^1.5", default=None
    )
    table: TablePoints | None = quantity(
        "Force at each overlap, measured or computed; linear between the points, with the last slope continued. "
        "A path is taken from the scene file's folder and may not leave it, unless `--outside-tables` is given.",
        "m, N",
        default=None,
    )
    damping: Damping = quantity("Damping of the contact.", default=Damping.model_construct())
    friction: NotNegative = quantity("Coefficient of friction of the contact.", "1", default=0.0)
    tangential: Tangential | None = quantity(
        "A tangential spring with history in place of the friction curve; needs friction, and "
        "leapfrog, semi_implicit_euler, velocity_verlet or rk4. Left out: none.",
        default=None,
    )


class BaseSpring(Part):
    """A spring between a base and a point of its belt, which holds a bottle where it stands."""

    stiffness: Positive = quantity("Stiffness k of the spring.", "N/m")
    damping: NotNegative = quantity(
        "Damping coefficient beside the spring; 2 sqrt(k m) is critical.", "kg/s", default=0.0
    )


class Base(Part):
    """Friction of bottles that stand on a belt or a plate."""

    between: Pair = quantity("Material of the bottle, then material of the belt or plate.")
    friction: NotNegative = quantity("Coefficient of friction of the bottle's base on the belt or plate.", "1")
    tangential: BaseSpring | None = quantity(
        "Static friction: a tangential spring with history between base and belt, in place of the friction curve, on "
        "which bottles creep; needs friction, and bottles that stand on points. Left out: none.",
        default=None,
    )
