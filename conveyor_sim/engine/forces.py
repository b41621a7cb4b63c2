"""One evaluation of all forces: a pure function of positions and velocities, whatever integrator asks."""

from .arrays import World
from .base import add_base_friction
from .compile import kernel
from .pairs import add_pair_forces
from .rails import add_rail_forces


@kernel
def evaluate_forces(world: World) -> None:
    """Fill `world.load` (N) and `world.spin.moment` (N m) from the bottles' positions and velocities (eq. 22).

    Sums run in a fixed order (pairs by slots, then segments, arcs, base), so the bits do not depend on when the
    neighbour lists were made.
    """
    load = world.load
    load.fx[:] = 0.0
    load.fy[:] = 0.0
    load.normal_max[:] = 0.0
    load.normal_sum[:] = 0.0
    _clear_moment(world.spin)
    add_pair_forces(world.settings, world.bottles, world.spin, load, world.pairs)
    add_rail_forces(
        world.settings,
        world.bottles,
        world.spin,
        load,
        world.segments,
        world.near_segments,
        world.arcs,
        world.near_arcs,
        world.rail_law,
        world.rail_contacts,
    )
    add_base_friction(world.settings.slip_limit, world.bottles, load, world.belts, world.surface)


@kernel
def _clear_moment(spin) -> None:  # type: ignore[no-untyped-def]
    if spin is not None:
        spin.moment[:] = 0.0
