"""Call the command line several times, as argument 1 lists by name; in the call "nan" rank 1 gets a NaN on its way.

Reports status and words of every rank by name.
"""

from __future__ import annotations

import json
import sys
from typing import Any

import numpy as np
from mpi4py import MPI

from gapbeam.solver.integrators.midpoint import Midpoint
from gapbeam.solver.system.semi_discrete import VALUE
from tests.programs.captured_call import captured

advance = Midpoint.advance


def spoiled(self: Midpoint, system: Any, condensed: Any, law: Any, old: Any, *others: Any, **options: Any) -> Any:
    """Advance as the scheme does, after a NaN has come into the state of rank 1."""
    if MPI.COMM_WORLD.rank == 1 and old.time > 0.002:
        old.v[VALUE][:] = np.nan
    return advance(self, system, condensed, law, old, *others, **options)


words = {}
for name, arguments in json.loads(sys.argv[1]).items():
    if name == "nan":
        Midpoint.advance = spoiled  # type: ignore[method-assign]
    ranks = MPI.COMM_WORLD.gather(captured(arguments))
    if MPI.COMM_WORLD.rank == 0:
        words[name] = ranks
if MPI.COMM_WORLD.rank == 0:
    print(json.dumps(words))
