"""Import gapbeam; print as JSON which heavy modules that loads, which names are missing or hidden, and the version."""

from __future__ import annotations

import json
import sys

import gapbeam

heavy = [name for name in ("numpy", "dolfinx", "mpi4py", "matplotlib", "pydantic") if name in sys.modules]
missing = [name for name in gapbeam.__all__ if getattr(gapbeam, name) is None]
hidden = sorted(set(gapbeam.__all__) - set(dir(gapbeam)))
print(json.dumps([heavy, missing, gapbeam.__version__, hidden]))
