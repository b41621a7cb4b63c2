# SPDX-License-Identifier: Apache-2.0
"""Table of routes and stretches."""

from __future__ import annotations

from rich.box import SIMPLE
from rich.console import Group, RenderableType
from rich.table import Table

from conveyor_sim.report.flow.exit_findings import ending
from conveyor_sim.report.flow.flow import LineFlow
from conveyor_sim.scene import Scene
from conveyor_sim.scene.problems import dotted
from conveyor_sim.support.printable import printable


def flow_table(scene: Scene, flow: LineFlow) -> RenderableType:
    """Return the routes of lone bottles, the stretches that they pass, and the bottleneck."""
    routes = Table(box=SIMPLE)
    for heading in ("route", "transit (s)", "way (m)", "end"):
        routes.add_column(heading, justify="right" if "(" in heading else "left", overflow="fold")
    for route in flow.routes:
        way = " -> ".join(printable(dotted(stop)) for stop in route.stops)
        end = "" if route.last.end == "exit" else ending(route.last, flow.surfaces)
        if route.traced is not None:
            end = f"{end} (estimated by belt speeds after {route.traced:.3g} m)".strip()
        routes.add_row(way, f"{route.seconds:.2f}", f"{route.length:.2f}", end)
    stretches = Table(box=SIMPLE)
    for heading in ("stretch", "", "length (m)", "width (m)", "bottles", "bottles/s"):
        stretches.add_column(heading, justify="left" if heading in ("stretch", "") else "right", overflow="fold")
    for stretch in flow.stretches:
        stretches.add_row(
            printable(stretch.name),
            "single file" if stretch.single else "wide",
            f"{stretch.length:.2f}",
            f"{stretch.width:.3f}",
            f"{stretch.capacity:.0f}",
            f"{stretch.rate:.3g}",
        )
    parts: list[RenderableType] = [routes, stretches] if flow.routes else ["flow: nothing to trace"]
    if flow.bottleneck is not None:
        parts.append(f"bottleneck: {printable(flow.bottleneck.name)}, {flow.bottleneck.rate:.3g} bottles/s")
    return Group(*parts)
