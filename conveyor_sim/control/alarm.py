"""What a controller declares of its alarms, once, before its first scan: how bad they are, whether they latch, ..."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, fields


@dataclass(frozen=True)
class Alarm:
    """One alarm. Whether it is on, the controller says in every scan, by the key `alarms/<id>` of its answer.

    With `high` or `low` it says nothing: the line watches the signal `tag` itself. Times in s.
    """

    id: str
    text: str = ""
    """What it says; empty: its id."""
    alarm_class: str = "warning"
    """error, warning or message."""
    priority: int | None = None
    """1 to 1000; None: by its class."""
    tag: str | None = None
    """The signal that it is about."""
    high: float | None = None
    low: float | None = None
    deadband: float = 0.0
    on_delay: float = 0.0
    off_delay: float = 0.0
    latching: bool = False
    """Whether it stands until it is acknowledged and reset."""
    suppressed_by: Sequence[str] = ()
    """Ids of alarms that it follows from."""
    group: str = ""
    """Within which the first to come is marked."""

    def as_text(self) -> str:
        """All but the id, as a JSON object; what is as by default is left out."""
        given = {key: value for key, value in asdict(self).items() if value != _DEFAULTS[key]}
        del given["id"]
        return json.dumps(given)


_DEFAULTS = {field.name: field.default for field in fields(Alarm)}
