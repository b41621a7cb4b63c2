"""The World with fewer groups: what takes it is compiled once for all that differ only in the groups left out.

Numba compiles for the types of a World, that is for the groups that are there. The groups of an integrator are nothing
to the forces, and what forces alone need is nothing to the lists.
"""

from typing import Any

from conveyor_sim.engine.arrays.world import World
from conveyor_sim.engine.compiler.compile import part


def _for_forces(world: World) -> World:
    return World(
        settings=world.settings,
        bottles=world.bottles,
        spin=world.spin,
        load=world.load,
        peaks=None,
        stage=None,
        path=world.path,
        slopes=None,
        linear=None,
        implicit=world.implicit,
        neighbourhood=world.neighbourhood,
        watch=world.watch,
        pairs=world.pairs,
        slots=world.slots,
        pair_law=world.pair_law,
        curves=world.curves,
        grid=world.grid,
        segments=world.segments,
        near_segments=world.near_segments,
        arcs=world.arcs,
        near_arcs=world.near_arcs,
        moving=world.moving,
        railed=world.railed,
        rail_law=world.rail_law,
        belts=world.belts,
        surface=world.surface,
        footing=world.footing,
        ring=world.ring,
        static_friction=world.static_friction,
        ledger=world.ledger,
        damage=None,
    )


def lists_of(world: World) -> Any:
    """The World for `rebuild`, and for a look at the overlaps; from Python."""
    return World(
        settings=world.settings,
        bottles=world.bottles,
        spin=None,
        load=None,  # type: ignore[arg-type]
        peaks=None,
        stage=None,
        path=None,
        slopes=None,
        linear=None,
        implicit=None,
        neighbourhood=world.neighbourhood,
        watch=world.watch,
        pairs=world.pairs,
        slots=world.slots,
        pair_law=world.pair_law,
        curves=None,
        grid=world.grid,
        segments=world.segments,
        near_segments=world.near_segments,
        arcs=world.arcs,
        near_arcs=world.near_arcs,
        moving=world.moving,
        railed=world.railed,
        rail_law=None,
        belts=world.belts,
        surface=world.surface,
        footing=world.footing,
        ring=world.ring,
        static_friction=None,
        ledger=None,
        damage=None,
    )


for_forces: Any = part(_for_forces)
"""The World for all in `forces.py`; for kernels."""

for_lists: Any = part(lists_of)
"""The same as `lists_of`, for kernels."""
