# SPDX-License-Identifier: Apache-2.0
"""Impacts of the benchmarks of Chung and Ooi (2011) against Hertz's peak force and the impulse of sliding contacts."""

import math
from typing import Any

import pytest
from published.studies import module, source

IMPACTS = module("chung_ooi_2011")


def impact(**case: Any) -> Any:
    """Return the results of one impact with half of the study's steps."""
    return source("chung_ooi_2011").simulate({"restitution": 1.0, "angle": 0.0, "steps": 2000, **case})


@pytest.mark.parametrize(("kind", "material"), [("pair", "glass"), ("plane", "magnesium alloy")])
def test_peak_force_and_rebound_of_an_elastic_impact(kind: str, material: str) -> None:
    sphere = {**IMPACTS.PAIRS, **IMPACTS.PLANES}[material]
    _, peak, _ = IMPACTS.hertz(sphere, kind == "pair")
    result = impact(**{"with": kind, "material": material})
    assert result["peak"] == pytest.approx(peak, rel=1e-5)
    assert result["rebound"] == pytest.approx(1.0, rel=1e-5)


def test_a_contact_that_slides_throughout() -> None:
    """dv_t = mu (1 + e) v_n, and a sphere gains 5/2 of that at its rim."""
    e, mu, angle = IMPACTS.OBLIQUE_RESTITUTION, IMPACTS.OBLIQUE_FRICTION, math.radians(60.0)
    result = impact(**{"with": "plane", "material": "aluminium oxide", "restitution": e, "angle": 60.0})
    change = mu * (1.0 + e) / math.tan(angle)
    assert result["rebound"] == pytest.approx(e, abs=1e-3)
    assert result["tangential"] == pytest.approx(1.0 - change, abs=1e-4)
    rim = abs(result["spin"]) * IMPACTS.OXIDE.radius / (IMPACTS.OBLIQUE_SPEED * math.sin(angle))
    assert rim == pytest.approx(2.5 * change, rel=1e-3)
