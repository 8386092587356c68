"""Runs that continue from what others left: spoiled checkpoints, and spoiled results beside whole checkpoints."""

from __future__ import annotations

import os
import random
import shutil
import tempfile
from collections.abc import Callable
from functools import cache, partial
from pathlib import Path
from typing import Any
from unittest import mock

from benchmarks.fuzz.checkpoint_mutations import spoil_checkpoint, spoil_kept_model
from benchmarks.fuzz.checkpoint_seeds import DEMO, PROJECT, STOPPED, Stopped
from benchmarks.fuzz.command_work import command
from benchmarks.fuzz.mutations import put_in_place, spoil_bytes, spoil_hdf5, spoil_json, spoil_text

WRONG = 0.01  # of the largest value: allowed difference between the histories of a resumed and an uninterrupted run
BESIDE = (
    "history.h5", "history.h5", "summary.json", "summary.json", "case.toml", "fields.xdmf", "fields.h5",
    "run.log", "run.lock", "history.h5.part", "checkpoint", "fields", "summary.json.part", "fields/000001.h5",
    "fields.h5.part", "fields.xdmf.part", "checkpoint/model.checkpoint",
)  # fmt: skip


def checkpoints(seeds: Path, folder: Path, chance: random.Random) -> Callable[[], int]:
    """Spoil one or both checkpoints of a stopped run, and resume it."""
    run, copy = _copy(seeds, folder, chance)
    paths = sorted((copy / "checkpoint").glob("step-*"))
    kept = copy / "checkpoint" / "model.checkpoint"
    spoiled = paths if chance.random() < 0.4 else [chance.choice((paths[-1], paths[-1], paths[0]))]
    if kept.exists() and chance.random() < 0.5:
        spoil_kept_model(kept, paths, chance)
        spoiled = []
    (folder / "input").mkdir()
    for path in spoiled:
        path.write_bytes(spoil_checkpoint(path.read_bytes(), chance))
        shutil.copy(path, folder / "input")  # the run takes them away when it is done
    if chance.random() < 0.06:
        places = (*paths, kept, paths[-1].with_name(f"{paths[-1].name}.part"))
        put_in_place(chance.choice(places), folder / "precious", chance)
    return partial(_go_on, run, seeds, copy)


def beside(seeds: Path, folder: Path, chance: random.Random) -> Callable[[], int]:
    """Spoil the files next to the checkpoints, and resume the run."""
    run, copy = _copy(seeds, folder, chance)
    path = copy / chance.choice(BESIDE)
    draw = chance.random()
    if not path.is_file() or draw < 0.3:
        if path.is_dir():
            shutil.rmtree(path)
        path.parent.mkdir(exist_ok=True)
        put_in_place(path, folder / "precious", chance)
    elif path.suffix == ".h5" and draw < 0.7:
        spoil_hdf5(path, chance)
    else:
        spoil = {".json": spoil_json, ".toml": spoil_text, ".xdmf": spoil_text}.get(path.suffix, spoil_bytes)
        path.write_bytes(spoil(path.read_bytes(), chance))
    return partial(_go_on, run, seeds, copy)


def _copy(seeds: Path, folder: Path, chance: random.Random) -> tuple[Stopped, Path]:
    run = chance.choice(STOPPED)
    os.chdir(PROJECT)  # where this process was last is gone
    _warm(run, seeds)
    copy = folder / "out"
    shutil.copytree(seeds / run.name, copy)
    return run, copy


@cache
def _warm(run: Stopped, seeds: Path) -> None:
    """Go on with a run once before processes are forked, so that they find compiled what they need."""
    with tempfile.TemporaryDirectory() as folder:
        shutil.copytree(seeds / run.name, Path(folder) / "out")
        if _go_on(run, seeds, Path(folder) / "out"):
            raise SystemExit(f"{run.name} does not go on")


@cache
def _built(run: Stopped) -> Any:
    """Return the model of a run."""
    from mpi4py import MPI

    from gapbeam.solver.case.reading.case_reader import read_case
    from gapbeam.solver.models.model import build_model

    return build_model(read_case(DEMO, list(run.keys)), MPI.COMM_SELF)


def _go_on(run: Stopped, seeds: Path, copy: Path) -> int:
    """Resume, and compare the result with the run without interruption."""
    import gapbeam.solver.run.run_case

    words = [word for key in run.keys for word in ("--set", key)]
    model = _built(run)
    with mock.patch.object(gapbeam.solver.run.run_case, "build_model", return_value=model):
        status = command("run", DEMO, *words, "--resume", "--output", copy)()
    if status == 0 and (wrong := _wrong(copy, seeds / f"{run.name}-whole")):
        raise AssertionError(f"taken as it was, and wrong in silence: {wrong}")
    return status


def _wrong(one: Path, other: Path) -> str:
    """Return in what the history of a run is not that of another, in words."""
    import numpy as np

    from gapbeam.postprocess.results.results import open_results
    from gapbeam.postprocess.results_errors import ResultsError

    try:
        found, expected = open_results(one).history, open_results(other).history
    except ResultsError:  # refused by whoever reads it
        return ""
    if len(found["time"]) != len(expected["time"]):
        return f"{len(found['time'])} records, expected {len(expected['time'])}"
    last = slice(-len(expected["time"]) // 4, None)  # well after the checkpoints
    for name in ("displacement", "velocity", "contact_force", "kinetic_energy", "strain_energy"):
        if name not in found:
            return f"no {name}"
        size = float(np.max(np.abs(expected[name].values)))
        if not np.allclose(found[name].values[last], expected[name].values[last], rtol=0.0, atol=WRONG * size):
            return name
    return ""
