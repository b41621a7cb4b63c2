# SPDX-License-Identifier: Apache-2.0
"""`Alarm`: a controller's declaration of an alarm, made before its first scan: class, priority, latching, ..."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, fields


@dataclass(frozen=True)
class Alarm:
    """Alarm of a controller. It is on or off by the key `alarms/<id>` of each scan's answer.

    With `high` or `low` the controller reports nothing: the line watches the signal `tag`. Times in s.
    """

    id: str
    text: str = ""
    """Text of the alarm; "": its id."""
    alarm_class: str = "warning"
    """error, warning or message."""
    priority: int | None = None
    """Priority from 1 to 1000; None: by its class."""
    tag: str | None = None
    """Signal that the alarm is about."""
    high: float | None = None
    low: float | None = None
    deadband: float = 0.0
    on_delay: float = 0.0
    off_delay: float = 0.0
    latching: bool = False
    """True if the alarm stands until it is acknowledged and reset."""
    suppressed_by: Sequence[str] = ()
    """Ids of alarms that suppress this one, because they cause it."""
    group: str = ""
    """Group within which the first alarm is marked."""

    def as_text(self) -> str:
        """Return all fields except the id as a JSON object, without those at their defaults."""
        changed = {key: value for key, value in asdict(self).items() if value != _DEFAULTS[key]}
        del changed["id"]
        return json.dumps(changed)


_DEFAULTS = {field.name: field.default for field in fields(Alarm)}
