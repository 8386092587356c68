"""Run cases on ranks, stop them, and go on with what one rank and what these ranks began; compares what was kept."""

from __future__ import annotations

import json
import shutil
import sys
from pathlib import Path

import numpy as np
from mpi4py import MPI

import gapbeam
from gapbeam.solver.case.reading.case_reader import read_case
from gapbeam.solver.models.model import build_model
from gapbeam.solver.run.checkpoint.checkpoint_files import found, read_checkpoint
from gapbeam.solver.run.checkpoint.checkpoints import last_checkpoint
from gapbeam.solver.run.checkpoint.same_model import keys_of
from gapbeam.solver.run.checkpoint.state_checks import layout_of
from tests.shared.command import DEMO
from tests.shared.interrupted import stopped_after

comm = MPI.COMM_WORLD
for name, (keys, stop) in json.loads(sys.argv[2]).items():
    folder = Path(sys.argv[1]) / name
    assert gapbeam.run(DEMO, keys, folder / "whole").exit_status == 0
    with stopped_after(stop):
        assert gapbeam.run(DEMO, keys, folder / "begun").exit_status == 143
    if comm.rank == 0:
        shutil.copytree(folder / "begun", folder / "parts")
    comm.barrier()
    case = read_case(DEMO, keys)
    model = build_model(case, comm)
    left = last_checkpoint(folder / "from-one", case, model, comm, keys_of(model.case))
    assert left is not None
    layout, state = layout_of(left.model, comm), left.paused.state
    before = read_checkpoint(found(folder / "from-one")[0])
    rows, points = layout.found_in(before), layout.points_in(before)
    for key in ("u", "v"):
        held = before.array(key)
        if layout.spread_out:
            held = held[:, rows.places].reshape(3, -1)
        np.testing.assert_array_equal(getattr(state, key), held)
    for key in ("depth", "pressure"):
        np.testing.assert_array_equal(getattr(state, key), before.array(key)[points])
    for part in ("parts", "from-one"):
        assert gapbeam.run(DEMO, keys, folder / part, resume=True).exit_status == 0
