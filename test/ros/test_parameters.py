# SPDX-License-Identifier: Apache-2.0
"""The table of parameters: what is refused, and that the documented file says the same."""

import math
from pathlib import Path

import pytest
from rclpy.parameter import Parameter, parameter_dict_from_yaml_file

from conveyor_sim.ros.parameters import RATES, TABLE, DeclaredParameter
from conveyor_sim.scene import Scene

ENTRIES = {entry.name: entry for entry in TABLE}
DOCUMENTED = Path(__file__).parents[2] / "config" / "ros" / "params.yaml"


def test_the_documented_file_holds_every_default() -> None:
    documented = parameter_dict_from_yaml_file(str(DOCUMENTED), target_nodes=["/**/conveyor_sim"])
    values = {name: Parameter.from_parameter_msg(message).value for name, message in documented.items()}
    assert values == {entry.name: entry.default for entry in TABLE}


@pytest.mark.parametrize("entry", TABLE, ids=lambda entry: entry.name)
def test_every_default_is_accepted_and_described(entry: DeclaredParameter) -> None:
    assert entry.refusal(entry.default) == ""
    assert entry.descriptor().description == entry.description != ""


def test_there_is_a_rate_for_each_output_of_a_scene() -> None:
    assert set(RATES) == set(Scene.TOPICS)


@pytest.mark.parametrize(
    ("name", "value", "reason"),
    [
        ("real_time_factor", -1.0, "real_time_factor: -1.0 given, expected a number from 0 to 1e+06"),
        ("real_time_factor", math.nan, "real_time_factor: nan given"),
        ("real_time_factor", math.inf, "real_time_factor: inf given"),
        ("real_time_factor", "fast", "real_time_factor: 'fast' given, expected a number"),
        ("clock_rate", 0, "clock_rate: 0.0 given, expected a number from 1 to 10000"),
        ("lockstep_max_ticks", 0, "lockstep_max_ticks: 0 given, expected a whole number from 1"),
        ("start_paused", 1, "start_paused: 1 given, expected true or false"),
        ("scene", 3, "scene: 3 given, expected a text"),
    ],
)
def test_a_value_that_cannot_be_is_refused_with_the_reason(name: str, value: object, reason: str) -> None:
    assert reason in ENTRIES[name].refusal(value)


def test_a_whole_number_will_do_where_a_number_is_expected() -> None:
    assert ENTRIES["real_time_factor"].refusal(2) == ""


def test_a_long_text_is_refused_in_short() -> None:
    assert len(ENTRIES["real_time_factor"].refusal("x\n" * 1_000_000)) < 300
