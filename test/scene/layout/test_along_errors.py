# SPDX-License-Identifier: Apache-2.0
"""Errors of devices along conveyors: one line each, with file, line, field, value and expectation."""

from __future__ import annotations

import json
from typing import Any

import pytest
from facts import missing
from scene.layout.along_line import Data, expansion, line

from conveyor_sim.errors import SceneError
from conveyor_sim.scene import parse_scene
from conveyor_sim.scene.layout.expand import expand

LINE = 40
"""Line of the first field of the device; its name is on the line before."""


def refused(kind: str, fields: Data) -> list[str]:
    """The errors of a scene with one device, each field of which is on a line of its own."""
    head = json.dumps({"name": "test", "duration": 10, **line()})[1:-1]
    own = [f'"{name}": {json.dumps(value)}' for name, value in fields.items()]
    text = "\n" * (LINE - 2) + f'{{{head}, "{kind}": {{"it": {{\n' + ",\n".join(own) + "}}}"
    with pytest.raises(SceneError) as error:
        parse_scene(text, "line.yaml")
    return str(error.value).splitlines()


GATE: Data = {"kind": "slide", "along": "lane", "at": 0.7, "max_speed": 1, "acceleration": 5, "material": "steel"}
EYE: Data = {"along": "lane", "at": 0.4}
REGION: Data = {"along": "lane", "at": 0.4, "length": 0.1}
FEED: Data = {"bottle": "bottle", "along": "lane", "at": 0.4, "rate": 1}
PUSHER: Data = {**REGION, "side": "left", "stroke": 0.1, "max_speed": 1, "acceleration": 5, "material": "steel"}
STATION: Data = {"kind": "station", "rate": 1, **REGION}
RAIL: Data = {"material": "steel", "along": "lane"}


@pytest.mark.parametrize(
    ("kind", "fields", "number", "facts"),
    [
        ("photo_eyes", {**EYE, "along": "lain"}, 0, ["it.along", '"lain"', "lane"]),
        ("photo_eyes", {"at": 0.4}, -1, ["it.along", "missing", "a name"]),
        ("photo_eyes", {**EYE, "along": ["lane"]}, 0, ["it.along", '["lane"]', "a name"]),
        ("photo_eyes", {**EYE, "at": 3.9}, 1, ["it.at", "3.9", "3.7854 m", "lane"]),
        ("photo_eyes", {**EYE, "at": -3.9}, 1, ["it.at", "-3.9", "3.7854 m", "lane"]),
        ("photo_eyes", {**EYE, "at": "0.1 m - 0.2 m"}, 1, ["it.at", "0.1 m - 0.2 m", "-0.1 m", "3.7854 m"]),
        ("photo_eyes", {**EYE, "at": "1 s"}, 1, ["it.at", '"1 s"', "a time"]),
        ("photo_eyes", {**EYE, "at": "start"}, 1, ["it.at", '"start"', '"end"']),
        ("photo_eyes", {**EYE, "at": None}, 1, ["it.at", "nothing", '"end"']),
        ("photo_eyes", {**EYE, "at": True}, 1, ["it.at", "true", '"end"']),
        ("photo_eyes", {**EYE, "extend": -0.04}, 2, ["it.extend", "-0.04", "longer than 0"]),
        ("photo_eyes", {**EYE, "extend": 1e19}, -1, ["photo_eyes.it", "1e+19", "100000"]),
        ("photo_eyes", {**EYE, "from": [0, 1]}, 2, ["it.from", "[0, 1]", "either along or from"]),
        ("counters", {**EYE, "length": 1}, 2, ["it.length", "no such field"]),
        ("zones", {"along": "lane"}, -1, ["zones.it", "no station", "at and length", "from and to"]),
        ("zones", {**REGION, "from": 0.1}, -1, ["zones.it", "at and length and from", "from and to"]),
        ("zones", {**REGION, "length": 0.5}, 2, ["it.length", "0.5", "0.4 m"]),
        ("zones", {"along": "lane", "from": 1, "to": 0.5}, 2, ["it.to", "0.5", "beyond its start, 1 m"]),
        ("zones", {**REGION, "width": 2, "at": 1.3}, 3, ["it.width", "bend of radius 0.5 m"]),
        ("zones", {**REGION, "region": [[0, 0], [1, 0], [1, 1]]}, 3, ["it.region", "either along or region"]),
        ("zones", {**REGION, "width": "end"}, 3, ["it.width", '"end"', "greater than 0"]),
        ("infeeds", {**FEED, "direction": 0}, 4, ["it.direction", "0", "either along or direction"]),
        ("infeeds", {**FEED, "offset": 0.02}, 2, ["it.at", "[0.4, 0.02]", "rail lane_left"]),
        ("infeeds", {**FEED, "rate": -1}, 3, ["it.rate", "-1", "greater than 0"]),
        ("gates", GATE, -1, ["it.side", "missing", '"left" or "right"']),
        ("gates", {**GATE, "side": "up"}, 6, ["it.side", '"up"', '"left" or "right"']),
        ("gates", {**GATE, "side": "left", "direction": 0}, 7, ["it.direction", "either along or direction"]),
        ("pushers", {**PUSHER, "acceleration": 5000}, 6, ["it.acceleration", "5000", "294.5"]),
        ("machines", STATION, -1, ["it.out", "missing", "along and at"]),
        ("machines", {**STATION, "out": {"at": 1}}, 5, ["it.out.along", "missing", "a name"]),
        ("machines", {**STATION, "out": {"along": "lane", "at": 9}}, 5, ["it.out.at", "9", "3.7854 m"]),
        ("machines", {**STATION, "out": {"along": "lane", "at": 0.35}}, 5, ["it.out.at", "outside its region"]),
        ("machines", {**STATION, "out": {**EYE}, "position": [0, 0]}, 6, ["it.position", "either out or position"]),
        ("machines", {"rate": 1, **REGION}, -1, ["it.kind", "missing", '"station"']),
        ("rails", RAIL, -1, ["rails.it", "no station", "from and to"]),
        ("rails", {**RAIL, "at": 1, "from": 0.5}, 3, ["it.from", "0.5", "either at, or from and to"]),
        ("rails", {**RAIL, "at": 1, "kind": "segment"}, 3, ["it.kind", "segment", "either along or kind"]),
        ("rails", {**RAIL, "from": 0.5, "to": 2, "offset": 0.6}, 4, ["it.offset", "0.6 m", "radius 0.5 m"]),
        ("rails", {**RAIL, "from": 0.5, "extend": 0.1}, 3, ["it.extend", "0.1", "at"]),
        ("rails", {"along": "lane", "at": 1}, -1, ["it.material", "missing", "a name"]),
    ],
)
def test_an_error_names_the_line_of_its_field(kind: str, fields: Data, number: int, facts: list[str]) -> None:
    """One error with the line, the field as written, the value, and what was expected."""
    (error,) = refused(kind, fields)
    assert error.startswith(f"line.yaml:{LINE + number}: {kind}.it")
    assert missing(error, *facts) == []


def test_a_misspelt_field_is_named_beside_the_missing_one() -> None:
    """Both errors are reported."""
    errors = refused("photo_eyes", {"along": "lane", "att": 0.4})
    assert missing("\n".join(errors), "it.at: missing", "did you mean at?") == []


def test_a_conveyor_with_a_problem_of_its_own_is_no_problem_of_a_device() -> None:
    """Only the conveyor is reported."""
    fields = line({"other": {"after": "nothing", "path": [{"straight": 1}], "width": 0.1, "material": "chain"}})
    expanded = expand({**fields, "photo_eyes": {"eye": {"along": "other", "at": 0.1}}})
    assert [problem.path[0] for problem in expanded.problems] == ["conveyors"]


def test_places_without_conveyors_are_refused() -> None:
    """There is no conveyor to list."""
    (problem,) = expand({"photo_eyes": {"eye": EYE}}).problems
    assert problem.path == ("photo_eyes", "eye", "along")
    assert "there are none" in problem.text


@pytest.mark.parametrize("name", ["lane_left_1", "beside"])
def test_names_of_rails_do_not_collide(name: str) -> None:
    """A rail along a conveyor has a name of its own."""
    rails = {"beside": {**RAIL, "from": 0.8, "to": 2}, name + "_1" * (name == "beside"): {**RAIL, "at": 1}}
    (problem,) = expand(line(rails=rails)).problems
    assert problem.path[0] == "rails"
    assert "as a name of rails" in problem.text


def test_coordinates_lead_to_the_fields_of_their_place() -> None:
    """Also those of `out`, and of rails in several parts."""
    capper = {**STATION, "out": {"along": "lane", "at": 1.2}}
    sources = expansion(machines={"c": capper}, rails={"r": {**RAIL, "from": 0.5, "to": 1.2}}).sources
    assert sources["machines", "c", "region"] == ("machines", "c", "at")
    assert sources["machines", "c", "position"] == ("machines", "c", "out", "at")
    assert sources["machines", "c", "speed"] == ("machines", "c", "out", "along")
    assert sources["rails", "r_2", "radius"] == ("rails", "r", "from")
    assert sources["rails", "r_2"] == ("rails", "r")


@pytest.mark.parametrize("value", [None, 1, "along", [], {}, [None], {"along": None}, {"along": {}}, {"out": []}])
def test_malformed_parts_are_refused_or_left_to_the_scene(value: Any) -> None:
    """No malformed device ends in another exception."""
    fields = ("rails", "gates", "pushers", "diverters", "infeeds", "machines", "zones", "bottles", "counters")
    for field in fields:
        with pytest.raises(SceneError):
            parse_scene(json.dumps({"name": "t", "duration": 1, **line(), field: {"it": value}}))
    with pytest.raises(SceneError):
        parse_scene(json.dumps({"name": "t", "duration": 1, **line(), "bottles": [value, {"grid": value}]}))
