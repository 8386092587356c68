"""Report which numerical libraries `import gapbeam` loads."""

from __future__ import annotations

import sys

import gapbeam  # noqa: F401 - what it loads is asked for

print([name for name in ("numpy", "scipy", "mpi4py", "petsc4py") if name in sys.modules])
