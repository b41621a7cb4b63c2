"""Which of a controller's variables are recorded, and what they are after a scan."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from fnmatch import fnmatchcase

from conveyor_sim.control.scan import ControlError

MOST = 1000
"""Variables that are recorded of a controller: as many numbers and names for each of its scans."""

PREFIX = "plc/"
"""What names of a program's variables begin with; a pattern may leave it out."""

_LISTED = 20


def patterns(record: str | Iterable[str]) -> tuple[str, ...]:
    """Those that were given, one or several."""
    return (record,) if isinstance(record, str) else tuple(record)


class RecordedVariables:
    """The variables of a controller that are recorded."""

    names: tuple[str, ...]
    """In the controller's order; none where nothing is to be recorded."""

    def __init__(self, controller: object, record: Sequence[str] = ()) -> None:
        """record: patterns beside those of the controller's own attribute `record`. * stands for anything and ? for a
        letter; v[1] is element 1.

        Raises ControlError for a pattern that fits none, and for more variables than MOST.
        """
        self._controller = controller
        wanted = [*getattr(controller, "record", ()), *record]
        known = tuple(self.variables) if wanted else ()
        found = {name for pattern in wanted for name in _fitting(pattern, known)}
        if len(found) > MOST:
            raise ControlError(f"record: found {len(found)} variables, expected at most {MOST}")
        self.names = tuple(name for name in known if name in found)

    @property
    def variables(self) -> Mapping[str, float]:
        """All variables that the controller shows, by name."""
        variables: Mapping[str, float] = getattr(self._controller, "variables", {})
        return variables

    def values(self) -> tuple[float, ...]:
        """What they are now, in the order of `names`."""
        now = self.variables
        return tuple(float(now[name]) for name in self.names)


def _fitting(pattern: str, known: Sequence[str]) -> list[str]:
    plain = pattern.lower().replace("[", "[[]")
    found = [name for name in known if any(fnmatchcase(name.lower(), one) for one in (plain, PREFIX + plain))]
    if not found:
        listed = ", ".join(known[:_LISTED]) + (", ..." if len(known) > _LISTED else "")
        expected = f"a pattern of {listed}" if known else "a controller that shows variables"
        raise ControlError(f"record: found {pattern!r}, which fits no variable, expected {expected}")
    return found
