# SPDX-License-Identifier: Apache-2.0
"""Actions of an operator at the panel in words: `press start`, `turn mode auto`, `set speed 0.4`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from conveyor_sim.errors import CommandError
from conveyor_sim.line.commands.refusal import refusal
from conveyor_sim.line.tag import PANEL, Tag
from conveyor_sim.support.printable import printable

ACTIONS: Mapping[str, tuple[tuple[str, ...], float | None]] = {
    "press": (("press", "pressed"), 1.0),
    "release": (("press", "pressed"), 0.0),
    "turn": (("turn",), None),
    "reset": (("reset",), 1.0),
    "set": (("set",), None),
}
"""By action: the last parts of the names of the tags that it sets, and the value; None: the action has a value."""

LATCHING = "emergency_stop"
"""Class of the devices that a release does not move."""


class PanelInputs:
    """Inputs of the panel of one line, by the names of its parts."""

    def __init__(self, tags: Sequence[Tag]) -> None:
        """tags: all tags of the line."""
        self._parts: dict[str, dict[str, Tag]] = {}
        for tag in tags:
            if tag.role == PANEL:
                _, name, what = tag.name.split("/")
                self._parts.setdefault(name, {})[what] = tag

    def command(self, action: str, name: str, value: str | float | None = None) -> tuple[str, float]:
        """Return the tag and the value of an action on a part of the panel.

        value: position of a selector, by name or number, or a number; None for actions without a value. Raise
        CommandError with the expectation.
        """
        if action not in ACTIONS:
            raise CommandError(f"{printable(action)}: no such action, expected one of {', '.join(ACTIONS)}")
        parts = [part for part in self._parts if self._tag(action, part) is not None]
        tag = self._tag(action, name)
        if tag is None:
            known = f"one of {', '.join(parts)}" if parts else "none: the panel has none for it"
            raise CommandError(f"{action} {printable(name)}: no such input, expected {known}")
        given = ACTIONS[action][1]
        if (given is None) != (value is not None):
            expected = "a value" if given is None else "no value"
            raise CommandError(f"{action} {name}: {printable(value)} given, expected {expected}")
        number = given if given is not None else _number(tag, value)
        if number is None or refusal({tag.name: tag}, "input", [tag.name], [number]):
            expected = ", ".join(tag.texts.values()) if tag.texts else f"{tag.low:g} to {tag.high:g} {tag.unit}"
            raise CommandError(f"{action} {name}: {printable(value)} given, expected {expected.removesuffix(' 1')}")
        return tag.name, number

    def parse(self, text: str) -> tuple[str, float]:
        """Return the tag and the value of an action in words. Raise CommandError with the expectation."""
        words = text.split()
        if not 2 <= len(words) <= 3:
            raise CommandError(
                f"{printable(text)} given, expected an action such as press start or set speed 0.4, with one of "
                f"{', '.join(ACTIONS)}"
            )
        return self.command(*words)

    def _tag(self, action: str, name: str) -> Tag | None:
        for what in ACTIONS[action][0]:
            tag = self._parts.get(name, {}).get(what)
            if tag is not None and (action != "release" or tag.device_class != LATCHING):
                return tag
        return None


def _number(tag: Tag, value: str | float | None) -> float | None:
    """Return a value of a tag as a number; None for a text that is none."""
    for number, text in tag.texts.items():
        if value == text:
            return float(number)
    try:
        return None if value is None or isinstance(value, bool) else float(value)
    except (TypeError, ValueError, OverflowError):
        return None
