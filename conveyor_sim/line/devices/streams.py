"""Streams of random numbers, one for each purpose of each device: two variants of a line draw the same ones."""

from hashlib import blake2b

import numpy as np

WORDS = 4
"""Of 32 bits, that stand for a device and a purpose in the key of its stream."""


def random_stream(seed: int, device: str, purpose: str) -> np.random.Generator:
    """The stream of one purpose ("jitter") of a device, by its name ("infeeds/inlet"), from the seed of a scene.

    Keyed by names and not by places in a list: what else is on the line changes nothing. A hash of both is the spawn
    key of NumPy's SeedSequence, which makes independent streams of one seed.
    """
    digest = blake2b(f"{device}\0{purpose}".encode(), digest_size=4 * WORDS).digest()
    key = tuple(int.from_bytes(digest[4 * n : 4 * n + 4], "little") for n in range(WORDS))
    return np.random.Generator(np.random.PCG64(np.random.SeedSequence(seed, spawn_key=key)))
