# SPDX-License-Identifier: Apache-2.0
"""The limit of overlaps is that of the committed results of docs/studies/stiffness_throughput."""

import pytest
from study_page import load_study

from conveyor_sim.physics.timestep.prediction import DEEP

COMPARE = load_study("stiffness_throughput/compare")
OTHERS = ("implicit", "impulses")
"""Settings whose flow differs by more than their overlaps: docs/accuracy.md has their tables."""
POINTS = [point for point in COMPARE.points() if not point.setting.startswith(OTHERS)]


@pytest.mark.parametrize("scene", ["funnel", "combiner", "paper_plant"])
def test_the_flow_agrees_up_to_the_limit(scene: str) -> None:
    own = [point for point in POINTS if point.scene == scene]
    reference = COMPARE.reference_of(own)
    shallow = [point for point in own if COMPARE.overlap(point) <= 1.05 * DEEP and not COMPARE.is_stiff(point)]
    assert shallow
    assert [point[:4] for point in shallow if not COMPARE.agrees(point, reference)] == []


def test_beyond_the_limit_a_flow_differs() -> None:
    """The stiffest point of the combiner beyond the limit differs from the reference."""
    own = [point for point in POINTS if point.scene == "combiner" and point.setting == "draft"]
    reference = COMPARE.reference_of(own)
    deep = [point for point in own if COMPARE.overlap(point) > DEEP]
    assert min(COMPARE.overlap(point) for point in deep) < 2.0 * DEEP
    differing = [point for point in deep if not COMPARE.agrees(point, reference)]
    assert min(deep, key=COMPARE.overlap) in differing
    assert min(differing, key=COMPARE.overlap).stiffness == max(point.stiffness for point in deep)


def test_soft_contacts_raise_the_throughput_of_the_funnel() -> None:
    own = [point for point in POINTS if point.scene == "funnel" and point.setting == "draft"]
    softest, reference = min(own, key=lambda point: point.stiffness), COMPARE.reference_of(own)
    seeds = sorted(softest.runs)
    ratio = COMPARE.values(softest, "throughput", seeds).mean() / COMPARE.values(reference, "throughput", seeds).mean()
    assert ratio > 1.8
