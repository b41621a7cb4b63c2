# SPDX-License-Identifier: Apache-2.0
"""Errors on a scene against its reference, where a closed form says what they must be."""

import math
from typing import Any

import numpy as np
import pytest
from scenes import NO_FLOOR, base, belt, bottle, contact, scene, segment, stiffness_for

from conveyor_sim.accuracy.candidates import candidates, forbidden, own_setting, softer, standard_steps
from conveyor_sim.accuracy.measure.precision import HORIZON, WorkPrecision, errors_of
from conveyor_sim.accuracy.measure.reference import reference_setting
from conveyor_sim.accuracy.measure.starts import find_starts
from conveyor_sim.accuracy.measure.timing import costs_of
from conveyor_sim.accuracy.setting import Setting, with_setting
from conveyor_sim.accuracy.trajectory import displace, energies, follow, variant
from conveyor_sim.scene import Scene
from conveyor_sim.simulation import Simulation

CONTACT_TIME = 0.01
"""s"""
SPEED = 0.7
K = stiffness_for(CONTACT_TIME, 0.1)


def silent(done: float, whole: float) -> None:
    """Progress that nobody watches."""


def head_on(**fields: Any) -> Scene:
    """Two bottles that touch first after 31.3 ticks of 1 ms."""
    parts: dict[str, Any] = {
        "tick": 0.001,
        "duration": 0.1,
        "contacts": [contact(K)],
        "bottles": [bottle(0.0, 0.0, SPEED), bottle(0.13 + SPEED * 0.0313, 0.0)],
        # As in test_horizon.py, for the kernels.
        "effects": {"unequal_radii": "on"},
        **NO_FLOOR,
    }
    return scene(**{**parts, **fields})


@pytest.fixture(scope="module")
def study() -> WorkPrecision:
    work = WorkPrecision(head_on())
    work.find_starts(silent)
    work.find_horizons(silent)
    work.make_reference(silent)
    return work


def test_starts_lie_shortly_before_the_first_contact(study: WorkPrecision) -> None:
    """31 ticks; that before the strongest force, half a contact later, is the same."""
    assert [start.simulation.tick for start in study.starts] == [31]
    assert study.starts[0].untouched
    assert study.starts[0].simulation.contacts().a.size == 0
    assert study.horizons[0].start == pytest.approx(0.031)
    assert (study.horizons[0].bottles, study.horizons[0].contacts) == (2, 0)


def test_starts_of_a_line_that_goes_on() -> None:
    """A bottle that a running belt throws onto a stop again and again: starts in each part of the run."""
    again = scene(
        tick=0.01,
        duration=6.0,
        accuracy={"per_tick": 50},
        contacts=[contact(1e4), contact(1e4, "steel")],
        base=base(0.4),
        belts={"belt": belt(0.3)},
        rails={"stop": segment((1.0, -1.0), (1.0, 1.0))},
        bottles=[bottle(0.0, 0.0), bottle(-0.2, 0.0)],
    )
    starts = find_starts(again, silent).starts
    assert [start.untouched for start in starts] == [True] + [False] * (len(starts) - 1)
    assert len(starts) >= 3
    ticks = [start.simulation.tick for start in starts]
    assert ticks == sorted(set(ticks))
    assert ticks[-1] >= 400


def test_little_work_shortens_the_horizons(study: WorkPrecision) -> None:
    """Two bottles, 10 ticks' worth of steps; whoever asks again with more gets the whole, and says so."""
    brief = WorkPrecision(head_on())
    brief.find_starts(silent)
    steps = standard_steps(head_on())
    brief.find_horizons(silent, work=10 * 2 * steps)
    assert [horizon.length for horizon in brief.horizons] == [pytest.approx(0.01)]
    assert brief.cut_short
    brief.find_horizons(silent)
    assert brief.horizons == study.horizons
    assert not brief.cut_short


def test_the_reference_has_the_closed_forms(study: WorkPrecision) -> None:
    """Peak force v sqrt(k m_r) to (pi/n)^2/8 of a sample at 200 steps a contact, impulse m_r 2 v, speeds exchanged."""
    assert study.reference is not None
    assert study.reference.setting.integrator == "dormand_prince"
    last = study._true[0].frames[HORIZON].bottles
    assert last.peak_force == pytest.approx(SPEED * math.sqrt(K * 0.1), rel=1.01 * (math.pi / 200) ** 2 / 8)
    np.testing.assert_allclose(last.impulse, 0.2 * SPEED, rtol=1e-7)
    np.testing.assert_allclose(last.vx, [0.0, SPEED], atol=1e-7)
    doubt = study.reference.doubt
    # Half the steps have four times its error of sampling.
    assert doubt.peak_force < (math.pi / 100) ** 2 / 8
    # Ten times its error of a step, a few times over, for the rest of the horizon.
    assert doubt.position_max < 1e-7


def test_a_peak_is_missed_by_pi_over_n_squared_over_8(study: WorkPrecision) -> None:
    """One phase only, so anything up to it; positions are off by what the rebound is, at order 2 as well."""
    numbers = [10, 20, 40]
    points = study.measure([Setting("semi_implicit_euler", n // 10) for n in numbers], silent)
    for n, point in zip(numbers, points, strict=True):
        assert point.failure == ""
        assert point.errors is not None
        assert point.errors.peak_force < 1.1 * (math.pi / n) ** 2 / 8
        # 0.7 / n^2 of the speed, RMS over phases (test_closed_forms.py), twice that at one, for 0.5 s at the most.
        assert point.errors.position_max < 2.0 * 0.7 / n**2 * SPEED * 0.5
        assert point.cost is not None
        assert 0.0 < point.cost.least <= point.cost.median <= point.cost.greatest


def test_softer_contacts_are_compared_from_the_first_start(study: WorkPrecision) -> None:
    """A quarter of the stiffness: half of the peak, the same impulse."""
    soft, same = study.measure([Setting("semi_implicit_euler", 8, 0.25), Setting("semi_implicit_euler", 8)], silent)
    assert soft.errors is not None
    assert same.errors is not None
    assert soft.errors.peak_force == pytest.approx(0.5, abs=1e-3)
    assert soft.errors.impulse < 1e-3
    assert same.errors.peak_force < 1e-3


def test_a_setting_that_fails_is_kept(study: WorkPrecision) -> None:
    """At a sixty-fourth of the stiffness both are deeper in each other than half a radius."""
    (failed,) = study.measure([Setting("semi_implicit_euler", 1, 1.0 / 640.0)], silent)
    assert failed.failure.startswith("tunnelling: bottle ")
    assert failed.errors is None
    assert failed.cost is None


LATE = {"bottle": "bottle", "position": [0, 0], "direction": 0, "speed": SPEED, "rate": 1.0, "start": 0.08}


@pytest.mark.parametrize(
    "fields",
    [{"bottles": [bottle(0.0, 0.0, SPEED)]}, {"bottles": [], "infeeds": {"late": LATE}}],
    ids=["one bottle", "none at the start"],
)
def test_a_scene_without_any_contact_has_no_errors_to_speak_of(fields: dict[str, Any]) -> None:
    """Nothing makes a force; free flight is exact at any step."""
    work = WorkPrecision(head_on(**fields))
    work.find_starts(silent)
    work.find_horizons(silent)
    work.make_reference(silent)
    (point,) = work.measure([Setting("semi_implicit_euler", 1)], silent)
    assert point.failure == ""
    assert point.errors is not None
    assert point.errors.position_max < 1e-12
    assert (point.errors.peak_force, point.errors.impulse) == (0.0, 0.0)
    assert (work.horizons[0].by_nudge, work.horizons[0].by_error) == (math.inf, math.inf)


@pytest.mark.parametrize("size", [0.0, 1e-3])
def test_errors_of_a_run_that_is_displaced(size: float) -> None:
    """All positions off by so much, nothing else."""
    flying = head_on(bottles=[bottle(0.0, 0.0, SPEED), bottle(0.0, 1.0)])
    setting = Setting("semi_implicit_euler", 1)
    start, run = variant(flying, setting), variant(flying, setting)
    reference = follow(run, start, 5)
    displace(start, np.full(2, 0.6 * size), np.full(2, 0.8 * size))
    errors = errors_of([(follow(run, start, 5), reference)])
    assert errors.position_rms == pytest.approx(size, rel=1e-9)
    assert errors.position_max == pytest.approx(size, rel=1e-9)
    assert (errors.peak_force, errors.impulse, errors.energy) == (0.0, 0.0, 0.0)


@pytest.mark.parametrize(("late", "counts"), [(0.001, False), (0.0022, True)])
def test_an_impact_that_the_horizon_cuts_off_is_compared_as_a_whole(late: float, counts: bool) -> None:
    """One that comes after the horizon, yet within a tick of it, is not missing; one that comes later is."""
    brief = head_on(contacts=[contact(stiffness_for(1e-4, 0.1))])
    setting = Setting("semi_implicit_euler", 400)
    start, run = variant(brief, setting), variant(brief, setting)
    start.advance(30)
    # Over at 31.4 ticks in one, at 32.4 or 33.6 in the other; the horizon ends at 32.
    reference = follow(run, start, 3)
    displace(start, np.array([-SPEED * late, 0.0]), np.zeros(2))
    errors = errors_of([(follow(run, start, 3), reference)])
    assert (errors.peak_force > 0.5) == counts
    assert (errors.impulse > 0.5) == counts


@pytest.mark.parametrize(
    ("law", "work"),
    [
        ({"stiffness": 4e3}, lambda d: 0.5 * 4e3 * d**2),
        ({"hertz_stiffness": 1e5}, lambda d: 0.4 * 1e5 * d**2.5),
        ({"table": [[1e-3, 2.0], [3e-3, 4.0]]}, lambda d: 1e-3 + (2.0 + 0.5 * 1e3 * (d - 1e-3)) * (d - 1e-3)),
    ],
    ids=["linear", "hertz", "table"],
)
@pytest.mark.parametrize("overlap", [2e-3, 5e-3])
def test_elastic_energy_is_the_work_of_the_law(law: dict[str, Any], work: Any, overlap: float) -> None:
    """Shared by two bottles, with the one at a rail the rail's; kinetic energy beside it."""
    still = scene(
        contacts=[
            {"between": ["glass", "glass"], **law},
            {"between": ["glass", "steel"], **law},
        ],
        rails={"rail": segment((-1.0, 1.0), (1.0, 1.0))},
        bottles=[bottle(0.0, 0.0, 0.3, 0.4), bottle(0.2, 0.0), bottle(0.0, 0.9)],
        **NO_FLOOR,
    )
    simulation = Simulation(still, threads=1)
    displace(simulation, np.array([0.0, -0.07 - overlap, 0.0]), np.array([0.0, 0.0, 0.035 + overlap]))
    found = energies(simulation.model, simulation.bottles(), simulation.contacts())
    expected = [0.5 * 0.2 * 0.25 + 0.5 * work(overlap), 0.5 * work(overlap), work(overlap)]
    np.testing.assert_allclose(found, expected, rtol=1e-9)


def test_candidates_begin_with_the_scenes_own_and_go_round_the_standard() -> None:
    chosen = head_on(tick=0.01, duration=0.1, accuracy={"integrator": "velocity_verlet", "per_tick": 37})
    standard = standard_steps(chosen)
    settings = candidates(chosen)
    assert settings[0] == own_setting(chosen) == Setting("velocity_verlet", 37)
    assert len(settings) == len(set(settings))
    for integrator in ("leapfrog", "velocity_verlet", "rk4"):
        assert Setting(integrator, standard) in settings
        assert Setting(integrator, 8 * standard) in settings
    # Without a belt that turns it gives the bits of leapfrog.
    assert "semi_implicit_euler" not in {setting.integrator for setting in settings}
    soft = {setting.stiffness: setting.per_tick for setting in settings if setting.stiffness != 1.0}
    # Contacts twice, four, and eight times as long.
    for factor, steps in soft.items():
        assert steps == pytest.approx(standard * math.sqrt(factor), abs=1.0)


@pytest.mark.parametrize("e", [0.3, 0.9])
def test_softer_contacts_rebound_as_before(e: float) -> None:
    """A restitution that is given stays what it is."""
    damped = head_on(contacts=[{**contact(K), "damping": {"law": "normal", "restitution": e}}])
    for setting in softer(damped):
        assert with_setting(damped, setting).contacts[0].damping.restitution == e
    numbers = [setting.per_tick for setting in softer(damped)]
    assert numbers == sorted(numbers, reverse=True)


def test_integrators_that_effects_forbid_are_left_out_and_named() -> None:
    sprung = head_on(contacts=[contact(K, friction=0.1, tangential={"stiffness": K})])
    reasons = forbidden(sprung)
    assert reasons.keys() == {"dormand_prince", "linearly_implicit", "impulses"}
    assert "tangential" in reasons["dormand_prince"]
    assert {setting.integrator for setting in candidates(sprung)} == {"leapfrog", "velocity_verlet", "rk4"}
    assert reference_setting(sprung).integrator == "velocity_verlet"
    assert reference_setting(sprung).per_tick >= 32 * standard_steps(sprung)


def test_implicit_friction_has_an_explicit_reference() -> None:
    implicit = head_on(contacts=[contact(K, friction=0.1)], friction_solver="implicit")
    expected = {"leapfrog", "velocity_verlet", "rk4", "impulses"}
    assert {setting.integrator for setting in candidates(implicit)} == expected
    assert reference_setting(implicit).integrator == "dormand_prince"


def test_costs_leave_the_state_as_it_was() -> None:
    flying = head_on()
    settings = [Setting("semi_implicit_euler", n) for n in (1, 2)]
    state = variant(flying, settings[0])
    before = state.state_hash()
    seen: list[float] = []
    costs = costs_of(
        {setting: variant(flying, setting) for setting in settings}, state, 0.0, lambda done, whole: seen.append(done)
    )
    assert set(costs) == set(settings)
    assert state.state_hash() == before
    assert seen == [1, 2, 3, 4, 5, 6]
