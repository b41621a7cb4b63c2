# SPDX-License-Identifier: Apache-2.0
"""Flow through a scene: traces, routes, stretches and findings."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

from conveyor_sim.page.drawings.underlay import shown_underlay
from conveyor_sim.report.flow.belt_findings import backward_belts, opposed_belts, transfer_gaps, watchdogs
from conveyor_sim.report.flow.clearance import clearance
from conveyor_sim.report.flow.device_findings import devices_beside, devices_reversed
from conveyor_sim.report.flow.exit_findings import perfect_columns, unreached_exits
from conveyor_sim.report.flow.finding import Finding
from conveyor_sim.report.flow.guide_findings import guide_gaps, narrow_passages
from conveyor_sim.report.flow.guides import Guides
from conveyor_sim.report.flow.routes import TransitRoute, routes_of
from conveyor_sim.report.flow.stretches import Bottleneck, Stretch, bottleneck, stretches_of
from conveyor_sim.report.flow.surfaces import SurfaceMap, surfaces_of
from conveyor_sim.report.flow.trace import trace, traced_scene
from conveyor_sim.report.flow.trace_scene import guide_pieces
from conveyor_sim.report.flow.wheel_findings import wrong_phases
from conveyor_sim.report.flow.wheels_as_belts import pitches_of, with_wheels_as_belts
from conveyor_sim.run.compilation import Compilation
from conveyor_sim.scene.schema import Scene


def hidden_underlay(scene: Scene) -> Iterator[Finding]:
    """Yield a finding for an underlay that can't be shown."""
    shown = shown_underlay(scene)
    if isinstance(shown, str):
        yield Finding(("underlay", "file"), shown)


@dataclass(frozen=True)
class LineFlow:
    """Flow of bottles through a scene."""

    surfaces: SurfaceMap
    routes: tuple[TransitRoute, ...]
    stretches: tuple[Stretch, ...]
    bottleneck: Bottleneck | None
    findings: tuple[Finding, ...]
    """Warnings in order of weight, then notes."""


def compile_traces(scene: Scene, say: Callable[[str], object]) -> None:
    """Bring the kernels of traces into this process. say: called with a sentence if they must be compiled.

    Ctrl-C interrupts it within a moment.
    """
    scene = with_wheels_as_belts(scene)
    traced = traced_scene(scene, surfaces_of(scene))
    if traced is not None:
        Compilation(traced, say).run()


def flow_of(scene: Scene) -> LineFlow:
    """Trace a lone bottle from every entry of a scene, and return routes, capacities and findings."""
    wheels, pitches = list(wrong_phases(scene)), pitches_of(scene)
    scene = with_wheels_as_belts(scene)
    surfaces = surfaces_of(scene)
    guides = Guides(guide_pieces(scene))
    legs = trace(scene, surfaces, guides)
    clearances = [clearance(leg, surfaces, guides) for leg in legs]
    routes = routes_of(scene, legs)
    stretches = stretches_of(legs, clearances, surfaces, pitches)
    findings = [
        *unreached_exits(scene, surfaces, routes),
        *opposed_belts(surfaces),
        *narrow_passages(scene, surfaces, guides, legs),
        *transfer_gaps(scene, surfaces, legs),
        *devices_beside(scene, surfaces),
        *devices_reversed(scene, surfaces, legs),
        *guide_gaps(scene, surfaces, guides, legs, clearances),
        *perfect_columns(scene, surfaces, legs, clearances),
        *watchdogs(scene),
        *backward_belts(scene, surfaces),
        *wheels,
        *hidden_underlay(scene),
    ]
    return LineFlow(surfaces, routes, stretches, bottleneck(scene, routes, stretches), tuple(findings))
