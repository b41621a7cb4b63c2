# SPDX-License-Identifier: Apache-2.0
"""Machines and the PackML state model: automatic transitions, commands, and stop reasons."""

from pathlib import Path
from typing import Any

import pytest
from facts import missing
from line.machines.machine_line import END, line, signals, sink, source

from conveyor_sim.line.machines.machine import MachineDevice
from conveyor_sim.line.machines.packml import COMMAND_TEXTS, STATE_TEXTS
from conveyor_sim.simulation import Simulation

COMMANDS = {text: number for number, text in COMMAND_TEXTS.items()}


def at(sim: Simulation, machine: str = "packer") -> tuple[str, str, str]:
    """Return state, time category and stop reason, in words."""
    texts = {tag.name: tag.texts for tag in sim.process_image.signals}
    now = signals(sim)
    names = [f"machines/{machine}/{what}" for what in ("state", "category", "stop_reason")]
    state, category, reason = (texts[name][int(now[name])] for name in names)
    return state, category, reason


def command(sim: Simulation, word: str, machine: str = "packer") -> str:
    """Send a command for the next tick, and return why it was refused, "" if it was not.

    The command is set back to none after it.
    """
    sim.take_outcomes()
    for value in (COMMANDS[word], 0):
        sim.command([f"machines/{machine}/cntrl_cmd"], [float(value)])
    sim.advance()
    first, second = sim.take_outcomes()
    assert second.accepted
    return first.reason


def packing(**more: Any) -> Simulation:
    """Return a packer with more bottles than it takes, one after another."""
    packer = sink(2.0, **{"suspend_after": 100.0, **more})
    sim = line(machines={"filler": source(4.0), "packer": packer}, duration=100.0)
    sim.advance(600)
    return sim


def taken(sim: Simulation) -> float:
    return signals(sim)["machines/packer/taken"]


def test_every_machine_is_in_execute_at_the_start() -> None:
    sim = line(machines={"filler": source(), "packer": sink()})
    assert at(sim, "filler") == ("Execute", "running", "none")
    assert at(sim) == ("Execute", "running", "none")
    now = signals(sim)
    assert (now["machines/packer/fault"], now["machines/packer/failures"], now["machines/packer/cur_rate"]) == (0, 0, 2)


def test_who_stopped_it_can_be_told() -> None:
    """Held, Suspended, Stopped and Aborted by a command, each with its way back."""
    sim = packing()
    for word, state, category, back in (
        ("Hold", "Held", "down", ["Unhold"]),
        ("Suspend", "Suspended", "idle", ["Unsuspend"]),
        ("Stop", "Stopped", "idle", ["Reset", "Start"]),
        ("Abort", "Aborted", "down", ["Clear", "Reset", "Start"]),
        ("Complete", "Completing", "running", ["Stop", "Reset", "Start"]),
    ):
        before = taken(sim)
        assert command(sim, word) == ""
        assert at(sim) == (state, category, f"command {word}")
        sim.advance(200)
        assert (taken(sim) > before) == (word == "Complete"), "emptying out, it works on"
        for each in back:
            assert command(sim, each) == ""
        assert at(sim)[0] == "Execute"
        reason = "command Stop" if word == "Complete" else f"command {word}"
        assert at(sim)[2] == reason, "the stop reason is kept"


def test_a_command_that_the_state_does_not_allow_is_refused_and_changes_nothing() -> None:
    sim = packing()
    name = "machines/packer/cntrl_cmd"
    assert missing(command(sim, "Start"), name, "Start", "Execute", "Idle") == []
    assert missing(command(sim, "Reset"), name, "Reset", "Execute", "Stopped or Complete") == []
    assert at(sim) == ("Execute", "running", "none")
    sim.command([name, "machines/packer/rate"], [float(COMMANDS["Clear"]), 1.0])
    sim.advance()
    (outcome,) = sim.take_outcomes()
    assert missing(outcome.reason, name, "Clear", "Execute", "Aborted") == []
    assert signals(sim)["machines/packer/cur_rate"] == 2.0, "all of it is refused"


def test_a_command_counts_as_it_changes() -> None:
    """A controller that writes all outputs in every scan does not stop a restarted machine again."""
    sim = packing()
    stop = float(COMMANDS["Stop"])
    for _ in range(3):
        sim.command(["machines/packer/cntrl_cmd"], [stop])
        sim.advance()
    assert at(sim) == ("Stopped", "idle", "command Stop")
    assert all(outcome.accepted for outcome in sim.take_outcomes()), "the same once more is no command"


def test_run_stops_and_starts() -> None:
    sim = packing()
    sim.command(["machines/packer/run"], [0.0])
    sim.advance(100)
    before = taken(sim)
    assert at(sim) == ("Stopped", "idle", "command run")
    says = "machines/packer/cntrl_cmd: Reset given while machines/packer/run is 0, expected 1 before"
    assert command(sim, "Reset") == says
    sim.command(["machines/packer/run"], [1.0])
    sim.advance()
    assert at(sim) == ("Execute", "running", "command run")
    sim.advance(50)
    assert taken(sim) == before + 1


def test_run_does_not_start_what_was_aborted_or_stopped_by_a_command_of_its_own() -> None:
    sim = packing()
    for word, state in (("Stop", "Stopped"), ("Abort", "Aborted")):
        command(sim, word)
        for _ in range(3):  # it was on before
            sim.command(["machines/packer/run"], [1.0])
            sim.advance()
        assert at(sim)[0] == state
    for value in (0.0, 1.0):
        sim.command(["machines/packer/run"], [value])
        sim.advance()
    assert at(sim)[0] == "Aborted", "an abort is cleared by hand"


def test_the_fault_stop_holds_it_until_it_is_gone() -> None:
    sim = packing()
    sim.inject("machines/packer/stop", 1.0)
    sim.advance(100)
    assert at(sim) == ("Held", "down", "fault stop")
    now = signals(sim)
    assert (now["machines/packer/fault"], now["machines/packer/failures"], now["machines/packer/running"]) == (1, 1, 0)
    assert now["machines/packer/cur_rate"] == 0.0
    says = "Unhold given while it is not repaired, expected machines/packer/fault to be off"
    assert command(sim, "Unhold") == f"machines/packer/cntrl_cmd: {says}"
    sim.inject("machines/packer/stop", 0.0)
    sim.advance()
    assert at(sim) == ("Execute", "running", "fault stop")
    assert signals(sim)["machines/packer/fault"] == 0.0


def test_a_command_does_not_hide_that_a_machine_has_failed() -> None:
    """A controller stops the line for a failure. The failed machine still shows it, and starts by command."""
    sim = packing()
    sim.inject("machines/packer/stop", 1.0)
    sim.advance()
    assert command(sim, "Stop", "filler") == ""
    assert command(sim, "Stop") == ""
    assert at(sim) == ("Stopped", "down", "fault stop")
    assert at(sim, "filler") == ("Stopped", "idle", "command Stop")
    sim.inject("machines/packer/stop", 0.0)
    sim.advance(10)
    assert at(sim) == ("Stopped", "idle", "fault stop")
    command(sim, "Reset")
    command(sim, "Start")
    assert at(sim)[0] == "Execute"


def test_one_that_was_held_by_command_stays_so_when_a_fault_goes() -> None:
    sim = packing()
    command(sim, "Hold")
    for value in (1.0, 0.0):
        sim.inject("machines/packer/stop", value)
        sim.advance(5)
    assert at(sim) == ("Held", "down", "command Hold")


def test_starved_and_blocked_become_suspended_after_their_time_and_not_before() -> None:
    """A packer could take a bottle every 0.25 s and gets one every 0.5 s, so each wait is short."""
    sim = line(machines={"filler": source(2.0), "packer": sink(4.0, suspend_after=1.0)}, duration=100.0)
    sim.advance(600)
    seen = set()
    for _ in range(200):
        sim.advance()
        seen.add(at(sim)[:2])
    assert seen == {("Execute", "running"), ("Execute", "starved")}
    sim.command(["machines/filler/run"], [0.0])
    sim.advance()
    while at(sim)[1] != "starved" or signals(sim)["machines/packer/starved_time"] < 3.0:
        sim.advance()
    states = []
    for _ in range(500):
        sim.advance()
        states.append(at(sim)[0])
    first = states.index("Suspended")
    assert set(states[first:]) == {"Suspended"}
    assert at(sim) == ("Suspended", "starved", "starved")
    sim.command(["machines/filler/run"], [1.0])
    before = taken(sim)
    while taken(sim) == before:
        sim.advance()
    assert at(sim) == ("Execute", "running", "starved"), "as soon as it can work it does, in the same tick"


def test_suspended_comes_at_the_tick_of_its_time() -> None:
    sim = line(machines={"packer": sink(4.0, suspend_after=0.5)}, duration=100.0)
    sim.advance(49)
    assert at(sim) == ("Execute", "starved", "none"), "starved counts from the first tick on"
    sim.advance()
    assert at(sim) == ("Suspended", "starved", "starved")
    assert signals(sim)["machines/packer/starved_time"] == pytest.approx(0.49), "after the tick in which it looks first"


def test_a_filler_without_room_is_suspended() -> None:
    sim = line(machines={"filler": source(suspend_after=1.0)}, duration=100.0)
    sim.advance(1500)
    assert at(sim, "filler") == ("Suspended", "blocked", "blocked")


def test_acting_states_take_their_times() -> None:
    times = {
        "stopping": 0.03, "resetting": 0.04, "starting": 0.05, "holding": 0.02, "unholding": 0.02, "suspending": 0.02,
        "unsuspending": 0.02, "aborting": 0.02, "clearing": 0.03, "completing": 0.02,
    }  # fmt: skip
    sim = packing(acting_times=times)
    for word, through, then in (
        ("Hold", ["Holding"] * 2, "Held"), ("Unhold", ["Unholding"] * 2, "Execute"),
        ("Suspend", ["Suspending"] * 2, "Suspended"), ("Unsuspend", ["Unsuspending"] * 2, "Execute"),
        ("Stop", ["Stopping"] * 3, "Stopped"), ("Reset", ["Resetting"] * 4, "Idle"),
        ("Start", ["Starting"] * 5, "Execute"), ("Abort", ["Aborting"] * 2, "Aborted"),
        ("Clear", ["Clearing"] * 3, "Stopped"),
    ):  # fmt: skip
        sim.command(["machines/packer/cntrl_cmd"], [float(COMMANDS[word])])
        seen = []
        for _ in range(len(through)):
            sim.advance()
            seen.append(at(sim)[0])
        # The tick at whose beginning it is commanded is the first of them, and what is seen is seen at its end.
        assert seen == [*through[1:], then]
        assert at(sim)[0] == then


def test_it_ramps_up_whenever_it_comes_into_execute() -> None:
    """From 0 to 2 per second in 2 s: two bottles during the ramp, then one every half second."""
    sim = packing(ramp_up=2.0)
    sim.inject("machines/packer/stop", 1.0)
    sim.advance(100)
    assert signals(sim)["machines/packer/cur_rate"] == 0.0
    before = taken(sim)
    sim.inject("machines/packer/stop", 0.0)
    rates = []
    for _ in range(200):
        sim.advance()
        rates.append(signals(sim)["machines/packer/cur_rate"])
    assert rates == pytest.approx([0.01 * min(n, 200) for n in range(1, 201)])
    assert taken(sim) - before == pytest.approx(2, abs=1)
    sim.advance(200)
    assert taken(sim) - before == pytest.approx(6, abs=1)


def test_minimum_fill_before_it_starts_and_after_it_was_starved() -> None:
    """The fill is counted in its region, which has room for two, or in a zone."""
    zone = [[1.2, -0.2], [2.0, -0.2], [2.0, 0.2], [1.2, 0.2]]
    machines = {"filler": source(), "packer": sink(4.0, start_fill=4, start_zone="before", suspend_after=0.1)}
    sim = line(machines=machines, zones={"before": {"region": zone}}, duration=100.0)
    assert at(sim) == ("Starting", "idle", "none")
    for _ in range(2):
        before = taken(sim)
        while taken(sim) == before:
            waiting = signals(sim)["zones/before/bottles"]
            sim.advance()
            assert sim.tick < 3000
        assert waiting >= 3, "the fourth came in this tick"
        while at(sim)[0] == "Execute":
            sim.advance()
            assert sim.tick < 3000
        assert at(sim) == ("Suspended", "starved", "starved")


def test_emptying_out_ends_when_nothing_has_come_for_a_while() -> None:
    sim = packing(run_down=1.0)
    command(sim, "Complete", "filler")
    assert at(sim, "filler") == ("Complete", "idle", "command Complete")
    fed = signals(sim)["machines/filler/produced"]
    command(sim, "Complete")
    last = sim.tick
    while at(sim)[0] == "Completing":
        before = taken(sim)
        sim.advance()
        last = sim.tick if taken(sim) > before else last
        assert sim.tick < 5000
    assert at(sim) == ("Complete", "idle", "command Complete")
    assert (taken(sim), sim.counts.present) == (fed, 0)
    # It wants one a cycle of half a second after the last.
    assert (sim.tick - last) * 0.01 == pytest.approx(0.5 + 1.0, abs=0.02)


JAM = {"between": {"kind": "list", "times": [3.0]}, "repair": {"kind": "list", "times": [1.0]}}


def stands(sim: Simulation, ticks: int, machine: str = "packer") -> list[tuple[int, str, str, str]]:
    """Return each change of state, category or reason, with its tick."""
    before, found = at(sim, machine), []
    for _ in range(ticks):
        sim.advance()
        if (now := at(sim, machine)) != before:
            found.append((sim.tick, *now))
            before = now
    return found


def test_failures_count_running_time_and_are_repaired() -> None:
    """The machine is starved until the first bottle arrives after 0.25 s + 3.5 s, then always busy."""
    machines = {"filler": source(4.0), "packer": sink(2.0, failures={"jam": JAM}, suspend_after=100.0)}
    sim = line(machines=machines, duration=100.0)
    found = [(category, reason, tick) for tick, _, category, reason in stands(sim, 2000) if tick > 400]
    starved = round(signals(sim)["machines/packer/starved_time"] * 100)
    assert starved == pytest.approx(375, abs=10)
    fails = [tick for category, _, tick in found if category == "down"]
    again = [tick for category, _, tick in found if category == "running"]
    assert fails == [starved + 300 + 400 * n for n in range(4)]
    assert again == [tick + 100 for tick in fails][: len(again)]
    assert {reason for category, reason, _ in found if category == "down"} == {"failure jam"}
    assert signals(sim)["machines/packer/failures"] == len(fails)


def test_failures_may_count_the_clock() -> None:
    sim = line(machines={"packer": sink(failures={"jam": {**JAM, "counted": "clock"}})}, duration=100.0)
    found = [tick for tick, _, category, _ in stands(sim, 1500) if category == "down"]
    assert found == [300, 700, 1100, 1500]


def test_two_variants_of_a_line_draw_the_same_failures() -> None:
    """Another machine before it in the list, and another failure mode, leave its jams at the same ticks."""
    way = {
        "between": {"kind": "exponential", "mean": 2.0}, "repair": {"kind": "weibull", "mean": 1.0, "shape": 2.0},
        "counted": "clock",
    }  # fmt: skip
    other = sink(region=[[0.5, -0.1], [0.6, -0.1], [0.6, 0.1]], failures={"jam": way})
    kept = []
    for machines in (
        {"packer": sink(failures={"jam": way})},
        {"another": other, "packer": sink(failures={"jam": way})},
        {"packer": sink(3.0, failures={"wear": {**JAM, "between": {"kind": "list", "times": [1e6]}}, "jam": way})},
    ):
        sim = line(machines=machines, duration=100.0, seed=5)
        kept.append([(tick, category) for tick, _, category, _ in stands(sim, 3000) if category in ("down", "starved")])
    assert len(kept[0]) > 8
    assert kept[0] == kept[1] == kept[2]
    sim = line(machines={"packer": sink(failures={"jam": way})}, duration=100.0, seed=6)
    assert [(tick, category) for tick, _, category, _ in stands(sim, 3000)] != kept[0]


def test_planned_stops_come_and_go_by_themselves() -> None:
    stop = {"start": 2.0, "duration": 1.0, "every": 4.0}
    sim = line(machines={"packer": sink(planned_stops={"lunch": stop}, suspend_after=100.0)}, duration=100.0)
    assert stands(sim, 1100) == [
        (1, "Execute", "starved", "none"),
        (200, "Stopped", "planned", "planned stop lunch"),
        (300, "Execute", "starved", "planned stop lunch"),
        (600, "Stopped", "planned", "planned stop lunch"),
        (700, "Execute", "starved", "planned stop lunch"),
        (1000, "Stopped", "planned", "planned stop lunch"),
        (1100, "Execute", "starved", "planned stop lunch"),
    ]


def test_a_planned_stop_ends_early_by_command_and_does_not_start_what_an_operator_stopped() -> None:
    stop = {"start": 2.0, "duration": 1.0}
    for names, then in ((["Reset", "Start"], "Execute"), (["Abort"], "Aborted")):
        sim = packing(planned_stops={"lunch": {**stop, "start": 6.5}})
        sim.advance(60)
        assert at(sim) == ("Stopped", "planned", "planned stop lunch")
        for name in names:
            assert command(sim, name) == ""
        assert at(sim)[0] == then
        sim.advance(200)
        assert at(sim)[0] == then
    sim = packing(planned_stops={"lunch": {**stop, "start": 6.5}})
    sim.command(["machines/packer/run"], [0.0])
    sim.advance(300)
    assert at(sim) == ("Stopped", "idle", "command run")


def test_one_planned_stop_ends_during_another_and_the_machine_stands_on() -> None:
    """The order in the scene and in time does not matter. Stops that follow at once make one stop."""
    for lunch, reel, stops, end in (
        ((2.0, 3.0), (2.0, 1.0), [(200, "lunch")], 500),
        ((2.0, 3.0), (3.0, 1.0), [(200, "lunch")], 500),
        ((3.0, 3.0), (2.0, 2.0), [(200, "reel"), (400, "lunch")], 600),
        ((2.0, 1.0), (3.0, 1.0), [(200, "lunch"), (300, "reel")], 400),
        ((3.0, 1.0), (2.0, 1.0), [(200, "reel"), (300, "lunch")], 400),
    ):
        planned = {
            name: {"start": start, "duration": time} for name, (start, time) in (("lunch", lunch), ("reel", reel))
        }
        sim = line(machines={"packer": sink(planned_stops=planned, suspend_after=100.0)}, duration=100.0)
        found = [(tick, state, reason) for tick, state, _, reason in stands(sim, 1000) if tick > 1]
        expected = [(tick, "Stopped", f"planned stop {name}") for tick, name in stops]
        assert found == [*expected, (end, "Execute", expected[-1][2])]


def test_times_change_with_the_category() -> None:
    sim = line(
        machines={"packer": sink(failures={"jam": {**JAM, "counted": "clock"}}, suspend_after=100.0)}, duration=100.0
    )
    (packer,) = [device for device in sim._line._devices if isinstance(device, MachineDevice)]
    changes = []
    for _ in range(900):
        before = packer.time.up_to(sim.tick)
        sim.advance()
        changes.append(next(name for name, ticks in packer.time.up_to(sim.tick).items() if ticks > before[name]))
    expected = {"running": 1, "starved": 299, "down": 100, "starved ": 300, "down ": 100, "starved  ": 100}
    assert changes == [name.strip() for name, ticks in expected.items() for _ in range(ticks)]


def busy() -> Simulation:
    """Return machines with all optional features."""
    way = {"between": {"kind": "exponential", "mean": 3.0}, "repair": {"kind": "weibull", "mean": 1.0, "shape": 2.0}}
    more: dict[str, Any] = {
        "failures": {"jam": way, "wear": {**way, "counted": "clock"}}, "ramp_up": 0.7, "suspend_after": 0.4,
        "planned_stops": {"lunch": {"start": 5.0, "duration": 0.5, "every": 4.0}},
        "acting_times": {"starting": 0.11, "unholding": 0.07, "suspending": 0.05, "stopping": 0.2},
    }  # fmt: skip
    machines = {
        "filler": source(3.0, bad_share=0.3, **more),
        "packer": sink(2.5, start_fill=2, region=END, **more),
    }
    return line(machines=machines, duration=100.0, seed=3)


def test_a_run_goes_on_from_a_checkpoint_with_the_same_bits(tmp_path: Path) -> None:
    sim = busy()
    states = set()
    for part in range(6):
        sim.advance(237)
        sim.save(tmp_path / "there")
        loaded = Simulation.load(tmp_path / "there")
        for each in (sim, loaded):
            each.command(["machines/packer/cntrl_cmd", "machines/filler/run"], [float(part % 3), float(part % 4 != 2)])
            each.advance(50)
        assert loaded.signals().tolist() == sim.signals().tolist()
        assert loaded.full_state_hash() == sim.full_state_hash()
        assert (loaded.line.happened, loaded.take_outcomes()) == (sim.line.happened, sim.take_outcomes())
        states |= {at(sim)[0], at(sim, "filler")[0]}
    assert len(states) > 3, states


def test_every_state_has_its_text() -> None:
    (tag,) = [tag for tag in busy().process_image.signals if tag.name == "machines/packer/state"]
    assert dict(tag.texts) == dict(STATE_TEXTS)
