"""The command `conveyor-sim`: check, explain, run, accuracy and more. Errors are one sentence, no traceback."""

from __future__ import annotations

import errno
import io
import signal
import sys
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from conveyor_sim.support.interrupt import one_line, while_importing

with while_importing():
    import click
    from rich.console import Console, RenderableType

    from conveyor_sim.errors import ConveyorError
    from conveyor_sim.support.garbage import collected_later
    from conveyor_sim.support.printable import SENTENCE, printable, printable_lines
    from conveyor_sim.support.progress import ProgressBar
    from conveyor_sim.support.signals import HandledOnce, held_back
    from conveyor_sim.version import __version__

# Commands import what they need when they run, so that `conveyor-sim --help` answers at once.


OUTSIDE_TABLES = "Let SCENE name tables (CSV files) that lie outside its own folder."


class _Group(click.Group):
    """Turns errors meant for the user into one sentence and exit code 1, and Ctrl-C into one line and 130."""

    def invoke(self, ctx: click.Context) -> Any:
        try:
            with one_line():
                return super().invoke(ctx)
        except ConveyorError as error:
            raise click.ClickException(printable_lines(error)) from error
        except OSError as error:
            if error.errno == errno.EPIPE:
                raise  # whoever read the output has gone: click ends without a word
            where = f"{error.filename}: " if error.filename else ""
            raise click.ClickException(printable_lines(f"{where}{error.strerror or error}")) from error


@click.group(cls=_Group)
@click.version_option(__version__, prog_name="conveyor-sim")
@click.pass_context
def main(context: click.Context) -> None:
    """Bottles on industrial conveyors, simulated by force."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")  # names of files may be bytes that are no text
    context.with_resource(HandledOnce([signal.SIGINT], signal.default_int_handler))


@main.command()
@click.argument("scene")
@click.option("--out", type=click.Path(path_type=Path), default=Path(), help="Folder for the picture (default: here).")
@click.option("--outside-tables", is_flag=True, help=OUTSIDE_TABLES)
def check(scene: str, out: Path, outside_tables: bool) -> None:
    """Validate SCENE and draw it.

    SCENE is a file, or the name of a shipped scene. Its effects and its time step are listed with their reasons.
    """
    from conveyor_sim.explain.account import account
    from conveyor_sim.model import build_model
    from conveyor_sim.model.remedies import step_limit
    from conveyor_sim.runs.report import plot_function
    from conveyor_sim.runs.speed import expected
    from conveyor_sim.runs.tags import tag_rows
    from conveyor_sim.scene import load_scene
    from conveyor_sim.support.resources import scene_path

    path = scene_path(scene)
    checked = load_scene(path, outside_tables=outside_tables)
    model = build_model(checked)
    tag_rows(checked)  # which finds alarms of tags that there are not
    _print(account(checked, model))
    for line in expected(step_limit(checked)):
        click.echo(line)
    plot_scene = plot_function("plot_scene")
    if plot_scene is not None:
        try:
            out.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise ConveyorError(f"{out}: can't be made ({error.strerror}), expected a folder to draw into") from error
        click.echo(f"drawn to {plot_scene(checked, out / f'{path.stem}.png')}")


@main.command()
@click.argument("scene")
@click.option("--csv", "as_csv", is_flag=True, help="As CSV, with all that is known of each tag.")
@click.option("--modbus", is_flag=True, help="As the map of their Modbus addresses, as CSV.")
@click.option("--map", "kept", type=click.Path(path_type=Path), help="With --modbus: a map to keep, which only grows.")
@click.option("--word-order", type=click.Choice(["big", "little"]), default="big", help="Of Modbus: ABCD or CDAB.")
@click.option("--outside-tables", is_flag=True, help=OUTSIDE_TABLES)
def tags(scene: str, outside_tables: bool, **chosen: Any) -> None:
    """List the tags of SCENE: all that can be read, commanded and injected, with units, ranges and meaning."""
    from conveyor_sim.runs.tags import listed
    from conveyor_sim.scene import load_scene
    from conveyor_sim.support.resources import scene_path

    shown = listed(load_scene(scene_path(scene), outside_tables=outside_tables), **chosen)
    click.echo(shown, nl=False) if isinstance(shown, str) else _print(shown)


@main.command()
@click.argument("scene")
@click.option(
    "--price",
    is_flag=True,
    help="Measure what each effect costs, in ns per bottle and step, and what each remedy saves.",
)
@click.option("--at", type=float, help="Simulated time in s at which to measure (default: half the duration).")
@click.option("--outside-tables", is_flag=True, help=OUTSIDE_TABLES)
def explain(scene: str, price: bool, at: float | None, outside_tables: bool) -> None:
    """Explain effects and time step of SCENE.

    Lists why each effect is on or off, and what bounds the time step; with --price, what each effect costs.
    """
    from conveyor_sim.explain.choices import explanation, price_table
    from conveyor_sim.model import build_model
    from conveyor_sim.scene import load_scene
    from conveyor_sim.support.resources import scene_path

    loaded = load_scene(scene_path(scene), outside_tables=outside_tables)
    if at is not None and not price:
        raise ConveyorError(f"--at: {at:g} given, expected --price with it, for it is the time to measure at")
    if at is not None and not 0.0 < at <= loaded.duration:
        raise ConveyorError(
            f"--at: {at:g} given, expected a time greater than 0 and at most the duration, {loaded.duration:g} (s)"
        )
    _print(explanation(loaded, build_model(loaded)))
    if not price:
        return
    from conveyor_sim.explain.effect_cost import Pricing
    from conveyor_sim.runs.compilation import Compilation

    Compilation(loaded, _say).run()
    pricing = Pricing(loaded, at)
    with ProgressBar(f"{loaded.name}, to a warm state", 0.0) as bar:
        pricing.warm_up(bar.update)
    with ProgressBar("compiling without each effect", 0.0, counted="variants") as bar:
        pricing.prepare(bar.update)
    with ProgressBar("with and without, in turn", 0.0, counted="measurements") as bar:
        prices = pricing.measure(bar.update)
    with ProgressBar("with what would take fewer steps", 0.0, counted="measurements") as bar:
        gains = pricing.gains(bar.update)
    _print(price_table(prices))
    for gain in gains:
        click.echo(f"fewer steps: {gain.sentence}")


@main.command()
@click.argument("scene")
@click.option(
    "--out", "--record", "out", type=click.Path(path_type=Path), help="Folder to record to (default: runs/<UTC time>)."
)
@click.option("--duration", type=float, help="Simulated time in s, instead of the scene's.")
@click.option("--no-record", is_flag=True, help="Simulate only; nothing is written.")
@click.option("--no-pictures", is_flag=True, help="Draw nothing; `conveyor-sim plot` does, any time later.")
@click.option("--threads", type=click.IntRange(1), help="Threads to step with (default: as many as prove fastest).")
@click.option("--outside-tables", is_flag=True, help=OUTSIDE_TABLES)
def run(
    scene: str,
    out: Path | None,
    duration: float | None,
    no_record: bool,
    no_pictures: bool,
    threads: int | None,
    outside_tables: bool,
) -> None:
    """Simulate SCENE without ROS, and record it.

    It runs as fast as possible, and records what the node would.
    """
    with collected_later():
        from conveyor_sim.bag.folder import require_recordable
        from conveyor_sim.bag.recorder import run_folder
        from conveyor_sim.explain.choices import setting_line
        from conveyor_sim.model import build_model
        from conveyor_sim.runs.compilation import Compilation
        from conveyor_sim.runs.drawing import Drawing
        from conveyor_sim.runs.report import report, report_unrecorded
        from conveyor_sim.runs.runner import run_scene
        from conveyor_sim.scene import load_scene
        from conveyor_sim.support.resources import scene_path

    loaded = load_scene(scene_path(scene), {} if duration is None else {"duration": duration}, outside_tables)
    model = build_model(loaded)
    click.echo(setting_line(model))
    folder = drawing = None
    if not no_record:
        folder = click.get_current_context().with_resource(run_folder(out))
        require_recordable(folder)  # not only once everything has been compiled
        drawing = None if no_pictures else click.get_current_context().with_resource(Drawing())
        if drawing is not None:
            drawing.get_ready()
    Compilation(loaded, _say).run()
    with ProgressBar(loaded.name, loaded.duration) as bar:
        done = run_scene(loaded, folder, bar.update, threads)
    if done.interrupted:
        click.echo(f"interrupted at {done.simulated:.2f} s")
    if done.bag is None:
        report_unrecorded(loaded, model, done)
    else:
        report(done.bag, done.wall, drawing, done.spent)


@main.command()
@click.argument("scene")
@click.option("--tolerance", type=float, default=0.01, help="Relative error to stay below (default: 0.01).")
@click.option("--out", type=click.Path(path_type=Path), help="Folder (default: runs/accuracy_<scene>_<hash>).")
@click.option("--thorough", is_flag=True, help="Many more long runs: up to an hour on two free processors.")
@click.option("--details", is_flag=True, help="Print all tables behind the answer, too.")
@click.option("--apply", "write", is_flag=True, help="Write the answer into a copy of the scene, in the folder.")
@click.option("--outside-tables", is_flag=True, help=OUTSIDE_TABLES)
def accuracy(
    scene: str,
    tolerance: float,
    out: Path | None,
    thorough: bool,
    details: bool,
    write: bool,
    outside_tables: bool,
) -> None:
    """Compare settings by error and run time.

    Recommends the cheapest setting that meets the tolerance on SCENE. A predicted answer comes first, then a
    preliminary one; Ctrl-C shows the best so far, and the same command goes on with what is finished.
    """
    if find_spec("scipy") is None:
        raise ConveyorError("accuracy: scipy is not installed, expected it (pip install 'conveyor_sim[accuracy]')")
    if not 0.0 < tolerance <= 0.5:
        raise ConveyorError(f"--tolerance: {tolerance:g} given, expected a number greater than 0, at most 0.5")
    with held_back():
        from conveyor_sim.accuracy.apply import apply
        from conveyor_sim.accuracy.effort import DEFAULT, THOROUGH
        from conveyor_sim.accuracy.session import Session
        from conveyor_sim.accuracy.study import study_folder
        from conveyor_sim.accuracy.tables import terminal
        from conveyor_sim.runs.report import plot_function
        from conveyor_sim.scene import load_scene
        from conveyor_sim.support.resources import scene_path

        path = scene_path(scene)
        loaded = load_scene(path, outside_tables=outside_tables)
        folder = out or study_folder(loaded)
        session = Session(loaded, tolerance, click.echo, _say)
        session.predict(folder, effort := THOROUGH if thorough else DEFAULT)
    study = session.run(folder, effort, lambda what, counted: ProgressBar(what, 0.0, counted=counted))
    if study is not None:
        if details:
            _print(terminal(study))
        plot_accuracy = plot_function("plot_accuracy")
        for picture in [] if plot_accuracy is None else plot_accuracy(study, folder):
            click.echo(f"picture: {picture}")
        click.echo(f"numbers: {folder}/study.json, and CSV files beside it")
    if write and session.setting is not None:
        copy = folder / path.name
        apply(loaded, session.setting, copy)
        click.echo(f"scene with the setting: {copy}")


@main.command()
@click.argument("bag", type=click.Path(path_type=Path))
def recover(bag: Path) -> None:
    """Verify a recording, and repair it.

    If BAG is damaged, or its recording was interrupted, a repaired copy takes its place; the original is kept.
    BAG may be the folder of inputs that a killed test has left: its run is simulated again, and recorded.
    """
    from conveyor_sim.runs.recovery import recover_bag, recover_runs

    if not recover_runs(bag):
        recover_bag(bag)


@main.command()
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
    from conveyor_sim.bag.replay import replay as replay_bag
    from conveyor_sim.bag.topics import TOPICS

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


@main.command()
@click.argument("bag", type=click.Path(path_type=Path))
@click.option("--kind", "kinds", multiple=True, help="Only of this kind: alarm_raised, bottle_*, ...; repeatable.")
@click.option("--name", "names", multiple=True, help="Only of this device, alarm, ...: machines/*, ...; repeatable.")
@click.option("--from", "start", type=float, help="Only from this simulated time in s on.")
@click.option("--to", "stop", type=float, help="Only up to this simulated time in s.")
@click.option("--csv", "file", type=click.Path(path_type=Path), help="Write them to this file and print none.")
def events(bag: Path, file: Path | None, **chosen: Any) -> None:
    """Print what happened on the line in BAG: bottles, alarms, states of machines, faults, refusals, limits passed."""
    from conveyor_sim.runs.events import chosen_events, event_table, write_csv

    rows = chosen_events(bag, **chosen)
    if file is None:
        _print(event_table(rows))
    else:
        write_csv(rows, file, bag)
        click.echo(f"{len(rows)} events written to {file}")


@main.command()
@click.argument("bag", type=click.Path(path_type=Path))
@click.option("--out", type=click.Path(path_type=Path), help="Folder for the pictures (default: BAG/report).")
@click.option("--no-pictures", is_flag=True, help="Print only.")
def report(bag: Path, **chosen: Any) -> None:
    """Report how the line in BAG produced: bottles, times, OEE, MTBF, MTTR, stop reasons and longest stops."""
    from conveyor_sim.runs.production_report import report_production

    report_production(bag, **chosen)


@main.command()
@click.argument("bag", type=click.Path(path_type=Path))
@click.option("--out", type=click.Path(path_type=Path), help="Folder for the pictures (default: BAG/pictures).")
@click.option("--time", "times", type=float, multiple=True, help="Simulated time to draw the plant at, s; repeatable.")
@click.option("--bottle", "bottles", type=int, multiple=True, help="Id of a bottle to draw over time; repeatable.")
def plot(bag: Path, out: Path | None, times: tuple[float, ...], bottles: tuple[int, ...]) -> None:
    """Draw a recording.

    Draws BAG as PNG and SVG: the plant at some times, velocities of bottles, flow and forces.
    """
    from conveyor_sim.runs.drawing import Drawing
    from conveyor_sim.runs.report import can_draw

    if not can_draw():
        sys.exit(1)
    with Drawing() as drawing:
        drawing.begin(bag, times or None, bottles or None)
        pictures = drawing.pictures(out or (bag if bag.is_dir() else bag.parent) / "pictures")
    for picture in pictures:
        click.echo(picture)


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


def _say(sentence: str) -> None:
    """What is happening, beside the results."""
    click.echo(sentence, err=True)


def _print(content: RenderableType) -> None:
    """Prints to the terminal; brackets in names and paths mean nothing."""
    Console(markup=False, highlight=False).print(content)
