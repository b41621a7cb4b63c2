# SPDX-License-Identifier: Apache-2.0
"""A capper that jams and misses caps: what the checkweigher finds is thrown out, and the line waits and goes on.

Run it by hand: `pytest examples/scenarios/test_two_stations.py`.
"""

from conveyor_sim.control.reject import TrackedReject
from conveyor_sim.control.scan import Constant, Controller
from conveyor_sim.testing.plugin import Lines

TIME = 240.0  # s
EXECUTE, SUSPENDED, HELD = 6, 5, 11  # states of PackML
STARVED, BLOCKED, CHAIN = 20, 21, 101  # stop reasons; failures are numbered from 100 on


def rejecting() -> Controller:
    """Each bottle that the eye behind the checkweigher sees as bad is followed by the belt's pulses."""
    return TrackedReject(
        belt="line",
        inspection="machines/eye/bad",
        seen="machines/eye/bad_time",
        fire="machines/rejecter/fire",
        distance=0.6,
        stroke=0.03,
        pulses_per_metre=2000.0,
    )


def test_what_the_checkweigher_finds_does_not_come_to_the_packer(line: Lines) -> None:
    plant = line("scenarios/two_stations")
    plant.attach(rejecting())
    plant.run_for(TIME)
    found = plant.signals["machines/checkweigher/defective"]
    # One may be on its way from the checkweigher to the rejecter still.
    assert found - 1 <= plant.signals["machines/rejecter/rejected"] <= found
    assert found >= 5
    assert plant.signals["machines/rejecter/missed"] == 0
    assert plant.signals["machines/packer/taken_bad"] == 0


def test_without_the_rejecter_bad_bottles_come_to_the_packer(line: Lines) -> None:
    plant = line("scenarios/two_stations")
    plant.attach(Constant({"machines/rejecter/fire": 0.0}))
    plant.run_for(TIME)
    assert plant.signals["machines/packer/taken_bad"] >= 5


def test_a_jam_of_the_capper_starves_the_packer_and_blocks_the_filler(line: Lines) -> None:
    """It breaks once, for a minute, so that the buffers run empty and full; each machine says why it stands."""
    chain = {"between": {"kind": "list", "times": [20.0, 1e6]}, "repair": {"kind": "list", "times": [60.0]}}
    failures = {"jam": {"between": {"mean": 1e6}}, "chain": chain}
    plant = line("scenarios/two_stations", {"machines": {"capper": {"failures": failures}}})
    plant.attach(rejecting())
    plant.run_until(lambda s: s["machines/capper/state"] == HELD, within=60.0)
    assert plant.signals["machines/capper/stop_reason"] == CHAIN
    plant.run_until(lambda s: s["machines/packer/state"] == SUSPENDED, within=40.0)
    assert plant.signals["machines/packer/stop_reason"] == STARVED
    plant.run_until(lambda s: s["machines/filler/state"] == SUSPENDED, within=60.0)
    assert plant.signals["machines/filler/stop_reason"] == BLOCKED
    assert plant.signals["machines/capper/state"] == HELD, "it is not repaired yet"
    names = [f"machines/{name}/state" for name in ("filler", "capper", "checkweigher", "packer")]
    plant.run_until(lambda s: all(s[name] == EXECUTE for name in names), within=90.0)
    assert plant.signals["machines/capper/failures"] == 1
