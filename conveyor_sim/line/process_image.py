"""The process image: all that a controller may read and write, once a tick, by name."""

from collections.abc import Sequence
from dataclasses import dataclass, field

from conveyor_sim.line.tag import COMMANDS, SIGNALS, Role, Tag


@dataclass(frozen=True)
class ProcessImage:
    """The tags of a line, and three tables of them by role. Values travel in the order of these tuples."""

    tags: tuple[Tag, ...]
    signals: tuple[Tag, ...] = field(init=False)
    commands: tuple[Tag, ...] = field(init=False)
    faults: tuple[Tag, ...] = field(init=False)
    """Not for controllers: a test injects them."""
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
    """Those of some roles, in their order."""
    return tuple(tag for tag in tags if tag.role in roles)


def speed_command(belt: str) -> str:
    """Name of a belt's speed setpoint; also the topic that takes it."""
    return f"belts/{belt}/cmd_speed"
