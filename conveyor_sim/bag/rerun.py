# SPDX-License-Identifier: Apache-2.0
"""Repetition of a run from its logged inputs (`input_log.py`), with a recording of it."""

from __future__ import annotations

import json
import shutil
import uuid
from base64 import b64decode
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from conveyor_sim.bag.folder import alone
from conveyor_sim.bag.input_log import FILE_NAME, FORMAT, START_NAME, copier, environment_of
from conveyor_sim.bag.outputs import OutputWriter
from conveyor_sim.bag.recorder import Recorder
from conveyor_sim.errors import BagError, SimulationError
from conveyor_sim.line.commands.inputs import Input
from conveyor_sim.line.run_state import ENDED, RUNNING, STOPPED, RunState
from conveyor_sim.scene import Scene, parse_again, parse_overrides
from conveyor_sim.simulation import Simulation
from conveyor_sim.support.files import MB, FileError, read_file
from conveyor_sim.support.printable import SENTENCE, printable

MOST = 512 * MB
"""Bytes of a file of inputs, at most."""

Watcher = Callable[[Simulation, Mapping[str, float]], None]
"""Called with a simulation and the variables of its controller that are recorded."""


@dataclass(frozen=True)
class Rerun:
    """Result of a repeated run."""

    bag: Path
    end: float
    """Simulated time at its end, s."""
    departure: str
    """One sentence on its first deviation from the logged run; "": every logged state is the same."""


@dataclass(frozen=True)
class _Changed:
    """Change of a controller's recorded variables at a scan."""

    names: tuple[str, ...] | None
    """None: unchanged."""
    values: list[tuple[int, float]]
    """Places and values of those that changed."""


@dataclass(frozen=True)
class _Run:
    """Content of a file of inputs."""

    scene: Scene
    sources: dict[str, bytes]
    from_checkpoint: bool
    environment: list[str]
    inputs: dict[int, list[Input]]
    """By the first tick at which they are applied."""
    variables: dict[int, _Changed]
    """By the tick of the scan."""
    hashes: dict[int, int]
    last: int
    """Last logged tick."""
    failed: bool


def rerun(
    folder: Path,
    bag: Path,
    progress: Callable[[float, float], None] | None = None,
    watch: Watcher | None = None,
) -> Rerun:
    """Simulate a run again with the inputs in a folder, and record it to another folder, new or empty.

    If the run began at a checkpoint, a copy of it is put into the bag's folder, because a replay needs it.
    progress(done, total) is called with simulated times, s. watch is called at the start and after each tick with the
    simulation, which it only reads, and the recorded variables of its controller. Raise BagError for inputs that are
    missing, damaged or still being written, and if the bag can't be recorded; CheckpointError for an invalid
    checkpoint. An error leaves no bag.
    """
    path = folder / FILE_NAME
    run = _read(path)
    with alone(path):
        start = folder / START_NAME
        if run.from_checkpoint:
            simulation = Simulation.load(start, scene=run.scene)
            simulation.line.take_waiting()  # it is among the inputs
            simulation.take_events()  # of the run before the checkpoint
        else:
            simulation = Simulation(run.scene)
        if run.last < simulation.tick:
            raise BagError(f"{path}: ends at tick {run.last}, expected the start, tick {simulation.tick}, or later")
        recorder = Recorder(bag, start=copier(start if run.from_checkpoint else None), sources=run.sources)
        try:
            with recorder:
                departure = _simulate(run, simulation, recorder, progress, watch)
        except BaseException:
            shutil.rmtree(bag, ignore_errors=True)
            raise
    if departure:
        departure += f", expected {_expected(run, simulation)}"
    return Rerun(bag, simulation.time, departure)


def _simulate(
    run: _Run,
    simulation: Simulation,
    recorder: Recorder,
    progress: Callable[[float, float], None] | None,
    watch: Watcher | None,
) -> str:
    """Run to the end. Return the first deviation from the logged states in words; "": there is none."""
    outputs = OutputWriter(simulation, [recorder], run_id=uuid.uuid4().hex)
    outputs.start()
    outputs.show_run(RunState(RUNNING))
    total = run.last * simulation.model.tick_ns * 1e-9
    applied: list[Input] = []
    departure = _departure(run, simulation)
    variables: dict[str, float] = {}

    def show() -> None:
        nonlocal variables
        if (scanned := run.variables.get(simulation.tick)) is not None:
            variables = _after(variables, scanned)
            outputs.show_variables(tuple(variables), tuple(variables.values()))
        if watch is not None:
            watch(simulation, variables)

    show()
    while simulation.tick < run.last or run.failed:
        applied = run.inputs.get(simulation.tick, applied)
        for one in applied:
            simulation.give(one)
        try:
            simulation.advance()
        except SimulationError as error:
            outputs.after_failure()
            outputs.show_run(RunState(STOPPED, printable(error, SENTENCE)))
            expected = run.failed and simulation.tick == run.last
            return departure or ("" if expected else f"the run stops at {simulation.time:.2f} s ({error})")
        outputs.after_tick()
        show()
        departure = departure or _departure(run, simulation)
        if simulation.tick > run.last:
            return departure or f"the run goes on after {total:.2f} s, where it stopped"
        if progress is not None:
            progress(simulation.time, total)
    outputs.show_run(RunState(ENDED))
    return departure


def _after(variables: dict[str, float], scanned: _Changed) -> dict[str, float]:
    """Return the variables by name after a scan."""
    names = tuple(variables) if scanned.names is None else scanned.names
    now = dict(variables) if scanned.names is None else dict.fromkeys(names, 0.0)
    now.update((names[place], value) for place, value in scanned.values)
    return now


def _departure(run: _Run, simulation: Simulation) -> str:
    logged = run.hashes.get(simulation.tick)
    same = logged is None or logged == simulation.state_hash()
    return "" if same else f"the repeated run differs at {simulation.time:.2f} s (tick {simulation.tick})"


def _expected(run: _Run, simulation: Simulation) -> str:
    here = environment_of(simulation)
    then = [entry for entry in run.environment if entry not in here]
    if then:
        return f"the versions and the machine of the first run ({', '.join(then)})"
    return "a test that changes its line by commands and faults only"


def _read(path: Path) -> _Run:
    """Read a file of inputs without a last line that was cut short. Raise BagError, SceneError."""
    try:
        text = read_file(path, MOST).decode("ascii", errors="replace")
    except FileError as error:
        raise BagError(f"{path}: {error}, expected the inputs of a run") from error
    inputs: dict[int, list[Input]] = {}
    variables: dict[int, _Changed] = {}
    hashes: dict[int, int] = {}
    known: tuple[str, ...] = ()
    last, failed = 0, False
    lines = text.split("\n")[:-1]
    try:
        header = json.loads(lines[0])
        if header["format"] != FORMAT:
            raise BagError(f"{path}: format {header['format']!r} of inputs, expected {FORMAT}")
        source = {key: str(header["scene"][key]) for key in ("text", "name", "overrides")}
        scene = parse_again(source["text"], source["name"], parse_overrides(source["overrides"]))
        sources = {name: b64decode(text, validate=True) for name, text in dict(header.get("sources", {})).items()}
        from_checkpoint, environment = bool(header["start"]), [str(entry) for entry in header["environment"]]
        for line in lines[1:]:
            entry = json.loads(line)
            tick = int(entry["tick"])
            if tick < last or failed:
                raise ValueError("ticks out of order")
            last = tick
            if "inputs" in entry:
                inputs[tick] = [_input(*row) for row in entry["inputs"]]
            elif "variables" in entry:
                names = tuple(str(name) for name in entry["names"]) if "names" in entry else None
                known = known if names is None else names
                variables[tick] = _Changed(names, [(range(len(known))[at], float(to)) for at, to in entry["variables"]])
            else:
                hashes[tick] = int(entry["hash"])
                failed = bool(entry.get("failed"))
    except (IndexError, KeyError, TypeError, ValueError, RecursionError) as error:
        raise BagError(f"{path}: is damaged ({printable(error)}), expected the inputs of a run") from error
    return _Run(scene, sources, from_checkpoint, environment, inputs, variables, hashes, last, failed)


def _input(source: Any, writer: Any, kind: Any, operation: Any, names: Any, values: Any, texts: Any) -> Input:
    origin = str(source), str(writer), str(kind), str(operation)
    logged = Input(*origin, tuple(map(str, names)), tuple(map(float, values)), tuple(map(str, texts)))
    if logged.by_line:
        raise ValueError("an input of the line itself")
    return logged
