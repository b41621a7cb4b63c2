"""The effects, declared once each: what law they add and what in a scene calls for them.

What no scene asks for is absent: its arrays are None and its branch is not compiled (engine/compile.py). An effect here
says whether and why; `model.py` builds its arrays; its law is one file in `engine/`.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

from conveyor_sim.laws import base_friction
from conveyor_sim.scene.geometry import ArcPiece, initial_bottles, rail_shapes
from conveyor_sim.scene.schema import Contact, CurvedBelt, Scene, Single


@dataclass(frozen=True)
class Effect:
    """One effect. `called_for` returns what in a scene calls for it, or None."""

    name: str
    law: str
    source: str
    called_for: Callable[[Scene], str | None]
    absent: str
    """What is missing when nothing calls for it."""


@dataclass(frozen=True)
class EffectChoice:
    """Whether an effect is on for a scene, and why."""

    name: str
    on: bool
    why: str


def choose_effects(scene: Scene) -> tuple[EffectChoice, ...]:
    """Decide every effect for a scene, in the order of EFFECTS."""
    choices = []
    for effect in EFFECTS:
        reason = effect.called_for(scene)
        choices.append(EffectChoice(effect.name, reason is not None, effect.absent if reason is None else reason))
    return tuple(choices)


def most_bottles(scene: Scene) -> int | None:
    """Bottles that a run can hold at most, None if an infeed has no end."""
    fed = 0
    for infeed in scene.infeeds.values():
        if infeed.count is None:
            return None
        fed += infeed.count
    return fed + len(initial_bottles(scene))


def _pairs(scene: Scene) -> str | None:
    most = most_bottles(scene)
    if most is None:
        return "infeeds: an infeed without end"
    return f"{most} bottles" if most > 1 else None


def _segments(scene: Scene) -> str | None:
    for rail in rail_shapes(scene):
        if any(not isinstance(piece, ArcPiece) for piece in rail.pieces):
            return f"rails.{rail.name}"
    return None


def _arcs(scene: Scene) -> str | None:
    for rail in rail_shapes(scene):
        if any(isinstance(piece, ArcPiece) for piece in rail.pieces):
            return f"rails.{rail.name}"
    return None


def _contacts_in_use(scene: Scene) -> Iterator[tuple[int, Contact]]:
    """The contacts between materials that can meet here: bottles if there are several, bottles and rails."""
    bottles = {kind.material for kind in scene.bottle_types.values()}
    rails = {rail.material for rail in rail_shapes(scene)}
    for index, contact in enumerate(scene.contacts):
        a, b = contact.between
        of_bottles = {a, b} <= bottles and _pairs(scene) is not None
        if of_bottles or (a in bottles and b in rails) or (b in bottles and a in rails):
            yield index, contact


def _damping(law: str) -> Callable[[Scene], str | None]:
    def called_for(scene: Scene) -> str | None:
        for index, contact in _contacts_in_use(scene):
            if contact.damping.law == law and contact.damping.coefficient > 0.0:
                return f"contacts.{index}.damping: {contact.damping.coefficient:g} kg/s"
        return None

    return called_for


def _contact_friction(scene: Scene) -> str | None:
    for index, contact in _contacts_in_use(scene):
        if contact.friction > 0.0:
            return f"contacts.{index}.friction: {contact.friction:g}"
    return None


def _rotation(scene: Scene) -> str | None:
    for reason in (_contact_friction(scene), _damping("paper")(scene)):
        if reason is not None:
            return reason
    for index, bottle in enumerate(scene.bottles):
        if isinstance(bottle, Single) and bottle.spin != 0.0:
            return f"bottles.{index}.spin: {bottle.spin:g} rad/s"
        if isinstance(bottle, Single) and bottle.angle != 0.0:
            return f"bottles.{index}.angle: {bottle.angle:g} rad"
    return None


def _base_friction(scene: Scene) -> str | None:
    table = base_friction(scene)
    if scene.gravity == 0.0 or not table.any():
        return None
    for row, name in enumerate(scene.belts):
        if table[row].any():
            return f"belts.{name}: friction {table[row].max():g}"
    return f"floor: friction {table[-1].max():g}"


def _belts(scene: Scene) -> str | None:
    return f"belts.{next(iter(scene.belts))}" if scene.belts and _base_friction(scene) else None


def _curved_belts(scene: Scene) -> str | None:
    for name, belt in scene.belts.items():
        if isinstance(belt, CurvedBelt) and _base_friction(scene):
            return f"belts.{name}"
    return None


EFFECTS: tuple[Effect, ...] = (
    Effect("bottle_contact", "N = k delta between bottles", "(22)-(23)", _pairs, "a single bottle"),
    Effect(
        "segment_rails", "N = k delta at the nearest point of a segment", "(22)-(23)", _segments, "no straight rail"
    ),
    Effect("arc_rails", "N = k delta at the nearest point of an arc", "(21)-(23)", _arcs, "no arc rail"),
    Effect("paper_damping", "-c v*, isotropic", "(22)", _damping("paper"), "no contact with damping law paper"),
    Effect(
        "normal_damping",
        "N = max(0, k delta + c v_n)",
        "added",
        _damping("normal"),
        "no contact with damping law normal",
    ),
    Effect("contact_friction", "mu N p(s), at the rim", "(7)-(10)", _contact_friction, "no contact with friction"),
    Effect(
        "rotation",
        "J alpha = M",
        "(1)",
        _rotation,
        "nothing turns a bottle: no contact friction, no paper damping, no spin, no angle",
    ),
    Effect(
        "base_friction", "mu m g p(s), at the axis", "(7)-(10), (15)", _base_friction, "no friction under the bottles"
    ),
    Effect("belts", "the last listed belt under the axis carries", "(11)-(15)", _belts, "no belt with friction"),
    Effect(
        "curved_belts", "surface velocity Omega x (r - C)", "Table 1", _curved_belts, "no curved belt with friction"
    ),
)
