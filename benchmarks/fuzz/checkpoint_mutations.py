"""Corruption of checkpoints: as files, and with a checksum that fits the corrupt contents."""

from __future__ import annotations

import hashlib
import io
import json
import os
import random
import shutil
import tempfile
import zipfile
from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import cache, partial
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np

from benchmarks.fuzz.mutations import put_in_place, spoil_bytes, spoil_hdf5, spoil_json, spoil_text
from benchmarks.fuzz.sandbox import DEMO, PROJECT, STOPPED, Stopped, command
from gapbeam.solver.run.checkpoint.checkpoint_files import VERSION
from gapbeam.solver.run.checkpoint.kept_model import EXPANSION, sum_of
from gapbeam.solver.run.checkpoint.state_checks import NODES, POINTS

Parts = tuple[bytes, bytes]  # JSON, arrays
APART = {EXPANSION, NODES, POINTS}  # not in the checksum of the matrices


def spoil_checkpoint(content: bytes, chance: random.Random) -> bytes:
    """Return another checkpoint: other bytes, another first line, or other contents with the checksum that fits."""
    draw = chance.random()
    if draw < 0.1:
        return spoil_bytes(content, chance)
    line, _, body = content.partition(b"\n")
    words = line.split(b" ")
    if draw < 0.2:
        words[chance.randrange(len(words))] = chance.choice(
            (b"2", b"0", b"-1", b"9" * 15, b"9" * 400, b"", b"x", b"gapbeam-checkpoint", b"\0", b"f" * 64)
        )
        return b" ".join(words) + b"\n" + body
    text, block = _halves(content)
    if draw < 0.55:
        text = spoil_json(text, chance)
    else:
        block = chance.choice(_BLOCKS)(block, chance)
    return sealed(text, block, words[1])


def spoil_kept_model(kept: Path, checkpoints: Sequence[Path], chance: random.Random) -> None:
    """Spoil the matrices that reduced models resume with, and make the checkpoints ask for the spoiled ones."""
    text, block = _halves(kept.read_bytes())
    header = json.loads(text)
    block = chance.choice(_BLOCKS)(block, chance)
    with suppress(Exception):  # no arrays any more
        header["basis"] = sum_of({name: array for name, array in opened(block).items() if name not in APART})
    kept.write_bytes(sealed(json.dumps(header).encode(), block))
    for path in checkpoints:
        text, block = _halves(path.read_bytes())
        text = json.dumps(json.loads(text) | {"basis": header["basis"]}).encode()
        path.write_bytes(sealed(text, block))


def _halves(content: bytes) -> Parts:
    line, _, body = content.partition(b"\n")
    size = int(line.split(b" ")[3])
    return body[:size], body[size:]


def sealed(text: bytes, block: bytes, version: bytes = b"%d" % VERSION) -> bytes:
    """Return a checkpoint of these contents, with a checksum that fits."""
    total = hashlib.sha256(text + block).hexdigest().encode()
    words = (b"gapbeam-checkpoint", version, total, b"%d" % len(text), b"%d" % len(block))
    return b" ".join(words) + b"\n" + text + block


def opened(block: bytes) -> dict[str, np.ndarray]:
    """Return the arrays of a checkpoint, by name."""
    with np.load(io.BytesIO(block)) as stored:
        return {name: stored[name] for name in stored.files}


def closed(arrays: dict[str, np.ndarray], compressed: bool = False) -> bytes:
    """Return arrays as checkpoints hold them."""
    packed = io.BytesIO()
    (np.savez_compressed if compressed else np.savez)(packed, **arrays)  # type: ignore[arg-type]
    return packed.getvalue()


def _bytes(block: bytes, chance: random.Random) -> bytes:
    return spoil_bytes(block, chance)


def _value(block: bytes, chance: random.Random) -> bytes:
    """Replace one number."""
    arrays, name = _drawn(block, chance)
    if arrays[name].size:
        place = chance.randrange(arrays[name].size)
        old = arrays[name].flat[place]
        whole = arrays[name].dtype.kind != "f"
        numbers = (-1, 0, 10**6, 2**31 - 1, old + 1) if whole else (
            np.nan, np.inf, -np.inf, 1e308, -1e308, 1e30, 0.0, -1.0, 1.0, 2.0 * old, -old, 1e-320
        )  # fmt: skip
        arrays[name].flat[place] = chance.choice(numbers)
    return closed(arrays)


def _all(block: bytes, chance: random.Random) -> bytes:
    """Replace all numbers of an array."""
    arrays, name = _drawn(block, chance)
    arrays[name] = np.full(arrays[name].shape, chance.choice((np.nan, 0.0, 1.0, 1e300, -1.0)))
    return closed(arrays)


def _scaled(block: bytes, chance: random.Random) -> bytes:
    """Take an array in another unit, or the other way round."""
    arrays, name = _drawn(block, chance)
    arrays[name] = chance.choice((1e3, 1e-3, -1.0, 2.0)) * arrays[name]
    return closed(arrays)


def _shape(block: bytes, chance: random.Random) -> bytes:
    arrays, name = _drawn(block, chance)
    array = arrays[name]
    arrays[name] = chance.choice(
        (array.reshape(-1), array[None], array[:0], array[:-1], np.concatenate([array, array]), array.T, np.zeros(()),
         np.zeros((3, 0)), np.zeros((1,) * 32), array.reshape(-1)[::-1].reshape(array.shape))
    )  # fmt: skip
    return closed(arrays)


def _kind(block: bytes, chance: random.Random) -> bytes:
    arrays, name = _drawn(block, chance)
    kind = chance.choice(("f4", "i8", "c16", "S8", "U3", "?", "M8[s]", ">f8", "V4"))
    arrays[name] = np.zeros(arrays[name].shape, kind) if kind in ("S8", "U3", "M8[s]", "V4") else (
        np.nan_to_num(arrays[name]).astype(kind)
    )  # fmt: skip
    return closed(arrays)


def _names(block: bytes, chance: random.Random) -> bytes:
    """Drop, swap or add arrays."""
    arrays, name = _drawn(block, chance)
    draw = chance.random()
    if draw < 0.5:
        del arrays[name]
    elif draw < 0.8:
        other = chance.choice(sorted(arrays))
        arrays[name], arrays[other] = arrays[other], arrays[name]
    else:
        more = ("modal_9", "modal_0", "a", "lagged", "traction", "closed_since", "mesh_u", "x", "../../precious/owned")
        arrays[chance.choice(more)] = arrays[name]
    return closed(arrays)


def _bomb(block: bytes, chance: random.Random) -> bytes:
    """Arrays that are far larger than the file, or that would run code when they are read."""
    arrays, name = _drawn(block, chance)
    draw = chance.randrange(4)
    if draw == 0:
        arrays[name] = np.zeros(chance.choice((10**7, 3 * 10**8)))
        return closed(arrays, compressed=True)
    if draw == 1:
        arrays[name] = np.array([{"a": 1}], dtype=object)
        return closed(arrays)
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED if draw == 2 else zipfile.ZIP_STORED) as archive:
        for other, array in arrays.items():
            data = io.BytesIO()
            np.save(data, array)
            content = data.getvalue()
            if other == name:
                shape = repr(array.shape).encode()
                claimed = chance.choice((b"(10000000000,)", b"(3, 1000000000000000)", b"(-1,)", b"(True,)"))
                content = content.replace(shape, claimed, 1)
            archive.writestr(f"{other}.npy", content)
    return packed.getvalue()


def _drawn(block: bytes, chance: random.Random) -> tuple[dict[str, np.ndarray], str]:
    arrays = opened(block)
    return arrays, chance.choice(sorted(arrays))


_BLOCKS: tuple[Callable[[bytes, random.Random], bytes], ...] = (
    _bytes, _value, _value, _value, _all, _scaled, _shape, _kind, _names, _names, _bomb,
)  # fmt: skip

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
