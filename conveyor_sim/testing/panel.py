# SPDX-License-Identifier: Apache-2.0
"""`OperatorPanel`: the panel of a line under test, as its operator uses it."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from conveyor_sim.line.commands.panel_actions import PanelInputs
from conveyor_sim.line.tag import Tag


class OperatorPanel:
    """The panel of a line. Actions act at the next tick, in every control mode.

    Each action raises CommandError for an unknown part, and for a part or a value that does not fit the action.
    """

    def __init__(self, tags: Sequence[Tag], set_: Callable[[str, float], None]) -> None:
        """tags: all tags of the line. set_: sets an input of the panel as an operator."""
        self._inputs = PanelInputs(tags)
        self._set = set_

    def press(self, name: str) -> None:
        """Press a button until its release, or an emergency stop."""
        self._set(*self._inputs.command("press", name))

    def release(self, name: str) -> None:
        """Release a button. A press and a release before the same tick last one scan."""
        self._set(*self._inputs.command("release", name))

    def turn(self, name: str, position: str | int) -> None:
        """Turn a selector switch to a position, by name or number."""
        self._set(*self._inputs.command("turn", name, position))

    def reset(self, name: str) -> None:
        """Reset an emergency stop."""
        self._set(*self._inputs.command("reset", name))

    def set(self, name: str, value: float) -> None:
        """Enter a value in a numeric field, in the field's unit."""
        self._set(*self._inputs.command("set", name, value))
