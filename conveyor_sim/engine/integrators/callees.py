"""Kernels that the integrators call by their addresses: what comes seldom, and is the same for all laws of contacts."""

from conveyor_sim.engine.arrays.world import Worker, World
from conveyor_sim.engine.compiler.compile import part
from conveyor_sim.engine.compiler.numba_internals.call_by_address import call
from conveyor_sim.engine.compiler.numba_internals.machine_code import address
from conveyor_sim.engine.lists.rebuild import rebuild
from conveyor_sim.engine.observers.guard_probe import probe_overlaps
from conveyor_sim.engine.world_views import lists_of

# Places in `Worker.callees`.
REBUILD, PROBE = 0, 1


def find_callees(world: World, worker: Worker) -> None:
    """Write the addresses for Worlds of this one's types to `worker.callees`, which the workers of a group share.

    Compiles the kernels if need be.
    """
    lists = lists_of(world)
    worker.callees[REBUILD] = address(rebuild, lists)
    worker.callees[PROBE] = address(probe_overlaps, lists, worker.found)


@part
def call_rebuild(world: World, worker: Worker) -> None:
    """Make the lists anew: `rebuild`."""
    call(worker.callees[REBUILD], world, None)


@part
def call_probe(world: World, worker: Worker) -> None:
    """Look at the overlaps: `probe_overlaps`."""
    call(worker.callees[PROBE], world, worker.found)
