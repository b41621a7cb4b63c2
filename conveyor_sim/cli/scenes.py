# SPDX-License-Identifier: Apache-2.0
"""Commands on a scene: check, tags, explain."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from conveyor_sim.cli.output import line_width, say, show, show_json, show_lines
from conveyor_sim.cli.scene_options import SceneOptions, scene_options
from conveyor_sim.errors import ConveyorError
from conveyor_sim.support.progress import ProgressBar

if TYPE_CHECKING:
    from conveyor_sim.support.modbus_rows import WordOrder

LIMITS_WIDTH = 120
"""Characters of a line of the list of limits without a terminal."""


@click.command()
@click.argument("scene")
@click.option("--out", type=click.Path(path_type=Path), default=Path(), help="Folder for the picture (default: here).")
@click.option("--details", is_flag=True, help="List routes, stretches, effects, bounds and their reasons as well.")
@click.option("--watch", is_flag=True, help="Serve a page with plan and problems, redrawn whenever a file is saved.")
@click.option("--port", type=click.IntRange(0, 65535), help="With --watch: serve the page here (default: any).")
@scene_options
def check(scene: str, out: Path, details: bool, watch: bool, port: int | None, options: SceneOptions) -> None:
    """Validate SCENE, trace a bottle through it, and draw it.

    SCENE is a file, or the name of a shipped scene. Faults of its layout are listed with file and line.
    """
    from conveyor_sim.physics.model import build_model
    from conveyor_sim.physics.model.remedies import step_limit
    from conveyor_sim.report.explain.account import account
    from conveyor_sim.report.flow.details import flow_table
    from conveyor_sim.report.flow.flow import compile_traces, flow_of
    from conveyor_sim.report.flow.overview import finding_lines, overview
    from conveyor_sim.report.report import can_draw
    from conveyor_sim.report.tags import tag_rows
    from conveyor_sim.run.speed import expected
    from conveyor_sim.support.resources import scene_path

    path = scene_path(scene)
    if port is not None and not watch:
        raise ConveyorError("--port: given without --watch, expected both or neither")
    if watch:
        _watch(path, port or 0, options)
        return
    checked = options.load_file(path)
    model = build_model(checked)
    tag_rows(checked)  # which finds alarms of tags that there are not
    compile_traces(checked, say)
    flow = flow_of(checked)
    if details:
        show(account(checked, model))
        show(flow_table(checked, flow))
        lines = [*finding_lines(checked, model, flow), *expected(step_limit(checked))]
    else:
        lines = overview(checked, model, step_limit(checked), flow)
    for line in lines:
        click.echo(line)
    lists = f"--details lists {len(model.effects)} effects, {len(model.bounds)} bounds and their reasons"
    if not can_draw():
        click.echo(lists)
        return
    from conveyor_sim.report.figures.draw import plot_scene

    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ConveyorError(f"{out}: can't be made ({error.strerror}), expected a folder to draw into") from error
    drawn = f"drawn to {plot_scene(checked, out / f'{path.stem}.png')} and {path.stem}.svg"
    click.echo(drawn if details else f"{drawn}; {lists}")


def _watch(path: Path, port: int, options: SceneOptions) -> None:
    """Serve the page of a scene that is being written until Ctrl-C."""
    from conveyor_sim.page.check_server import CheckServer
    from conveyor_sim.report.check_page import CheckPage
    from conveyor_sim.support.stop_request import StopRequest

    page = CheckPage(path, options.load_file)
    with StopRequest() as stop, CheckServer(page.examine, port) as server:
        click.echo(f"{path}: {server.url} (Ctrl-C ends it)")
        stop.wait()


@click.command()
@click.argument("scene")
@click.option("--kind", "kinds", multiple=True, help="Only of this role or data type: command, bool, ...; repeatable.")
@click.option("--name", "names", multiple=True, help="Only these tags: belts/*, ...; repeatable.")
@click.option("--json", "as_json", is_flag=True, help="Print all properties of each tag as JSON.")
@click.option("--csv", "as_csv", is_flag=True, help="Print all properties of each tag as CSV.")
@click.option("--modbus", is_flag=True, help="Print the map of Modbus addresses of all tags as CSV.")
@click.option("--map", "kept", type=click.Path(path_type=Path), help="With --modbus: a map to keep, which only grows.")
@click.option("--word-order", type=click.Choice(["big", "little"]), default="big", help="Of Modbus: ABCD or CDAB.")
@click.option(
    "--controller", help="List its alarms as well: program.st, library.so, file.py:factory or module:factory."
)
@click.option("--parameters", default="", help="The controller's, by name: a mapping in YAML, or a .yaml file.")
@scene_options
def tags(
    scene: str,
    kinds: tuple[str, ...],
    names: tuple[str, ...],
    as_json: bool,
    as_csv: bool,
    modbus: bool,
    kept: Path | None,
    word_order: WordOrder,
    controller: str | None,
    parameters: str,
    options: SceneOptions,
) -> None:
    """List the tags of SCENE: signals, commands and faults, with units, ranges and meaning."""
    from conveyor_sim.cli.controller_options import controller_source
    from conveyor_sim.protocols.modbus.address_map import keep_map, modbus_map
    from conveyor_sim.report.tags import chosen_tags, line_tags, tag_csv, tag_listing, tag_objects
    from conveyor_sim.run.controller_tags import controller_tags
    from conveyor_sim.support.modbus_rows import to_csv

    given = [option for option, on in (("--json", as_json), ("--csv", as_csv), ("--modbus", modbus)) if on]
    if len(given) > 1:
        raise ConveyorError(f"{given[1]}: given with {given[0]}, expected one of them")
    if modbus and (kinds or names):
        raise ConveyorError("--modbus: given with --kind or --name, expected neither: the map has the addresses of all")
    source = controller_source(controller, parameters, ())
    if modbus and source is not None:
        raise ConveyorError("--modbus: given with --controller, expected one of them: its alarms have no addresses")
    loaded = options.load(scene)
    if modbus:
        tags = line_tags(loaded)
        rows = modbus_map(tags, word_order=word_order) if kept is None else keep_map(kept, tags, word_order)
        click.echo(to_csv(rows), nl=False)
        return
    chosen = chosen_tags(loaded, names, kinds, [] if source is None else controller_tags(loaded, source))
    if as_csv:
        click.echo(tag_csv(loaded, chosen), nl=False)
    elif as_json:
        show_json(tag_objects(loaded, chosen))
    else:
        show_lines(tag_listing(chosen, line_width()))


@click.command()
@click.argument("scene", required=False)
@click.option("--limits", is_flag=True, help="Print what the simulation does not model; needs no SCENE.")
@click.option(
    "--price",
    is_flag=True,
    help="Measure what each effect costs, in ns per bottle and step, and what each remedy saves.",
)
@click.option("--at", type=float, help="Simulated time in s at which to measure (default: half the duration).")
@scene_options
def explain(scene: str | None, limits: bool, price: bool, at: float | None, options: SceneOptions) -> None:
    """Explain effects and time step of SCENE.

    Lists why each effect is on or off, and what bounds the time step; with --price, what each effect costs; with
    --limits, what no scene models.
    """
    alone = limits and scene is None and not price and at is None
    if scene is None and not alone:
        raise ConveyorError("explain: no SCENE given, expected a scene file, or --limits alone")
    loaded = None if scene is None else options.load(scene)
    if limits:
        from conveyor_sim.physics.effects.limits import limits_text

        show_lines(limits_text(line_width() or LIMITS_WIDTH))
    if loaded is None:
        return
    from conveyor_sim.physics.model import build_model
    from conveyor_sim.report.explain.choices import explanation, price_table

    if at is not None and not price:
        raise ConveyorError(f"--at: {at:g} given, expected --price with it, for it is the time to measure at")
    if at is not None and not 0.0 < at <= loaded.duration:
        raise ConveyorError(
            f"--at: {at:g} given, expected a time greater than 0 and at most the duration, {loaded.duration:g} (s)"
        )
    show(explanation(loaded, build_model(loaded)))
    if not price:
        return
    from conveyor_sim.report.explain.effect_cost import Pricing
    from conveyor_sim.run.compilation import Compilation

    Compilation(loaded, say).run()
    pricing = Pricing(loaded, at)
    with ProgressBar(f"{loaded.name}, to a warm state", 0.0) as bar:
        pricing.warm_up(bar.update)
    with ProgressBar("compiling without each effect", 0.0, counted="variants") as bar:
        pricing.prepare(bar.update)
    with ProgressBar("with and without, in turn", 0.0, counted="measurements") as bar:
        prices = pricing.measure(bar.update)
    with ProgressBar("with what would take fewer steps", 0.0, counted="measurements") as bar:
        gains = pricing.gains(bar.update)
    show(price_table(prices))
    for gain in gains:
        click.echo(f"fewer steps: {gain.sentence}")
