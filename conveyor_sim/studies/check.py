# SPDX-License-Identifier: Apache-2.0
"""A study looked over before its runs: what would fail in many of them is said once, and where."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from conveyor_sim.errors import ConveyorError, StudyError
from conveyor_sim.scene import Scene
from conveyor_sim.scene.part import Part
from conveyor_sim.scene.problems import Path, Problem
from conveyor_sim.scene.provenance import SceneFile, Sources
from conveyor_sim.scene.refusal import refused
from conveyor_sim.scene.words import field_names, shown, unit_of
from conveyor_sim.scene.yaml_lines import Document
from conveyor_sim.simulation import Simulation
from conveyor_sim.studies.design import Point, points_of
from conveyor_sim.studies.gauges import Gauge
from conveyor_sim.studies.line_of import controller_of, scene_of, steps_of
from conveyor_sim.studies.parameter import Parameter
from conveyor_sim.studies.setup import Setup


def check_study(setup: Setup, first: Point | None = None) -> None:
    """Make the line of the first point, and with each value of each parameter alone, but run none.

    first: None is that of the design. Raises StudyError with a line for each value that can't be.
    """
    first = points_of(setup.study)[0] if first is None else first
    problems = [_at_parameter(setup, first, found) for found in _problems(setup, first)]
    for name, parameter in setup.study.parameters.items() if not problems else ():
        for place, value in _values(name, parameter):
            if value != first[name]:
                found = next(_problems(setup, {**first, name: value}), None)
                problems += [Problem(place, f"{shown(value)} given, but {found.text}")] if found else []
    if problems:
        raise _refused(setup, problems)


def _refused(setup: Setup, problems: list[Problem]) -> StudyError:
    places = Sources(SceneFile(setup.path, Document(setup.source, setup.path)))
    return StudyError(str(refused(problems, places.place_of, setup.path)))


def gauges_of(setup: Setup, simulation: Simulation) -> dict[str, Gauge]:
    """Return a gauge for each metric, from the present tick on.

    Raise StudyError with a line for each metric of a device, machine or tag that the line doesn't have.
    """
    gauges, problems = {}, []
    for name, metric in setup.kept.items():
        try:
            gauges[name] = metric.make(simulation)
        except StudyError as error:
            problems.append(Problem(("metrics", name), str(error)))
    if problems:
        raise _refused(setup, problems)
    return gauges


def units_of(setup: Setup, simulation: Simulation) -> dict[str, str]:
    """Return the unit of each metric. simulation: of any run. Raise StudyError as `gauges_of`."""
    gauges = gauges_of(setup, simulation)
    return {name: metric.unit or str(getattr(gauges[name], "unit", "1")) for name, metric in setup.kept.items()}


def parameter_units(setup: Setup, scene: Scene) -> dict[str, str]:
    """Return the unit of each parameter: as stated in the study, or that of its scene field; "" without one."""
    units = {}
    for name, parameter in setup.study.parameters.items():
        units[name] = parameter.unit or ("" if parameter.field is None else _unit_at(scene, steps_of(parameter.field)))
    return units


def _unit_at(scene: Scene, path: Path) -> str:
    part: Any = scene
    unit = ""
    for step in path:
        if isinstance(part, Part):
            found = field_names(type(part)).get(str(step))
            unit = "" if found is None else unit_of(found)
            names = {field.alias or name: name for name, field in type(part).model_fields.items()}
            part = getattr(part, names.get(str(step), ""), None)
        elif isinstance(part, dict):
            part = part.get(step)
        else:  # a list; what is in a point has its unit
            part = part[step] if isinstance(part, (list, tuple)) and isinstance(step, int) else None
    return "" if unit == "1" else unit


def _problems(setup: Setup, point: Point) -> Iterator[Problem]:
    """Yield the first problem of the line of a point."""
    path: Path = ("function",) if setup.function else ("scene",)
    try:
        scene = scene_of(setup, point, setup.study.seeds.first)
        warm_up, whole = setup.study.warm_up, scene.duration - (setup.study.warm_start or 0.0)
        if not isinstance(warm_up, str) and warm_up >= whole:
            yield Problem(("warm_up",), f"{warm_up:g} given, expected less than a run takes (s)")
        path = ("controller",)
        controller_of(setup, point)
    except ConveyorError as error:
        yield Problem(path, str(error).splitlines()[0])
    except Exception as error:  # raised by a function of the study
        yield Problem(path, f"{type(error).__name__}: {error}")


def _at_parameter(setup: Setup, point: Point, found: Problem) -> Problem:
    """Assign the problem of a point to the parameter that causes it."""
    for name, parameter in setup.study.parameters.items():
        what = "field" if parameter.field is not None else "controller"
        given = getattr(parameter, what)
        rest = {other: value for other, value in point.items() if other != name}
        if given is not None and next(_problems(setup, rest), None) is None:
            return Problem(("parameters", name, what), f"{shown(given)} given, but {found.text}")
    return found


def _values(name: str, parameter: Parameter) -> Iterator[tuple[Path, Any]]:
    if parameter.values is not None:
        yield from ((("parameters", name, "values", index), value) for index, value in enumerate(parameter.values))
    else:
        ends = (("low", parameter.low), ("high", parameter.high))
        yield from ((("parameters", name, end), value) for end, value in ends)
