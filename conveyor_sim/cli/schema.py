# SPDX-License-Identifier: Apache-2.0
"""Command schema: the JSON Schema of scene files."""

import json

import click


@click.command()
def schema() -> None:
    """Print the JSON Schema of scene files, with which an editor completes, documents and checks them.

    Save it and name it in the first line of a scene: `# yaml-language-server: $schema=scene.schema.json`.
    """
    from conveyor_sim.scene.json_schema import scene_schema

    click.echo(json.dumps(scene_schema(), indent=2, ensure_ascii=False))
