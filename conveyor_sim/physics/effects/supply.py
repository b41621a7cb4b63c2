"""Bottles that enter and leave."""

from collections.abc import Collection

from conveyor_sim.physics.effects.declaration import Cause, Effect
from conveyor_sim.physics.plant import Plant


def _infeed(plant: Plant, on: Collection[str]) -> Cause | None:
    return next((Cause(path) for path, _ in plant.scene.givers()), None)


def _outfeed(plant: Plant, on: Collection[str]) -> Cause | None:
    return next((Cause(path) for path, _ in plant.scene.exits()), None)


INFEED = Effect(
    name="infeed",
    law="bottles enter one behind the other, by gap or rate; stations give theirs back",
    source="added",
    called_for=_infeed,
    absent="no infeed, source, spill or station",
    needs="counters and draws of each entry; room for more bottles as they come",
)
OUTFEED = Effect(
    name="outfeed",
    law="bottles whose axis is in a region are removed: at once, at a rate, or when a reject is fired",
    source="added",
    called_for=_outfeed,
    absent="no outfeed, sink, reject or station",
    needs="corners and counters of each",
)
