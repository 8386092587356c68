"""Compile a kernel; reports where it is kept, and what it computed."""

from __future__ import annotations

import numpy as np

from gapbeam.solver.jit import cache_folder
from gapbeam.solver.march.compiled.array_loops import fill

x = np.zeros(3)
fill(x, 2.0)
print(cache_folder(), x.sum())
