# SPDX-License-Identifier: Apache-2.0
"""An input is refused on receipt exactly if the line refuses it in every state."""

from __future__ import annotations

import math
from itertools import product

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from conveyor_sim.line.commands.authority import MAY, MODES
from conveyor_sim.line.commands.inputs import WRITER_KINDS, Input
from conveyor_sim.line.commands.receipt import COUNTING, Receipt
from conveyor_sim.line.device import Device
from conveyor_sim.line.device_kinds import DEVICES
from conveyor_sim.scene import load_scene
from conveyor_sim.simulation import Simulation

SCENES = ("config/scenarios/zoned_line.yaml", "config/scenarios/two_stations.yaml")
SIMULATIONS = [Simulation(load_scene(scene), threads=1) for scene in SCENES]
ZONED = SIMULATIONS[0]
VALUES = [0.0, 1.0, 2.0, 3.0, 4.0, 0.5, -1.0, 1e6, 1e300, math.inf, math.nan]
NAMES = [
    "belts/zone1",
    "belts/zone1/cmd_speed",
    "belts/zone1/trip",
    "belts/zone1/speed",
    "photo_eyes/full1/blocked",
    "machines/filler/cntrl_cmd",
    "machines/filler/state",
    "machines/filler",
    "line",
    "nothing",
    "alarms/jam",
    "",
]


RECEIPTS = [Receipt(simulation.process_image.tags, simulation.scene.where) for simulation in SIMULATIONS]


def receipt() -> Receipt:
    """Return the receipt of the zoned line."""
    return RECEIPTS[0]


def asked(
    kind: str, operation: str, names: tuple[str, ...], values: tuple[float, ...], texts: tuple[str, ...] = ()
) -> Input:
    return Input("test", "jo", kind, operation, names, values, texts)


@given(
    st.sampled_from(WRITER_KINDS),
    st.sampled_from([*MAY, "nothing"]),
    st.lists(st.sampled_from(NAMES), max_size=3),
    st.lists(st.sampled_from(VALUES), max_size=3),
    st.lists(st.sampled_from(["*", "belts/*", "nothing", ""]), max_size=2),
)
@settings(max_examples=400, deadline=None)
def test_the_line_refuses_what_its_receipt_refuses(
    kind: str, operation: str, names: list[str], values: list[float], texts: list[str]
) -> None:
    wanted = asked(kind, operation, tuple(names), tuple(values), tuple(texts))
    for simulation, of_line in zip(SIMULATIONS, RECEIPTS, strict=True):
        if of_line.refusal(wanted) is not None:
            assert simulation.line.refusal(wanted)


@pytest.mark.parametrize("operation", ["set", "inject", "mode", "force"])
def test_what_the_line_refuses_at_its_start_its_receipt_refuses(operation: str) -> None:
    """Exceptions depend on the control mode of a device, or on the state of a machine."""
    for kind, name, value in product(WRITER_KINDS, NAMES, VALUES):
        wanted = asked(kind, operation, (name,), (value,))
        known = receipt().refusal(wanted)
        reason = ZONED.line.refusal(wanted)
        by_state = any(words in reason for words in ("is in Automatic", "in Execute"))
        assert (known is not None) == bool(reason) or by_state, (wanted, reason)


def test_the_table_says_which_modes_a_kind_can_set() -> None:
    causes = {
        (kind, mode): None
        if (found := receipt().refusal(asked(kind, "mode", ("belts/zone1",), (mode,)))) is None
        else found.cause
        for kind, mode in product(WRITER_KINDS, (*MODES, 9, 1.5))
    }
    assert {mode for (kind, mode), cause in causes.items() if kind == "operator" and cause is None} == {1, 3}
    assert causes["operator", 2] == "role" and causes["operator", 9] == causes["operator", 1.5] == "value"
    assert {mode for (kind, mode), cause in causes.items() if kind == "engineer" and cause is None} == {1, 2, 3}
    assert {cause for (kind, _), cause in causes.items() if kind in ("controller", "line")} == {"operation"}


@pytest.mark.parametrize(
    ("operation", "names", "values", "texts", "cause"),
    [
        ("set", ("belts/zone1/cmd_speed",), (math.nan,), (), "value"),
        ("set", ("belts/zone1/speed",), (0.1,), (), "name"),
        ("set", ("belts/zone1/cmd_speed",) * 2, (0.1, 0.2), (), "form"),
        ("set", ("machines/filler/cntrl_cmd",), (1.5,), (), "value"),
        ("inject", ("belts/zone1/trip",), (0.5,), (), "value"),
        ("inject", ("belts/zone1/speed",), (1.0,), (), "name"),
        ("mode", ("belts/zone1", "belts/zone1"), (1.0, 3.0), (), "form"),
        ("mode", ("photo_eyes/full1",), (1.0,), (), "name"),
        ("force", ("photo_eyes/full1/blocked",), (0.5,), (), "value"),
        ("force", ("machines/filler/state",), (99.0,), (), "value"),
        ("force", ("belts/zone1/cmd_speed",), (0.5,), (), "name"),
        ("unforce", ("nothing",), (), (), "name"),
        ("unforce", (), (1.0,), (), "form"),
        ("shelve", ("x",), (-1.0,), (), "value"),
        ("shelve", ("x",), (1e12,), (), "value"),
        ("shelve", (), (), (), "form"),
        ("reset_counters", ("belts/zone1",), (), (), "name"),
        ("reset_counters", ("line",), (), ("x",), "form"),
    ],
)
def test_the_cause_is_told(
    operation: str, names: tuple[str, ...], values: tuple[float, ...], texts: tuple[str, ...], cause: str
) -> None:
    found = receipt().refusal(asked("test", operation, names, values, texts))
    assert found is not None and found.cause == cause and found.reason


def test_devices_that_count_are_known_by_their_class() -> None:
    counting = {kind for kind, made in DEVICES.items() if isinstance(made, type) and made.counts is not Device.counts}
    assert counting | {"station"} == set(COUNTING)  # a function chooses the class of a station
