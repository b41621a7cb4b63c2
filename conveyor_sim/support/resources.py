# SPDX-License-Identifier: Apache-2.0
"""Folders of the files that ship beside the code: scenes (config/), examples and message definitions (msg_defs/)."""

from __future__ import annotations

import os
from functools import lru_cache
from pathlib import Path

from conveyor_sim.errors import ConveyorError, SceneError


@lru_cache(maxsize=1)
def share_dir() -> Path:
    """Return the folder that holds config/ and msg_defs/.

    It is the checkout, or share/conveyor_sim below the prefix of an installation: the environment's for pip, the
    package's for colcon. Raises ConveyorError if neither is there.
    """
    for parent in Path(__file__).resolve().parents:
        for candidate in (parent, parent / "share" / "conveyor_sim"):
            if (candidate / "config").is_dir() and (candidate / "msg_defs" / "msg").is_dir():
                return candidate
    raise ConveyorError(
        f"{Path(__file__).parent}: the folders config and msg_defs were not installed with conveyor_sim; "
        "expected them in share/conveyor_sim of the same prefix"
    )


def config_dir() -> Path:
    """Return the folder of the scenes that ship with conveyor_sim."""
    return share_dir() / "config"


def examples_dir() -> Path:
    """Return the folder of the example lines that ship with conveyor_sim."""
    return share_dir() / "examples"


def msg_defs_dir() -> Path:
    """Return the folder whose msg/ and srv/ define the package conveyor_msgs."""
    return share_dir() / "msg_defs"


def in_config(path: Path) -> Path | None:
    """Return a path relative to config/, with or without `config/` at its start. None if it leads out of there."""
    if path.is_absolute() or ".." in path.parts:
        return None
    return config_dir().joinpath(*(path.parts[1:] if path.parts[:1] == ("config",) else path.parts))


def scene_path(name_or_path: str | Path) -> Path:
    """Return the scene file of a path, or of the name of a shipped scene ("paper_plant", "scenarios/zoned_line").

    `.yaml` and `config/` may be left out. A file relative to the working directory has priority over a shipped one.
    Raises SceneError if there is neither.
    """
    try:
        path = Path(name_or_path).expanduser()
    except RuntimeError:  # ~ of a user who is not there
        path = Path(name_or_path)
    # What is no regular file is refused where it is read, and says why.
    if os.path.exists(path) and not os.path.isdir(path):
        return path
    shipped = in_config(path.with_suffix(".yaml") if path.name else path)
    if shipped is not None and os.path.isfile(shipped):
        return shipped
    # Beside the hall are parts of lines, which are no scenes.
    scenes = [*config_dir().glob("*.yaml"), *config_dir().glob("scenarios/*.yaml"), config_dir() / "brewery/hall.yaml"]
    names = ", ".join(sorted(scene.relative_to(config_dir()).with_suffix("").as_posix() for scene in scenes))
    raise SceneError(f"{name_or_path}: no such scene file; expected a path, or the name of a shipped scene ({names})")
