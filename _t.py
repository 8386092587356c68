import time
from mpi4py import MPI
import sys
from tests.models import *
from solver.analyses.modes import held_modes
from solver.case_file.reader import read_case
from pathlib import Path
from solver.model import build_model

for file, over in (
    ("demo", []),
    ("clamped", []),
    ("demo", ["model.type=reduced"]),
    ("demo", ["model.type=beam"]),
    ("li2013", []),
    ("li2013", ["model.type=reduced"]),
):
    t = time.time()
    m = build_model(read_case(Path(f"cases/{file}.toml"), over), MPI.COMM_WORLD)
    t1 = time.time()
    for h in held_modes(m, 4):
        if MPI.COMM_WORLD.rank == 0:
            print(
                file,
                over,
                h.name,
                h.closed,
                h.points,
                [(round(f, 2), x.kind[:4], round(x.share, 3)) for f, x in zip(h.frequencies, h.motions)],
                len(h.places),
            )
    print(t1 - t, time.time() - t1)
