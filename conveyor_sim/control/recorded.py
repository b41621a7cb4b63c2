# SPDX-License-Identifier: Apache-2.0
"""`RecordedVariables`: variables of a controller that are recorded, with their values after a scan."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from fnmatch import fnmatchcase

from conveyor_sim.control.scan import PROGRAM, ControlError

MOST = 1000
"""Largest number of recorded variables of a controller. Every scan records that many numbers."""

_LISTED = 20


def patterns(record: str | Iterable[str]) -> tuple[str, ...]:
    """Return one or several patterns as a tuple."""
    return (record,) if isinstance(record, str) else tuple(record)


class RecordedVariables:
    """Recorded variables of a controller."""

    names: tuple[str, ...]
    """Names in the controller's order; () if none is recorded."""

    def __init__(self, controller: object, record: Sequence[str] = ()) -> None:
        """Select the variables by patterns.

        record: patterns beside those of the controller's attribute `record`. * matches any text and ? one character;
        v[1] is element 1. Raise ControlError for a pattern without a match, and for more variables than MOST.
        """
        self._controller = controller
        wanted = [*getattr(controller, "record", ()), *record]
        known = tuple(self.variables) if wanted else ()
        chosen = {name for pattern in wanted for name in _fitting(pattern, known)}
        if len(chosen) > MOST:
            raise ControlError(f"record: found {len(chosen)} variables, expected at most {MOST}")
        self.names = tuple(name for name in known if name in chosen)

    @property
    def variables(self) -> Mapping[str, float]:
        """Return all variables of the controller, by name."""
        variables: Mapping[str, float] = getattr(self._controller, "variables", {})
        return variables

    def values(self) -> tuple[float, ...]:
        """Return the present values, in the order of `names`."""
        now = self.variables
        return tuple(float(now[name]) for name in self.names)


def _fitting(pattern: str, known: Sequence[str]) -> list[str]:
    plain = pattern.lower().replace("[", "[[]")
    names = [name for name in known if any(fnmatchcase(name.lower(), one) for one in (plain, PROGRAM + plain))]
    if not names:
        listed = ", ".join(known[:_LISTED]) + (", ..." if len(known) > _LISTED else "")
        expected = f"a pattern of {listed}" if known else "a controller with variables"
        raise ControlError(f"record: found {pattern!r}, which fits no variable, expected {expected}")
    return names
