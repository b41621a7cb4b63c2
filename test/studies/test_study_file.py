# SPDX-License-Identifier: Apache-2.0
"""Errors of a study are reported before it runs: file, line, field, value and expectation."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from facts import stating
from studies.small import Here, setup_of, write_study

from conveyor_sim.errors import ConveyorError, StudyError
from conveyor_sim.scene.part import part_from
from conveyor_sim.studies.check import check_study
from conveyor_sim.studies.load import load_study
from conveyor_sim.studies.parameter import Parameter
from conveyor_sim.studies.row import Job
from conveyor_sim.studies.run import run_alone
from conveyor_sim.studies.runs import Runs
from conveyor_sim.studies.sweep import sweep

UNTIL = {"metric": "stops", "half_width": 1.0}
RATE = {"argument": "rate", "values": [4.0]}
RATE_TWICE = {"argument": "rate", "values": [4.0, 5.0, 4.0]}


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"seed": 2}, r"study.yaml:\d+: seed: no such field, did you mean seeds\?"),
        ({"seeds": 0}, r"study.yaml:\d+: seeds.count: 0 given, expected a whole number, 1 or greater"),
        ({"seeds": 2.5}, r"study.yaml:\d+: seeds.count: 2.5 given, expected a whole number, 1 or greater"),
        ({"seeds": None}, r"seeds: missing, expected a whole number, 1 or greater, or a mapping"),
        ({"seeds": {"first": 3}}, r"seeds: expected either count or until"),
        (
            {"seeds": {"until": {"metric": "stops", "half_width": 1.0}, "batch": 5}},
            r"seeds.batch: 5 given, expected .*10",
        ),
        (
            {"seeds": {"until": {"metric": "stop", "half_width": 1.0}}},
            r"until.metric: \"stop\" given, expected one of thr",
        ),
        (
            {"seeds": 2_000_000},
            r"study.yaml:\d+: seeds: 4000000 runs given by all points and seeds, expected at most 10000",
        ),
        (
            {"seeds": {"first": 2**64 - 2, "count": 5}},
            r"seeds.first: 18446744073709551614 given, expected one with which",
        ),
        ({"scene": "push"}, r"study.yaml:1: expected either scene or function"),
        ({"function": "code.py:lin"}, r"study.yaml:\d+: function: .*code.py has no function lin"),
        ({"function": "other.py:line"}, r"function: .*other.py: No such file or directory, expected a Python file"),
        ({"design": "random"}, r'design: "random" given, expected "grid", "list"'),
        ({"design": "sobol"}, r"parameters.rate.values: given, expected low and high, as the design is sobol"),
        ({"points": 3}, r"points: 3 given, expected none: a grid has them by values"),
        ({"metrics": ["speed"]}, r'metrics.speed: "speed" given, expected efficiency, .* or file.py:function'),
        ({"metrics": ["stops", "stops"]}, r"metrics: .*each name once"),
        ({"metrics": [{"q": "quantile 2 x"}]}, r'metrics.q: "quantile 2 x" given, expected such as quantile 0.95'),
        ({"metrics": [{"q": "mean"}]}, r'metrics.q: "mean" given, expected mean <tag>'),
        ({"metrics": [{"wall": "stops"}]}, r"metrics.wall: given as a name, expected another"),
        ({"parameters": {"x": {}}}, r"parameters.x: nothing given, expected one of field, controller and argument"),
        ({"parameters": {"stops": RATE}}, r"parameters.stops: stops given as a name, expected another"),
        ({"parameters": {"x": {"field": "belts..x", "values": [1]}}}, r'x.field: "belts..x" given, expected a path'),
        ({"parameters": {"x": {"controller": "x", "values": [1]}}}, r"x.controller: given, expected controller beside"),
        (
            {"parameters": {"x": {"argument": "x", "low": 2.0, "high": 1.0}}},
            r"x.high: 1 given, expected more than low, 2",
        ),
        (
            {"parameters": {"x": {"argument": "x", "values": [1.0, 2, 1]}}},
            r"x.values\[2\]: 1 given twice, expected each value once",
        ),
        (
            {"design": "list", "parameters": {"x": {"argument": "x", "values": [1, 2, 1]}, "y": RATE_TWICE}},
            r"study.yaml:\d+: design: list given with the point x 1, y 4 twice, expected each once",
        ),
        ({"warm_up": "msr"}, r'warm_up: "msr" given, expected a number, 0 or greater, or "mser"'),
        (
            {"warm_up": "mser", "metrics": ["stops"]},
            r"warm_up: mser given, expected one of these metrics, .* it: efficiency, throughput, mean, quantile",
        ),
        ({"metrics": [{"x_half_width": "stops"}]}, r"metrics.x_half_width: given as a name, expected another"),
        ({"warm_start": 1.0}, r"parameters.rate: varies the line, expected a parameter of the controller"),
    ],
)
def test_a_study_that_cannot_be(tmp_path: Path, changes: dict[str, Any], said: str) -> None:
    with pytest.raises(StudyError, match=said):
        setup_of(tmp_path, **changes)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        (
            {"parameters": {"v": {"field": "belts.conveyor.speed", "values": [0.1, "fast"]}}},
            r'study.yaml:\d+: parameters.v.values\[1\]: "fast" given, but .*conveyor.speed: "fast" given, expected',
        ),
        (
            {"parameters": {"v": {"field": "belts.convoyer.speed", "values": [0.1]}}},
            r'study.yaml:\d+: parameters.v.field: "belts.convoyer.speed" given, but .* did you mean conveyor\?',
        ),
        (
            {"parameters": {"r": RATE, "v": {"field": "belts.conveyor.sped", "values": [0.1]}}},
            r'parameters.v.field: "belts.conveyor.sped" given, but .*sped: no such field, did you mean speed\?',
        ),
        (
            {"parameters": {"v": {"field": "base[3].friction", "values": [0.1]}}},
            r"the scene has no such entry of a list",
        ),
        ({"parameters": {"v": {"argument": "v", "values": [0.1]}}}, r"unexpected keyword argument 'v'; its arguments"),
        ({"controller": "code.py:Feeder"}, r"study.yaml:\d+: controller: .*missing a required argument: 'speed'"),
        (
            {
                "controller": "code.py:Feeder",
                "settings": {"speed": 1.0},
                "parameters": {"u": {"controller": "untl", "values": [1.0]}},
            },
            r"parameters.u.controller: \"untl\" given, but .*unexpected keyword argument 'untl'",
        ),
        ({"warm_up": 1.0}, r"warm_up: 1 given, expected less than a run takes \(s\)"),
    ],
)
def test_a_line_that_cannot_be(tmp_path: Path, changes: dict[str, Any], said: str) -> None:
    setup = setup_of(tmp_path, **changes)
    with pytest.raises(StudyError, match=said):
        check_study(setup)


@pytest.mark.parametrize(
    ("metric", "said"),
    [
        (
            "throughput machines/thrid",
            r'"machines/thrid" given as a device, expected one of machines/first, machines/sec',
        ),
        ("stops machines/thrid", r'"machines/thrid" given as a machine, expected machines/first, machines/second'),
        ("mean belts/conveyor/sped", r'"belts/conveyor/sped" given as a tag, expected a signal'),
    ],
)
def test_a_metric_of_an_unknown_device_is_refused_before_the_first_run(tmp_path: Path, metric: str, said: str) -> None:
    """By a sweep before it makes a run, and by a single run before its first scan, which would raise."""
    worn = {"controller": "code.py:Feeder", "settings": {"speed": 0.5, "until": 0.0}}
    setup, engine = setup_of(tmp_path, metrics=[{"flow": metric}], warm_up=0.5, **worn), Here()
    problem = r"study.yaml:\d+: metrics.flow: " + said
    with Runs(setup, tmp_path / "out", engine) as runs, pytest.raises(StudyError, match=problem):
        sweep(runs, setup)
    assert engine.made == 0
    with pytest.raises(StudyError, match=problem):
        run_alone(setup, Job(0, {"rate": 4.0}, 1), None)
    with pytest.raises(ConveyorError, match="worn out"):
        run_alone(setup_of(tmp_path, **worn), Job(0, {"rate": 4.0}, 1), None)


@pytest.mark.parametrize("value", [".nan", "-.inf"])
def test_a_value_is_a_finite_number(tmp_path: Path, value: str) -> None:
    path = write_study(tmp_path)
    path.write_text(path.read_text().replace("6.0", value))
    with pytest.raises(StudyError, match=stating("parameters.rate.values[1]", value, "number", "finite")):
        load_study(path)


def test_files_that_are_none(tmp_path: Path) -> None:
    with pytest.raises(StudyError, match=stating("none.yaml", "no such file", "study file")):
        load_study(tmp_path / "none.yaml")
    (tmp_path / "empty.yaml").touch()
    with pytest.raises(StudyError, match=stating("empty.yaml", "empty", "study")):
        load_study(tmp_path / "empty.yaml")


def test_scenes_are_found_beside_the_study_or_by_name(tmp_path: Path) -> None:
    parameters = {"g": {"field": "gravity", "values": [9.8]}}
    assert "name: two_bottles" in setup_of(tmp_path, function=None, scene="two_bottles", parameters=parameters).text
    (tmp_path / "two_bottles").write_text(load_study(write_study(tmp_path)).source)  # which is no scene
    with pytest.raises(Exception, match="two_bottles:"):
        setup_of(tmp_path, function=None, scene="two_bottles", parameters=parameters)


def test_ranges_take_quantities_with_units() -> None:
    parameter = part_from(Parameter, {"field": "belts.main.speed", "low": "6 m/min", "high": "0.4 m/s"})
    assert isinstance(parameter, Parameter)
    assert (parameter.low, parameter.high) == (0.1, 0.4)
