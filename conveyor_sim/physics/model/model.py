# SPDX-License-Identifier: Apache-2.0
"""Scene -> Model: the constant arrays, the chosen effects and the time step, with their reasons."""

import math
import platform
from dataclasses import dataclass
from functools import cache
from importlib.metadata import version

import llvmlite.binding as llvm
import numpy as np

from conveyor_sim import __version__
from conveyor_sim.engine.arrays.contacts import ContactLaw, Curves
from conveyor_sim.engine.arrays.lists import StaticGrid
from conveyor_sim.engine.arrays.rails import Arcs, Segments
from conveyor_sim.engine.arrays.types import F8
from conveyor_sim.engine.arrays.world import EngineSettings
from conveyor_sim.engine.compiler.compile import ENGINE_HASH
from conveyor_sim.engine.integrators import AHEAD, LAG, SWEPT, WARM
from conveyor_sim.errors import SceneError
from conveyor_sim.physics.effects.choice import prediction_of
from conveyor_sim.physics.effects.declaration import EffectChoice
from conveyor_sim.physics.effects.load import Load
from conveyor_sim.physics.effects.queue import longest_queue
from conveyor_sim.physics.laws.coefficients import BaseSprings, Laws
from conveyor_sim.physics.laws.rebounds import Rebounds, build_rebounds
from conveyor_sim.physics.model.plant_arrays import plant_grid, rail_arrays
from conveyor_sim.physics.model.remedies import too_many
from conveyor_sim.physics.model.step_choice import choose_steps
from conveyor_sim.physics.plant import Plant
from conveyor_sim.physics.sources_hash import sources_hash
from conveyor_sim.physics.timestep.bounds import IMPULSE_SKIN, LEAST_WAY, MOST_WAY, SKIN, WAY_TIME, Bound
from conveyor_sim.physics.timestep.prediction import Impact, Prediction
from conveyor_sim.physics.timestep.settling import Settling, settling
from conveyor_sim.scene.accuracy import MOST_STEPS
from conveyor_sim.scene.effect_names import EffectName
from conveyor_sim.scene.places import Places
from conveyor_sim.scene.schema import BottleType, Scene


@dataclass(frozen=True, eq=False)
class Model:
    """Everything about a scene that is constant during a run. T types, H surfaces, M rail materials."""

    name: str
    dt: float
    """s"""
    steps_per_tick: int
    tick_ns: int
    dt_reason: str
    bounds: tuple[Bound, ...]
    """Bounds on the time step for the preset or tolerance of the scene; for `standard` if the scene sets the step."""
    accuracy: str
    """Choice of the scene, in words."""
    impacts: tuple[Impact, ...]
    """Hardest expected impact of each pair of types, and of types and materials."""
    prediction: Prediction
    load: Load
    """Largest expected resting load on a contact."""
    integrator: str
    sweeps: int
    """Sweeps in a step of integrator impulses; 0 with others."""
    settling: Settling | None
    """Time in which forces in queues settle with integrator impulses; None with others."""
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
    type_base_radius: F8 | None
    """(T,), m, radius of the ring that a bottle stands on, 0 for a point; None if all stand on points."""
    type_heights: F8
    """(T, 2), m, heights of the contact band and of the centre of gravity; NaN where unknown."""
    plant: Plant
    settings: EngineSettings
    ways: tuple[float, float, float] | None
    """Least way of a bottle until the lists are rebuilt (m), its time at its speed (s), longest way (m).

    None with integrators other than impulses.
    """
    pair_law: ContactLaw | None
    """(T * T,), bottle and bottle; None where bottles do not touch bottles."""
    rail_law: ContactLaw | None
    """(T * M,), bottle and rail; None without rails."""
    rebounds: Rebounds
    curves: Curves | None
    """Tables of force against overlap; None without tables."""
    friction_curve: str
    """`polynomial` or `atan`."""
    friction_solver: str
    """`explicit` or `implicit`."""
    segments: Segments | None
    arcs: Arcs | None
    grid: StaticGrid | None
    base_friction: F8 | None
    """(H + 1, T), the floor last, 0 where a spring acts; None without friction under the bottles."""
    base_spring: BaseSprings | None
    """None without springs under the bottles."""
    largest_base_friction: float
    """Largest friction coefficient under any bottle, by curve or spring; 0 without friction."""
    gravity: float
    engine_hash: str
    versions: tuple[str, ...]
    machine: str

    def has(self, effect: EffectName) -> bool:
        """Return True if an effect is on."""
        return any(choice.on for choice in self.effects if choice.name == effect)


def build_model(scene: Scene) -> Model:
    """Build the Model of a valid scene. Raise SceneError if a tick has more than MOST_STEPS steps."""
    plant = Plant.of(scene)
    choice = choose_steps(plant)
    laws, on, steps = choice.terms.laws, choice.terms.on, choice.steps
    if steps > MOST_STEPS:
        raise SceneError(f"{Places(scene).of(('accuracy',))}: accuracy: {too_many(scene, choice)}")
    types = list(scene.bottle_types.values())
    radius = np.array([kind.radius for kind in types])
    smallest = float(radius.min())
    swept = scene.accuracy.integrator in SWEPT
    skin = (IMPULSE_SKIN if swept else SKIN) * smallest
    ways = (LEAST_WAY * smallest, WAY_TIME, MOST_WAY * smallest) if swept else None
    segments, arcs = rail_arrays(plant.rails_at_rest, plant.rail_materials)
    dt = scene.tick_ns * 1e-9 / steps
    warm = "implicit_friction" in on and scene.accuracy.integrator in WARM and not scene.friction_anew
    ahead, at_once = (1.0, 0.0) if warm else AHEAD.get(scene.accuracy.integrator, (1.0, 0.0))
    return Model(
        name=scene.name,
        dt=dt,
        steps_per_tick=steps,
        tick_ns=scene.tick_ns,
        dt_reason=choice.reason,
        bounds=choice.bounds,
        accuracy=choice.aim.words if choice.given is None else f"given, {_given_words(scene)}",
        impacts=choice.impacts,
        prediction=prediction_of(choice.terms, choice.impacts, dt),
        load=choice.terms.load,
        integrator=scene.accuracy.integrator,
        sweeps=scene.accuracy.sweeps or 0,
        settling=_settling(plant, steps, scene.accuracy.sweeps),
        effects=choice.effects,
        belts=tuple(scene.belts),
        rails=tuple(rail.name for rail in plant.rails),
        bottle_types=tuple(scene.bottle_types),
        type_radius=radius,
        type_mass=np.array([kind.mass for kind in types]),
        type_inertia=np.array([kind.moment_of_inertia for kind in types]),
        type_base_radius=laws.base_radius,
        type_heights=np.array([_heights(kind) for kind in types]),
        plant=plant,
        settings=EngineSettings(
            slip_limit=scene.slip_limit,
            lever=1.0 if scene.lever_arm == "overlap" else 0.0,
            skin=skin,
            cell=2.0 * float(radius.max()) + skin,
            rail_materials=len(plant.rail_materials),
            reach=2.0 * float(radius[0]),
            atan=1 if "atan_friction" in on else None,
            error=choice.terms.step_error,
            ahead=ahead,
            at_once=at_once,
            warm=1 if warm else None,
            lag=LAG.get(scene.accuracy.integrator, 0.0),
        ),
        ways=ways,
        pair_law=laws.pair,
        rail_law=laws.rail,
        rebounds=build_rebounds(laws.pair, laws.rail, np.array([kind.mass for kind in types])),
        curves=laws.curves,
        friction_curve="atan" if "atan_friction" in on else "polynomial",
        friction_solver="implicit" if "implicit_friction" in on else "explicit",
        segments=segments if "segment_rails" in on else None,
        arcs=arcs if "arc_rails" in on else None,
        grid=plant_grid(
            plant.rails_at_rest,
            plant.surfaces if "belts" in on else (),
            plant.sweeps,
            float(radius.max()),
            _largest(laws.base_radius),
            skin if ways is None else max(skin, ways[-1]),
        ),
        base_friction=_friction_table(laws),
        base_spring=laws.base_spring,
        largest_base_friction=laws.largest_base_friction,
        gravity=scene.gravity,
        engine_hash=ENGINE_HASH,
        versions=versions_here(),
        machine=_machine(),
    )


def _settling(plant: Plant, steps: int, sweeps: int | None) -> Settling | None:
    return None if sweeps is None else settling(steps, sweeps, plant.scene.tick, *longest_queue(plant))


@cache
def versions_here() -> tuple[str, ...]:
    """Return "package=version" of all packages that can change bits, except the engine (`ENGINE_HASH`)."""
    packages = (f"{package}={version(package)}" for package in ("numba", "llvmlite", "numpy"))
    return f"conveyor_sim={__version__}+{sources_hash()}", *packages


def _given_words(scene: Scene) -> str:
    accuracy = scene.accuracy
    steps = f"{accuracy.per_tick} steps a tick" if accuracy.dt is None else f"at most {accuracy.dt * 1e6:g} us"
    return steps if accuracy.sweeps is None else f"{steps}, {accuracy.sweeps} sweeps"


def _friction_table(laws: Laws) -> F8 | None:
    """Return the friction coefficients without springs, zeros if springs act everywhere; None without friction."""
    if laws.base_friction is None and laws.base_spring is not None:
        return np.zeros_like(laws.base_spring.friction)
    return laws.base_friction


def _heights(kind: BottleType) -> tuple[float, float]:
    """Return the heights of the contact band and of the centre of gravity, m; NaN where unknown."""
    if kind.contact_height is None or kind.gravity_height is None:
        return math.nan, math.nan
    return kind.contact_height, kind.gravity_height


def _largest(radii: F8 | None) -> float:
    """Return the largest of some radii, m; 0 without radii."""
    return 0.0 if radii is None else float(radii.max())


@cache
def _machine() -> str:
    """Return CPU architecture and the features that change compiled code."""
    features = llvm.get_host_cpu_features()
    present = ",".join(sorted(name for name, has in features.items() if has))
    return f"{platform.machine()} {llvm.get_host_cpu_name()} {present}"
