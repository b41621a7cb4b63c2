# SPDX-License-Identifier: Apache-2.0
"""Positions of axes in time, and the poses of the bodies that they move, with their pieces.

Only bodies near bottles have poses, and only those of axes that move are placed in each step. Straight pieces have
places; arcs stay in the frame of their body.
"""

import math
from typing import Any

from conveyor_sim.engine.arrays.moving import OFF_PROFILE, PHASES, MovingBodies
from conveyor_sim.engine.arrays.rails import Ends, Segments
from conveyor_sim.engine.arrays.types import F8
from conveyor_sim.engine.compiler.compile import kernel, part
from conveyor_sim.engine.rails.actuators import is_off_profile
from conveyor_sim.engine.rails.cams import find_displacement, is_present
from conveyor_sim.engine.rails.joint import FREE
from conveyor_sim.engine.rails.motion_profile import phase_at


@part
def note_resting(moving: MovingBodies) -> None:
    """Determine which axes stand still until the end of the tick."""
    for a in range(moving.position.size):
        moving.resting[a] = 1 if _rests(moving, a) else 0


@part
def _rests(moving: MovingBodies, a: int) -> bool:
    if is_off_profile(moving.actuators, a):
        return False
    if moving.speed[a] != 0.0:
        return False
    for k in range(PHASES):
        stands = moving.course[a, k, 2] == 0.0 and moving.course[a, k, 3] == 0.0
        if not stands or moving.course[a, k, 1] != moving.position[a]:
            return False
    return True


@part
def list_active(moving: MovingBodies) -> None:
    """List the axes that move, or with bodies near bottles."""
    count = 0
    for a in range(moving.position.size):
        if moving.loaded[a] != 0 or moving.resting[a] == 0:
            moving.active[count] = a
            count += 1
    moving.actives[0] = count


@part
def list_near_axes(moving: MovingBodies) -> None:
    """List the bodies marked as near bottles, and their axes."""
    for a in range(moving.position.size):
        moving.loaded[a] = 0
    count = 0
    for b in range(moving.axis.size):
        if moving.is_near[b] != 0:
            moving.near[count] = b
            count += 1
            if moving.axis[b] >= 0:
                moving.loaded[moving.axis[b]] = 1
    moving.nears[0] = count
    list_active(moving)


@part
def move_axes(moving: MovingBodies, time: float) -> None:
    """Move the axes that follow profiles to their positions at a time (s)."""
    for entry in range(moving.actives[0]):
        a = moving.active[entry]
        if moving.resting[a] == 0 and not is_off_profile(moving.actuators, a):
            k = phase_at(moving.course, a, time)
            since, acceleration = time - moving.course[a, k, 0], moving.course[a, k, 3]
            moving.position[a] = moving.course[a, k, 1] + (moving.course[a, k, 2] + 0.5 * acceleration * since) * since
            moving.speed[a] = moving.course[a, k, 2] + acceleration * since


@part
def mean_speed(moving: MovingBodies, a: int, h: float) -> float:
    """Return the mean speed in the next h (s) of an axis on its profile; 0 off it."""
    if moving.resting[a] != 0 or is_off_profile(moving.actuators, a):
        return 0.0
    time = (moving.clock[0] + 1.0) * h
    k = phase_at(moving.course, a, time)
    since = time - moving.course[a, k, 0]
    then = moving.course[a, k, 1] + (moving.course[a, k, 2] + 0.5 * moving.course[a, k, 3] * since) * since
    return (then - moving.position[a]) / h


@kernel
def fastest_point(moving: MovingBodies, reach: F8) -> float:
    """Return the largest speed (m/s) that a point of a body can have in this tick without bottles.

    reach: path of the fastest point per change of each axis's position, (A,).
    """
    fastest = 0.0
    for a in range(reach.size):
        speed = 0.0
        for k in range(PHASES):
            speed = max(speed, abs(moving.course[a, k, 2]))
        fastest = max(fastest, reach[a] * max(speed, _off_profile_speed(moving, moving.actuators, a)))
    return fastest


@part
def _off_profile_speed(moving: MovingBodies, actuators: Any, a: int) -> float:
    if actuators is None:
        return 0.0
    if actuators.mode[a] != OFF_PROFILE:
        return 0.0
    return max(abs(moving.speed[a]), actuators.max_speed[a])


@part
def stands(moving: MovingBodies, b: int) -> bool:
    """Return True if body b stands still until the end of the tick."""
    if moving.axis[b] < 0:
        return True
    return moving.resting[moving.axis[b]] != 0


@part
def place_bodies(moving: MovingBodies, standing: bool) -> None:
    """Place the bodies near bottles where their axes are. standing: True for bodies that stand still as well."""
    for entry in range(moving.nears[0]):
        b = moving.near[entry]
        if standing or not stands(moving, b):
            _set_pose(moving, moving.cams, b)
            if is_present(moving.cams, b):
                _place_pieces(moving, b)


@part
def _set_pose(moving: MovingBodies, cams: Any, b: int) -> None:
    a, pose = moving.axis[b], moving.pose
    coordinate = speed = 0.0
    if a >= 0:
        coordinate, speed = moving.position[a] - moving.lag[b], moving.speed[a]
    displacement = _displacement(cams, b, coordinate)
    moved = _rate(cams, b) * speed
    pose.displacement[b] = displacement
    pose.x[b] = moving.pivot_x[b] + moving.along_x[b] * displacement
    pose.y[b] = moving.pivot_y[b] + moving.along_y[b] * displacement
    pose.vx[b], pose.vy[b] = moving.along_x[b] * moved, moving.along_y[b] * moved
    pose.turn[b] = moving.turning[b] * moved
    pose.cosine[b], pose.sine[b] = 1.0, 0.0
    if moving.turning[b] != 0.0:
        angle = moving.turning[b] * displacement
        pose.cosine[b], pose.sine[b] = math.cos(angle), math.sin(angle)
    _slide(moving, cams, b, speed)


@part
def _displacement(cams: Any, b: int, coordinate: float) -> float:
    if cams is None:
        return coordinate
    return find_displacement(cams, b, coordinate)


@part
def _rate(cams: Any, b: int) -> float:
    if cams is None:
        return 1.0
    return cams.rate[b]


@part
def _slide(moving: MovingBodies, cams: Any, b: int, speed: float) -> None:
    """Add the motion along the second direction of a body."""
    if cams is None:
        return
    pose, moved = moving.pose, cams.aside_rate[b] * speed
    pose.x[b] += cams.across_x[b] * cams.aside[b]
    pose.y[b] += cams.across_y[b] * cams.aside[b]
    pose.vx[b] += cams.across_x[b] * moved
    pose.vy[b] += cams.across_y[b] * moved


@part
def _place_pieces(moving: MovingBodies, b: int) -> None:
    pose, clusters = moving.pose, moving.clusters
    begin = clusters.segment[moving.first_cluster[b]]
    end = clusters.segment[moving.first_cluster[b + 1]]
    _place_segments(
        moving.home_segments, moving.segments, pose.x[b], pose.y[b], pose.cosine[b], pose.sine[b], begin, end
    )


@part
def _place_segments(
    home: Any, segments: Any, x: float, y: float, cosine: float, sine: float, first: int, end: int
) -> None:
    if home is None:
        return
    for g in range(first, end):
        _place_segment(home, segments, x, y, cosine, sine, g)


@part
def _place_segment(home: Segments, segments: Segments, x: float, y: float, cosine: float, sine: float, g: int) -> None:
    start_x = x + (home.x[g] * cosine - home.y[g] * sine)
    start_y = y + (home.x[g] * sine + home.y[g] * cosine)
    tx = home.tx[g] * cosine - home.ty[g] * sine
    ty = home.tx[g] * sine + home.ty[g] * cosine
    segments.x[g], segments.y[g], segments.tx[g], segments.ty[g] = start_x, start_y, tx, ty
    segments.ends.x[g, 0], segments.ends.y[g, 0] = start_x, start_y
    segments.ends.x[g, 1] = start_x + segments.length[g] * tx
    segments.ends.y[g, 1] = start_y + segments.length[g] * ty
    _turn_neighbours(home.ends, segments.ends, cosine, sine, g)


@part
def _turn_neighbours(home: Ends, ends: Ends, cosine: float, sine: float, piece: int) -> None:
    for end in range(2):
        if ends.joint[piece, end] != FREE:
            x, y = home.neighbour_x[piece, end], home.neighbour_y[piece, end]
            ends.neighbour_x[piece, end] = x * cosine - y * sine
            ends.neighbour_y[piece, end] = x * sine + y * cosine
