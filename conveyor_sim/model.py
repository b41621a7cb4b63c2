"""Scene -> Model: the constant arrays, the chosen effects and why, the time step and its reason."""

import platform
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.metadata import version

import llvmlite.binding as llvm
import numpy as np

from conveyor_sim.effects import EffectChoice, choose_effects, most_bottles
from conveyor_sim.engine.arrays import F8, Arcs, PairLaw, RailLaw, Segments, Settings, StaticGrid
from conveyor_sim.engine.compile import ENGINE_HASH
from conveyor_sim.laws import base_friction, pair_law, rail_law
from conveyor_sim.line.process_image import ProcessImage, process_image
from conveyor_sim.plant import plant_grid, rail_arrays
from conveyor_sim.scene.geometry import BeltShape, RailShape, belt_shapes, rail_shapes
from conveyor_sim.scene.schema import Scene
from conveyor_sim.timestep import (
    Bound,
    base_friction_bound,
    contact_bound,
    contact_friction_bound,
    damping_bound,
    lattice_bound,
    steps_per_tick,
)
from conveyor_sim.version import __version__, sources_hash

SKIN = 0.2
"""Of the smallest radius: the distance that keeps rebuilds rare and lists short on dense tables."""

ENDLESS_QUEUE = 100
"""Bottles assumed to press on each other where an infeed has no end."""


@dataclass(frozen=True, eq=False)
class Model:
    """Everything about a scene that does not change while it runs. T types, H belts, M rail materials."""

    name: str
    dt: float
    """s"""
    steps_per_tick: int
    tick_ns: int
    dt_reason: str
    bounds: tuple[Bound, ...]
    integrator: str
    effects: tuple[EffectChoice, ...]
    belts: tuple[str, ...]
    rails: tuple[str, ...]
    bottle_types: tuple[str, ...]
    type_radius: F8
    """(T,), m"""
    type_mass: F8
    """(T,), kg"""
    type_inertia: F8
    """(T,), kg m^2"""
    belt_shapes: tuple[BeltShape, ...]
    rail_shapes: tuple[RailShape, ...]
    process_image: ProcessImage
    settings: Settings
    pair_law: PairLaw | None
    rail_law: RailLaw | None
    segments: Segments | None
    arcs: Arcs | None
    grid: StaticGrid | None
    base_friction: F8 | None
    """(H + 1, T), the floor last; None without friction under the bottles."""
    gravity: float
    engine_hash: str
    versions: tuple[str, ...]
    machine: str

    def has(self, effect: str) -> bool:
        """Whether an effect is on."""
        return any(choice.on for choice in self.effects if choice.name == effect)


def build_model(scene: Scene) -> Model:
    """Build the Model of a valid scene."""
    effects = choose_effects(scene)
    on = {effect.name for effect in effects if effect.on}
    rails, belts = rail_shapes(scene), belt_shapes(scene)
    types = list(scene.bottle_types.values())
    rail_materials = sorted({rail.material for rail in rails})
    radius = np.array([kind.radius for kind in types])
    pairs = pair_law(scene) if "bottle_contact" in on else None
    rail_contact = rail_law(scene, rail_materials) if rails else None
    friction = base_friction(scene) if "base_friction" in on else None
    skin = SKIN * float(radius.min())
    segments, arcs = rail_arrays(rails, rail_materials)
    bounds = _bounds(scene, pairs, rail_contact, friction)
    steps, reason = steps_per_tick(scene.tick, list(bounds), scene.step.per_tick)
    return Model(
        name=scene.name,
        dt=scene.tick_ns * 1e-9 / steps,
        steps_per_tick=steps,
        tick_ns=scene.tick_ns,
        dt_reason=reason,
        bounds=bounds,
        integrator=scene.step.integrator,
        effects=effects,
        belts=tuple(scene.belts),
        rails=tuple(rail.name for rail in rails),
        bottle_types=tuple(scene.bottle_types),
        type_radius=radius,
        type_mass=np.array([kind.mass for kind in types]),
        type_inertia=np.array([kind.moment_of_inertia for kind in types]),
        belt_shapes=tuple(belts),
        rail_shapes=tuple(rails),
        process_image=process_image(
            [(name, *belt.speed_limits) for name, belt in scene.belts.items()], scene.infeeds, scene.outfeeds
        ),
        settings=Settings(
            slip_limit=scene.slip_limit,
            lever=1.0 if scene.lever_arm == "overlap" else 0.0,
            skin=skin,
            cell=2.0 * float(radius.max()) + skin,
        ),
        pair_law=pairs,
        rail_law=rail_contact,
        segments=segments,
        arcs=arcs,
        grid=plant_grid(rails, belts if "belts" in on else [], float(radius.max()), skin),
        base_friction=friction,
        gravity=scene.gravity,
        engine_hash=ENGINE_HASH,
        versions=(
            f"conveyor_sim={__version__}+{sources_hash()}",
            *(f"{package}={version(package)}" for package in ("numba", "llvmlite", "numpy")),
        ),
        machine=_machine(),
    )


def _bounds(scene: Scene, pairs: PairLaw | None, rails: RailLaw | None, base: F8 | None) -> tuple[Bound, ...]:
    """The bounds on dt that apply, each the tightest over types and materials."""
    types = list(scene.bottle_types.values())
    mass = np.array([kind.mass for kind in types])
    found: list[Bound] = []

    def tightest(name: str, candidates: Sequence[tuple[float, str]]) -> None:
        if candidates:
            dt, reason = min(candidates)
            found.append(Bound(name, dt, reason))

    contacts = []
    lattices = []
    dashpots = []
    for a, _ in enumerate(types):
        for b, _ in enumerate(types):
            if pairs is not None and pairs.stiffness[a, b] > 0.0:
                k, reduced = float(pairs.stiffness[a, b]), float(mass[a] * mass[b] / (mass[a] + mass[b]))
                contacts.append((contact_bound(k, reduced), f"20 steps a contact of two bottles at k = {k:g} N/m"))
                lattices.append((lattice_bound(k, 2.0 * reduced), f"a hexagonal packing at k = {k:g} N/m"))
                dashpots += [(c, reduced) for c in _dampings(pairs, a, b)]
        if rails is not None:
            for material, k in enumerate(rails.stiffness[a]):
                if k > 0.0:
                    reason = f"20 steps a contact of a bottle and a rail at k = {k:g} N/m"
                    contacts.append((contact_bound(float(k), float(mass[a])), reason))
                    dashpots += [(c, float(mass[a])) for c in _dampings(rails, a, material)]
    tightest("contact time", contacts)
    tightest("lattice stability", lattices)
    tightest("damping", [(damping_bound(c, reduced), f"m_r / (2 c) at c = {c:g} kg/s") for c, reduced in dashpots])
    if base is not None:
        mu = float(base.max())
        tightest(
            "base friction",
            [(base_friction_bound(mu, scene.gravity, scene.slip_limit), f"20 steps in v_lim / (mu g) at mu = {mu:g}")],
        )
        tightest("contact friction", _contact_friction_bounds(scene, pairs, rails, mu))
    return tuple(found)


def _dampings(law: PairLaw | RailLaw, row: int, column: int) -> list[float]:
    """Damping coefficients of one pair that are not 0, kg/s."""
    tables = [table for table in (law.damping_paper, law.damping_normal) if table is not None]
    return [float(table[row, column]) for table in tables if table[row, column] > 0.0]


def _contact_friction_bounds(
    scene: Scene, pairs: PairLaw | None, rails: RailLaw | None, base_mu: float
) -> list[tuple[float, str]]:
    """Friction in contacts, at the force with which a single-file queue of all bottles presses."""
    most = most_bottles(scene)
    queue = ENDLESS_QUEUE if most is None else most
    # Which types queue behind which is not known: the heaviest may press on the lightest.
    heaviest = max(kind.mass for kind in scene.bottle_types.values())
    candidates = []
    for a, kind in enumerate(scene.bottle_types.values()):
        tables = [law.friction[a] for law in (pairs, rails) if law is not None and law.friction is not None]
        mu = max((float(table.max()) for table in tables), default=0.0)
        if mu > 0.0:
            force = queue * base_mu * heaviest * scene.gravity
            dt = contact_friction_bound(mu, force, kind.mass, kind.moment_of_inertia, kind.radius, scene.slip_limit)
            candidates.append(
                (
                    dt,
                    f"v_lim / [2 mu (1/m + R^2/J) N] at mu = {mu:g} and N = {force:.3g} N, "
                    f"a single-file queue of {queue}",
                )
            )
    return candidates


def _machine() -> str:
    """CPU architecture and the features that change compiled code."""
    features = llvm.get_host_cpu_features()
    present = ",".join(sorted(name for name, has in features.items() if has))
    return f"{platform.machine()} {llvm.get_host_cpu_name()} {present}"
