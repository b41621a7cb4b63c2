# SPDX-License-Identifier: Apache-2.0
"""Commands on a recording: recover, replay, sources, events, alarms, report, plot."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import click

from conveyor_sim.cli.output import line_width, show_json, show_lines
from conveyor_sim.errors import ConveyorError
from conveyor_sim.support.printable import SENTENCE, printable
from conveyor_sim.support.progress import ProgressBar


@click.command()
@click.argument("bag", type=click.Path(path_type=Path))
def recover(bag: Path) -> None:
    """Verify a recording, and repair it.

    If BAG is damaged, or its recording was interrupted, a repaired copy takes its place; the original is kept.
    BAG may be the folder of inputs that a killed test has left: its run is simulated again, and recorded.
    """
    from conveyor_sim.run.recovery import recover_bag, recover_runs

    if not recover_runs(bag):
        recover_bag(bag)


@click.command()
@click.argument("bag", type=click.Path(path_type=Path))
@click.argument("ros_arguments", nargs=-1, type=click.UNPROCESSED, metavar="[-- --ros-args ...]")
@click.option("--publish", is_flag=True, help="Play the recording over ROS, with /clock, instead of simulating.")
@click.option("--rate", type=float, help="With --publish: recorded s per wall s, 0 for no limit (default: 1).")
@click.option("--start", type=float, help="With --publish: simulated time in s to begin at (default: its start).")
@click.option("--paused", is_flag=True, help="With --publish: wait until resumed, by the space key or the service.")
def replay(
    bag: Path,
    ros_arguments: tuple[str, ...],
    publish: bool,
    rate: float | None,
    start: float | None,
    paused: bool,
) -> None:
    """Simulate a recording again and compare.

    The commands in BAG are applied at their ticks, and every recorded state is compared. With --publish
    nothing is simulated: the recorded messages are published over ROS as the live node would.
    """
    if publish:
        _publish(bag, 1.0 if rate is None else rate, start, paused, ros_arguments)
        return
    given = {"--rate": rate is not None, "--start": start is not None, "--paused": paused, "--ros-args": ros_arguments}
    for option, is_given in given.items():
        if is_given:
            raise ConveyorError(f"{option}: given without --publish, expected both or neither")
    from conveyor_sim.bag.messages.topics import TOPICS
    from conveyor_sim.bag.replay import replay as replay_bag

    with ProgressBar(f"replay {bag}", 0.0) as bar:
        report = replay_bag(bag, bar.update)
    for sentence in report.environment:
        click.echo(f"not the same as in the recording: {printable(sentence, SENTENCE)}")
    within = TOPICS["bottles"].compare.within
    near = f"{within['x']:g} m, {within['vx']:g} m/s and {within['peak_force']:g} N"
    how = "bit for bit" if report.exact else f"within {near}"
    count = sum(report.compared.values())
    if report.difference is not None:
        raise click.ClickException(f"{bag}: the first difference ({how}) is at {report.difference}")
    began = "" if report.first_tick == 0 else f" from tick {report.first_tick}"
    click.echo(f"{bag}: {count} messages equal {how}{began} up to tick {report.last_tick} ({report.end:.2f} s)")


def _publish(bag: Path, rate: float, start: float | None, paused: bool, ros_arguments: tuple[str, ...]) -> None:
    if not 0.0 <= rate < float("inf"):
        raise ConveyorError(f"--rate: {rate:g} given, expected a number of at least 0")
    try:
        from conveyor_sim.ros.replay_job import publish_bag
    except ImportError as error:
        raise ConveyorError(
            f"replay --publish: {error}, expected ROS 2 with rclpy and conveyor_msgs: source it, or run in the "
            "environment that `make` sets up"
        ) from error
    publish_bag(bag, rate, start, paused, ros_arguments)


@click.command()
@click.argument("bag", type=click.Path(path_type=Path))
@click.option("--out", type=click.Path(path_type=Path), help="New or empty folder (default: BAG/sources).")
def sources(bag: Path, out: Path | None) -> None:
    """Write the files that the scene in BAG was read from: scene, included files, cells, tables, overrides."""
    from conveyor_sim.bag.sources import write_sources

    folder = out or (bag if bag.is_dir() else bag.parent) / "sources"
    result = write_sources(bag, folder)
    for name in result.written:
        click.echo(printable(folder / name))
    if result.refused:
        raise ConveyorError("\n".join(result.refused))


@click.command()
@click.argument("bag", type=click.Path(path_type=Path))
@click.option("--kind", "kinds", multiple=True, help="Only of this kind: alarm_raised, bottle_*, ...; repeatable.")
@click.option("--name", "names", multiple=True, help="Only of this device, alarm, ...: machines/*, ...; repeatable.")
@click.option("--from", "start", type=float, help="Only from this simulated time in s on.")
@click.option("--to", "stop", type=float, help="Only up to this simulated time in s.")
@click.option("--all", "every", is_flag=True, help="Print repeated events one by one.")
@click.option("--json", "as_json", is_flag=True, help="Print all of them as JSON.")
@click.option("--csv", "file", type=click.Path(path_type=Path), help="Write all of them to this file and print none.")
def events(bag: Path, file: Path | None, every: bool, as_json: bool, **chosen: Any) -> None:
    """List the events in BAG: bottles, alarms, states of machines, faults, refusals, limits passed.

    Events that are repeated, such as those of each cycle of a machine, are counted in one line between other events.
    """
    from conveyor_sim.report.events import chosen_events, event_listing, write_csv

    if file is not None and as_json:
        raise ConveyorError("--csv: given with --json, expected one of them")
    rows = chosen_events(bag, **chosen)
    if file is not None:
        write_csv(rows, file, bag)
        click.echo(f"{len(rows)} events written to {file}")
    elif as_json:
        show_json(row._asdict() for row in rows)
    else:
        show_lines(event_listing(rows, line_width(), every))


@click.command()
@click.argument("bag", type=click.Path(path_type=Path))
@click.option("--kind", "kinds", multiple=True, help="Only of this class: error, warning, message; repeatable.")
@click.option("--name", "names", multiple=True, help="Only this alarm: infeed*, ...; repeatable.")
@click.option("--json", "as_json", is_flag=True, help="Print them as JSON.")
def alarms(bag: Path, as_json: bool, **chosen: Any) -> None:
    """List the alarms of BAG: how often each was raised, how long it was active, its state at the end."""
    from conveyor_sim.report.alarms import alarm_listing, chosen_alarms

    rows = chosen_alarms(bag, **chosen)
    if as_json:
        show_json(row._asdict() for row in rows)
    else:
        show_lines(alarm_listing(rows, line_width()))


@click.command()
@click.argument("bag", type=click.Path(path_type=Path))
@click.option("--parquet", is_flag=True, help="Write Parquet files, with units in the metadata of the columns.")
@click.option("--csv", "as_csv", is_flag=True, help="Write CSV files.")
@click.option("--table", "tables", multiple=True, help="bottles, contacts, signals, events or belts; repeatable.")
@click.option("--out", type=click.Path(path_type=Path), help="Folder for the files (default: BAG/tables).")
def export(bag: Path, parquet: bool, as_csv: bool, tables: tuple[str, ...], out: Path | None) -> None:
    """Write BAG as tables for other programs: bottles, contacts, signals and events.

    Each table is one file with one row per bottle, contact, event or tick. Simulated time and tick come first.
    """
    from conveyor_sim.bag.export import export_tables

    if not (parquet or as_csv):
        raise ConveyorError("neither --parquet nor --csv given, expected one of them")
    formats = [name for name, on in (("parquet", parquet), ("csv", as_csv)) if on]
    folder = out or (bag if bag.is_dir() else bag.parent) / "tables"
    with ProgressBar(f"export {bag}", 0.0, counted="messages") as bar:
        written = export_tables(bag, folder, formats, tables, bar.update)
    for file, rows in written.items():
        click.echo(f"{file.name:<17}{rows} rows, {file.stat().st_size / 1e6:.3g} MB")
    click.echo(f"written to {folder}")


@click.command()
@click.argument("bag", type=click.Path(path_type=Path))
@click.option("--out", type=click.Path(path_type=Path), help="Folder for the pictures (default: BAG/report).")
@click.option("--no-pictures", is_flag=True, help="Print only.")
@click.option("--from", "start", type=float, help="First simulated time in s (default: the end of the warm-up).")
@click.option("--to", "stop", type=float, help="Last simulated time in s (default: the end).")
def report(bag: Path, **chosen: Any) -> None:
    """Report how the line in BAG produced: bottles, times, OEE, MTBF, MTTR, stop reasons and longest stops."""
    from conveyor_sim.report.production_report import report_production

    report_production(bag, **chosen)


@click.command()
@click.argument("bag", type=click.Path(path_type=Path))
@click.option("--out", type=click.Path(path_type=Path), help="Folder for the pictures (default: BAG/pictures).")
@click.option("--time", "times", type=float, multiple=True, help="Simulated time to draw the plant at, s; repeatable.")
@click.option("--bottle", "bottles", type=int, multiple=True, help="Id of a bottle to draw over time; repeatable.")
def plot(bag: Path, out: Path | None, times: tuple[float, ...], bottles: tuple[int, ...]) -> None:
    """Draw a recording.

    Draws BAG as PNG and SVG: the plant at some times, velocities of bottles, flow and forces.
    """
    from conveyor_sim.report.drawing import Drawing
    from conveyor_sim.report.report import can_draw

    if not can_draw():
        sys.exit(1)
    with Drawing() as drawing:
        drawing.begin(bag, times or None, bottles or None)
        pictures = drawing.pictures(out or (bag if bag.is_dir() else bag.parent) / "pictures")
    for picture in pictures:
        click.echo(picture)
