# SPDX-License-Identifier: Apache-2.0
"""Force in one contact: each law by itself, and their sums."""

import math
from typing import Any

import numpy as np
import pytest
from worlds import callable_part

from conveyor_sim.engine.arrays.contacts import ContactLaw, Curves
from conveyor_sim.engine.contact.contact import carried as carried_part
from conveyor_sim.engine.contact.contact import contact_force as contact_force_part
from conveyor_sim.engine.contact.contact import spring_after as spring_after_part

carried = callable_part(carried_part)
contact_force = callable_part(contact_force_part)
spring_after = callable_part(spring_after_part)

K, C, MU, LIMIT = 5000.0, 2.0, 0.3, 0.01
K_HERTZ = 3e6
LINE = Curves(np.array([0, 2], np.uint32), np.array([0.0, 0.01]), np.array([0.0, 0.01 * K]))


def law(**columns: float) -> ContactLaw:
    """Return a law with coefficients in entry 1 of two, without columns for other laws."""
    flat: dict[str, Any] = dict.fromkeys(ContactLaw._fields)
    for name, value in columns.items():
        flat[name] = np.array([-1.0, value]) if name != "curve" else np.array([-1, value], np.int32)
    return ContactLaw(**flat)


def force(
    overlap: float, closing: float = 0.0, slip: float = 0.0, share: float = 1.0, *,
    curves: Any = None, atan: Any = None, spring: Any = None, implicit: Any = None, **columns: float,
) -> tuple[float, float]:  # fmt: skip
    return contact_force(
        law(**(columns or {"stiffness": K})), np.uint64(1), curves, LIMIT, atan, overlap, share, closing, slip, spring,
        implicit,
    )  # fmt: skip


def test_the_linear_spring_alone() -> None:
    """N = k delta (23), times the share of the contact; nothing along the tangent."""
    assert force(0.002, closing=0.5, slip=1.0) == (K * 0.002, 0.0)
    assert force(0.002, share=0.25) == (K * 0.002 * 0.25, 0.0)


def test_hertz() -> None:
    """N = k_h delta^1.5, with the power from square roots alone."""
    for overlap in (1e-9, 1e-4, 0.002):
        assert force(overlap, 0.5, 1.0, hertz=K_HERTZ) == (pytest.approx(K_HERTZ * overlap**1.5, rel=1e-15), 0.0)


def test_a_table_that_is_a_line_is_the_linear_spring() -> None:
    """A table with the points of a line gives the same force, damping and friction included."""
    for overlap in (0.0, 0.002, 0.03):
        expected = force(overlap, 0.5, 0.3, stiffness=K, damping_normal=C, friction=MU)
        assert force(overlap, 0.5, 0.3, curves=LINE, curve=0, damping_normal=C, friction=MU) == pytest.approx(expected)


def test_elastic_laws_of_other_pairs_add_nothing() -> None:
    """A pair has one elastic law; the columns of the others hold 0, or -1 for a table."""
    mixed = force(0.002, stiffness=K, hertz=0.0, curve=-1, curves=LINE)
    assert mixed == force(0.002)


def test_paper_damping_is_isotropic_and_not_clamped() -> None:
    """-c v* (22) acts against the slip, too, and pulls at the end of a rebound."""
    paper = {"stiffness": K, "damping_paper": C}
    assert force(0.002, 0.5, -0.4, **paper) == (pytest.approx(K * 0.002 + C * 0.5), pytest.approx(C * 0.4))
    assert force(0.0001, -0.5, **paper)[0] == pytest.approx(K * 0.0001 - C * 0.5)
    assert force(0.0001, -0.5, **paper)[0] < 0.0


def test_normal_damping() -> None:
    """N = k delta + c v_n, and no force along the tangent."""
    assert force(0.002, 0.5, -0.4, stiffness=K, damping_normal=C) == (pytest.approx(K * 0.002 + C * 0.5), 0.0)


def test_tsuji_damping() -> None:
    """N = k_h delta^1.5 + c delta^0.25 v_n (Tsuji et al. 1992)."""
    expected = K_HERTZ * 0.002**1.5 + C * 0.002**0.25 * 0.5
    assert force(0.002, 0.5, -0.4, hertz=K_HERTZ, damping_tsuji=C) == (pytest.approx(expected), 0.0)


@pytest.mark.parametrize("elastic", [{"stiffness": K}, {"hertz": K_HERTZ}])
def test_onset_damping(elastic: dict[str, float]) -> None:
    """N = N_elastic (1 + lambda v_n) (Hunt and Crossley 1975): it starts at zero, with any elastic law."""
    bare = force(0.002, **elastic)[0]
    assert force(0.002, 0.5, -0.4, damping_onset=0.8, **elastic) == (pytest.approx(bare * (1.0 + 0.8 * 0.5)), 0.0)
    assert force(1e-12, 0.5, damping_onset=0.8, **elastic)[0] < 1e-7


@pytest.mark.parametrize("damping", ["damping_normal", "damping_tsuji", "damping_onset"])
def test_damping_that_never_pulls(damping: str) -> None:
    """For all laws but the paper's, the total normal force is clamped at 0, and friction with it."""
    assert force(1e-5, -80.0, 0.3, stiffness=K, friction=MU, **{damping: C}) == (0.0, 0.0)


@pytest.mark.parametrize("slip", [-0.5, 0.5])
def test_friction_acts_against_the_slip_with_the_damped_normal_force(slip: float) -> None:
    """T = -mu N p(s) s/|s|, N with its damping."""
    normal, tangential = force(0.002, 0.5, slip, stiffness=K, friction=MU, damping_normal=C)
    assert tangential == pytest.approx(-MU * normal * (1.0 if slip > 0.0 else -1.0))
    below = 0.4 * LIMIT
    p = 2 * 0.4 - 0.4**2
    assert force(0.002, slip=below, stiffness=K, friction=MU)[1] == pytest.approx(-MU * K * 0.002 * p)
    p = 2.0 / math.pi * math.atan(0.4 * math.pi)
    assert force(0.002, slip=below, atan=1, stiffness=K, friction=MU)[1] == pytest.approx(-MU * K * 0.002 * p)


def test_a_contact_that_pulls_has_no_friction() -> None:
    """Coulomb's law uses the clamped normal force; the paper's damping continues along the tangent."""
    normal, tangential = force(0.0001, -0.5, 0.3, stiffness=K, friction=MU, damping_paper=C)
    assert normal < 0.0
    assert tangential == pytest.approx(-C * 0.3)


def test_both_dampings_in_one_table() -> None:
    """A pair of materials has one law; the other's coefficient is 0 in the table and changes nothing."""
    clamped = force(0.002, 0.5, 0.3, stiffness=K, friction=MU, damping_normal=C)
    assert force(0.002, 0.5, 0.3, stiffness=K, friction=MU, damping_paper=0.0, damping_normal=C) == clamped
    paper = force(0.0001, -0.5, 0.3, stiffness=K, friction=MU, damping_paper=C)
    assert force(0.0001, -0.5, 0.3, stiffness=K, friction=MU, damping_paper=C, damping_normal=0.0) == paper


def test_a_share_scales_the_whole_law() -> None:
    """Two collinear pieces that halve one contact push as one, for any law."""
    columns = {"hertz": K_HERTZ, "damping_tsuji": C, "friction": MU, "tangential_stiffness": 400.0}
    whole = force(0.002, 0.5, 1e-3, spring=1e-4, **columns)
    half = force(0.002, 0.5, 1e-3, 0.5, spring=1e-4, **columns)
    assert (2.0 * half[0], 2.0 * half[1]) == pytest.approx(whole)


def test_implicit_friction_takes_the_slip_after_the_step() -> None:
    """T dt/m_t is the loss of slip: s + b v_lim p(s) = s_0 with mu N p(s) = -T."""
    compliance, slip = 5e-4, 0.6 * LIMIT
    columns = {"stiffness": K, "friction": MU, "damping_normal": C}
    normal, tangential = force(0.002, 0.5, slip, implicit=(compliance, 0.0, slip), **columns)
    after = slip + compliance * tangential
    assert 0.0 < after < slip
    assert -tangential == pytest.approx(MU * normal * (2.0 * after / LIMIT - (after / LIMIT) ** 2))


@pytest.mark.parametrize("compliance", [1e-6, 5e-4, 1.0])
def test_implicit_friction_keeps_a_steady_slip(compliance: float) -> None:
    """Started from the friction of that slip, the solver returns it: creep does not depend on the step."""
    slip, columns = 0.02 * LIMIT, {"stiffness": K, "friction": MU}
    normal, explicit = force(0.002, 0.0, slip, **columns)
    start = slip - compliance * explicit
    assert force(0.002, 0.0, slip, implicit=(compliance, 0.0, start), **columns)[1] == pytest.approx(explicit, rel=1e-9)
    assert abs(explicit) < 0.1 * MU * normal


def test_implicit_friction_of_a_small_ease_is_the_explicit_one() -> None:
    """Up to b = at_once friction uses the present slip; beyond, it looks ahead by the excess of b."""
    slip = 0.6 * LIMIT
    columns = {"stiffness": K, "friction": MU}
    normal, explicit = force(0.002, 0.0, slip, **columns)
    one = LIMIT / (MU * normal)
    assert force(0.002, 0.0, slip, implicit=(0.5 * one, 0.5, slip), **columns)[1] == pytest.approx(explicit, rel=1e-14)
    ahead = force(0.002, 0.0, slip, implicit=(1.5 * one, 0.5, slip), **columns)
    assert ahead == force(0.002, 0.0, slip, implicit=(one, 0.0, slip), **columns)


def test_the_tangential_spring_holds_up_to_coulombs_limit() -> None:
    """T = -(k_t xi + c_t s), at most mu N in size; a pair without a spring uses the friction curve."""
    spring = {"stiffness": K, "friction": MU, "tangential_stiffness": 4000.0, "tangential_damping": 6.0}
    assert force(0.002, slip=0.01, spring=2e-4, **spring)[1] == pytest.approx(-(4000.0 * 2e-4 + 6.0 * 0.01))
    assert force(0.002, slip=0.0, spring=-2e-4, **spring)[1] == pytest.approx(4000.0 * 2e-4)
    for xi in (-0.1, 0.1):
        assert force(0.002, spring=xi, **spring)[1] == pytest.approx(-math.copysign(MU * K * 0.002, xi))
    without = {**spring, "tangential_stiffness": 0.0, "tangential_damping": 0.0}
    assert force(0.002, slip=0.004, spring=0.1, **without) == force(0.002, slip=0.004, stiffness=K, friction=MU)


def test_the_spring_goes_with_the_slip_and_no_further_than_it_can_hold() -> None:
    """The elongation is xi + dt s, cut to mu N/k_t while the contact slides, and reset without a normal force."""
    spring = law(friction=MU, tangential_stiffness=4000.0)
    assert spring_after(spring, 1, 1e-4, 0.002, 0.02, 1e-3, 10.0, 1.0) == pytest.approx(1e-4 + 0.02 * 1e-3)
    for sign in (-1.0, 1.0):
        assert spring_after(spring, 1, sign * 1e-4, 0.002, sign * 5.0, 1e-3, 10.0, 1.0) == pytest.approx(
            sign * MU * 10.0 / 4000.0
        )
    assert spring_after(spring, 1, 1e-4, 0.002, 0.02, 1e-3, 0.0, 1.0) == 0.0
    assert spring_after(spring, 1, 1e-4, 0.002, 0.02, 1e-3, -3.0, 1.0) == 0.0
    assert spring_after(law(friction=MU, tangential_stiffness=0.0), 1, 1e-4, 0.002, 0.02, 1e-3, 10.0, 1.0) == 0.0
    # Implicit friction at rails keeps a history for pairs, too, which may be without friction.
    assert spring_after(law(stiffness=K), 1, 0.0, 0.002, 0.02, 1e-3, 10.0, 1.0) == 0.0


MINDLIN = {"hertz": K_HERTZ, "friction": MU, "tangential_stiffness": 0.0, "tangential_mindlin": 1.2 * K_HERTZ}


def test_mindlins_spring_stiffens_with_the_overlap() -> None:
    """k_t = 0.8 dN/d delta, for 1.5 x 0.8 = 1.2; a pair of the scene without it uses the friction curve."""
    for overlap in (0.0005, 0.002):
        normal = K_HERTZ * overlap**1.5
        assert force(overlap, spring=1e-5, **MINDLIN)[1] == pytest.approx(-0.8 * 1.5 * normal / overlap * 1e-5)
        assert force(overlap, spring=1.0, **MINDLIN)[1] == pytest.approx(-MU * normal)
    without = {**MINDLIN, "tangential_mindlin": 0.0}
    assert force(0.002, slip=0.004, spring=0.1, **without) == force(0.002, slip=0.004, hertz=K_HERTZ, friction=MU)


def test_a_spring_that_stiffens_keeps_its_force_and_one_that_softens_its_elongation() -> None:
    """So a spring never gains energy by itself, and is without load when a contact begins."""
    mindlin, xi = law(**MINDLIN), 1e-5
    depth, before, after = 0.0020, 0.0019, 0.0021
    stiffer = carried(mindlin, 1, xi, depth, depth - before, 0.0)
    assert stiffer * math.sqrt(depth) == pytest.approx(xi * math.sqrt(before))
    # The force grows by the mean stiffness times the displacement.
    way = 3e-6
    force_after = (carried(mindlin, 1, xi, depth, depth - before, way) + way) * math.sqrt(depth)
    mean = 0.5 * (math.sqrt(before) + math.sqrt(depth))
    assert force_after == pytest.approx(xi * math.sqrt(before) + way * mean)
    # k_t xi^2, with the force k_t xi as before.
    assert math.sqrt(depth) * stiffer**2 < math.sqrt(before) * xi**2
    assert carried(mindlin, 1, xi, depth, depth - after, 1e-5) == xi
    assert carried(mindlin, 1, xi, depth, 2.0 * depth, 0.0) == 0.0
    assert carried(mindlin, 1, xi, depth, 0.0, 1e-5) == xi
    other = law(**{**MINDLIN, "tangential_stiffness": 4000.0, "tangential_mindlin": 0.0})
    assert carried(other, 1, xi, depth, 1e-4, 1e-5) == xi


EVERYTHING = {
    "stiffness": K, "hertz": K_HERTZ, "damping_paper": C, "damping_normal": C, "damping_tsuji": C, "damping_onset": C,
    "friction": MU, "tangential_stiffness": 4000.0, "tangential_mindlin": 3e5, "tangential_damping": 6.0,
}  # fmt: skip


@pytest.mark.parametrize("overlap", [0.0, -0.0, -1e-300, -0.004])
def test_apart_there_is_no_force_at_all(overlap: float) -> None:
    """Every law gives exactly 0, at any velocities, because loops add it up for all listed pairs."""
    for closing in (-3.0, 0.0, 3.0):
        for slip in (-3.0, 0.0, 1e-3):
            assert force(overlap, closing, slip, **EVERYTHING, spring=0.01, implicit=(1e-3, 0.5, slip)) == (0.0, 0.0)
            assert force(overlap, closing, slip, **EVERYTHING, spring=0.01, atan=1) == (0.0, 0.0)


def test_what_is_not_a_number_stays_visible() -> None:
    """No clamp hides a NaN."""
    for arguments in ((math.nan, 0.1, 0.1), (0.001, math.nan, 0.1)):
        assert math.isnan(force(*arguments, **EVERYTHING, spring=0.01, implicit=(1e-3, 0.5, 0.1))[0])
    assert math.isnan(force(0.001, 0.1, math.nan, **EVERYTHING, spring=0.01, implicit=(1e-3, 0.5, math.nan))[1])


@pytest.mark.parametrize("share", [0.2, 0.5, 1.0])
def test_a_share_of_a_contact_slides_at_mu_times_what_it_presses_with(share: float) -> None:
    """After a long slip the spring holds mu N of that share."""
    coefficients = {"stiffness": K, "friction": MU, "tangential_stiffness": 4000.0}
    normal = force(0.002, share=share, **coefficients)[0]
    held = spring_after(law(**coefficients), 1, 0.0, 0.002, 1.0, 1.0, normal, share)
    assert force(0.002, share=share, spring=held, **coefficients)[1] == pytest.approx(-MU * normal, rel=1e-12)
