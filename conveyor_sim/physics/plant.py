# SPDX-License-Identifier: Apache-2.0
"""Scene -> Plant: the scene with its geometry, built once and handed down to effects, laws, arrays and the run."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.scene.bodies import AxisShape, BodyShape
from conveyor_sim.scene.driven import belt_speeds
from conveyor_sim.scene.geometry import (
    ArcPiece,
    BeltShape,
    InitialBottle,
    Piece,
    RailShape,
    initial_bottles,
    is_full_turn,
    rail_shapes,
    surface_shapes,
)
from conveyor_sim.scene.moving import axes_of, bodies_at, bodies_of
from conveyor_sim.scene.overlaps import near_pieces
from conveyor_sim.scene.parts.work import Working
from conveyor_sim.scene.problems import Path
from conveyor_sim.scene.schema import Scene, Single

JOINT_TOLERANCE = 1e-6
"""m; well above the rounding of coordinates, well below any distance that matters to a bottle."""

SPEED_AT_REST = 1.0
"""m/s, assumed impact speed where nothing in a scene moves at first."""


@dataclass(frozen=True, eq=False)
class Plant:
    """A scene with its geometry. Build it with `Plant.of`."""

    scene: Scene
    surfaces: tuple[BeltShape, ...]
    """Surfaces of belts, in the order of the belts, then plates."""
    rails_at_rest: tuple[RailShape, ...]
    """Rails in the scene's order, then those of curved belts; arcs with narrow mouths are cut in halves."""
    moving: tuple[BodyShape, ...]
    """Bodies; bodies of one machine follow each other."""
    axes: tuple[AxisShape, ...]
    """Axes of the bodies."""
    bottles: tuple[InitialBottle, ...]
    """Bottles at the start of a run."""

    @classmethod
    def of(cls, scene: Scene) -> "Plant":
        """Build the plant of a valid scene."""
        largest = max(kind.radius for kind in scene.bottle_types.values())
        return cls(
            scene=scene,
            surfaces=tuple(surface_shapes(scene)),
            rails_at_rest=tuple(cut_at_mouths(rail_shapes(scene), largest)),
            moving=tuple(_cut_body(shape, largest) for shape in bodies_of(scene)),
            axes=tuple(axes_of(scene)),
            bottles=tuple(initial_bottles(scene)),
        )

    @cached_property
    def surface_paths(self) -> tuple[Path, ...]:
        """Path in the scene of the belt or plate of each surface."""
        return tuple(
            ("plates", shape.name) if shape.belt is None else ("belts", shape.belt_name) for shape in self.surfaces
        )

    @cached_property
    def belt_of_surface(self) -> NDArray[np.int32]:
        """Index of the belt of each surface, and of the floor at the end, (H + 1,); -1 for plates and the floor."""
        belts = (-1 if shape.belt is None else shape.belt for shape in self.surfaces)
        return np.array([*belts, -1], dtype=np.int32)

    @cached_property
    def belt_surfaces(self) -> tuple[tuple[int, int], ...]:
        """Index of each surface that belongs to a belt, and that of the belt."""
        return tuple((index, shape.belt) for index, shape in enumerate(self.surfaces) if shape.belt is not None)

    @cached_property
    def one_surface_per_belt(self) -> bool:
        """True if the index of a surface is that of its belt: no belt has several surfaces, and there is no plate."""
        return len(self.surfaces) == len(self.scene.belts)

    @cached_property
    def machines(self) -> tuple[str, ...]:
        """Names of the machines with bodies; their rail numbers follow those of `rails_at_rest`."""
        return tuple(dict.fromkeys(shape.name for shape in self.moving))

    @cached_property
    def machine_of_body(self) -> tuple[int, ...]:
        """Index of the machine of each body."""
        return tuple(self.machines.index(shape.name) for shape in self.moving)

    @cached_property
    def axis_of_body(self) -> tuple[int, ...]:
        """Index of the axis of each body; -1 for a body at rest."""
        names = [axis.name for axis in self.axes]
        return tuple(names.index(shape.axis) if shape.axis else -1 for shape in self.moving)

    @cached_property
    def sweeps(self) -> tuple[NDArray[np.float64], ...]:
        """Box of all places of each body, (4,): least x and y, greatest x and y, m."""
        strokes = [0.0 if axis < 0 else self.axes[axis].stroke for axis in self.axis_of_body]
        return tuple(shape.sweep(stroke) for shape, stroke in zip(self.moving, strokes, strict=True))

    @cached_property
    def reach_of_axes(self) -> NDArray[np.float64]:
        """Path of the fastest point of any body per change of each axis's position, (axes,)."""
        reach = np.zeros(len(self.axes))
        for axis, shape in zip(self.axis_of_body, self.moving, strict=True):
            if axis >= 0:
                reach[axis] = max(reach[axis], shape.fastest_point)
        return reach

    def moving_at(
        self, positions: Sequence[float], lags: Sequence[float] = (), only: Sequence[int] | None = None
    ) -> tuple[RailShape, ...]:
        """Return the bodies that are present, each as a rail, at positions (m or rad) of the axes.

        lags: of the bodies where machines have slipped, m or rad; without any, those of the scene. only: indices of
        bodies; None: all.
        """
        lags = lags or [shape.lag for shape in self.moving]
        shapes = ((self.moving[body], lags[body]) for body in (range(len(self.moving)) if only is None else only))
        bodies = (shape if shape.lag == lag else replace(shape, lag=lag) for shape, lag in shapes)
        return bodies_at(bodies, {axis.name: at for axis, at in zip(self.axes, positions, strict=True)})

    @cached_property
    def rails(self) -> tuple[RailShape, ...]:
        """All rails by number, those of machines with all pieces of their bodies at the initial positions."""
        bodies = self.moving_at([axis.first for axis in self.axes])
        machines = (
            RailShape(
                name,
                next(shape.material for shape in self.moving if shape.name == name),
                tuple(piece for shape in bodies if shape.name == name for piece in shape.pieces),
            )
            for name in self.machines
        )
        return (*self.rails_at_rest, *machines)

    @cached_property
    def rail_materials(self) -> tuple[str, ...]:
        """Materials of all rails, sorted: a material's number is its index."""
        return tuple(sorted({rail.material for rail in self.rails}))

    @cached_property
    def supply(self) -> dict[str, float]:
        """Largest number of bottles of each type in a run, by type name; infinite for an infeed without end.

        Types without bottles are left out. Stations and carousels give bottles other types.
        """
        supply: dict[str, float] = {}
        for name, *_ in self.bottles:
            supply[name] = supply.get(name, 0.0) + 1.0
        for _, entry in self.scene.entries():
            for kind in entry.kinds:
                supply[kind] = supply.get(kind, 0.0) + (math.inf if entry.most is None else entry.most)
        return self._after_changes(supply)

    def _after_changes(self, supply: dict[str, float]) -> dict[str, float]:
        """Return the supply of each type, with that of all types that stations and carousels turn into it."""
        sources = {kind: {kind} for kind in supply}
        workers = [part for _, part in self.scene.devices() if isinstance(part, Working)]
        changes = [change for worker in workers for change in worker.changes.items()]
        for _ in self.scene.bottle_types:  # a type is reached by that many changes at most
            for before, after in changes:
                if before in sources:
                    sources[after] = sources.get(after, set()) | sources[before]
        return {kind: sum(supply[source] for source in sorted(some)) for kind, some in sources.items()}

    @property
    def most_bottles(self) -> int | None:
        """Largest number of bottles in a run; None if an infeed has no end."""
        most = [entry.most for _, entry in self.scene.entries()]
        return None if None in most else len(self.bottles) + sum(number for number in most if number is not None)

    @cached_property
    def impact_speed(self) -> float:
        """Speed of the hardest expected impact, m/s; SPEED_AT_REST if everything rests.

        The fastest belt or entering bottle against something at rest, or the largest difference between initial
        velocities; plus the fastest moving rail.
        """
        belts = list(belt_speeds(self.scene).values())
        speeds = [
            abs(belts[shape.belt]) * shape.ratio + (shape.vibration.speed if shape.vibration is not None else 0.0)
            for shape in self.surfaces
            if shape.belt is not None
        ]
        speeds += [giver.heading[1] for _, giver in self.scene.givers()]
        single = (entry.velocity for entry in self.scene.bottles if isinstance(entry, Single))
        speeds.append(math.hypot(*np.ptp(np.array([(0.0, 0.0), *single]), axis=0)))
        rails = [axis.max_speed * reach for axis, reach in zip(self.axes, self.reach_of_axes.tolist(), strict=True)]
        rails += [abs(shape.surface_speed or 0.0) for shape in self.moving]
        return max(speeds) + max(rails, default=0.0) or SPEED_AT_REST


def cut_at_mouths(rails: Sequence[RailShape], radius: float) -> list[RailShape]:
    """Cut C-shaped arcs in halves where a bottle of a radius (m) can touch both tips at once.

    An arc piece pushes at its nearest point only. On an uncut arc that point would jump between the tips and push the
    bottle to one side. Arcs with wider mouths, and arcs with both ends joined to other rails, stay as they are.
    """
    pieces = [piece for rail in rails for piece in rail.pieces]
    narrow = [place for place, piece in enumerate(pieces) if isinstance(piece, ArcPiece) and _is_narrow(piece, radius)]
    cut = _with_a_free_end(pieces, narrow)
    place, result = 0, []
    for rail in rails:
        parts = [_halves(piece) if place + n in cut else (piece,) for n, piece in enumerate(rail.pieces)]
        place += len(rail.pieces)
        result.append(replace(rail, pieces=tuple(half for part in parts for half in part)))
    return result


def _cut_body(shape: BodyShape, radius: float) -> BodyShape:
    """Cut C-shaped arcs of a body in halves (`cut_at_mouths`)."""
    (cut,) = cut_at_mouths([RailShape(shape.name, shape.material, shape.pieces)], radius)
    return shape if cut.pieces == shape.pieces else replace(shape, pieces=cut.pieces, clusters=())


def _is_narrow(arc: ArcPiece, radius: float) -> bool:
    """Return True if a bottle of this radius (m) can touch both ends of an arc at once, from outside its opening."""
    if is_full_turn(arc.span):
        return False
    return (arc.radius * math.sin(0.5 * arc.span) if arc.span > math.pi else arc.radius) < radius


def _with_a_free_end(pieces: Sequence[Piece], some: Sequence[int]) -> set[int]:
    """Return those of the piece numbers `some` that have an end without another piece."""
    ends = np.array([end for index in some for end in pieces[index].ends]).reshape(-1, 2)
    joined = np.zeros(len(ends), dtype=bool)
    for index, near, apart in near_pieces(ends, pieces, JOINT_TOLERANCE):
        own = np.array([some[end // 2] == index for end in near])
        joined[near[(apart <= JOINT_TOLERANCE) & ~own]] = True
    return {index for index, (first, last) in zip(some, joined.reshape(-1, 2), strict=True) if not (first and last)}


def _halves(piece: Piece) -> tuple[Piece, ...]:
    if not isinstance(piece, ArcPiece):
        return (piece,)
    half = 0.5 * piece.span
    return replace(piece, span=half), replace(piece, start_angle=piece.start_angle + half, span=piece.span - half)
