# SPDX-License-Identifier: Apache-2.0
"""Controller of `config/brewery.yaml`: start, stop and changeover of the line, its combiners, V-curve and reject.

`config/brewery/plc/` has the same controller in Structured Text.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import IntEnum

from conveyor_sim.control.cell import in_cell
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


@dataclass
class Combiner:
    """Control of a combiner by the queue in the lane behind it.

    The feed is slower while the queue reaches the photo-eye `queued`, and stands while it reaches `full`. All stands
    while it reaches `backed`. Bottles that stand on running chains, with none behind them in the lane, have wedged: the
    chains run backward for a moment.
    """

    cell: str
    supply: str
    """Belt before the cell."""
    speeds: tuple[float, float]
    """Full speeds of this belt and of the feed, m/s."""
    slower: float = 0.65
    """Share of these speeds while the queue reaches `queued`."""
    stuck: int = 100
    """Time after which standing bottles have wedged, scans."""
    clearing: int = 300
    """Time to clear them, scans. In its first half, the chains run backward."""
    _stuck: int = 0
    _clearing: int = 0

    def scan(self, inputs: Inputs, runs: bool) -> Mapping[str, float]:
        """Return the commands of its belts in one scan."""

        def covered(eye: str) -> bool:
            return inputs[f"photo_eyes/{self.cell}_{eye}/blocked"] != 0.0

        backed = covered("backed")
        wedged = covered("standing") and not covered("entered") and not backed
        if self._clearing:
            self._clearing -= 1
        else:
            self._stuck = self._stuck + 1 if wedged else 0
        if self._stuck > self.stuck:
            self._stuck, self._clearing = 0, self.clearing
        if not runs:
            self._stuck = self._clearing = 0
        feeds = runs and not backed and not covered("full") and not self._clearing
        share = self.slower if covered("queued") else 1.0
        feed, chains = f"belts/{self.cell}_feed", f"belts/{self.cell}_chains"
        return {
            f"belts/{self.supply}/run": float(feeds),
            f"belts/{self.supply}/cmd_speed": share * self.speeds[0],
            f"{feed}/run": float(feeds),
            f"{feed}/cmd_speed": share * self.speeds[1],
            f"{chains}/run": float(runs and not backed),
            f"{chains}/reverse": float(2 * self._clearing > self.clearing),
        }


@dataclass
class BottlingLine:
    """Control of `config/brewery.yaml`, without the rates of machines.

    The start button starts the line after a warning by the horn, and the filler block with it. The stop button (NC) and
    the emergency stop end it. After an emergency stop, the reset button precedes the next start. A turn of the selector
    `format` while the line runs empties the line, and then changes the format.
    """

    block: FillerBlock
    source: str
    """Machine that feeds the line."""
    supply: str
    """Belt that it feeds."""
    full: float
    """Number of bottles on this belt at which the source stands, because there is no room for another layer."""
    room: float
    """Number of bottles at which it continues."""
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
    _full: bool = False

    def scan(self, inputs: Inputs) -> Mapping[str, float]:
        """Return the commands of one scan."""
        powered = inputs["panel/estop/contact"] != 0.0
        start = inputs["panel/start/contact"] != 0.0
        starts = start and not self._start
        self._start = start
        self._ready = powered and (self._ready or inputs["panel/reset/contact"] != 0.0)
        supplied = inputs[f"belts/{self.supply}/bottles"]
        self._full = supplied >= self.full or (self._full and supplied > self.room)
        self._step = self._next(inputs, starts, self._ready and inputs["panel/stop/contact"] != 0.0)
        runs = self._step in (LineStep.RUNNING, LineStep.EMPTYING)
        self.block.run_empty = self._step == LineStep.EMPTYING
        commands = {
            **self.block.scan(inputs),
            **self.formats[self._format],
            "panel/horn/on": float(self._step == LineStep.WARNING),
            "panel/empties/on": float(self._step == LineStep.EMPTYING),
            f"machines/{self.source}/run": float(self._step == LineStep.RUNNING and not self._full),
        }
        for belt in self.belts:
            commands[f"belts/{belt}/run"] = float(runs)
        for combiner in self.combiners:
            commands.update(combiner.scan(inputs, runs))
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


def brewery(supply: float = 9.0, buffer: float = 8.0) -> Controller:
    """Return the controller of `config/brewery.yaml`: the sequence of the line, its V-curve, and the reject.

    supply, buffer: lengths of the wide conveyors before and behind the block, m, the scene's parameters.
    """
    belts = ("supply", "spread", "filled", "leaving", "cold", "wide", "packing")
    cells = ("single", "label")
    line = BottlingLine(
        block=FillerBlock(
            ("inlet", "filler", "outlet", "capper"), master="master", cell="block_", top_rate=40_000, top_speed=1.75
        ),
        source="depalletiser",
        supply="supply",
        full=2400 * supply / 9.0,
        room=2200 * supply / 9.0,
        machines=("rinser", "pasteuriser", "labeller", "packer"),
        belts=("spread", "filled", "leaving", "wide", "packing", *(f"{cell}_lane" for cell in cells)),
        combiners=(Combiner("single", "supply", (0.046, 0.12)), Combiner("label", "cold", (0.05, 0.12))),
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
    return together(line, v_curve(supply, buffer), reject)


def v_curve(supply: float, buffer: float) -> VCurve:
    """Return the rates of the machines around the filler block of the brewery, with levels that suit the lengths."""

    def neighbour(machine: str, zone: str, *levels: float) -> Neighbour:
        size = {"supply": supply / 9.0, "cold": 1.0}.get(zone, buffer / 8.0)
        low, target, high = (level * size for level in levels)
        return Neighbour(f"machines/{machine}/rate", Count(f"zones/{zone}/bottles"), low, target, high)

    return VCurve(
        bottleneck=None,
        rate="panel/rate/value",
        margin=0.04,
        upstream=(neighbour("depalletiser", "supply", 1400, 1650, 1900),),
        downstream=(
            neighbour("pasteuriser", "filled", 270, 450, 630),
            neighbour("labeller", "cold", 700, 850, 1000),
            neighbour("packer", "packing", 270, 450, 630),
        ),
    )


def hall() -> Controller:
    """Return the controller of `config/brewery/hall.yaml`, ten lines of the brewery."""
    return together(*(in_cell(brewery(), f"line_{number}") for number in range(10)))
