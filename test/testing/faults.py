# SPDX-License-Identifier: Apache-2.0
"""Faults of the answers of a PLC, drawn by a seed."""

from __future__ import annotations

import random
import time
from collections.abc import Callable

from testing.faulty_proxy import Fault

DELAY = 0.05
"""s"""


def flipped(rng: random.Random, data: bytes) -> bytes:
    """A few bits are wrong."""
    damaged = bytearray(data)
    for _ in range(rng.randint(1, 4)):
        damaged[rng.randrange(len(damaged))] ^= 1 << rng.randrange(8)
    return bytes(damaged)


def headed(rng: random.Random, data: bytes) -> bytes:
    """One of the first bytes is wrong: lengths and kinds of messages."""
    damaged = bytearray(data)
    damaged[rng.randrange(min(8, len(damaged)))] = rng.randrange(256)
    return bytes(damaged)


def delayed(_: random.Random, data: bytes) -> bytes:
    time.sleep(DELAY)
    return data


WRONG_VALUES: dict[str, Callable[[random.Random, bytes], bytes | None]] = {
    "flipped": flipped,
    "headed": headed,
    "garbage": lambda rng, _: rng.randbytes(rng.randint(1, 200)),
}
"""Faults after which a value may be wrong, because no protocol of these has a checksum above TCP's."""
RIGHT_VALUES: dict[str, Callable[[random.Random, bytes], bytes | None]] = {
    "doubled": lambda _, data: data + data,
    "extended": lambda rng, data: data + rng.randbytes(rng.randint(1, 50)),
    "delayed": delayed,
    "silent": lambda _, data: b"",
    "closed": lambda _, data: None,
}
"""Faults after which a value is right, or there is none."""


def after(count: int, damage: Callable[[random.Random, bytes], bytes | None], rng: random.Random) -> Fault:
    """Return the fault that begins after `count` answers."""
    passed = 0

    def fault(data: bytes) -> bytes | None:
        nonlocal passed
        passed += 1
        return data if passed <= count else damage(rng, data)

    return fault


def cut_off(count: int, rng: random.Random) -> Fault:
    """Return the fault that passes on a part of the answer after `count`, then ends the connection."""
    passed = 0

    def fault(data: bytes) -> bytes | None:
        nonlocal passed
        passed += 1
        if passed <= count:
            return data
        return data[: rng.randrange(len(data))] if passed == count + 1 else None

    return fault
