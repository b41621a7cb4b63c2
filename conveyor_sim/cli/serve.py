# SPDX-License-Identifier: Apache-2.0
"""The command serve."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from rich.console import Console

from conveyor_sim.cli import controller_options as controllers
from conveyor_sim.cli.output import Number
from conveyor_sim.cli.scene_options import NAMES, SceneOptions, scene_options
from conveyor_sim.errors import BagError, ConveyorError
from conveyor_sim.support.garbage import collected_later

if TYPE_CHECKING:
    from conveyor_sim.protocols.hosting.server_kinds import ServerKind
    from conveyor_sim.protocols.hosting.serving import Serving
    from conveyor_sim.protocols.hosting.settings import ServerSettings
    from conveyor_sim.protocols.server.interface import Stamps
    from conveyor_sim.protocols.tags.bag_provider import BagTagProvider
    from conveyor_sim.protocols.tags.scene_provider import SceneTagProvider
    from conveyor_sim.ros.node_source import NodeSource

    Source = SceneTagProvider | BagTagProvider | NodeSource

LOOK = 1.0
"""Wall time between two updates of the progress on a terminal, s."""
PLAIN_LOOK = 10.0
"""Wall time between two progress lines where output is not a terminal, s."""

IN_LOCKSTEP = "in lockstep: simulated time advances only when a client writes run/target_tick"

PORT = click.IntRange(0, 65535)

MQTT_ROLES = ("viewer", "operator", "engineer", "controller")

_RUN = ("out", "no_record", "duration", "threads", "lockstep", *controllers.NAMES)
TAKEN_BY_SCENE = (*_RUN, "real_time_factor", "options")
OF_SCENE = (*_RUN, *NAMES)
OF_BAG = ("loop",)
OPTIONS = {"variables": "record-variables"}
"""Names of options that differ from those of their arguments."""

DRAWING = ("web", "foxglove")
"""Protocol options whose clients display bottle positions."""

OF_FACES = (
    "modbus_role",
    "modbus_map",
    "mqtt_role",
    "mqtt_password_file",
    "mqtt_ca",
    "mqtt_primary_host",
    "users",
    "anonymous",
    "opcua_certificates",
    "opcua_history",
    "web_certificates",
)

_WHERE = {
    **dict.fromkeys(OF_SCENE, "it with a scene only"),
    "loop": "it with a bag only",
    "real_time_factor": "it with a scene or a bag: the node has a parameter of that name",
    **dict.fromkeys(("modbus_role", "mqtt_role"), "none: a recording can't be commanded"),
}


@click.command()
@click.argument("what", required=False, metavar="[SCENE|BAG]")
@click.option("--node", is_flag=False, flag_value="", metavar="[NAMESPACE]", help="Serve the line of a ROS 2 node.")
@click.option("--opcua", type=PORT, is_flag=False, flag_value=4840, help="Serve OPC UA on this port.")
@click.option("--opcua-certificates", type=click.Path(path_type=Path), help="Folder of its certificate and key.")
@click.option("--opcua-history", multiple=True, metavar="PATTERN", help="Tags to keep values of: 'belts/*/speed'.")
@click.option("--modbus", type=PORT, is_flag=False, flag_value=5020, help="Serve Modbus TCP on this port.")
@click.option(
    "--modbus-role",
    type=click.Choice(["controller", "operator"]),
    help="Role of clients that write (default: none may write).",
)
@click.option(
    "--modbus-map",
    type=click.Path(path_type=Path),
    help="File that stores the address map; existing addresses never change.",
)
@click.option(
    "--mqtt",
    is_flag=False,
    flag_value="mqtt://127.0.0.1:1883",
    metavar="URL",
    help="Publish with Sparkplug B to the broker at this URL.",
)
@click.option("--mqtt-role", type=click.Choice(MQTT_ROLES), help="Role of hosts that write (default: viewer).")
@click.option("--mqtt-password-file", type=click.Path(path_type=Path), help="File of the password for the broker.")
@click.option(
    "--mqtt-ca", type=click.Path(path_type=Path), help="CA certificates that authenticate the broker of a mqtts:// URL."
)
@click.option("--mqtt-primary-host", default="", metavar="ID", help="Publish only while this host is online.")
@click.option("--web", type=PORT, is_flag=False, flag_value=8080, help="Serve a page for browsers on this port.")
@click.option("--foxglove", type=PORT, is_flag=False, flag_value=8765, help="Serve Foxglove on this port.")
@click.option(
    "--web-certificates", type=click.Path(path_type=Path), help="Folder of the certificate and key of the page."
)
@click.option(
    "--users",
    "--opcua-users",
    "users",
    type=click.Path(path_type=Path),
    help="File of users with more than read access over OPC UA and on the web page.",
)
@click.option(
    "--anonymous/--no-anonymous",
    "--opcua-anonymous/--no-opcua-anonymous",
    "anonymous",
    default=True,
    help="Allow reading without a login (default: allowed).",
)
@click.option("--limit", "limits", multiple=True, metavar="NAME=VALUE", help="A limit: 'opcua.nodes_per_read=500'.")
@click.option("--bind", default="127.0.0.1", help="Address to listen on, for other machines (default: this one only).")
@click.option(
    "--stamps",
    type=click.Choice(["wall", "simulated"]),
    default="wall",
    help="Kind of time stamps of values: wall time or simulated time.",
)
@click.option("--real-time-factor", type=Number(0.0, 1e6), default=1.0, help="0: as fast as possible.")
@click.option("--lockstep", is_flag=True, help="SCENE only: advance only when a PLC client has finished its scan.")
@controllers.controller_options
@click.option("--loop", is_flag=True, help="BAG only: restart at the end.")
@click.option("--duration", type=float, help="Of SCENE: simulated time in s, instead of the scene's.")
@click.option(
    "--out",
    "--record",
    "out",
    type=click.Path(path_type=Path),
    help="Of SCENE: folder to record to (default: runs/<UTC time>).",
)
@click.option("--no-record", is_flag=True, help="SCENE only: do not record.")
@click.option("--threads", type=click.IntRange(1), help="Of SCENE: threads to step with.")
@scene_options
def serve(what: str | None, node: str | None, bind: str, stamps: Stamps, **given: Any) -> None:
    """Serve a line to SCADA systems, HMIs, PLCs, MQTT hosts, browsers and Foxglove.

    SCENE is simulated in real time, and recorded with all that clients write. With --controller, a program owns its
    line: it scans at every tick, and operators take devices by their control mode. BAG is played back. With --node,
    serve the line of a running ROS node. Without a protocol option, OPC UA and Modbus are served on their default
    ports. Ctrl-C ends it.
    """
    with collected_later():
        from conveyor_sim.protocols.hosting.server_child import ServerChild
        from conveyor_sim.protocols.hosting.server_kinds import SERVER_KINDS
        from conveyor_sim.protocols.hosting.serving import Serving
        from conveyor_sim.protocols.hosting.settings import ServerSettings, limit_settings

    console = Console(stderr=True, markup=False, highlight=False, soft_wrap=True)
    chosen: list[tuple[ServerKind, Any]] = [
        (kind, place) for kind in SERVER_KINDS if (place := given[kind.name]) is not None
    ]
    chosen = chosen or [(kind, kind.port) for kind in SERVER_KINDS if kind.by_default and kind.installed]
    for kind, _ in chosen or [(SERVER_KINDS[0], 0)]:
        kind.require()
    settings = ServerSettings(
        bind, stamps, **{name: given[name] for name in OF_FACES}, **limit_settings(given["limits"])
    )
    for kind, place in chosen:
        kind.require_place(place, settings)  # before kernels are compiled
    paused: SceneTagProvider | None = None
    with ExitStack() as stack:
        if (what is None) == (node is None):
            raise ConveyorError("serve: expected one of SCENE, BAG and --node")
        ready = {kind.name: ServerChild(kind.name) for kind, _ in chosen}  # they import while the line is loaded
        for child in ready.values():
            stack.callback(child.end)
        if what is None:
            _require_not_given("--node", (*OF_SCENE, *OF_BAG, "real_time_factor"))
            drawn = any(given[face] is not None for face in DRAWING)
            source: Source = stack.enter_context(_node(node or "", console, drawn))
        elif _is_bag(what):
            _require_not_given(what, (*OF_SCENE, "modbus_role", "mqtt_role"))
            source = stack.enter_context(_bag(Path(what), console, given["real_time_factor"], given["loop"]))
        else:
            _require_not_given(what, OF_BAG)
            if given["lockstep"]:
                _require_lockstep(settings)
            paused = stack.enter_context(scene_source(what, console, **{name: given[name] for name in TAKEN_BY_SCENE}))
            source = paused
        with Serving(source, chosen, settings, console.print, ready) as serving:
            notes = [IN_LOCKSTEP] if given["lockstep"] else []
            if paused is not None and not given["lockstep"]:
                paused.control("resume", 0.0, "")
            if given["controller"] is not None:
                notes.append(f"{given['controller']} commands the line; a reset loads it again")
            watch(serving, console, [*serving.greeting, *notes])
            summary = serving.summary()
    tell_end(summary, getattr(source, "recordings", []))


def tell_end(summary: str, bags: Sequence[Path]) -> None:
    """Print the summary and the paths of recordings. Raise BagError if one is not intact, as on a full disk."""
    from conveyor_sim.bag.reader import open_bag

    whole: list[str] = []
    broken: list[str] = []
    for bag in bags:
        try:
            open_bag(bag).close()
            whole.append(str(bag))
        except BagError as error:
            broken.append(str(error))
    click.echo(summary + (f"; recorded to {', '.join(whole)}" if whole else ""))
    if broken:
        raise BagError(f"not recorded up to the end: {'; '.join(broken)}")


def _is_bag(what: str) -> bool:
    from conveyor_sim.bag.mcap.storage import other_storage
    from conveyor_sim.bag.reader import SUFFIXES

    return Path(what).is_dir() or Path(what).suffix in SUFFIXES or bool(other_storage(Path(what)))


def _require_lockstep(settings: ServerSettings) -> None:
    _require_not_given("--lockstep", ("real_time_factor",), "none: the PLC advances the time")
    _require_not_given("--lockstep", controllers.NAMES, "none: the PLC is the controller")
    if settings.modbus_role != "controller" and settings.users is None:
        raise ConveyorError(
            "--lockstep: no client may advance the line, expected --modbus-role controller, or --users with a "
            "controller"
        )


def _require_not_given(what: str, names: Sequence[str], expected: str = "") -> None:
    context = click.get_current_context()
    for name in names:
        if context.get_parameter_source(name) is click.core.ParameterSource.COMMANDLINE:
            option = OPTIONS.get(name, name.replace("_", "-"))
            raise ConveyorError(f"--{option}: given with {what}, expected {expected or _WHERE[name]}")


@contextmanager
def scene_source(
    what: str,
    console: Console,
    out: Path | None,
    no_record: bool,
    duration: float | None,
    real_time_factor: float,
    threads: int | None,
    options: SceneOptions,
    lockstep: bool = False,
    controller: str | None = None,
    parameters: str = "",
    variables: tuple[str, ...] = (),
) -> Iterator[SceneTagProvider]:
    """Yield a paused scene once its tags are known. lockstep: clients advance it.

    controller, parameters, variables: options of a controller that owns the line, if there is one.

    A failure before its first tick leaves no recording.
    """
    from conveyor_sim.bag.folder import require_recordable
    from conveyor_sim.bag.recorder import run_folder
    from conveyor_sim.protocols.tags.scene_messages import SceneTask
    from conveyor_sim.protocols.tags.scene_provider import SceneTagProvider
    from conveyor_sim.support.stop_request import StopRequest

    scans = controllers.controller_source(controller, parameters, variables)
    scene = options.load(what, duration)
    with ExitStack() as starting:
        stop = starting.enter_context(StopRequest())  # an interrupt would be lost, or leave a folder behind
        folder = None
        if not no_record:
            folder = click.get_current_context().with_resource(run_folder(out))
            require_recordable(folder)
        task = SceneTask(
            scene, folder, 0, real_time_factor, threads, playing=False, controller=scans, lockstep=lockstep
        )
        source = SceneTagProvider(task, console.print)
        try:
            with source:
                if not source.wait_for_line(lambda: stop.requested) or stop.requested:
                    raise KeyboardInterrupt
                starting.close()
                yield source
        except BaseException:
            source.discard()
            raise


def _bag(path: Path, console: Console, speed: float, loop: bool) -> BagTagProvider:
    from conveyor_sim.protocols.tags.bag_provider import BagTagProvider

    return BagTagProvider(path, console.print, speed=speed, loop=loop)


@contextmanager
def _node(namespace: str, console: Console, drawn: bool) -> Iterator[NodeSource]:
    """Yield the line of a node once its tags are known. drawn: True if the web page or Foxglove displays it."""
    try:
        from conveyor_sim.ros.node_source import NodeSource
    except ImportError as error:
        raise ConveyorError(
            f"serve --node: {error}, expected ROS 2 with rclpy and conveyor_msgs: source it, or run in the environment "
            "that `make` sets up"
        ) from error
    with NodeSource(console.print, namespace, drawn) as source:
        with console.status("waiting for the line of a node, and for its first tick"):
            while not source.wait(LOOK):
                pass
        yield source


def watch(serving: Serving, console: Console, greeting: Sequence[str]) -> None:
    """Print the greeting, then the progress until a signal arrives (Ctrl-C, SIGTERM), which ends serving in order."""
    from conveyor_sim.support.stop_request import StopRequest

    with StopRequest() as stop:
        for sentence in greeting:
            console.print(sentence)
        if not console.is_terminal:
            while not stop.wait(PLAIN_LOOK):
                console.print(serving.progress())
            return
        with console.status(serving.progress()) as shown:
            while not stop.wait(LOOK):
                shown.update(serving.progress())
