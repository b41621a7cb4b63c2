# SPDX-License-Identifier: Apache-2.0
"""A drive trips: one alarm comes, what follows from it does not, and when it is reset nothing is left of it.

Run it by hand: `pytest examples/scenarios/test_trip.py`.
"""

from conveyor_sim.control.cascade import Cascade, CascadeZone
from conveyor_sim.control.scan import Controller
from conveyor_sim.testing.plugin import Lines

TRIPPED = "belts/zone3/tripped"
ZONES = [f"zone{number}" for number in range(1, 7)]
ALARMS = {
    # Each follows from a trip; without one, each tells of something else.
    "no_bottles": {"tag": "machines/packer/starved", "high": 0.5, "on_delay": 20.0},
    "filler_blocked": {"tag": "machines/filler/blocked", "high": 0.5, "on_delay": 20.0, "alarm_class": "error"},
}
for _alarm in ALARMS.values():
    _alarm |= {"group": "line", "suppressed_by": [f"belts/{zone}/tripped" for zone in ZONES]}


def cascade() -> Controller:
    """Zones stop as they fill."""
    zones = tuple(CascadeZone(zone, f"full{number}", 0.5) for number, zone in enumerate(ZONES, 1))
    return Cascade(zones, takes="machines/packer/running")


def test_a_trip_is_the_first_out_and_what_follows_is_suppressed(line: Lines) -> None:
    plant = line("scenarios/zoned_line", {"alarms": ALARMS})
    plant.attach(cascade())
    plant.run_until(lambda s: s["machines/packer/taken"] >= 3, within=35)
    plant.simulation.operate("acknowledge", writer="anna")  # that there were no bottles at first
    plant.run_for(0.01)
    assert plant.signals["alarm_counts/unacknowledged"] == 0
    plant.always(lambda s: not plant.alarms - {TRIPPED})

    plant.inject("belts/zone3/trip")
    plant.eventually(lambda s: s[f"alarms/{TRIPPED}"], within=0.01)
    trip, starved = plant.simulation.line.alarms[TRIPPED], plant.simulation.line.alarms["no_bottles"]
    assert plant.signals["alarm_counts/first_out"] == trip.number
    plant.run_for(40)  # the packer takes what is behind the zone, in 13 s, then waits
    assert starved.active and starved.state.name == "SUPPRESSED"
    assert plant.signals["alarm_counts/unacknowledged"] == plant.signals["alarm_counts/errors"] == 1

    plant.simulation.operate("acknowledge", [TRIPPED], writer="anna")
    plant.run_for(0.01)
    assert (trip.state.name, trip.changed_by) == ("ACKNOWLEDGED", "anna")
    plant.inject("belts/zone3/trip", 0)
    plant.command("belts/zone3/reset", 1)
    plant.eventually(lambda s: s["alarm_counts/first_out"] == 0, within=0.02)
    assert trip.state.name == "NORMAL"
    # The packer still waits for bottles; it has 20 s to get some before that is news.
    assert plant.signals["machines/packer/starved"]
    plant.run_for(30)
    assert not plant.signals["machines/packer/starved"] and not plant.alarms
