# SPDX-License-Identifier: Apache-2.0
"""Edges of a photo-eye between two scans."""

from __future__ import annotations

import pytest
from control.scans import LENGTH, Beam

from conveyor_sim.control import Inputs
from conveyor_sim.control.edges import EyeEdges

Seen = tuple[int, int, float | None]


def seen(*scans: tuple[float, ...]) -> list[Seen]:
    """Return edges, rises and the fall before the last rise, after scans with edges at these times."""
    beam, edges, results = Beam("e"), EyeEdges("e"), []
    for tick, times in enumerate(((), *scans)):
        for time in times:
            beam.toggle(time)
        edges.read(Inputs(beam.signals(), tick * LENGTH, tick, LENGTH))
        results.append((edges.edges, edges.rises, edges.fell_before))
    return results[1:]


def test_one_edge_a_scan() -> None:
    assert seen((0.001,), (0.012,), (0.026,), ()) == [(1, 1, None), (1, 0, None), (1, 1, 0.012), (0, 0, 0.012)]


def test_a_bottle_that_goes_as_the_next_one_comes() -> None:
    assert seen((0.001,), (0.012, 0.015)) == [(1, 1, None), (2, 1, 0.012)]


def test_a_bottle_shorter_than_a_scan() -> None:
    assert seen((0.001, 0.003), (0.012, 0.015)) == [(2, 1, None), (2, 1, 0.003)]


@pytest.mark.parametrize(("times", "before"), [((0.021, 0.022, 0.023), 0.022), ((0.021, 0.022, 0.023, 0.024), None)])
def test_more_edges_than_the_eye_can_tell_of(times: tuple[float, ...], before: float | None) -> None:
    assert seen((0.001,), (0.011,), times)[-1] == (len(times), 2, before)


def test_an_eye_that_tells_late_is_counted_by_its_beam() -> None:
    edges = EyeEdges("e")
    rows = (
        (0, 0.0, 0.0, 0, 0),
        (0, 0.011, 0.0, 1, 1),
        (1, 0.011, 0.0, 1, 0),
        (1, 0.011, 0.035, 2, 0),
        (1, 0.046, 0.035, 3, 1),
    )
    for tick, (blocked, rose, fell, count, rises) in enumerate(rows):
        values = {"blocked": blocked, "rose": rose, "fell": fell, "edges": count}
        signals = {f"photo_eyes/e/{what}": value for what, value in values.items()}
        assert edges.read(Inputs(signals, tick * LENGTH, tick, LENGTH)).rises == rises
    assert edges.fell_before == 0.035
