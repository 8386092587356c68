"""Hold an HDF5 file, argument 1, open for writing until standard input ends."""

from __future__ import annotations

import sys

import h5py

file = h5py.File(sys.argv[1], "a")
print("open", flush=True)
sys.stdin.read()
