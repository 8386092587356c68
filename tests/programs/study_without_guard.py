"""A script that sweeps a case without looking whether it is the main module, and notes each time that it runs."""

import sys
from pathlib import Path

import gapbeam

_, case, folder, *overrides = sys.argv
with Path(folder, "runs.txt").open("a", encoding="utf-8") as file:
    file.write("run\n")
found = gapbeam.sweep(case, {"support.clearance": [0.1e-3, 0.2e-3]}, overrides, workers=2, output=Path(folder, "sweep"))
print(found)
