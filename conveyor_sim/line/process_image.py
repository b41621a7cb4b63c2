"""The process image: all tags that a controller may read and write, once per tick, by name."""

from collections.abc import Sequence
from dataclasses import dataclass, field

from conveyor_sim.line.tag import COMMANDS, SIGNALS, Role, Tag


@dataclass(frozen=True)
class ProcessImage:
    """Tags of a line, and tables of them by role. Values are sent in the order of these tables."""

    tags: tuple[Tag, ...]
    signals: tuple[Tag, ...] = field(init=False)
    commands: tuple[Tag, ...] = field(init=False)
    faults: tuple[Tag, ...] = field(init=False)
    """Faults. Tests inject them, controllers don't see them."""
    signal_names: tuple[str, ...] = field(init=False)
    command_names: tuple[str, ...] = field(init=False)
    fault_names: tuple[str, ...] = field(init=False)

    def __post_init__(self) -> None:
        for table, roles in (("signal", SIGNALS), ("command", COMMANDS), ("fault", ("fault",))):
            chosen = of_roles(self.tags, roles)
            object.__setattr__(self, f"{table}s", chosen)
            object.__setattr__(self, f"{table}_names", tuple(tag.name for tag in chosen))

    @property
    def command_limits(self) -> dict[str, tuple[float, float]]:
        """Minimum and maximum of each command, by name."""
        return {tag.name: (tag.low, tag.high) for tag in self.commands}


def of_roles(tags: Sequence[Tag], roles: Sequence[Role]) -> tuple[Tag, ...]:
    """Return the tags that have one of some roles, in their order."""
    return tuple(tag for tag in tags if tag.role in roles)


def speed_command(belt: str) -> str:
    """Return the name of a belt's speed setpoint, which is also its topic."""
    return f"belts/{belt}/cmd_speed"


def speed_topics(belts: Sequence[str], commands: Sequence[str]) -> list[str]:
    """Return the topics of speed setpoints, of all belts and of named drives, from names of belts and commands.

    Belts that a named drive moves have a topic, too, because a refusal with a reason is better than no answer.
    """
    drives = [name for name in commands if name.startswith("drives/") and name.endswith("/cmd_speed")]
    return [*map(speed_command, belts), *drives]
