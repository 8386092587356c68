"""Report the numbers of threads that the libraries are given once the command line is loaded."""

from __future__ import annotations

import json
import os

import gapbeam.command_line  # noqa: F401 - chooses them
from gapbeam.solver.run.rank_threads import THREADS

print(json.dumps([os.environ.get(name) for name in THREADS]))
