# SPDX-License-Identifier: Apache-2.0
"""`FillerBlock`: start, run, stop and restart of a block of machines on axes in gear, fed through a stop gate."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import IntEnum

from conveyor_sim.control.scan import Inputs


class Step(IntEnum):
    """Step of the sequence."""

    STOPPED = 0
    ENABLING = 1
    """The axes are disabled for one scan, because a rising edge of `enable` starts them."""
    GEARING = 2
    """The slaves gear in, while the master stands."""
    RUNNING = 3
    FAILED = 4
    """An axis has failed. The axes in gear brake in phase."""


@dataclass
class FillerBlock:
    """Control of `config/filler_block.yaml`.

    The start button enables all axes, gears the slaves in, and starts the master. The block runs without bottles until
    enough wait at the gate. The gate closes when too few wait, when the discharge is full, and when the block stops.
    After the failure of an axis or an emergency stop, the reset button precedes the next start.
    """

    slaves: Sequence[str]
    """Names of the axes with a master."""
    master: str = "block"
    slow: float = 0.6
    """Rate over the commanded one while few bottles come."""
    cell: str = ""
    """Prefix of the names of all parts but the panel, such as "block_" for a cell "block"."""
    run_empty: bool = False
    """The gate is open even if too few bottles wait, until the discharge is full or the block stops."""
    top_rate: float = 24000.0
    """Bottles per hour at which the infeed conveyor has `top_speed`."""
    top_speed: float = 1.05
    """Speed of the infeed conveyor while the block stands, and at `top_rate`, m/s.

    In between it runs in proportion to the master: a faster one would push bottles ahead of their pockets.
    """
    _step: Step = Step.STOPPED
    _ready: bool = True
    _start: bool = field(default=True)
    _pulse: bool = False

    def scan(self, inputs: Inputs) -> Mapping[str, float]:
        """Return the commands of one scan."""
        cell, axes = self.cell, [f"{self.cell}{axis}" for axis in (self.master, *self.slaves)]
        powered = inputs["panel/estop/contact"] != 0.0
        failed = any(inputs[f"axes/{axis}/fault"] for axis in axes)
        start, reset = inputs["panel/start/contact"] != 0.0, inputs["panel/reset/contact"] != 0.0
        starts = start and not self._start
        self._start = start
        # An axis reports the end of its failure one scan after the reset.
        self._ready = powered and not failed and (self._ready or reset)
        geared = all(inputs[f"axes/{axis}/in_gear"] for axis in axes[1:])
        self._pulse = self._step == Step.GEARING and not self._pulse
        self._step = self._next(failed, starts, geared, inputs["panel/stop/contact"] != 0.0)
        runs = self._step == Step.RUNNING
        full = inputs[f"photo_eyes/{cell}backed_up/blocked"] != 0.0
        turns = runs and not full
        rate = inputs["panel/rate/value"]
        wanted = rate / 3600.0
        share = 1.0 if inputs[f"photo_eyes/{cell}supplied/blocked"] else self.slow
        queued = self.run_empty or inputs[f"photo_eyes/{cell}queued/blocked"] != 0.0
        commands = {
            f"axes/{axes[0]}/rate": wanted * share if turns else 0.0,
            f"belts/{cell}infeed/cmd_speed": self.top_speed * (rate / self.top_rate) * share
            if turns
            else self.top_speed,
            f"gates/{cell}stop/open": float(turns and queued),
            f"belts/{cell}infeed/run": float(powered and self._step != Step.FAILED),
            f"belts/{cell}discharge/run": float(powered and self._step != Step.FAILED),
            "panel/stack/red": float(failed or not powered),
            "panel/stack/yellow": float(powered and not failed and not self._ready),
            "panel/stack/green": float(runs),
            "panel/filled/write": inputs[f"carousels/{cell}valves/good"],
        }
        for axis in axes:
            commands[f"axes/{axis}/enable"] = float(self._step != Step.ENABLING)
            commands[f"axes/{axis}/reset"] = float(reset)
        for axis in axes[1:]:
            commands[f"axes/{axis}/gear_in"] = float(self._step == Step.GEARING and self._pulse)
        return commands

    def _next(self, failed: bool, starts: bool, geared: bool, stop_closed: bool) -> Step:
        """Return the next step. A stop button opens its contact."""
        if failed:
            return Step.FAILED
        if not self._ready or not stop_closed:
            return Step.STOPPED
        if self._step in (Step.STOPPED, Step.FAILED):
            return Step.ENABLING if starts else Step.STOPPED
        if self._step == Step.ENABLING or (self._step == Step.GEARING and not geared):
            return Step.GEARING
        return Step.RUNNING


def filler_block() -> FillerBlock:
    """Return the controller of `config/filler_block.yaml`."""
    return FillerBlock(("inlet", "filler", "outlet", "capper"))
