# SPDX-License-Identifier: Apache-2.0
"""Commands on drawings: import, draw."""

from __future__ import annotations

from pathlib import Path
from typing import Final

import click

from conveyor_sim.cli.scene_options import SceneOptions, scene_options
from conveyor_sim.errors import ConveyorError

_LONGEST_GAP: Final = 0.1  # m


@click.command("import")
@click.argument("plan", type=click.Path(path_type=Path))
@click.option("--layers", is_flag=True, help="Print the layers of PLAN as a map to start from, and end.")
@click.option("--map", "map_", type=click.Path(path_type=Path), help="What each layer stands for (YAML).")
@click.option("-o", "--out", type=click.Path(path_type=Path), help="Scene file to write.")
@click.option("--base", type=click.Path(path_type=Path), help="Scene that the parts are added to: types, materials.")
@click.option(
    "--unit", type=click.Choice(["mm", "cm", "dm", "m", "in", "ft", "yd"]), help="Unit of PLAN, if it names none."
)
@click.option("--join", metavar="LENGTH", default="0 mm", help="Close gaps in conveyors up to this length: '5 mm'.")
def import_(
    plan: Path, layers: bool, map_: Path | None, out: Path | None, base: Path | None, unit: str | None, join: str
) -> None:
    """Write a scene from PLAN, a DXF file.

    Conveyors, rails and devices are what the map says of their layers. What could not be used is listed.
    """
    if layers:
        _print_layers(plan)
        return
    if map_ is None or out is None:
        missing = "--map" if map_ is None else "--out"
        raise ConveyorError(f"no {missing} given, expected --map and --out; --layers prints a map to start from")
    from conveyor_sim.page.drawings.entities import read_plan
    from conveyor_sim.page.drawings.importing import imported
    from conveyor_sim.page.drawings.layer_map import read_map
    from conveyor_sim.page.drawings.listing import skipped_lines
    from conveyor_sim.page.drawings.scene_text import scene_text
    from conveyor_sim.support.files import FileError, write_file

    rules = read_map(map_)
    drawn = read_plan(plan, unit, rules.is_symbol)
    result = imported(drawn, rules, _gap(join))
    for line in skipped_lines(result.skipped):
        click.echo(line)
    for note in result.notes:
        click.echo(f"note: {note}")
    if not any(result.sections.values()):
        if rules.ignores_all:
            raise ConveyorError(f"{map_}: every layer is ignored, expected another kind than ignore for one at least")
        raise ConveyorError(f"{plan}: no entity became a part, expected entities on the layers of {map_}")
    text = scene_text(result.sections, f"From {plan.name} (drawn in {drawn.unit}) by the map {map_.name}.", base)
    try:
        write_file(out, text.encode())
    except FileError as error:
        raise ConveyorError(f"{out}: {error}") from None
    counts = ", ".join(f"{len(parts)} {section}" for section, parts in result.sections.items() if parts)
    click.echo(f"wrote {out}: {counts} (unit of the drawing: {drawn.unit})")


def _print_layers(plan: Path) -> None:
    from conveyor_sim.page.drawings.dxf_file import open_dxf
    from conveyor_sim.page.drawings.layer_list import map_lines
    from conveyor_sim.support.files import FileError

    try:
        document = open_dxf(plan)
    except FileError as error:
        raise ConveyorError(f"{plan}: {error}, expected a DXF file") from None
    for line in map_lines(document):
        click.echo(line)


def _gap(text: str) -> float:
    """Return the length (m) of the option --join. Raise ConveyorError."""
    from conveyor_sim.scene.quantities import to_si

    try:
        length = to_si(text, "m")
    except ValueError as error:
        raise ConveyorError(f"--join {text}: {error}") from None
    if not 0.0 <= length <= _LONGEST_GAP:
        raise ConveyorError(f"--join {text}: expected a length from 0 to {1e3 * _LONGEST_GAP:g} mm")
    return length


@click.command()
@click.argument("scene")
@click.option("--dxf", type=click.Path(path_type=Path), help="DXF file to write, in mm.")
@click.option("--svg", type=click.Path(path_type=Path), help="SVG file to write, in mm.")
@scene_options
def draw(scene: str, dxf: Path | None, svg: Path | None, options: SceneOptions) -> None:
    """Write the plan of SCENE: belts, rails and devices, with their names, on layers."""
    from conveyor_sim.page.drawings.dxf_plan import dxf_of
    from conveyor_sim.page.drawings.plan import plan_of
    from conveyor_sim.page.drawings.svg_plan import svg_of
    from conveyor_sim.support.files import FileError, write_file

    if dxf is None and svg is None:
        raise ConveyorError("neither --dxf nor --svg given, expected one of them")
    loaded = options.load(scene)
    shapes = plan_of(loaded)
    for file, make in ((dxf, dxf_of), (svg, lambda drawn: svg_of(drawn, loaded.name))):
        if file is not None:
            try:
                write_file(file, make(shapes))
            except FileError as error:
                raise ConveyorError(f"{file}: {error}") from None
            click.echo(f"drawn to {file}")
