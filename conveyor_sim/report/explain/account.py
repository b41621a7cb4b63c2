# SPDX-License-Identifier: Apache-2.0
"""Table of a scene: contents, effects, time step and expected errors."""

from __future__ import annotations

from rich.table import Table

from conveyor_sim.physics.model import Model
from conveyor_sim.report.explain.choices import accuracy_rows, note_rows
from conveyor_sim.scene import Scene
from conveyor_sim.support.printable import printable_lines


def account(scene: Scene, model: Model) -> Table:
    """Return a table with contents, effects and time step, each with its reason, and expected errors."""
    table = Table.grid(padding=(0, 2))
    fed = [f"{path[-1]} {'endless' if entry.most is None else entry.most}" for path, entry in scene.entries()]
    table.add_row("scene", ": ".join(filter(None, (model.name, printable_lines(scene.description)))))
    supply = f"; fed by {', '.join(fed)}" if fed else ""
    table.add_row("bottles", f"{len(model.plant.bottles)} at the start{supply}")
    table.add_row("belts", ", ".join(model.belts) or "none")
    if scene.plates:
        table.add_row("plates", ", ".join(scene.plates))
    table.add_row("rails", ", ".join(model.rails) or "none")
    table.add_row("duration", f"{scene.duration:g} s in {scene.duration_ticks} ticks of {scene.tick:g} s")
    for name, text in [*accuracy_rows(model), *note_rows(model)]:
        table.add_row(name, text)
    for index, bound in enumerate(model.bounds):
        table.add_row("" if index else "bounds", f"{bound.name}: at most {bound.dt:.3g} s, {bound.reason}")
    for effect in model.effects:
        table.add_row("effect", f"{effect.name} {'on' if effect.on else 'off'}: {effect.why}")
    return table
