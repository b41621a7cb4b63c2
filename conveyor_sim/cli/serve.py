"""The command serve."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import click
from rich.console import Console

from conveyor_sim.cli.output import OUTSIDE_TABLES
from conveyor_sim.support.garbage import collected_later

if TYPE_CHECKING:
    from conveyor_sim.line.inputs import WriterKind
    from conveyor_sim.scada.face import Stamps
    from conveyor_sim.scada.scene_source import SceneSource
    from conveyor_sim.scada.serving import Serving

LOOK = 1.0
"""s of wall time between two looks at how it goes, on a terminal."""
PLAIN_LOOK = 10.0
"""The same where lines stay."""

PORT = click.IntRange(0, 65535)


@click.command()
@click.argument("what", metavar="SCENE")
@click.option("--opcua", type=PORT, is_flag=False, flag_value=4840, help="Serve OPC UA on this port.")
@click.option("--opcua-users", type=click.Path(path_type=Path), help="File of its users, who may do more than read.")
@click.option("--opcua-certificates", type=click.Path(path_type=Path), help="Folder of its certificate and key.")
@click.option("--opcua-anonymous/--no-opcua-anonymous", default=True, help="Whether all may read (default: they may).")
@click.option("--modbus", type=PORT, is_flag=False, flag_value=5020, help="Serve Modbus TCP on this port.")
@click.option("--modbus-role", type=click.Choice(["controller", "operator"]), help="As what its clients may write.")
@click.option("--modbus-map", type=click.Path(path_type=Path), help="File that keeps its addresses; it only grows.")
@click.option("--bind", default="127.0.0.1", help="Address to listen on, for other machines (default: this one only).")
@click.option("--stamps", type=click.Choice(["wall", "simulated"]), default="wall", help="What times of values are.")
@click.option("--real-time-factor", type=click.FloatRange(0.0, 1e6), default=1.0, help="0: as fast as possible.")
@click.option("--duration", type=float, help="Simulated time in s, instead of the scene's.")
@click.option(
    "--out", "--record", "out", type=click.Path(path_type=Path), help="Folder to record to (default: runs/<UTC time>)."
)
@click.option("--no-record", is_flag=True, help="Nothing is written.")
@click.option("--threads", type=click.IntRange(1), help="Threads to step with (default: as many as prove fastest).")
@click.option("--outside-tables", is_flag=True, help=OUTSIDE_TABLES)
def serve(
    what: str,
    opcua: int | None,
    opcua_users: Path | None,
    opcua_certificates: Path | None,
    opcua_anonymous: bool,
    modbus: int | None,
    modbus_role: WriterKind | None,
    modbus_map: Path | None,
    bind: str,
    stamps: Stamps,
    real_time_factor: float,
    duration: float | None,
    out: Path | None,
    no_record: bool,
    threads: int | None,
    outside_tables: bool,
) -> None:
    """Serve a line to SCADA systems, HMIs and PLCs.

    SCENE is simulated in real time, and recorded with all that clients write. Without the option of any protocol, all
    that are installed are served, each on its port. Ctrl-C ends it.
    """
    with collected_later():
        from conveyor_sim.scada.face import Settings
        from conveyor_sim.scada.faces import FACES
        from conveyor_sim.scada.serving import Serving

    console = Console(stderr=True, markup=False, highlight=False, soft_wrap=True)
    ports = {"opcua": opcua, "modbus": modbus}
    chosen = [(kind, port) for kind in FACES if (port := ports[kind.name]) is not None]
    chosen = chosen or [(kind, kind.port) for kind in FACES if kind.installed]
    if not chosen:
        FACES[0].require()
    settings = Settings(bind, stamps, modbus_role, modbus_map, opcua_users, opcua_anonymous, opcua_certificates)
    with (
        _simulated(what, console, out, no_record, duration, real_time_factor, threads, outside_tables) as source,
        Serving(source, chosen, settings) as serving,
    ):
        for sentence in serving.greeting:
            console.print(sentence)
        _watch(serving, console)
        summary = serving.summary()
    bags = [] if no_record else source.recordings
    click.echo(summary + (f"; recorded to {', '.join(map(str, bags))}" if bags else ""))


@contextmanager
def _simulated(
    what: str,
    console: Console,
    out: Path | None,
    no_record: bool,
    duration: float | None,
    real_time_factor: float,
    threads: int | None,
    outside_tables: bool,
) -> Iterator[SceneSource]:
    """A scene, once its tags are known."""
    from conveyor_sim.bag.folder import require_recordable
    from conveyor_sim.bag.recorder import run_folder
    from conveyor_sim.scada.scene_process import Task
    from conveyor_sim.scada.scene_source import SceneSource
    from conveyor_sim.scene import load_scene
    from conveyor_sim.support.resources import scene_path

    scene = load_scene(scene_path(what), {} if duration is None else {"duration": duration}, outside_tables)
    folder = None
    if not no_record:
        folder = click.get_current_context().with_resource(run_folder(out))
        require_recordable(folder)
    with SceneSource(Task(scene, folder, 0, real_time_factor, threads), console.print) as source:
        source.wait_for_line()
        yield source


def _watch(serving: Serving, console: Console) -> None:
    """Tell how it goes until a signal comes."""
    from conveyor_sim.support.stop_request import StopRequest

    with StopRequest() as stop:
        if not console.is_terminal:
            while not stop.wait(PLAIN_LOOK):
                console.print(serving.progress())
            return
        with console.status(serving.progress()) as shown:
            while not stop.wait(LOOK):
                shown.update(serving.progress())
