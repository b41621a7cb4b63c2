# SPDX-License-Identifier: Apache-2.0
"""Kernels that integrators call by their addresses: calls that are rare, and the same for all laws of contact."""

from conveyor_sim.engine.arrays.world import Worker, World
from conveyor_sim.engine.compiler.compile import part
from conveyor_sim.engine.compiler.numba_internals.call_by_address import call
from conveyor_sim.engine.compiler.numba_internals.machine_code import address
from conveyor_sim.engine.lists.rebuild import rebuild
from conveyor_sim.engine.observers.guard_probe import probe_overlaps
from conveyor_sim.engine.world_views import lists_of

# Indices in `Worker.callees`.
REBUILD, PROBE = 0, 1


def find_callees(world: World, worker: Worker) -> None:
    """Write addresses of the kernels for the types of `world` to `worker.callees`, which the workers of a group share.

    Compiles the kernels if necessary.
    """
    lists = lists_of(world)
    worker.callees[REBUILD] = address(rebuild, lists)
    worker.callees[PROBE] = address(probe_overlaps, lists, worker.rail_contacts)


@part
def call_rebuild(world: World, worker: Worker) -> None:
    """Rebuild the lists: `rebuild`."""
    call(worker.callees[REBUILD], world, None)


@part
def call_probe(world: World, worker: Worker) -> None:
    """Update the deepest overlaps: `probe_overlaps`."""
    call(worker.callees[PROBE], world, worker.rail_contacts)
