# SPDX-License-Identifier: Apache-2.0
"""Serialized messages have the bytes that rosbags makes of the same values."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from conveyor_sim.bag.messages.cdr import CODES, behind_tick, packer
from conveyor_sim.bag.messages.topics import TOPICS
from conveyor_sim.bag.messages.typestore import typestore

TYPES = sorted({topic.type for topic in TOPICS.values() if topic.type.startswith("conveyor_msgs/")})
TEXTS = ("", "a", "infeeds/infeed/fed", "Zuführung 1 ▲", "x" * 1000)


def value_of(kind: int, details: Any, random: np.random.Generator, longest: int) -> Any:
    """Some value of a field, as rosbags takes it."""
    if kind == 1:
        (base, _) = details
        if base == "string":
            return str(random.choice(TEXTS))
        return (
            np.frombuffer(random.bytes(8), dtype=np.dtype(base))[0].item()
            if base != "bool"
            else bool(random.integers(2))
        )
    (part, _) = details
    count = int(random.integers(longest + 1))
    if part[0] == 2:  # a message
        return [message_of(part[1], random, longest) for _ in range(count)]
    base, _ = part[1]
    if base == "string":
        return [str(text) for text in random.choice(TEXTS, count)]
    return np.frombuffer(random.bytes(8 * count), dtype=np.dtype(base))[:count].copy()


def message_of(type_name: str, random: np.random.Generator, longest: int) -> Any:
    """Some message that is part of another one."""
    store = typestore()
    fields = store.fielddefs[type_name][1]
    return store.types[type_name](**{name: value_of(*what, random, longest) for name, what in fields})


@pytest.mark.parametrize("type_name", TYPES)
def test_every_message_has_the_bytes_that_rosbags_makes(type_name: str) -> None:
    store, random = typestore(), np.random.default_rng(7)
    time, head = (store.types[name] for name in ("builtin_interfaces/msg/Time", "std_msgs/msg/Header"))
    for number in range(60):
        frame, stamp, tick = str(random.choice(TEXTS)), int(random.integers(1, 10**18)), int(random.integers(2**63))
        fields = store.fielddefs[type_name][1][2:]
        values = {name: value_of(*what, random, longest=number // 6) for name, what in fields}
        header = head(stamp=time(*divmod(stamp, 10**9)), frame_id=frame)
        expected = store.serialize_cdr(store.types[type_name](header=header, tick=tick, **values), type_name)
        assert packer(type_name).pack(frame, stamp, tick, values.__getitem__) == bytes(expected)


@pytest.mark.parametrize("frame", TEXTS)
def test_messages_of_other_ticks_share_the_bytes_behind_the_tick(frame: str) -> None:
    pack = packer("conveyor_msgs/msg/Belts").pack
    first, same, other = (
        pack(frame, 10**9 * tick + 1, tick, {"commanded": [speed], "actual": [speed]}.__getitem__)
        for tick, speed in ((1, 0.5), (7, 0.5), (7, 0.25))
    )
    assert first != same and behind_tick(first) == behind_tick(same) != behind_tick(other)
    assert first.endswith(behind_tick(first)) and len(behind_tick(first)) >= 16
    for unknown in (b"\x00\x00" + first[2:], first[:20], first[:7]):  # big endian; cut short
        assert behind_tick(unknown) == unknown


def test_arrays_of_other_types_are_brought_to_the_field_and_strided_ones_are_packed_in_order() -> None:
    pack = packer("conveyor_msgs/msg/Signals").pack
    plain = np.arange(5.0)
    expected = pack("world", 1, 0, lambda _: plain)
    for values in (np.arange(5), np.arange(10.0)[::2] / 2.0, (0, 1, 2, 3, 4), plain.astype(np.float32)):
        assert pack("world", 1, 0, lambda _, values=values: values) == expected


def test_a_type_with_anything_else_is_refused_at_once() -> None:
    for type_name, why in (("std_msgs/msg/Bool", "header and a tick"), ("geometry_msgs/msg/PoseArray", "tick")):
        with pytest.raises(ValueError, match=why):
            packer(type_name)


def test_all_numbers_have_a_code() -> None:
    for base, code in CODES.items():
        assert np.dtype(base) == np.dtype(code)
