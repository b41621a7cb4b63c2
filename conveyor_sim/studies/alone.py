"""One run of a study by itself, as its command asks for it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from conveyor_sim.errors import SceneError, StudyError
from conveyor_sim.scene import parse_overrides
from conveyor_sim.scene.words import listed
from conveyor_sim.studies.row import Job, RunRow
from conveyor_sim.studies.run import Work, simulate, warm_start
from conveyor_sim.studies.setup import Setup


def job_of(setup: Setup, given: Sequence[str], seed: int) -> Job:
    """given: "name=value" for each parameter, as YAML. Raises StudyError for others than those of the study."""
    values: dict[str, Any] = {}
    wanted = list(setup.study.parameters)
    for text in given:
        name, sign, value = text.partition("=")
        if not sign or name not in wanted:
            raise StudyError(f"--set {text}: given, expected name=value of {listed(wanted)}")
        try:
            values[name] = parse_overrides(f"value: {value}")["value"]
        except SceneError:
            raise StudyError(f"--set {text}: given, expected a number, a text, true or false as its value") from None
    missing = [name for name in wanted if name not in values]
    if missing:
        raise StudyError(f"--set: {listed(missing)} missing, expected a value for each parameter")
    return Job(0, {name: values[name] for name in wanted}, seed)


def run_alone(setup: Setup, job: Job, bag: Path | None) -> RunRow:
    """Repeat one run of a study, with the same bits, in this process.

    bag: folder to record to. Raise any exception of the run.
    """
    start = None if setup.study.warm_start is None else warm_start(Work(setup, job))
    return simulate(Work(setup, job, start), bag)
