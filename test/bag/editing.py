# SPDX-License-Identifier: Apache-2.0
"""Bags that are another bag with some of its messages changed."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from conveyor_sim.bag.messages.topics import OUTPUTS
from conveyor_sim.bag.messages.typestore import typestore
from conveyor_sim.bag.reader import open_bag
from conveyor_sim.bag.recorder import Recorder

Edit = Callable[[str, Any], None]


def edited(bag: Path, folder: Path, edit: Edit) -> Path:
    """A copy of a bag in which `edit(topic, decoded message)` has changed messages."""
    store = typestore()
    with open_bag(bag) as opened, Recorder(folder) as recorder:
        for topic, log_time, data in opened.raw():
            kind = OUTPUTS[topic].type
            message = opened.decode(topic, data)
            edit(topic, message)
            recorder.write(topic, bytes(store.serialize_cdr(message, kind)), log_time)
    return folder
