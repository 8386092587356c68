"""Independent normal numbers by their count: any of them at any time, the same ones wherever they are asked for.

A counter-based generator turns a key and a counter into random bits without a state. The key is a hash of the seed
and of a name, the counter is the place in the sequence; pairs of uniform numbers become pairs of normal ones (Box and
Muller), which takes a fixed number of bits.

Source: Salmon, Moraes, Dror and Shaw, Parallel random numbers: as easy as 1, 2, 3 (2011); Philox4x64-10 of NumPy.
"""

from __future__ import annotations

import hashlib

import numpy as np

from gapbeam.solver.system.operators import Array

WORDS = 4  # of 64 bits that a count of the generator gives
ORIGIN = 2**62  # counts before the first block: numbers before t = 0 are asked for as well
_UNIT = 2.0**-53


def noise_key(seed: int, name: str) -> int:
    """Return the key of a sequence, 128 bits: sequences of other seeds or names are independent."""
    return int.from_bytes(hashlib.sha256(f"{seed} {name}".encode()).digest()[:16], "little")


def normal_block(key: int, block: int, size: int) -> Array:
    """Return a block of independent normal numbers of mean 0 and variance 1, (size,).

    Args:
        key: Of the sequence.
        block: Number of the block; it may be negative.
        size: A multiple of 4.
    """
    bits = np.random.Philox(key=key, counter=ORIGIN + block * (size // WORDS)).random_raw(size)
    first, second = (bits.reshape(-1, 2).T >> np.uint64(11)).astype(float) * _UNIT
    radius, angle = np.sqrt(-2.0 * np.log(first + _UNIT)), 2.0 * np.pi * second
    return np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1).ravel()
