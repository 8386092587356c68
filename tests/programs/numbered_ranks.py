"""Call gapbeam after every rank has left the number of its process in a folder, and its standard error beside it.

    python3 -m tests.programs.numbered_ranks FOLDER [--apart] [ARGUMENT ...]

--apart: standard error goes to the file said-RANK in the folder.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

from mpi4py import MPI

folder, rank = Path(sys.argv.pop(1)), MPI.COMM_WORLD.rank
(folder / str(rank)).write_text(str(os.getpid()), encoding="ascii")
if sys.argv[1] == "--apart":
    sys.argv.pop(1)
    os.dup2(os.open(folder / f"said-{rank}", os.O_WRONLY | os.O_CREAT), 2)

from gapbeam.command_line import main  # noqa: E402 - after the number is there

main(sys.argv[1:])
