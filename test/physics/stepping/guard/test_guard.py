# SPDX-License-Identifier: Apache-2.0
"""The guard: a fault of each kind is injected, and is cured by shorter steps or told in one sentence."""

from __future__ import annotations

import math
import re
from dataclasses import astuple
from typing import Any

import numpy as np
import pytest
from facts import missing, stating
from scenes import (
    COMMON,
    MASS,
    NO_FLOOR,
    NO_OUTPUTS,
    RADIUS,
    arc,
    base,
    belt,
    bottle,
    contact,
    every_law,
    kind,
    segment,
    simulation,
    stiffness_for,
    with_bends,
)

from conveyor_sim.accuracy.trajectory import displace
from conveyor_sim.columns.events import GuardEvent
from conveyor_sim.errors import SimulationError
from conveyor_sim.physics.stepping.guard.chatter import EVERY
from conveyor_sim.simulation import Simulation

STOP = {"stop": segment((0.6, -1.0), (0.6, 1.0))}


def told(sim: Simulation) -> GuardEvent:
    """The only thing that the guard said."""
    (event,) = sim.take_events().guard
    return event


def against_a_stop(speed: float, stiffness: float, per_tick: int, **fields: Any) -> Simulation:
    """A bottle half a radius before a rail, in ticks of 10 ms. Undamped is as good as that, to share kernels."""
    return simulation(
        **{
            "accuracy": {"per_tick": per_tick},
            "contacts": [contact(stiffness, "steel", ("normal", 1e-9))],
            "effects": {"energy_ledger": "on"},
            "rails": STOP,
            "bottles": [bottle(0.6 - 1.5 * RADIUS, 0.0, speed)],
            **NO_FLOOR,
            **fields,
        }
    )


@pytest.mark.parametrize("value", [math.nan, math.inf])
@pytest.mark.parametrize("column", ["x", "vy"])
def test_what_was_not_finite_before_a_step_is_told_at_once(value: float, column: str) -> None:
    sim = simulation(**every_law([contact(1e3)]), bottles=[bottle(0.0, 0.0), bottle(1.0, 0.5)], **NO_FLOOR)
    sim.advance(3)
    getattr(sim._state.world.bottles, column)[1] = value
    with pytest.raises(SimulationError) as stopped:
        sim.advance()
    assert str(stopped.value).startswith(
        "bottle 1 has no finite position or velocity before the first step in the tick that began at 0.03 s at ("
    )
    assert sim.tick == 3
    assert told(sim).kind == "stopped"


def struck_too_hard(shorten: bool = True) -> Simulation:
    """A contact of 1 ms in steps of 1 ms, beyond 2 / w, throws a bottle back many times faster."""
    stiffness = stiffness_for(1e-3, MASS)
    assert 2.0 / math.sqrt(stiffness / MASS) < 1e-3
    return Simulation(against_a_stop(1.0, stiffness, 10).scene, threads=1, shorten=shorten)


def test_a_spring_that_a_step_is_too_long_for_is_cured_by_shorter_ones() -> None:
    """Elastic, the bottle comes back as fast as it came, as far as four steps a contact can tell."""
    sim = struck_too_hard()
    sim.advance(10)
    assert sim.bottles().vx[0] == pytest.approx(-1.0, rel=0.4)
    assert sim.integration.shortened_ticks == 1
    event = told(sim)
    assert (event.kind, event.bottle) == ("shorter_steps", 0)
    assert re.search(
        r"rises from 0\.1 to \S+ J in the tick that began at 0\.0\d s .*; "
        r"the tick was repeated in steps 4 times shorter$",
        event.text,
    )


def test_without_shorter_steps_the_same_is_told_and_the_tick_not_taken() -> None:
    sim = struck_too_hard(shorten=False)
    before = []
    with pytest.raises(SimulationError, match=stating("fastest", "energy", "rises")) as stopped:
        for _ in range(20):
            before.append((sim.tick, sim.bottles().x[0], sim.bottles().vx[0]))
            sim.advance()
    assert stopped.value.kind == "unstable"
    assert before[-1] == (sim.tick, sim.bottles().x[0], sim.bottles().vx[0])


def test_a_tick_that_is_done_again_is_booked_once() -> None:
    """Free flight is the same in steps of any length: a cured run is one whose steps were short from the beginning."""
    stiffness = stiffness_for(1e-3, MASS)
    damped = [contact(stiffness, "steel", ("normal", 0.1 * math.sqrt(stiffness * MASS)))]
    ledgers = []
    for per_tick, shortened in ((10, 1), (40, 0)):
        sim = against_a_stop(1.0, stiffness, per_tick, contacts=damped)
        sim.advance(10)
        assert sim.integration.shortened_ticks == shortened
        ledgers.append(sim.ledger())
    cured, short = ledgers
    assert cured is not None
    assert short is not None
    assert cured.damping > 0.1 * short.fed
    for name in ("kinetic", "damping", "fed", "residual"):
        assert getattr(cured, name) == pytest.approx(getattr(short, name), rel=1e-9)


def test_a_bottle_that_would_step_over_a_rail_is_caught() -> None:
    """At 20 m/s a step of 10 ms is three radii: shorter steps find the rail, and the bottle comes back."""
    sim = against_a_stop(20.0, 1e6, 1)
    sim.advance(2)
    assert sim.bottles().x[0] < 0.6 - RADIUS
    assert sim.bottles().vx[0] == pytest.approx(-20.0, rel=0.2)
    assert missing(sim.take_events().guard[0].text, ["bottle 0", "200 mm", "one step of 0.01 s"]) == []


def test_what_no_step_can_stop_is_told_with_the_stiffness_that_can() -> None:
    """Faster than R sqrt(k/m) = 14.5 m/s, a bottle passes a rail of 10 kN/m by energy alone: m v^2 > k R^2."""
    stiffness = 1e4
    most = RADIUS * math.sqrt(stiffness / MASS)
    assert most == pytest.approx(14.5, abs=0.05)
    slow = against_a_stop(0.7 * most, stiffness, 500)
    slow.advance(5)
    assert slow.bottles().vx[0] == pytest.approx(-0.7 * most, rel=1e-3)
    fast = against_a_stop(1.1 * most, stiffness, 500)
    with pytest.raises(SimulationError) as stopped:
        fast.advance(5)
    assert stopped.value.kind == "tunnelling"
    sentence = re.fullmatch(
        r"bottle 0 sinks (\S+) of its radius into rail stop in the tick that began at 0 s at \(\S+, 0\) m, even in "
        r"steps 64 times shorter: it arrived at 16 m/s, and the contact with rail stop can stop at most 14\.5 m/s "
        r"within a radius; give this contact a stiffness of about (\S+) N/m",
        str(stopped.value),
    )
    assert sentence is not None
    assert 0.75 < float(sentence[1]) <= 1.0
    assert fast.bottles().x[0] == 0.6 - 1.5 * RADIUS
    event = told(fast)
    assert (event.kind, event.tick, event.x, event.text) == ("stopped", 0, 0.6 - 1.5 * RADIUS, str(stopped.value))
    cured = against_a_stop(1.1 * most, float(sentence[2]), 500)
    cured.advance(5)
    assert cured.bottles().vx[0] == pytest.approx(-1.1 * most, rel=1e-2)
    assert cured.integration.deepest_overlap < 0.11


def test_two_bottles_that_would_pass_through_each_other() -> None:
    sim = simulation(
        accuracy={"per_tick": 200},
        **every_law([contact(1e3)]),
        bottles=[bottle(0.0, 0.0, 8.0), bottle(2.2 * RADIUS, 0.0, -8.0)],
        **NO_FLOOR,
    )
    with pytest.raises(SimulationError, match=r"bottle 0 overlaps bottle 1 by \S+ of a radius .* it arrived at 16 m/s"):
        sim.advance(5)


def test_a_soft_contact_is_told_once_with_the_force_that_presses_it() -> None:
    """A bottle on a belt against a stop sinks in by mu m g / k: 0.3 of the radius."""
    pressing = 0.4 * MASS * 9.81
    stiffness = pressing / (0.3 * RADIUS)
    sim = simulation(
        accuracy={"per_tick": 200},
        contacts=[contact(stiffness, "steel", ("normal", 2.0 * math.sqrt(stiffness * MASS)))],
        base=base(0.4),
        belts={"belt": belt(0.2)},
        rails=STOP,
        bottles=[bottle(0.6 - RADIUS, 0.0)],
        slip_limit=0.01,
    )
    sim.advance(300)
    event = told(sim)
    assert event.kind == "soft"
    assert re.match(r"bottle 0 sinks 0\.2\d* of its radius into rail stop at \(\S+, 0\) m: it is pressed with about "
                    r"0\.5\d* N", event.text)  # fmt: skip
    assert sim.integration.deepest_overlap == pytest.approx(0.3, rel=0.01)


@pytest.mark.parametrize(("of_bound", "shakes"), [(0.9, False), (1.9, True)])
def test_chatter_is_told_where_it_shakes_more_than_a_quarter_of_the_limit(of_bound: float, shakes: bool) -> None:
    """The slip settles at +-2 (1 - 1/b) v_lim for b = dt mu g / v_lim; only the guard detects it."""
    mu, limit, per_tick = 0.4, 0.01, 64
    dt = round(of_bound * limit / (mu * 9.81), 8)
    sim = simulation(
        tick=per_tick * dt,
        accuracy={"per_tick": per_tick},
        slip_limit=limit,
        base=base(mu),
        belts={"belt": belt(0.2)},
        bottles=[bottle(0.1, 0.2, 0.2 - 0.3 * limit)],
    )
    sim.advance(EVERY // per_tick)
    events = sim.take_events().guard
    assert len(events) == shakes
    if shakes:
        share = float(re.search(r"alternates by \+-(\S+) slip_limit", events[0].text)[1])  # type: ignore[index]
        assert share == pytest.approx(2.0 * (1.0 - 1.0 / of_bound), abs=0.01)
        assert (events[0].kind, events[0].bottle) == ("chatter", 0)


def test_a_scene_too_stiff_for_an_error_control_is_told_in_time() -> None:
    """Friction of a press of 2 kN on 1 g within 0.1 um/s allows steps of some 1e-13 s: it would take for ever."""
    sim = simulation(
        accuracy={"integrator": "dormand_prince", "per_tick": 1, "error": 1e-9},
        slip_limit=1e-7,
        bottle_types={"bottle": kind(mass=1e-3)},
        contacts=[contact(1e6, "steel", friction=1.0)],
        rails={
            "one": segment((-1.0, -RADIUS + 2e-3), (1.0, -RADIUS + 2e-3)),
            "other": segment((-1.0, RADIUS - 2e-3), (1.0, RADIUS - 2e-3)),
        },
        bottles=[bottle(0.0, 0.5, 0.3, 0.0)],
        **NO_FLOOR,
    )
    displace(sim, np.zeros(1), np.full(1, -0.5))
    with pytest.raises(SimulationError, match=stating("dormand_prince", "error", "1e-09 m/s", "1,000,000")):
        sim.advance()
    assert sim.tick == 0


def test_listening_for_chatter_leaves_no_trace() -> None:
    """Steps on a trial, springs stretched and the ledger open, are taken back whole."""
    sprung = {"damping": ("normal", 0.1), "friction": 0.5, "tangential": {"stiffness": 3000.0, "damping": 0.2}}
    runs = []
    for every in (0, 3):
        sim = simulation(
            contacts=[contact(5e3, **sprung), contact(2e4, "steel", **sprung)],  # type: ignore[arg-type]
            base=base(0.4),
            belts={"belt": belt(0.3)},
            rails={**STOP, "side": segment((-2.0, 1.04 * RADIUS), (0.6, 1.04 * RADIUS))},
            bottles=[bottle(0.6 - (2 * i + 1.05) * RADIUS, 0.002 * (i % 2)) for i in range(5)],
            outputs={**NO_OUTPUTS, "ledger": 100},
        )
        assert sim.integration._chatter_ticks > 0
        sim.integration._chatter_ticks = every
        hashes = []
        for _ in range(30):
            sim.advance()
            hashes.append(sim.state_hash())
        ledger = sim.ledger()
        assert ledger is not None
        books = [np.asarray(value).tobytes() for value in astuple(ledger)]
        runs.append((sim._state.springs(), hashes, books, sim.integration.deepest_overlap))
    assert runs[0] == runs[1]
    assert len(runs[0][0]) > 4 * 16  # a spring takes 16 bytes


def test_a_driven_line_has_nothing_to_tell() -> None:
    """Belts do work, bottles fall in and out: no false alarm in a second at the preset."""
    given = {
        "contacts": [contact(2e5, other, ("normal", 20.0), 1e-3) for other in ("glass", "steel")],
        "effects": COMMON,
        "base": base(0.4),
        "belts": {"belt": belt(1.0)},
        "rails": STOP,
        "bottles": [bottle(-2.0 + 2.1 * RADIUS * i, 0.01 * (-1) ** i) for i in range(12)],
    }
    sim = simulation(**with_bends(given))
    sim.advance(100)
    sim.command(["belts/belt/cmd_speed"], [-1.0])
    sim.advance(100)
    assert sim.take_events().guard == []
    assert sim.integration.shortened_ticks == 0


def unsteady(threads: int) -> Simulation:
    """Bottles with tangential springs, friction and rotation on a belt, in steps that one contact is too stiff for."""
    sprung = {"friction": 0.5, "tangential": {"stiffness": 3000.0, "damping": 0.2}}
    stiff = stiffness_for(1e-4, MASS)
    given = simulation(
        accuracy={"per_tick": 20},
        contacts=[contact(5e3, **sprung), contact(stiff, "steel", **sprung)],
        rails={
            "stop": segment((0.6, -1.0), (0.6, 1.0)),
            "side": segment((-1.0, -RADIUS), (0.6, -RADIUS)),
            "bend": arc((3.0, 3.0), 0.1, 0.0, 1.0),  # for the kernels of test_springs.py
        },
        bottles=[bottle(0.6 - (2 * i + 1.05) * RADIUS, 0.002 * (i % 2), 1.0) for i in range(5)],
        **NO_FLOOR,
    ).scene
    return Simulation(given, threads)


def test_a_cured_run_has_the_same_bits_however_it_is_divided_and_on_any_threads() -> None:
    whole, parted = unsteady(1), unsteady(2)
    whole.advance(40)
    for _ in range(40):
        parted.advance(1)
        parted.bottles()
    assert whole.integration.shortened_ticks == parted.integration.shortened_ticks > 0
    assert whole.full_state_hash() == parted.full_state_hash()
    assert np.isfinite(whole.bottles().vx).all()
    assert whole.take_events().guard == parted.take_events().guard
