"""The parameters of the node `conveyor_sim`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rclpy.node import Node

from conveyor_sim.errors import ConveyorError
from conveyor_sim.ros.declared import Entry, declare_table

_RATE_TEXT = "Hz of simulated time; -1: as the scene says, 0: never. Must divide the tick rate."
RATES = ("bottles", "poses", "contacts", "belts", "signals", "ledger", "damage", "counters")

TABLE = (
    Entry("scene", "paper_plant", "Scene file, or the name of a shipped scene."),
    Entry("duration", 0.0, "s of simulated time at which the run ends; 0: as the scene says.", 0.0, 1e9),
    Entry("start_paused", False, "Wait at tick 0 for resume, step_simulation, set_simulation_state or lockstep."),
    Entry(
        "real_time_factor",
        1.0,
        "Simulated seconds per wall second; 0: as fast as possible, for recording and lockstep, not for controllers "
        "that run free.",
        0.0,
        1e6,
        fixed=False,
    ),
    Entry("outside_tables", False, "Whether the scene may name tables that lie outside its own folder."),
    Entry(
        "checkpoint_folder",
        "checkpoints",
        "Folder that save_checkpoint and load_checkpoint keep to, made when first needed; empty text: both refuse.",
    ),
    Entry("record", "", "Folder of the rosbag2 recording, new or empty; empty text: do not record."),
    Entry("frame_id", "world", "Frame of all positions, in every header."),
    Entry("publish_clock", True, "Whether /clock is published."),
    Entry("clock_rate", 100.0, "At most so many /clock messages per wall second.", 1.0, 1e4),
    Entry("marker_rate", 30.0, "At most so many markers per wall second; recordings are not thinned.", 1.0, 1e4),
    Entry("threads", 0, "Threads to step with; 0: as many as prove fastest.", 0, 1024),
    Entry("lockstep_max_ticks", 100_000, "Longest advance, in ticks, that a lockstep request may ask for.", 1, 10**9),
    *(Entry(f"rates.{name}", -1.0, f"Rate of {name}: {_RATE_TEXT}", -1.0, 1e6) for name in RATES),
)


@dataclass(frozen=True)
class Parameters:
    """The values at start."""

    scene: str
    duration: float
    start_paused: bool
    real_time_factor: float
    outside_tables: bool
    checkpoint_folder: Path | None
    record: Path | None
    frame_id: str
    publish_clock: bool
    clock_rate: float
    marker_rate: float
    threads: int
    lockstep_max_ticks: int
    rates: Mapping[str, float]

    def overrides(self) -> dict[str, Any]:
        """What is merged over the scene file, so that the recording can tell it to a replay."""
        changed: dict[str, Any] = {}
        if self.duration > 0.0:
            changed["duration"] = self.duration
        rates = {name: rate for name, rate in self.rates.items() if rate >= 0.0}
        if rates:
            changed["outputs"] = rates
        return changed


def declare(node: Node) -> Parameters:
    """Declare all of TABLE on `node`. Raises ConveyorError for a value that can't be."""
    values = declare_table(node, TABLE)
    rates = {name: values.pop(f"rates.{name}") for name in RATES}
    record, checkpoints = values.pop("record"), values.pop("checkpoint_folder")
    return Parameters(
        **values,
        record=_folder(record) if record else None,
        checkpoint_folder=_folder(checkpoints).absolute() if checkpoints else None,
        rates=rates,
    )


def _folder(text: str) -> Path:
    try:
        return Path(text).expanduser()
    except RuntimeError:
        raise ConveyorError(f"parameter: {text!r} given, expected the home of a user that is there") from None
