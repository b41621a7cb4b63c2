# SPDX-License-Identifier: Apache-2.0
"""Common part of all runs of a study, as sent to the worker processes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

from conveyor_sim.errors import StudyError
from conveyor_sim.physics.sources_hash import version_hashes
from conveyor_sim.scene.overrides import merged
from conveyor_sim.studies.code import digest_of
from conveyor_sim.studies.metrics import Metric, metric_of
from conveyor_sim.studies.study import Study


@dataclass(frozen=True)
class Setup:
    """A study, its scene as text, and what it names, found."""

    study: Study
    path: str
    """Path of the study file."""
    source: str
    """Text of its file."""
    text: str
    """Text of the scene, like `overrides`; "" if a function returns the scene."""
    name: str
    overrides: str
    function: str
    """Located, as are the controller and functions in metrics; "": there is none."""
    controller: str
    metrics: Mapping[str, str]
    """By name, what is kept."""
    code: Mapping[str, str] = field(default_factory=dict)
    """By file, a hash of what it held when the study was read."""
    made_by: tuple[str, ...] = ()
    """Files of `code` that define the line and its controller."""
    asked: Mapping[str, str] = field(default_factory=dict)
    """By metric, what it is: as the study says it, with the hashes of its files if it is a function."""
    versions: tuple[str, str] = field(default_factory=version_hashes)
    """Hashes of the engine and of the other sources that decide bits."""

    @cached_property
    def kept(self) -> dict[str, Metric]:
        """The metrics by name. Raises StudyError for one that there is not."""
        return {name: metric_of(what) for name, what in self.metrics.items()}

    def needs(self, data: Mapping[str, Any]) -> dict[str, Any]:
        """Return the overrides of a scene (as plain data) that the metrics require."""
        changes: dict[str, Any] = {}
        for metric in self.kept.values():
            changes = merged(changes, metric.needs(data))
        return changes

    def with_warm_up(self, seconds: float) -> Setup:
        """Return a copy with a warm-up from pilot runs."""
        return replace(self, study=self.study.model_copy(update={"warm_up": seconds}))

    def require_same_versions(self) -> None:
        """Raise StudyError in a process with another version of package or code, whose bits would differ."""
        here = version_hashes()
        if self.versions != here:
            engine, sources = self.versions
            raise StudyError(
                f"conveyor_sim here has engine {here[0]} and sources {here[1]}, expected {engine} and {sources}, as "
                "where the study runs"
            )
        for file, before in self.code.items():
            if (now := digest_of(Path(file))) != before:
                what = "is not here" if not now else "has changed since the study was read"
                raise StudyError(f"{file}: {what}, expected the same file")

    def __getstate__(self) -> dict[str, Any]:
        """Without the metrics: functions of a file are found again where they are needed."""
        return {name: value for name, value in self.__dict__.items() if name != "kept"}
