# SPDX-License-Identifier: Apache-2.0
"""Content of the page of `conveyor-sim check --watch`: plan of a scene, and its problems with their places."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, Final

from conveyor_sim.errors import ConveyorError
from conveyor_sim.page.drawings.plan import plan_of
from conveyor_sim.page.head import plan_head
from conveyor_sim.physics.model import build_model
from conveyor_sim.physics.model.remedies import step_limit
from conveyor_sim.report.flow.flow import flow_of
from conveyor_sim.report.flow.overview import all_findings, overview
from conveyor_sim.report.tags import tag_rows
from conveyor_sim.scene import Scene, load_scene
from conveyor_sim.scene.driven import belt_speeds
from conveyor_sim.scene.geometry import initial_bottles
from conveyor_sim.scene.places import Places
from conveyor_sim.scene.problems import dotted
from conveyor_sim.support.printable import SENTENCE, printable

_LINE: Final = re.compile(
    r"(?P<place>.*?:\d+(?: \(cell [^)]*\))?|.*? \(override\)):(?: (?P<path>[\w.\[\]]+):)? (?P<text>.*)"
)
"""Line of a SceneError: file, line, path and problem."""
_SECTIONS: Final = dict.fromkeys(("INSPECTIONS", "SINKS", "STATIONS", "REJECTS", "SOURCES"), "machines")
"""Sections of layers with another name."""

XY = tuple[float, float]
Load = Callable[[Path], Scene]


class CheckPage:
    """Examines a scene whenever it is asked to. The plan of the last valid scene stays."""

    def __init__(self, path: Path, load: Load = load_scene) -> None:
        """path: of the scene's file. load: reads it."""
        self._path, self._load = path, load
        self._plan: dict[str, Any] | None = None
        self._places: Mapping[str, XY] = {}

    def examine(self) -> dict[str, Any]:
        """Return the plan of the last valid scene, and the problems of the present one."""
        try:
            scene = self._load(self._path)
            model = build_model(scene)
            tag_rows(scene)
            flow = flow_of(scene)
            overview_ = overview(scene, model, step_limit(scene), flow)
        except ConveyorError as error:
            problems = [self._problem(line) for line in printable_problems(error)]
            return {"valid": False, "plan": self._plan, "problems": problems, "overview": []}
        self._plan, self._places = _plan(scene), _middles(scene)
        places = Places(scene)
        problems = [
            {
                "level": finding.level,
                "where": printable(places.of(finding.path)),
                "path": dotted(finding.path),
                "text": printable(finding.text, SENTENCE),
                "at": self._place(dotted(finding.path)),
            }
            for finding in all_findings(model, flow)
        ]
        return {"valid": True, "plan": self._plan, "problems": problems, "overview": overview_[:1]}

    def _problem(self, line: str) -> dict[str, Any]:
        """Return a problem from a line of an error."""
        match = _LINE.fullmatch(line)
        if match is None:
            return {"level": "error", "where": "", "path": "", "text": line, "at": None}
        path = match["path"] or ""
        place, text = match["place"], match["text"]
        return {"level": "error", "where": place, "path": path, "text": text, "at": self._place(path)}

    def _place(self, path: str) -> XY | None:
        """Return the place on the plan of the part that a path leads to; None if it is not drawn."""
        section, _, rest = path.partition(".")
        name = re.split(r"[.\[]", rest)[0]
        for wanted in (f"{section}.{name}", f"conveyors.{name}", f"rails.{name}_left", f"rails.{name}_right"):
            if wanted in self._places:
                return self._places[wanted]
        return None


def printable_problems(error: ConveyorError) -> Iterator[str]:
    """Yield the lines of an error, each safe to show."""
    for line in str(error).split("\n"):
        yield printable(line, 1000)


def _plan(scene: Scene) -> dict[str, Any]:
    """Return what the page draws: the head of the plan, speeds of belts (m/s), and bottles at the start."""
    types = list(scene.bottle_types)
    return {
        **plan_head(scene),
        "types": [{"name": name, "radius": kind.radius} for name, kind in scene.bottle_types.items()],
        "speeds": list(belt_speeds(scene).values()),
        "bottles": [
            {"id": number, "type": types.index(row[0]), "x": row[1], "y": row[2]}
            for number, row in enumerate(initial_bottles(scene))
        ],
    }


def _middles(scene: Scene) -> dict[str, XY]:
    """Return the middle (m) of each drawn part by its path."""
    shapes = plan_of(scene)
    return {f"{_SECTIONS.get(shape.layer, shape.layer.lower())}.{shape.name}": shape.middle for shape in shapes}
