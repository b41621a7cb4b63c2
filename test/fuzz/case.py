# SPDX-License-Identifier: Apache-2.0
"""A case: a scene, commands and how many ticks; as two YAML files, so that a failure can be run again by anyone."""

from __future__ import annotations

import io
from dataclasses import asdict, dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

from fuzz.commands import Command, commands
from fuzz.families import Family
from fuzz.scenes import scenes
from hypothesis import strategies as st
from ruamel.yaml import YAML

from conveyor_sim.scene.yaml_lines import Document

MOST_TICKS = 200


@dataclass(frozen=True)
class Case:
    """What is played: the same in every run, in which ticks are divided into calls of `advance` differently."""

    scene: dict[str, Any]
    ticks: int
    commands: list[Command] = field(default_factory=list)
    calls: list[int] = field(default_factory=lambda: [7])
    """Ticks in a call of `advance`, in turn, where the run is divided; commands divide it as well."""
    threads: int = 2
    """Of the run that is the same but for them; the others have one."""
    recorded: bool = True
    """Whether it is recorded and replayed from the bag, too."""

    @cached_property
    def scene_text(self) -> str:
        """The scene file."""
        return yaml_text(self.scene)

    def script_text(self) -> str:
        """The rest as YAML."""
        script = {name: value for name, value in asdict(self).items() if name != "scene"}
        return yaml_text(script)

    def __repr__(self) -> str:
        return f"\n--- scene\n{self.scene_text}--- script\n{self.script_text()}"

    def save(self, folder: Path, name: str, comment: str = "") -> Path:
        """Writes NAME.yaml, the scene, and NAME.script.yaml into a folder; returns the first."""
        folder.mkdir(parents=True, exist_ok=True)
        file = folder / f"{name}.yaml"
        head = "".join(f"# {line}\n" for line in comment.splitlines())
        file.write_text(head + self.scene_text, encoding="utf-8")
        file.with_suffix(".script.yaml").write_text(self.script_text(), encoding="utf-8")
        return file


def load_case(file: Path) -> Case:
    """The case that a scene file and the script beside it are."""
    scene, script = (
        Document(one.read_text(encoding="utf-8"), one.name).data for one in (file, file.with_suffix(".script.yaml"))
    )
    sent = [
        Command(one["tick"], tuple(one["names"]), tuple(map(float, one["values"])), one.get("fault", False))
        for one in script["commands"]
    ]
    return Case(scene, **{**script, "commands": sent})


def yaml_text(data: Any) -> str:
    """Data as YAML that reads as the same data, NaN and infinity included."""
    yaml = YAML(typ="safe", pure=True)
    yaml.default_flow_style = None
    yaml.width = 120
    yaml.sort_base_mapping_type_on_output = False
    stream = io.StringIO()
    yaml.dump(plain(data), stream)
    return stream.getvalue()


def plain(data: Any) -> Any:
    """Tuples as lists."""
    if isinstance(data, dict):
        return {key: plain(value) for key, value in data.items()}
    return [plain(value) for value in data] if isinstance(data, (list, tuple)) else data


@st.composite
def cases(draw: st.DrawFn, family: Family, beyond: bool = True) -> Case:
    """A case of a family; `beyond` as for scenes."""
    scene = draw(scenes(family, beyond))
    ticks = draw(st.sampled_from([MOST_TICKS, MOST_TICKS, MOST_TICKS // 2, 1]))
    sent = draw(commands(scene, ticks))
    calls = draw(st.lists(st.integers(1, 30), min_size=1, max_size=3))
    return Case(scene, ticks, sent, calls, draw(st.sampled_from([1, 1, 2])), draw(st.integers(0, 3)) == 0)
