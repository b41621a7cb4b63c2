# SPDX-License-Identifier: Apache-2.0
"""The command demo."""

from __future__ import annotations

import os
import webbrowser

import click
from rich.console import Console

from conveyor_sim.cli.scene_options import SceneOptions
from conveyor_sim.cli.serve import scene_source, watch
from conveyor_sim.support.garbage import collected_later

SCENE = "small_packaging"
"""Scene and controller in the folder of the examples, without suffix."""

DURATION = 3600.0
"""Simulated time, s."""

DISPLAYS = ("DISPLAY", "WAYLAND_DISPLAY", "WSL_DISTRO_NAME")
"""Variables of which one is set where a browser can open a window."""


@click.command()
@click.option("--port", type=click.IntRange(0, 65535), default=0, help="Port of the page (default: any free one).")
@click.option("--no-browser", is_flag=True, help="Print the address only.")
def demo(port: int, no_browser: bool) -> None:
    """Show a packaging line with its controller on the live page.

    Three lanes feed an accumulation table, a single-file lane, a filler, a reject and a packer. Nothing is recorded.
    Ctrl-C ends it.
    """
    with collected_later():
        from conveyor_sim.protocols.hosting.server_kinds import SERVER_KINDS
        from conveyor_sim.protocols.hosting.serving import Serving
        from conveyor_sim.protocols.hosting.settings import ServerSettings
        from conveyor_sim.support.resources import examples_dir

    web = next(kind for kind in SERVER_KINDS if kind.name == "web")
    web.require()
    console = Console(stderr=True, markup=False, highlight=False, soft_wrap=True)
    scene = examples_dir() / f"{SCENE}.yaml"
    with (
        scene_source(
            str(scene),
            console,
            out=None,
            no_record=True,
            duration=DURATION,
            real_time_factor=1.0,
            threads=None,
            options=SceneOptions(),
            controller=f"{scene.with_suffix('.py')}:controller",
        ) as source,
        Serving(source, [(web, port)], ServerSettings(), console.print) as serving,
    ):
        source.control("resume", 0.0, "")
        page = serving.hosts[0].address
        if not no_browser and any(os.environ.get(name) for name in DISPLAYS):
            webbrowser.open(page)
        watch(serving, console, [f"{page}: {SCENE} with its controller; scene and program are in {scene.parent}"])
