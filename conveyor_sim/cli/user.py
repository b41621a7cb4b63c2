# SPDX-License-Identifier: Apache-2.0
"""The command user: an entry in the file of those who may do more than read by OPC UA and on the page."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from conveyor_sim.protocols.server.users import Role

ROLES = ("viewer", "operator", "engineer", "controller", "test")


@click.command()
@click.argument("file", type=click.Path(path_type=Path))
@click.argument("name")
@click.option("--role", type=click.Choice(ROLES), default="viewer", help="What they may do (default: only read).")
@click.password_option(help="Asked for if it is left out, which is better: who looks over the processes sees this.")
def user(file: Path, name: str, role: Role, password: str) -> None:
    """Add a user to FILE, or give NAME another role and password.

    FILE is for `conveyor-sim serve --users`. It has hashes of passwords; a line that is deleted is a user less.
    """
    from conveyor_sim.protocols.server.users import keep_user, new_user

    os.umask(0o077)
    keep_user(file, name, new_user(role, password))
    click.echo(f"{name}: {role}, in {file}")
