"""Call gapbeam with a line of progress at every look."""

from __future__ import annotations

import sys

import gapbeam.solver.run.output.progress as progress
from gapbeam.command_line import main

progress.LINE = 0.0
main(sys.argv[1:])
