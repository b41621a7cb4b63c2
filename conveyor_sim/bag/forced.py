# SPDX-License-Identifier: Apache-2.0
"""Forced signals of a recording."""

from __future__ import annotations

from conveyor_sim.bag.messages.encode import to_image
from conveyor_sim.bag.reader import Bag
from conveyor_sim.line.commands.inputs import FORCE
from conveyor_sim.support.printable import printable


def forced_signals(bag: Bag) -> tuple[str, ...]:
    """Return the names of the signals that were forced at any time, in the order of their first forcing."""
    names: dict[str, None] = {}
    for frame in bag.messages("signals"):  # the first has signals forced before the start
        names.update((bag.line.signal_names[place], None) for place in to_image(frame.data).forced)
        break
    word = FORCE.encode()
    for _, _, data in bag.raw({"outcomes"}):
        if word not in data:  # decoding the commands of each scan would take long
            continue
        outcome = bag.decode("outcomes", data)
        if outcome.accepted and outcome.operation == FORCE:
            names.update(dict.fromkeys(outcome.names))
    return tuple(printable(name) for name in names)
