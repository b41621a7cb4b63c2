"""Parameters of the node `conveyor_sim`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rclpy.node import Node

from conveyor_sim.errors import ConveyorError
from conveyor_sim.ros.declared import DeclaredParameter, declare_table
from conveyor_sim.scene.choices import choices, settings_of

_RATE_TEXT = "Hz of simulated time; -1: that of the scene, 0: never. Must divide the tick rate."
RATES = ("bottles", "poses", "contacts", "belts", "signals", "ledger", "damage", "counters")

TABLE = (
    DeclaredParameter("scene", "paper_plant", "Scene file, or the name of a shipped scene."),
    DeclaredParameter("duration", 0.0, "s of simulated time at which the run ends; 0: that of the scene.", 0.0, 1e9),
    DeclaredParameter(
        "start_paused", False, "Wait at tick 0 for resume, step_simulation, set_simulation_state, lockstep."
    ),
    DeclaredParameter(
        "real_time_factor",
        1.0,
        "Simulated seconds per wall second; 0: as fast as possible, for recording and lockstep, not for free "
        "controllers.",
        0.0,
        1e6,
        fixed=False,
    ),
    DeclaredParameter("outside_tables", False, "Whether the scene may refer to files outside its folder."),
    DeclaredParameter("set", "", "Parameters of the scene: NAME=VALUE, several with semicolons between them."),
    DeclaredParameter("variant", "", "Variant of the scene; empty text: the one that its file names, if any."),
    DeclaredParameter("format", "", "Format of the scene; empty text: the one that its file names, if any."),
    DeclaredParameter(
        "checkpoint_folder",
        "checkpoints",
        "Folder of save_checkpoint and load_checkpoint, made when first needed; empty text: both refuse.",
    ),
    DeclaredParameter("record", "", "Folder of the rosbag2 recording, new or empty; empty text: do not record."),
    DeclaredParameter("frame_id", "world", "Frame of all positions, in every header."),
    DeclaredParameter("publish_clock", True, "Whether /clock is published."),
    DeclaredParameter("clock_rate", 100.0, "Largest number of /clock messages per wall second.", 1.0, 1e4),
    DeclaredParameter("marker_rate", 30.0, "Largest number of markers per wall second; recordings have all.", 1.0, 1e4),
    DeclaredParameter("threads", 0, "Number of threads that step; 0: the fastest number.", 0, 1024),
    DeclaredParameter("lockstep_max_ticks", 100_000, "Longest advance of one lockstep request, in ticks.", 1, 10**9),
    *(DeclaredParameter(f"rates.{name}", -1.0, f"Rate of {name}: {_RATE_TEXT}", -1.0, 1e6) for name in RATES),
)


@dataclass(frozen=True)
class Parameters:
    """Values at the start."""

    scene: str
    duration: float
    start_paused: bool
    real_time_factor: float
    outside_tables: bool
    set: str
    variant: str
    format: str
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
        """Return the overrides of the scene file, which the recording stores for a replay. Raise SceneError."""
        settings = settings_of(text for text in self.set.split(";") if text.strip())
        changed = choices(settings, self.variant or None, self.format or None)
        if self.duration > 0.0:
            changed["duration"] = self.duration
        rates = {name: rate for name, rate in self.rates.items() if rate >= 0.0}
        if rates:
            changed["outputs"] = rates
        return changed


def declare(node: Node) -> Parameters:
    """Declare all parameters of TABLE on `node`. Raise ConveyorError for an invalid value."""
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
        raise ConveyorError(f"parameter: {text!r} given, expected the home of an existing user") from None
