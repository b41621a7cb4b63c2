"""Bottles that enter and leave."""

from collections.abc import Collection

from conveyor_sim.effects.declaration import Cause, Effect
from conveyor_sim.scene.schema import Scene


def _infeed(scene: Scene, on: Collection[str]) -> Cause | None:
    return Cause(("infeeds", next(iter(scene.infeeds)))) if scene.infeeds else None


def _outfeed(scene: Scene, on: Collection[str]) -> Cause | None:
    return Cause(("outfeeds", next(iter(scene.outfeeds)))) if scene.outfeeds else None


INFEED = Effect(
    name="infeed",
    law="bottles enter one behind the other, by gap or rate",
    source="added",
    called_for=_infeed,
    absent="no infeed",
    needs="counters and draws of each infeed; room for more bottles as they come",
)
OUTFEED = Effect(
    name="outfeed",
    law="bottles whose axis is in a region are removed",
    source="added",
    called_for=_outfeed,
    absent="no outfeed",
    needs="corners and counter of each outfeed",
)
