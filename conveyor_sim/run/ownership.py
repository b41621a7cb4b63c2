"""Who owns the simulation in lockstep owns the line too: these inputs tell it so, and are on record."""

from __future__ import annotations

from conveyor_sim.line.commands.inputs import DISOWN, OWN, Input
from conveyor_sim.run.lockstep import LOCKSTEP, LockstepRequest, Refused
from conveyor_sim.simulation import Simulation
from conveyor_sim.support.printable import SENTENCE, printable


def require_fitting(simulation: Simulation, request: LockstepRequest) -> None:
    """Raises Refused if it releases devices that there are not."""
    modes = simulation.line.modes
    # A controller releases the same ones in every request.
    if list(request.released) != modes.released and (reason := modes.pattern_problem(request.released)):
        raise Refused(f"released: {reason}")


def claim(simulation: Simulation, request: LockstepRequest) -> None:
    """Have the line owned by whoever asks, but for the devices that are released, if it is not already."""
    hands = simulation.line.modes.later()
    released = [printable(pattern, SENTENCE) for pattern in request.released]
    if hands.owner and hands.owner != printable(request.run_id):
        give_up(simulation)
    if (hands.owner, hands.released) != (printable(request.run_id), released):
        simulation.give(Input(LOCKSTEP, request.run_id, "controller", OWN, (), (), request.released))


def give_up(simulation: Simulation) -> None:
    """Have it owned by nobody."""
    if owner := simulation.line.modes.later().owner:
        simulation.give(Input(LOCKSTEP, owner, "controller", DISOWN, (), ()))
