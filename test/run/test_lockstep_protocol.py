# SPDX-License-Identifier: Apache-2.0
"""The lockstep protocol by itself."""

import math
from concurrent.futures import Future

import numpy as np
import pytest

from conveyor_sim.run.lockstep import Lockstep, LockstepAnswer, LockstepRequest, Refused, SentInputs

END = 1000
RUN = "5ee2"


def request(target: int, run_id: str = "plc", speed: float = 0.1, release: bool = False) -> LockstepRequest:
    sent = SentInputs(names=("belts/feeder/cmd_speed",), values=(speed,))
    return LockstepRequest(run_id, target, sent, release)


def answer_to(lockstep: Lockstep, asked: LockstepRequest, tick: int) -> Future[LockstepAnswer]:
    coming = lockstep.accept(asked, RUN, tick, END)
    coming.set_result(LockstepAnswer("run", asked.target_tick, 0, np.zeros(0), 0, ()))
    return coming


def test_a_repeated_request_gets_the_same_answer() -> None:
    lockstep = Lockstep(100)
    coming = answer_to(lockstep, request(10), 0)
    assert lockstep.repeated(request(10)) is coming


def test_a_request_repeated_before_its_answer_waits_for_it() -> None:
    lockstep = Lockstep(100)
    coming = lockstep.accept(request(10), RUN, 0, END)
    assert lockstep.repeated(request(10)) is coming
    assert not coming.done()


def test_a_request_with_nan_equals_its_repetition() -> None:
    lockstep = Lockstep(100)
    coming = answer_to(lockstep, request(10, speed=math.nan), 0)
    assert lockstep.repeated(request(10, speed=math.nan)) is coming


def test_a_request_that_differs_in_anything_is_no_repetition() -> None:
    lockstep = Lockstep(100)
    answer_to(lockstep, request(10), 0)
    for other in (request(11), request(10, "other"), request(10, speed=0.2), request(10, release=True)):
        assert lockstep.repeated(other) is None


def test_only_the_last_answer_is_kept() -> None:
    lockstep = Lockstep(100)
    answer_to(lockstep, request(10), 0)
    answer_to(lockstep, request(20), 10)
    assert lockstep.repeated(request(10)) is None


def test_a_repeated_release_still_gets_its_answer() -> None:
    lockstep = Lockstep(100)
    coming = answer_to(lockstep, request(10, release=True), 0)
    assert lockstep.owner == ""
    assert lockstep.repeated(request(10, release=True)) is coming


@pytest.mark.parametrize(
    ("asked", "reason"),
    [
        (request(20, run_id=""), "run_id is empty"),
        (request(10, speed=0.2), "stale: target_tick 10 given, expected more than the present tick 10"),
        (request(5), "stale"),
        (request(20, "other"), "owned by run 'plc'"),
        (request(111), "is 101 ticks away, expected at most 100"),
        (request(END + 1), "the run ends at tick 1000"),
    ],
)
def test_refusals_say_why_and_change_nothing(asked: LockstepRequest, reason: str) -> None:
    lockstep = Lockstep(100)
    coming = answer_to(lockstep, request(10), 0)
    with pytest.raises(Refused, match=reason):
        lockstep.accept(asked, RUN, 10, END)
    assert lockstep.owner == "plc"
    assert lockstep.repeated(request(10)) is coming


def test_a_second_request_during_the_advance_is_refused() -> None:
    lockstep = Lockstep(100)
    lockstep.accept(request(10), RUN, 0, END)
    with pytest.raises(Refused, match="the advance to tick 10 is still under way"):
        lockstep.accept(request(20), RUN, 5, END)


def test_after_a_release_another_may_own_it() -> None:
    lockstep = Lockstep(100)
    answer_to(lockstep, request(10, release=True), 0)
    answer_to(lockstep, request(20, "other"), 10)
    assert lockstep.owner == "other"


def test_clear_forgets_owner_and_answer() -> None:
    lockstep = Lockstep(100)
    answer_to(lockstep, request(10), 0)
    lockstep.clear()
    assert lockstep.owner == ""
    assert lockstep.repeated(request(10)) is None
