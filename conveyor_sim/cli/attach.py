# SPDX-License-Identifier: Apache-2.0
"""The command attach."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from rich.console import Console

from conveyor_sim.cli.output import Number
from conveyor_sim.cli.scene_options import SceneOptions, scene_options
from conveyor_sim.cli.serve import scene_source, tell_end, watch
from conveyor_sim.errors import ConveyorError
from conveyor_sim.support.garbage import collected_later
from conveyor_sim.support.printable import printable

if TYPE_CHECKING:
    from conveyor_sim.protocols.attach.access import PlcAccess

PASSWORD = "CONVEYOR_SIM_PLC_PASSWORD"
"""Environment variable of the password, if no file is given."""

ACCESS = ("user_certificate", "user_key", "security", "plain_password", "trust")
"""Names of options that are fields of `PlcAccess`."""


@click.command()
@click.argument("places", nargs=-1, metavar="[SCENE] URL")
@click.option("--tags", type=click.Path(path_type=Path), help="CSV file: our tags, and theirs.")
@click.option("--user", default="", help="Of OPC UA (default: anonymous).")
@click.option(
    "--password-file",
    type=click.Path(path_type=Path),
    help=f"File of the password of --user (default: ${PASSWORD}, else it is asked for).",
)
@click.option("--user-certificate", type=click.Path(path_type=Path), help="Of OPC UA, instead of --user; DER or PEM.")
@click.option("--user-key", type=click.Path(path_type=Path), help="Private key of --user-certificate, PEM.")
@click.option(
    "--security",
    type=click.Choice(["best", "encrypt", "sign", "none"]),
    default="best",
    help="Of OPC UA messages (default: the most secure that the PLC offers).",
)
@click.option("--plain-password", is_flag=True, help="Send the password even where others on the network can read it.")
@click.option("--trust", default="", metavar="SHA256", help="Trust the certificate of the PLC with this fingerprint.")
@click.option(
    "--opcua-certificates", type=click.Path(path_type=Path), help="Folder of our certificate and of trusted ones."
)
@click.option("--browse", is_flag=True, help="Print the variables of the PLC as a map for --tags; runs nothing.")
@click.option("--period", type=Number(0.001, 10.0), default=0.01, help="s from scan to scan (default: 0.01).")
@click.option("--real-time-factor", type=Number(0.001, 1e6), default=1.0, help="Of the simulation.")
@click.option("--duration", type=float, help="Simulated time in s, instead of the scene's.")
@click.option(
    "--out", "--record", "out", type=click.Path(path_type=Path), help="Folder to record to (default: runs/<UTC time>)."
)
@click.option("--no-record", is_flag=True, help="Nothing is written.")
@click.option("--threads", type=click.IntRange(1), help="Threads to step with.")
@scene_options
def attach(
    places: tuple[str, ...],
    tags: Path | None,
    browse: bool,
    user: str,
    password_file: Path | None,
    opcua_certificates: Path | None,
    period: float,
    **more: Any,
) -> None:
    """Have the PLC at URL control SCENE in real time.

    URL is that of the PLC's server: opc.tcp://host:port, modbus://host:port, s7://host/rack/slot (Siemens),
    eip://host/slot (Rockwell) or ads://net-id:port?host=address (Beckhoff). The line writes its signals there, and
    reads what the PLC commands. The simulation does not wait for the PLC; the lag is reported. Ctrl-C ends it.

    Without SCENE, --trust stores the certificate of the PLC, and --browse prints its variables.
    """
    with collected_later():
        from conveyor_sim.protocols.attach.access import PlcAccess
        from conveyor_sim.protocols.attach.free_running import plc_kind
        from conveyor_sim.protocols.hosting.serving import Serving
        from conveyor_sim.protocols.hosting.settings import ServerSettings

    console = Console(stderr=True, markup=False, highlight=False, soft_wrap=True)
    if len(places) not in (1, 2):
        raise ConveyorError(f"attach: {len(places)} arguments given, expected SCENE and URL, or URL alone")
    scene, url = places[0] if len(places) > 1 else None, places[-1]
    given = {name: more.pop(name) for name in ACCESS}
    password = _password(user, password_file, given["user_certificate"])
    access = PlcAccess(user, password, certificates=opcua_certificates, **given)
    if browse:
        click.echo(_browsed(url, access, console, scene, more["options"]), nl=False)
        return
    if scene is None:
        _trust(url, access, console)
        return
    if tags is None:
        raise ConveyorError("--tags: missing, expected a map of tags (`conveyor-sim attach URL --browse` prints one)")
    with ExitStack() as stack:
        source = stack.enter_context(scene_source(scene, console, **more))
        kind = plc_kind(url, tags, access, period, console.print, source.observe)
        with Serving(source, [(kind, 0)], ServerSettings()) as serving:
            source.control("resume", 0.0, "")
            watch(serving, console, [f"{url} commands the line, and reads its signals"])
            summary = serving.summary()
    tell_end(summary, source.recordings)


def _password(user: str, file: Path | None, user_certificate: Path | None) -> str:
    from conveyor_sim.protocols.server.password_file import read_password

    if user and user_certificate is not None:
        raise ConveyorError("--user-certificate: given with --user, expected one of them")
    if file is not None and not user:
        raise ConveyorError("--password-file: given without --user, expected both")
    if not user:
        return ""
    password = read_password(file, PASSWORD, "the PLC")
    if file is not None and not password:
        raise ConveyorError(f"{file}: line 1 is empty, expected the password of the PLC")
    return password or str(click.prompt("password", hide_input=True, err=True))


def _require_opcua(url: str, option: str) -> None:
    from conveyor_sim.protocols.attach.links import refuse_user

    refuse_user(url)
    if not url.startswith("opc.tcp://"):
        raise ConveyorError(f"{option}: given with {printable(url)}, expected opc.tcp://host:port")


def _trust(url: str, access: PlcAccess, console: Console) -> None:
    if not access.trust:
        raise ConveyorError("attach: URL alone given, expected SCENE and URL, or --browse or --trust")
    _require_opcua(url, "--trust")
    from conveyor_sim.protocols.attach.opcua_client import trust_server
    from conveyor_sim.protocols.hosting.server_thread import ServerThread

    with ServerThread() as thread:
        thread.run(trust_server(url, access, console.print))


def _browsed(url: str, access: PlcAccess, console: Console, scene: str | None, options: SceneOptions) -> str:
    """Return the map of a PLC's variables, with the names of the tags of a scene where they match."""
    _require_opcua(url, "--browse")
    from conveyor_sim.protocols.attach.opcua_browse import browse, tag_rows
    from conveyor_sim.protocols.hosting.server_thread import ServerThread
    from conveyor_sim.report.tags import line_tags

    tags = () if scene is None else line_tags(options.load(scene))
    with console.status(f"{url}: browsing") as status, ServerThread() as thread:
        variables = thread.run(
            browse(url, access, console.print, lambda nodes, numbers: status.update(f"{nodes} nodes, {numbers} tags"))
        )
    console.print(f"{url}: {len(variables)} variables that hold a number or a bool")
    return tag_rows(variables, tags)
