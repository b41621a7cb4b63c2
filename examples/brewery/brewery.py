# SPDX-License-Identifier: Apache-2.0
"""Controller of brewery.yaml: start, stop and changeover of the line, its combiners, V-curve and reject.

cd examples/brewery; conveyor-sim serve brewery.yaml --controller brewery.py:brewery --web

The folder plc has the same controller in Structured Text.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import IntEnum

from conveyor_sim.control.filler_block import FillerBlock
from conveyor_sim.control.level import Count
from conveyor_sim.control.reject import TrackedReject
from conveyor_sim.control.scan import Controller, Inputs, together
from conveyor_sim.control.start_stop import ABORTED, CLEAR
from conveyor_sim.control.v_curve import Neighbour, VCurve


class LineStep(IntEnum):
    """Step of the sequence."""

    STOPPED = 0
    WARNING = 1
    """The horn sounds before the start."""
    RUNNING = 2
    EMPTYING = 3
    """The source stands, and the line runs until it is empty. Then the format changes."""


@dataclass(frozen=True)
class Combiner:
    """Combiner, slower while a queue behind it reaches the photo-eye `queued`, and standing while it reaches `full`."""

    cell: str
    supply: str
    """Belt before the cell."""
    speeds: tuple[float, float]
    """Full speeds of this belt and of the feed, m/s."""
    slower: float = 0.72
    """Share of these speeds while a queue stands in the lane."""

    def commands(self, inputs: Inputs, runs: bool) -> Mapping[str, float]:
        """Return the commands of its belts in one scan."""
        clear = inputs[f"photo_eyes/{self.cell}_full/blocked"] == 0.0
        share = 1.0 if inputs[f"photo_eyes/{self.cell}_queued/blocked"] == 0.0 else self.slower
        feed, chains = f"{self.cell}_feed", f"{self.cell}_chains"
        return {
            **{f"belts/{belt}/run": float(runs and clear) for belt in (self.supply, feed, chains)},
            **{
                f"belts/{belt}/cmd_speed": share * speed
                for belt, speed in zip((self.supply, feed), self.speeds, strict=True)
            },
        }


@dataclass
class BottlingLine:
    """Control of `brewery.yaml`, without the rates of machines.

    The start button starts the line after a warning by the horn, and the filler block with it. The stop button (NC) and
    the emergency stop end it. After an emergency stop, the reset button precedes the next start. A turn of the selector
    `format` while the line runs empties the line, and then changes the format.
    """

    block: FillerBlock
    source: str
    """Machine that feeds the line."""
    machines: Sequence[str]
    """Other machines."""
    belts: Sequence[str]
    """Belts with a drive, except those of combiners and of the block."""
    combiners: Sequence[Combiner]
    bottles: Sequence[str]
    """Signals whose sum is the number of bottles on the line."""
    formats: Sequence[Mapping[str, float]]
    """Commands by position of the selector."""
    remainder: float = 23.0
    """Largest number of bottles on an empty line, fewer than a case."""
    warning: int = 100
    """Duration of the warning, scans."""
    settle: int = 2000
    """Scans for which the line must be empty; longer than the way of a bottle through the wheels."""
    _step: LineStep = LineStep.STOPPED
    _format: int = 0
    _waited: int = 0
    _ready: bool = True
    _start: bool = field(default=True)

    def scan(self, inputs: Inputs) -> Mapping[str, float]:
        """Return the commands of one scan."""
        powered = inputs["panel/estop/contact"] != 0.0
        start = inputs["panel/start/contact"] != 0.0
        starts = start and not self._start
        self._start = start
        self._ready = powered and (self._ready or inputs["panel/reset/contact"] != 0.0)
        self._step = self._next(inputs, starts, self._ready and inputs["panel/stop/contact"] != 0.0)
        runs = self._step in (LineStep.RUNNING, LineStep.EMPTYING)
        self.block.run_empty = self._step == LineStep.EMPTYING
        commands = {
            **self.block.scan(inputs),
            **self.formats[self._format],
            "panel/horn/on": float(self._step == LineStep.WARNING),
            "panel/empties/on": float(self._step == LineStep.EMPTYING),
            f"machines/{self.source}/run": float(self._step == LineStep.RUNNING),
        }
        for belt in self.belts:
            commands[f"belts/{belt}/run"] = float(runs)
        for combiner in self.combiners:
            commands.update(combiner.commands(inputs, runs))
        for machine in self.machines:
            commands[f"machines/{machine}/run"] = float(runs)
        for machine in (self.source, *self.machines):
            clears = self._ready and inputs[f"machines/{machine}/state"] == ABORTED
            commands[f"machines/{machine}/cntrl_cmd"] = CLEAR if clears else 0.0
        return commands

    def _next(self, inputs: Inputs, starts: bool, may_run: bool) -> LineStep:
        """Return the next step, and change the format at the end of an emptying."""
        if not may_run:
            return LineStep.STOPPED
        if self._step == LineStep.STOPPED:
            self._waited = 0
            return LineStep.WARNING if starts else LineStep.STOPPED
        self._waited += 1
        if self._step == LineStep.WARNING and self._waited <= self.warning:
            return LineStep.WARNING
        wanted = int(inputs["panel/format/position"])
        if wanted == self._format:
            return LineStep.RUNNING
        if self._step != LineStep.EMPTYING or sum(inputs[name] for name in self.bottles) > self.remainder:
            self._waited = 0
        elif self._waited > self.settle:
            self._format = wanted
            return LineStep.RUNNING
        return LineStep.EMPTYING


def brewery() -> Controller:
    """Return the controller of `brewery.yaml`: the sequence of the line, its V-curve, and the reject."""
    belts = ("supply", "spread", "filled", "leaving", "cold", "wide", "packing")
    cells = ("single", "label")
    line = BottlingLine(
        block=FillerBlock(
            ("inlet", "filler", "outlet", "capper"), master="master", cell="block_", top_rate=40_000, top_speed=1.75
        ),
        source="depalletiser",
        machines=("rinser", "pasteuriser", "labeller", "packer"),
        belts=("spread", "filled", "leaving", "wide", "packing", *(f"{cell}_lane" for cell in cells)),
        combiners=(Combiner("single", "supply", (0.05, 0.12)), Combiner("label", "cold", (0.055, 0.12))),
        bottles=(
            *(f"belts/{belt}/bottles" for belt in (*belts, "block_infeed", "block_discharge")),
            *(f"belts/{cell}_{belt}/bottles" for cell in cells for belt in ("feed", "chains", "lane")),
            *(f"machines/{machine}/held" for machine in ("rinser", "pasteuriser", "labeller")),
            "zones/layer/bottles",
        ),
        formats=({"machines/depalletiser/cmd_bottle": 0.0}, {"machines/depalletiser/cmd_bottle": 1.0}),
    )
    reject = TrackedReject(
        belt="label_lane",
        inspection="machines/camera/bad",
        seen="machines/camera/bad_time",
        fire="machines/reject/fire",
        distance=1.0,
        stroke=0.03,
        pulses_per_metre=2000.0,
    )
    return together(line, v_curve(), reject)


def v_curve() -> VCurve:
    """Return the rates of the machines around the filler block of `brewery.yaml`."""

    def neighbour(machine: str, zone: str, low: float, target: float, high: float) -> Neighbour:
        return Neighbour(f"machines/{machine}/rate", Count(f"zones/{zone}/bottles"), low, target, high)

    return VCurve(
        bottleneck=None,
        rate="panel/rate/value",
        margin=0.04,
        upstream=(neighbour("depalletiser", "supply", 2200, 2600, 3000),),
        downstream=(
            neighbour("pasteuriser", "filled", 300, 500, 700),
            neighbour("labeller", "cold", 300, 900, 1100),
            neighbour("packer", "packing", 300, 500, 700),
        ),
    )
