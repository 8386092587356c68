"""Call the command line several times, as argument 1 lists, in JSON; reports status and words of each, on rank 0."""

from __future__ import annotations

import json
import sys

from tests.programs.captured_call import captured

if __name__ == "__main__":  # the processes of a study import this file
    words = [captured(arguments) for arguments in json.loads(sys.argv[1])]

    from mpi4py import MPI  # the commands decide when MPI is loaded

    if MPI.COMM_WORLD.rank == 0:
        print(json.dumps(words))
