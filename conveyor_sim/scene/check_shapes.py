# SPDX-License-Identifier: Apache-2.0
"""Checks of geometry, and of bottles that start or enter where something else is."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.scene.areas import CurvedArea, StraightArea
from conveyor_sim.scene.belts import CurvedBelt, PathBelt
from conveyor_sim.scene.check_machines import machine_problems
from conveyor_sim.scene.geometry import (
    Array,
    RailShape,
    arc_centre,
    area_shape,
    grid_points,
    rail_pieces,
    rails_of_curved,
)
from conveyor_sim.scene.moving import mover_shape, movers_of
from conveyor_sim.scene.overlaps import near_pieces, overlapping
from conveyor_sim.scene.parts.device_part import Entry, Giver
from conveyor_sim.scene.problems import Path, Problem
from conveyor_sim.scene.rails import PolylineRail, SegmentRail
from conveyor_sim.scene.schema import Grid, Scene, Single
from conveyor_sim.scene.star_places import guide_rails
from conveyor_sim.scene.types import COORDINATE_LIMIT, TOUCH, XY
from conveyor_sim.scene.words import shown

_MOST_BOTTLES = 1_000_000  # of one grid
_MOST_PLACES = 1000  # that are checked for new bottles of one device


def shape_problems(scene: Scene) -> list[Problem]:
    """Return problems of belts, plates, rails, and of the places of new bottles."""
    areas = list(_curved_areas(scene))
    rails = list(_rails(scene))
    wrong = {problem.path[:2] for problem in areas + rails}
    resting = _valid_rails(scene, wrong)
    shapes = [*resting, *_valid_moving(scene)]
    groups = list(_groups(scene))
    return [
        *areas,
        *rails,
        *_grids(scene),
        *_in_rails(groups, shapes),
        *_infeeds_in_rails(scene, shapes),
        *_in_each_other(groups),
        *(() if wrong else machine_problems(scene, resting)),
    ]


def _areas(scene: Scene) -> Iterator[tuple[Path, StraightArea | CurvedArea]]:
    """Yield the areas of belts and plates with their paths."""
    for name, belt in scene.belts.items():
        if isinstance(belt, PathBelt):
            yield from ((("belts", name, "surfaces", index), part) for index, part in enumerate(belt.surfaces))
        else:
            yield ("belts", name), belt
    yield from ((("plates", name), plate) for name, plate in scene.plates.items())


def _curved_areas(scene: Scene) -> Iterator[Problem]:
    for path, area in _areas(scene):
        if not isinstance(area, CurvedArea):
            continue
        if isinstance(area, CurvedBelt):
            yield from _belt_rails(path, area)
        by_centre = {"centre": area.centre, "start_angle": area.start_angle, "span": area.span}
        by_points = {"from": area.from_, "to": area.to, "side": area.side}
        given = [field for field, value in (by_centre | by_points).items() if value is not None]
        if given not in (list(by_centre), list(by_points)):
            yield Problem(
                path,
                f"{', '.join(given) or 'no place'} given, "
                "expected either centre, start_angle and span, or from, to and side",
            )
        elif area.from_ is not None and area.to is not None:
            yield from _two_points(path, area.from_, area.to, area)


def _belt_rails(path: Path, belt: CurvedBelt) -> Iterator[Problem]:
    rails = belt.rails
    if (rails.inner or rails.outer) and rails.material is None:
        yield Problem((*path, "rails", "material"), "missing, expected the material of the belt's rails")
    if rails.inner and belt.inner_radius == 0:
        yield Problem((*path, "rails", "inner"), "true given, expected false, as the inner radius is 0")


def _two_points(path: Path, start: XY, end: XY, area: CurvedArea) -> Iterator[Problem]:
    chord = math.dist(start, end)
    if chord <= TOUCH:
        yield Problem((*path, "to"), f"{shown(end)} given, expected a point away from `from`")
        return
    try:
        arc_centre(start, end, area.inner_radius, str(area.side))
    except ValueError:
        yield Problem(
            (*path, "inner_radius"),
            f"{shown(area.inner_radius)} given, expected at least half the chord between `from` and `to`, "
            f"{chord / 2:.6g} (m)",
        )


def _rails(scene: Scene) -> Iterator[Problem]:
    for name, rail in scene.rails.items():
        if isinstance(rail, SegmentRail) and math.dist(rail.from_, rail.to) <= TOUCH:
            yield Problem(
                ("rails", name, "to"), f"{shown(rail.to)} given, expected a point away from `from` (zero length)"
            )
        if isinstance(rail, PolylineRail):
            corners = rail.points
            for index in range(0 if rail.closed else 1, len(corners)):
                if math.dist(corners[index - 1], corners[index]) <= TOUCH:
                    yield Problem(
                        ("rails", name, "points", index),
                        f"{shown(corners[index])} given, expected a point away from the one before it (zero length)",
                    )


def _valid_rails(scene: Scene, wrong: set[Path]) -> list[RailShape]:
    """Return the rails at rest with a valid geometry."""
    shapes = [
        RailShape(name, rail.material, rail_pieces(rail))
        for name, rail in scene.rails.items()
        if ("rails", name) not in wrong
    ]
    for name, belt in scene.belts.items():
        if isinstance(belt, CurvedBelt) and ("belts", name) not in wrong:
            shapes.extend(rails_of_curved(area_shape(name, belt), belt))
    shapes += [RailShape(name, rail.material, rail_pieces(rail)) for name, rail in guide_rails(scene.stars).items()]
    return shapes


def _valid_moving(scene: Scene) -> list[RailShape]:
    """Return the moving rails with a valid geometry, at their initial positions."""
    moving = [mover_shape(path, mover) for path, mover in movers_of(scene) if not any(mover.shape_problems(path))]
    shapes = (body.shape(axis.first) for bodies, axis in moving for body in bodies)
    return [shape for shape in shapes if shape.pieces]


@dataclass(frozen=True)
class _Group:
    """Bottles of one entry of `bottles`."""

    path: Path
    points: Array
    radius: float


def _groups(scene: Scene) -> Iterator[_Group]:
    for index, entry in enumerate(scene.bottles):
        kind = scene.bottle_types.get(entry.type if isinstance(entry, Single) else entry.grid.type)
        if kind is None:
            continue
        if isinstance(entry, Single):
            yield _Group(("bottles", index, "position"), np.array([entry.position]), kind.radius)
        elif _grid_problem(scene, index, entry) is None:
            yield _Group(("bottles", index, "grid"), grid_points(entry.grid), kind.radius)


def _grids(scene: Scene) -> Iterator[Problem]:
    for index, entry in enumerate(scene.bottles):
        if isinstance(entry, Grid):
            problem = _grid_problem(scene, index, entry)
            if problem is not None:
                yield problem


def _grid_problem(scene: Scene, index: int, entry: Grid) -> Problem | None:
    grid = entry.grid
    path: Path = ("bottles", index, "grid")
    number = grid.rows * grid.columns
    if number > _MOST_BOTTLES:
        return Problem(path, f"{number} bottles given, expected at most {_MOST_BOTTLES}")
    if max(grid.rows, grid.columns) * grid.pitch > COORDINATE_LIMIT:
        return Problem(
            (*path, "pitch"), f"{shown(grid.pitch)} given, expected a grid of at most {COORDINATE_LIMIT:g} m"
        )
    kind = scene.bottle_types.get(grid.type)
    if kind is not None and number > 1 and grid.pitch < 2 * kind.radius - TOUCH:
        return Problem(
            (*path, "pitch"),
            f"{shown(grid.pitch)} given, expected at least the diameter of {grid.type}, {2 * kind.radius:g} (m)",
        )
    return None


@dataclass(frozen=True)
class _All:
    """Points of many groups, one behind the other."""

    points: Array
    radius: Array
    owner: NDArray[np.intp]
    """Group of each point."""
    start: NDArray[np.intp]
    """Index of the first point of each group."""

    @classmethod
    def of(cls, groups: list[_Group]) -> "_All":
        sizes = [len(group.points) for group in groups]
        return cls(
            np.vstack([np.empty((0, 2)), *(group.points for group in groups)]),
            np.repeat([group.radius for group in groups], sizes),
            np.repeat(np.arange(len(groups)), sizes),
            np.cumsum([0, *sizes]),
        )


def _in_rails(groups: list[_Group], rails: list[RailShape]) -> Iterator[Problem]:
    for index, rail, inside, apart in _inside(_All.of(groups), rails):
        group = groups[index]
        yield Problem(
            group.path,
            f"{_at(group, inside)} given, expected at least {group.radius:g} m between a bottle's axis "
            f"and rail {rail.name} ({_metres(apart[0])})",
        )


def _infeeds_in_rails(scene: Scene, rails: list[RailShape]) -> Iterator[Problem]:
    radii = {name: kind.radius for name, kind in scene.bottle_types.items()}
    feeds, groups = [], []
    for path, feed in scene.givers():
        # Any bottle may come to a machine that returns bottles.
        kinds = [radii[kind] for kind in feed.kinds if kind in radii] if isinstance(feed, Entry) else radii.values()
        radius = max(kinds, default=None)
        if radius is not None:
            feeds.append(feed)
            groups.append(_Group((*path, "position"), _births(feed, radius), radius))
    for index, rail, _, apart in _inside(_All.of(groups), rails):
        group, feed = groups[index], feeds[index]
        jitter = ", lateral_jitter included" if len(group.points) > 1 and np.ptp(group.points, axis=0).any() else ""
        yield Problem(
            group.path,
            f"{shown(feed.position)} given, expected at least {group.radius:g} m between a bottle's axis "
            f"and rail {rail.name} ({_metres(apart.min())}{jitter})",
        )


def _births(feed: Giver, radius: float) -> Array:
    """Return places of new bottles, (n, 2): no rail lies between two neighbouring ones without touching a bottle."""
    ends = np.array(feed.births())
    first, last = ends[0], ends[-1]
    steps = math.ceil(min(math.dist(first, last) / radius, _MOST_PLACES))
    return np.vstack([ends, first + np.linspace(0.0, 1.0, steps + 1)[1:-1, None] * (last - first)])


def _inside(every: _All, rails: list[RailShape]) -> Iterator[tuple[int, RailShape, NDArray[np.intp], Array]]:
    """Yield group, rail, numbers of the group's points in the rail, and their distances (m), by group and rail."""
    if not len(every.points):
        return
    pieces = [piece for rail in rails for piece in rail.pieces]
    rail_of = [index for index, rail in enumerate(rails) for _ in rail.pieces]
    hits: list[tuple[NDArray[np.intp], NDArray[np.intp], Array]] = []
    for piece, near, apart in near_pieces(every.points, pieces, float(every.radius.max())):
        inside = apart < every.radius[near] - TOUCH
        hits.append((near[inside], np.full(inside.sum(), rail_of[piece]), apart[inside]))
    if not hits:
        return
    point, rail, distance = (np.concatenate(columns) for columns in zip(*hits, strict=True))
    order = np.lexsort((distance, point, rail, every.owner[point]))
    point, rail, distance = point[order], rail[order], distance[order]
    # The nearest piece of a rail decides.
    first = np.append(True, (np.diff(point) != 0) | (np.diff(rail) != 0))[: len(point)]
    point, rail, distance = point[first], rail[first], distance[first]
    changes = np.flatnonzero((np.diff(every.owner[point]) != 0) | (np.diff(rail) != 0)) + 1
    for some in np.split(np.arange(len(point)), changes) if len(point) else []:
        group = int(every.owner[point[some[0]]])
        yield group, rails[rail[some[0]]], point[some] - every.start[group], distance[some]


def _in_each_other(groups: list[_Group]) -> Iterator[Problem]:
    every = _All.of(groups)
    centres, radii, owner = every.points, every.radius, every.owner
    first, second = overlapping(centres, radii, TOUCH)
    order = np.lexsort((first, second))
    first, second = first[order], second[order]
    later, begin = np.unique(owner[second], return_index=True)
    for entry, where in zip(later, np.split(np.arange(len(second)), begin[1:]), strict=False):
        i, j = first[where[0]], second[where[0]]
        apart = float(np.hypot(*(centres[i] - centres[j])))
        yield Problem(
            groups[entry].path,
            f"{_at(groups[entry], np.unique(second[where]) - every.start[entry])} given, "
            f"expected at least {radii[i] + radii[j]:g} m between the axes of two bottles, "
            f"as to that at {_xy(centres[i])} ({_metres(apart)})",
        )


def _at(group: _Group, hit: NDArray[np.intp]) -> str:
    """Return the first wrong bottle in words, and the number of others in its grid."""
    point = _xy(group.points[hit[0]])
    if len(group.points) == 1:
        return point
    return f"a bottle at {point}" + (f" (and {len(hit) - 1} more)" if len(hit) > 1 else "")


def _xy(point: Array) -> str:
    return f"[{point[0]:.6g}, {point[1]:.6g}]"


def _metres(distance: float) -> str:
    return f"{round(float(distance), 9):.4g} m"
