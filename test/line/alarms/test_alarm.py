# SPDX-License-Identifier: Apache-2.0
"""States of one alarm, by the diagram of ISA-18.2."""

import pytest
from line.alarms.board import Board

PATHS = {
    "NORMAL": [],
    "UNACKNOWLEDGED": ["on"],
    "ACKNOWLEDGED": ["on", "acknowledge"],
    "RETURNED": ["on", "off"],
    "SHELVED": ["shelve"],
    "SUPPRESSED": ["cause on"],
    "OUT_OF_SERVICE": ["remove_from_service"],
}
"""Steps by which an alarm without latching gets to each state."""

LATCHING = {
    "NORMAL": [],
    "UNACKNOWLEDGED": ["on"],
    "ACKNOWLEDGED": ["on", "acknowledge"],
    "LATCHED_UNACKNOWLEDGED": ["on", "off"],
    "LATCHED_ACKNOWLEDGED": ["on", "off", "acknowledge"],
}

STEPS = (
    "on",
    "off",
    "acknowledge",
    "confirm",
    "reset",
    "shelve",
    "unshelve",
    "remove_from_service",
    "return_to_service",
)
HIDE = {"shelve": "SHELVED", "cause on": "SUPPRESSED", "remove_from_service": "OUT_OF_SERVICE"}

DIAGRAM = {
    ("NORMAL", "on"): "UNACKNOWLEDGED",
    ("UNACKNOWLEDGED", "acknowledge"): "ACKNOWLEDGED",
    ("UNACKNOWLEDGED", "off"): "RETURNED",
    ("ACKNOWLEDGED", "off"): "NORMAL",
    ("RETURNED", "acknowledge"): "NORMAL",
    ("RETURNED", "on"): "UNACKNOWLEDGED",
    ("SHELVED", "unshelve"): "NORMAL",
    ("SHELVED", "remove_from_service"): "OUT_OF_SERVICE",
    ("SUPPRESSED", "cause off"): "NORMAL",
    ("SUPPRESSED", "shelve"): "SHELVED",
    ("SUPPRESSED", "remove_from_service"): "OUT_OF_SERVICE",
    ("OUT_OF_SERVICE", "return_to_service"): "NORMAL",
    **{
        (state, hide): hidden
        for state in ("NORMAL", "UNACKNOWLEDGED", "ACKNOWLEDGED", "RETURNED")
        for hide, hidden in HIDE.items()
    },
    # Shelved once more is shelved for another time.
    ("SHELVED", "shelve"): "SHELVED",
}
"""All transitions of an alarm without latching. Any other operation is refused, or changes nothing."""

DIAGRAM_LATCHING = {
    ("NORMAL", "on"): "UNACKNOWLEDGED",
    ("UNACKNOWLEDGED", "acknowledge"): "ACKNOWLEDGED",
    ("UNACKNOWLEDGED", "off"): "LATCHED_UNACKNOWLEDGED",
    ("ACKNOWLEDGED", "off"): "LATCHED_ACKNOWLEDGED",
    ("LATCHED_UNACKNOWLEDGED", "acknowledge"): "LATCHED_ACKNOWLEDGED",
    ("LATCHED_UNACKNOWLEDGED", "on"): "UNACKNOWLEDGED",
    ("LATCHED_ACKNOWLEDGED", "on"): "UNACKNOWLEDGED",
    ("LATCHED_ACKNOWLEDGED", "reset"): "NORMAL",
    **{(state, hide): hidden for state in LATCHING for hide, hidden in HIDE.items()},
}


CONFIRM = {
    "UNACKNOWLEDGED": ["on"],
    "UNCONFIRMED": ["on", "acknowledge"],
    "ACKNOWLEDGED": ["on", "acknowledge", "confirm"],
    "RETURNED": ["on", "off"],
    "RETURNED_UNCONFIRMED": ["on", "off", "acknowledge"],
    "NORMAL": ["on", "off", "acknowledge", "confirm"],
}
"""Steps by which an alarm that must be confirmed gets to each state."""

DIAGRAM_CONFIRM = {
    ("NORMAL", "on"): "UNACKNOWLEDGED",
    ("UNACKNOWLEDGED", "acknowledge"): "UNCONFIRMED",
    ("UNACKNOWLEDGED", "off"): "RETURNED",
    ("UNCONFIRMED", "confirm"): "ACKNOWLEDGED",
    ("UNCONFIRMED", "off"): "RETURNED_UNCONFIRMED",
    ("ACKNOWLEDGED", "off"): "NORMAL",
    ("RETURNED", "acknowledge"): "RETURNED_UNCONFIRMED",
    ("RETURNED", "on"): "UNACKNOWLEDGED",
    ("RETURNED_UNCONFIRMED", "confirm"): "NORMAL",
    ("RETURNED_UNCONFIRMED", "on"): "UNACKNOWLEDGED",
    **{(state, hide): hidden for state in CONFIRM for hide, hidden in HIDE.items()},
}

LATCHING_CONFIRM = {
    "LATCHED_UNACKNOWLEDGED": ["on", "off"],
    "LATCHED_UNCONFIRMED": ["on", "off", "acknowledge"],
    "LATCHED_ACKNOWLEDGED": ["on", "off", "acknowledge", "confirm"],
    "UNCONFIRMED": ["on", "acknowledge"],
}

DIAGRAM_LATCHING_CONFIRM = {
    ("LATCHED_UNACKNOWLEDGED", "acknowledge"): "LATCHED_UNCONFIRMED",
    ("LATCHED_UNACKNOWLEDGED", "on"): "UNACKNOWLEDGED",
    ("LATCHED_UNCONFIRMED", "confirm"): "LATCHED_ACKNOWLEDGED",
    ("LATCHED_UNCONFIRMED", "on"): "UNACKNOWLEDGED",
    ("LATCHED_ACKNOWLEDGED", "reset"): "NORMAL",
    ("LATCHED_ACKNOWLEDGED", "on"): "UNACKNOWLEDGED",
    ("UNCONFIRMED", "confirm"): "ACKNOWLEDGED",
    ("UNCONFIRMED", "off"): "LATCHED_UNCONFIRMED",
    **{(state, hide): hidden for state in LATCHING_CONFIRM for hide, hidden in HIDE.items()},
}


def board_at(path: list[str], latching: bool, confirm: bool = False) -> Board:
    board = Board(cause={}, it={"latching": latching, "confirm": confirm, "suppressed_by": ["cause"]})
    for step in path:
        assert take(board, step) == ""
    return board


def take(board: Board, step: str) -> str:
    if step in ("on", "off"):
        board.say(it=step == "on")
        return ""
    if step.startswith("cause"):
        board.say(cause=step == "cause on")
        return ""
    return board.do(step, "it")


@pytest.mark.parametrize("step", [*STEPS, "cause on", "cause off"])
@pytest.mark.parametrize("state", PATHS)
def test_every_transition(state: str, step: str) -> None:
    board = board_at(PATHS[state], latching=False)
    assert board.states()["it"] == state
    problem = take(board, step)
    expected = DIAGRAM.get((state, step), state)
    assert board.states()["it"] == expected
    operation = step not in ("on", "off") and not step.startswith("cause")
    assert bool(problem) == (operation and (state, step) not in DIAGRAM)
    if problem:
        assert problem.startswith(f"it: is {state.lower().replace('_', ' ')}, expected one ")


@pytest.mark.parametrize("step", [*STEPS, "cause on", "cause off"])
@pytest.mark.parametrize("state", LATCHING)
def test_every_transition_of_one_that_latches(state: str, step: str) -> None:
    board = board_at(LATCHING[state], latching=True)
    assert board.states()["it"] == state
    problem = take(board, step)
    assert board.states()["it"] == DIAGRAM_LATCHING.get((state, step), state)
    operation = step not in ("on", "off") and not step.startswith("cause")
    assert bool(problem) == (operation and (state, step) not in DIAGRAM_LATCHING)


@pytest.mark.parametrize("step", [*STEPS, "cause on", "cause off"])
@pytest.mark.parametrize(
    ("latching", "path", "state"),
    [
        *((False, path, state) for state, path in CONFIRM.items()),
        *((True, path, state) for state, path in LATCHING_CONFIRM.items()),
    ],
)
def test_every_transition_of_one_that_must_be_confirmed(latching: bool, path: list[str], state: str, step: str) -> None:
    diagram = DIAGRAM_LATCHING_CONFIRM if latching else DIAGRAM_CONFIRM
    board = board_at(path, latching, confirm=True)
    assert board.states()["it"] == state
    problem = take(board, step)
    assert board.states()["it"] == diagram.get((state, step), state)
    operation = step not in ("on", "off") and not step.startswith("cause")
    assert bool(problem) == (operation and (state, step) not in diagram)


@pytest.mark.parametrize(
    ("hide", "show"),
    [("shelve", "unshelve"), ("cause on", "cause off"), ("remove_from_service", "return_to_service")],
)
@pytest.mark.parametrize("latching", [False, True])
def test_one_that_is_shown_again_is_a_new_alarm_or_normal(hide: str, show: str, latching: bool) -> None:
    board = board_at(["on", "acknowledge", hide], latching)
    take(board, show)
    assert board.states()["it"] == "UNACKNOWLEDGED"
    take(board, hide)
    take(board, "off")
    take(board, show)
    assert board.states()["it"] == "NORMAL"


def test_the_strongest_of_what_hides_it_is_shown() -> None:
    board = board_at(["on", "cause on", "shelve", "remove_from_service"], False)
    assert board.states()["it"] == "OUT_OF_SERVICE"
    assert board.do("unshelve", "it") == ""
    assert board.do("return_to_service", "it") == ""
    assert board.states()["it"] == "SUPPRESSED"
