"""Call gapbeam with a line of progress after every step."""

from __future__ import annotations

import sys

import gapbeam.solver.run.output.progress as progress
from gapbeam.command_line import main
from gapbeam.solver.march import simulation as gathered_steps

progress.LINE = 0.0
gathered_steps.MOST_STEPS = 1
main(sys.argv[1:])
