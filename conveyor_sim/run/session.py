# SPDX-License-Identifier: Apache-2.0
"""One run of a scene, from tick 0 or a checkpoint to its end: its simulation, publishers and recording."""

from __future__ import annotations

import time
import uuid
from collections.abc import Sequence
from pathlib import Path

from conveyor_sim.bag.outputs import MessageSink, OutputWriter
from conveyor_sim.bag.recorder import Recorder
from conveyor_sim.control.scan import Controller
from conveyor_sim.errors import CheckpointError, SimulationError
from conveyor_sim.line.commands.inputs import CommandOutcome, Input
from conveyor_sim.line.commands.refusal import shown
from conveyor_sim.run.force_check import PeakWatch, achieved
from conveyor_sim.run.scan_loop import ScanLoop
from conveyor_sim.scene.recorded import sources_of
from conveyor_sim.simulation import Simulation
from conveyor_sim.support.printable import SENTENCE, printable

FILE_NAME = "stopped.npz"
"""A checkpoint (`Simulation.load`), in the folder of the recording."""


def keep_stopped(simulation: Simulation, folder: Path | None, error: SimulationError) -> SimulationError:
    """Write the state before the failed tick into a folder, if one is passed. Return the error with the path."""
    if folder is None:
        return error
    path = folder / FILE_NAME
    try:
        simulation.save(path)
    except CheckpointError as failed:
        return SimulationError(f"{error}; the state before that tick was not saved: {failed}", error.kind)
    return SimulationError(f"{error}; the state before that tick is in {path}", error.kind)


class RunSession:
    """A simulation with its sinks. Only the thread that steps it may use it."""

    def __init__(
        self,
        simulation: Simulation,
        sink: MessageSink,
        bag: Path | None,
        frame_id: str,
        distro: str,
        controller: Controller | None = None,
        record: Sequence[str] = (),
        *,
        namespace: str = "",
    ) -> None:
        """Start the run at the present tick of `simulation`. bag: folder to record to, or None.

        controller: owns the line and scans at every tick, if one is passed. record: patterns of its recorded variables.
        namespace: prefix of the recorded topics.
        Raises BagError if the folder can't be written, and ConveyorError for a controller that does not fit the line;
        nothing has been published then.
        """
        self.run_id = uuid.uuid4().hex
        self.bag = bag
        self._sink = sink
        self._frame_id = frame_id
        self.wall = 0.0
        """Time from the start of the first tick to the end of the last one, s of wall time."""
        self._first_tick_at: float | None = None
        self.simulation = simulation
        self._scans = ScanLoop(simulation, controller, record)
        self._scans.own()
        self._began = simulation.time
        keep_start = simulation.save if simulation.tick > 0 else None
        sources = sources_of(simulation.scene)
        self._recorder = (
            Recorder(bag, distro=distro, start=keep_start, sources=sources, namespace=namespace) if bag else None
        )
        sinks = [sink] if self._recorder is None else [self._recorder, sink]
        self.outputs = OutputWriter(self.simulation, sinks, frame_id=frame_id, run_id=self.run_id)
        self.outputs.start()
        self._peaks = PeakWatch(self.simulation)
        self._last_outcomes: list[CommandOutcome] = []

    @property
    def last_tick(self) -> int:
        """The tick at which the run ends."""
        return self.simulation.scene.duration_ticks

    def tick(self) -> list[CommandOutcome]:
        """Advance by one tick and write all topics that are due. Return the command results.

        Raises SimulationError, BagError, and ConveyorError for a controller that can't go on.
        """
        if self._first_tick_at is None:
            self._first_tick_at = time.monotonic()
        self._scans.before_tick(self.outputs)
        try:
            self.simulation.advance(1)
        except SimulationError as error:
            self._last_outcomes = self.outputs.after_failure()
            raise keep_stopped(self.simulation, self.bag, error) from error
        outcomes = self.outputs.after_tick()
        self._last_outcomes = outcomes
        self._scans.after_tick(outcomes)
        self._last_outcomes = []
        self._peaks.after_tick()
        self.wall = time.monotonic() - self._first_tick_at
        return outcomes

    @property
    def account(self) -> str:
        """Speed and peak force of the run, in one line."""
        simulation = self.simulation
        simulated = simulation.time - self._began
        account = f"{simulated:g} s simulated in {self.wall:.2f} s"
        if self.wall > 0.0:
            account += f", {simulated / self.wall:.3g} x real time"
        reached = achieved(simulation.model, self._peaks.force)
        if reached is None or not reached.peak_force:
            return account
        return f"{account}; {reached.warning or f'peak force {reached.peak_force:.3g} N'}"

    @property
    def to_bag(self) -> str:
        """Folder of the recording, as the end of a sentence; empty if the run is not recorded."""
        return f", recorded to {self.bag}" if self.bag else ""

    def take_last_outcomes(self) -> list[CommandOutcome]:
        """Return the command results of a tick that failed."""
        outcomes, self._last_outcomes = self._last_outcomes, []
        return outcomes

    def tell(self, outcome: CommandOutcome) -> None:
        """Write a command result that belongs to no tick. Raise BagError."""
        self.outputs.tell(outcome)

    def refuse(self, request: Input, reason: str) -> None:
        """Publish the refusal of an input that came too late for a tick. The recording is closed by then."""
        shortened = request._replace(names=shown(request.names))
        self.outputs.tell(CommandOutcome(self.simulation.tick, shortened, False, printable(reason, SENTENCE)))

    def flush(self) -> None:
        """Pass recorded messages on to the operating system. Raise BagError."""
        if self._recorder is not None:
            self._recorder.flush()

    def close(self) -> None:
        """Complete the recording. Raise BagError if that fails."""
        if self._recorder is not None:
            recorder, self._recorder = self._recorder, None
            # Results of commands that come too late are still published.
            self.outputs = OutputWriter(self.simulation, [self._sink], frame_id=self._frame_id, run_id=self.run_id)
            recorder.close()
