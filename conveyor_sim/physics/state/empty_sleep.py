# SPDX-License-Identifier: Apache-2.0
"""Arrays of sleeping bottles of a State in which none sleeps."""

import numpy as np

from conveyor_sim.engine.arrays.impulses import COLOURS
from conveyor_sim.engine.arrays.sleep import SeenSurfaces, Sleep, SleepLoads
from conveyor_sim.engine.threads.workers import UNIT
from conveyor_sim.physics.model import Model


def empty_sleep(model: Model, slots: int) -> Sleep:
    """Return the arrays for a number of slots."""
    asleep, island, quiet, kind, begin, end, root = np.zeros((7, slots), np.uint32)
    bottle, mark, noise = np.zeros((3, slots), np.int64)
    x, y, press, total = np.zeros((4, slots))
    return Sleep(
        asleep=asleep,
        island=island,
        quiet=quiet,
        x=x,
        y=y,
        press=press,
        id=bottle,
        type=kind,
        loads=SleepLoads(*np.zeros((2, slots))) if model.has("peaks") else None,
        surfaces=_surfaces(model),
        sleepers=np.zeros(1, np.int64),
        ticks=np.zeros(2, np.int64),
        ahead=np.zeros(1),
        end=np.zeros(COLOURS, np.int64),
        first_run=np.zeros(slots // UNIT + 2, np.uint32),
        run_begin=begin,
        run_end=end,
        mark=mark,
        root=root,
        noise=noise,
        sum=total,
    )


def _surfaces(model: Model) -> SeenSurfaces | None:
    if model.base_friction is None:
        return None
    surfaces = model.base_friction.shape[0]
    turn = np.zeros(surfaces) if model.has("curved_belts") else None
    return SeenSurfaces(np.zeros(surfaces), np.zeros(surfaces), turn)
