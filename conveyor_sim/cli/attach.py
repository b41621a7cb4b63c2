# SPDX-License-Identifier: Apache-2.0
"""The command attach."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import Any

import click
from rich.console import Console

from conveyor_sim.cli.output import Number
from conveyor_sim.cli.scene_options import scene_options
from conveyor_sim.cli.serve import scene_source, tell_end, watch
from conveyor_sim.support.garbage import collected_later


@click.command()
@click.argument("scene")
@click.argument("url")
@click.option("--tags", required=True, type=click.Path(path_type=Path), help="CSV file: our tags, and theirs.")
@click.option("--user", default="", help="Of OPC UA (default: anonymous); the password is asked for.")
@click.option("--period", type=Number(0.001, 10.0), default=0.01, help="s from scan to scan (default: 0.01).")
@click.option("--real-time-factor", type=Number(0.001, 1e6), default=1.0, help="Of the simulation.")
@click.option("--duration", type=float, help="Simulated time in s, instead of the scene's.")
@click.option(
    "--out", "--record", "out", type=click.Path(path_type=Path), help="Folder to record to (default: runs/<UTC time>)."
)
@click.option("--no-record", is_flag=True, help="Nothing is written.")
@click.option("--threads", type=click.IntRange(1), help="Threads to step with.")
@scene_options
def attach(scene: str, url: str, tags: Path, user: str, period: float, **of_scene: Any) -> None:
    """Have the PLC at URL control SCENE in real time.

    URL is that of the PLC's server: opc.tcp://host:port, modbus://host:port, s7://host/rack/slot (Siemens),
    eip://host/slot (Rockwell) or ads://net-id:port?host=address (Beckhoff). The line writes its signals there, and
    reads what the PLC commands. The simulation does not wait for the PLC; the lag is reported. Ctrl-C ends it.
    """
    with collected_later():
        from conveyor_sim.protocols.attach.free_running import plc_kind
        from conveyor_sim.protocols.hosting.serving import Serving
        from conveyor_sim.protocols.hosting.settings import ServerSettings

    console = Console(stderr=True, markup=False, highlight=False, soft_wrap=True)
    password = click.prompt("password", hide_input=True, err=True) if user else ""
    with ExitStack() as stack:
        source = stack.enter_context(scene_source(scene, console, **of_scene))
        kind = plc_kind(url, tags, user, password, period, console.print, source.observe)
        with Serving(source, [(kind, 0)], ServerSettings()) as serving:
            source.control("resume", 0.0, "")
            watch(serving, console, [f"{url} commands the line, and reads its signals"])
            summary = serving.summary()
    tell_end(summary, source.recordings)
