"""Checkpoints and results folders that came from elsewhere: what fuzzing found, and what it is likely to find again."""

from __future__ import annotations

import io
import json
import os
import shutil
import zipfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from mpi4py import MPI
from numpy.typing import NDArray

import gapbeam
from benchmarks.fuzz.checkpoint_mutations import closed, opened, sealed
from gapbeam.solver.case.case import Case
from gapbeam.solver.case.reading.case_reader import read_case
from gapbeam.solver.diagnostics.history_rows import Recorder
from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.models.model import Model, build_model
from gapbeam.solver.run.checkpoint.checkpoints import Left, last_checkpoint
from gapbeam.solver.run.checkpoint.kept_model import EXPANSION, sum_of
from gapbeam.solver.run.checkpoint.resume import find_left
from gapbeam.solver.run.checkpoint.same_model import keys_of
from gapbeam.solver.run.checkpoint.state_checks import NODES, POINTS
from gapbeam.solver.run.output.history_file import HistoryWriter
from gapbeam.solver.run.output.results_folder import check_folder
from tests.shared.command import DEMO, RATTLE, alone
from tests.shared.interrupted import stopped_after

pytestmark = alone

BRIEF = (*RATTLE, "time.end=0.012", "output.fields_interval=2e-3")
FRICTION = "contact.friction={coefficient=0.3, static_coefficient=0.4, slip_velocity=1e-3}"
RUBBING = (*BRIEF, FRICTION, "time.adaptive=true")
REDUCED = (*RATTLE, "time.end=0.05", "model.type=reduced", "model.modes=8", "model.shapes=5")

Arrays = dict[str, NDArray[Any]]
Header = dict[str, Any]


class Stopped:
    """A run that was stopped with checkpoints, and its model."""

    def __init__(self, keys: tuple[str, ...], folder: Path, stops: int) -> None:
        self.folder, self.case = folder, read_case(DEMO, keys)
        with stopped_after(stops):
            assert gapbeam.run(DEMO, keys, folder).exit_status == 143
        self.model: Model = build_model(self.case, MPI.COMM_SELF)

    def copied(self, where: Path) -> Path:
        """Return a copy of the results that a test may spoil."""
        return Path(shutil.copytree(self.folder, where))

    def last(self, folder: Path) -> Left | None:
        """Return where the run in a folder was left."""
        return last_checkpoint(folder, self.case, self.model, MPI.COMM_SELF, keys_of(self.model.case))


@pytest.fixture(scope="module")
def rubbing(tmp_path_factory: pytest.TempPathFactory) -> Stopped:
    """A full model with friction and adaptive steps."""
    return Stopped(RUBBING, tmp_path_factory.mktemp("rubbing") / "out", 30)


@pytest.fixture(scope="module")
def reduced(tmp_path_factory: pytest.TempPathFactory) -> Stopped:
    """A reduced model, compiled."""
    return Stopped(REDUCED, tmp_path_factory.mktemp("reduced") / "out", 3)


def parts_of(path: Path) -> tuple[Header, Arrays]:
    line, _, body = path.read_bytes().partition(b"\n")
    size = int(line.split(b" ")[3])
    return json.loads(body[:size]), opened(body[size:])


def spoil(folder: Path, change: Callable[[Header, Arrays], Any]) -> None:
    """Change the checkpoints of a run, with checksums that fit."""
    for path in (folder / "checkpoint").glob("step-*"):
        header, arrays = parts_of(path)
        change(header, arrays)
        path.write_bytes(sealed(json.dumps(header).encode(), closed(arrays)))


HEADERS: dict[str, tuple[Callable[[Header], Any], str]] = {
    "time": (lambda h: h.update(time=float("nan")), "its time is nan"),
    "later": (lambda h: h.update(time=2 * h["time"]), "its time is"),
    "steps": (lambda h: h.update(done=-1), "negative"),
    "records": (lambda h: h.update(records=0), "negative"),
    "fields": (lambda h: h.update(fields=["x"]), "times of its fields"),
    "order": (lambda h: h["fields"].reverse() or h["fields"].append(0.0), "times of its fields"),
    "seat": (lambda h: h["seat"].update(base_force="a lot"), "its seat"),
    "counts": (lambda h: h["accounts"]["gates"].update(impacts=-3), "expected a count"),
    "words": (lambda h: h["accounts"]["tally"].update(steps="3"), "expected a number"),
    "infinite": (lambda h: h["accounts"]["ledger"].update(structural=float("inf")), "expected a number"),
    "faces": (lambda h: h["accounts"]["episodes"].update(running={"0": [1]}), "expected two numbers"),
    "missing": (lambda h: h["accounts"].pop("peaks"), "its accounts cannot be read"),
    "energy": (lambda h: h["accounts"]["ledger"].update(kinetic=3.0), "its kinetic energy is 3.0 J, expected"),
    "velocity": (lambda h: h["accounts"]["recorder"].update(_last_velocity=[[1.0]]), "expected finite numbers"),
}
ARRAYS: dict[str, tuple[Callable[[Arrays], Any], str]] = {
    "unit": (
        lambda a: a.update(u=1e3 * a["u"]),
        "the depth of the contact points is not that of u; its strain energy is",
    ),
    "value": (lambda a: a["v"].__setitem__((0, 7, 0), a["v"][0, 7, 0] + 0.1), "v and what mass and stiffness"),
    "backward": (lambda a: a.update(v=-a["v"]), "the probes do not move as in the last record"),
    "nan": (lambda a: a["v"].__setitem__((0, 0, 0), np.nan), "other things than finite numbers"),
    "depth": (lambda a: a.update(depth=a["depth"] + 1e-5), "the depth of the contact points"),
    "pressure": (lambda a: a["pressure"].__setitem__(3, 1e30), "far beyond the largest force"),
    "traction": (lambda a: a["traction"].__setitem__(3, 1e30), "far beyond the largest force"),
    "closed": (lambda a: a.update(closed_since=a["closed_since"] * 0.0 - 1.0), "times that are none"),
    "flat": (lambda a: a.update(u=a["u"].reshape(-1)), "do not fit"),
    "longer": (lambda a: a.update(pressure=np.append(a["pressure"], 0.0)), "do not fit"),
    "nothing": (lambda a: a.update(depth=np.zeros(())), "do not fit"),
    "single": (lambda a: a.update(u=a["u"].astype("f4")), "other things than finite numbers"),
    "words": (lambda a: a.update(pressure=np.full(a["pressure"].shape, "x")), "other things than"),
    "gone": (lambda a: a.pop("depth"), "depth is missing"),
    "slides": (lambda a: a["slides"].__setitem__(3, 0.5), "points neither stick nor slide"),
    "slides gone": (lambda a: a.pop("slides"), "slides is missing"),
    "closed gone": (lambda a: a.pop("closed_since"), "closed_since is missing"),
    "nodes": (lambda a: a.update(nodes=a["nodes"] + 1.0), "do not fit"),
}


@pytest.mark.parametrize("name", HEADERS)
def test_headers_that_do_not_belong(name: str, rubbing: Stopped, tmp_path: Path) -> None:
    """Numbers that are none, counts below 0, an energy that differs from the state's: refused though checksums fit."""
    change, words = HEADERS[name]
    folder = rubbing.copied(tmp_path / "out")
    spoil(folder, lambda header, _: change(header))
    with pytest.raises(UserError, match=words):
        rubbing.last(folder)


@pytest.mark.parametrize("name", ARRAYS)
def test_states_that_are_none(name: str, rubbing: Stopped, tmp_path: Path) -> None:
    """Other shapes, types and units, NaN, a motion that is not that of its images: refused though checksums fit."""
    change, words = ARRAYS[name]
    folder = rubbing.copied(tmp_path / "out")
    spoil(folder, lambda _, arrays: change(arrays))
    with pytest.raises(UserError, match=words):
        rubbing.last(folder)


@pytest.mark.slow(minutes=0.3)
def test_whole_checkpoints_pass(rubbing: Stopped, reduced: Stopped, tmp_path: Path) -> None:
    """What nobody spoiled is gone on with, also when it was packed anew."""
    for number, run in enumerate((rubbing, reduced)):
        folder = run.copied(tmp_path / str(number))
        spoil(folder, lambda *_: None)
        assert isinstance(run.last(folder), Left)


@pytest.mark.parametrize("part", ["watch", "recorder"])
def test_accounts_of_another_form(part: str, rubbing: Stopped, tmp_path: Path) -> None:
    """Those that only a run restores, too: refused before anything in the folder changes."""
    folder = rubbing.copied(tmp_path / "out")
    spoil(folder, lambda header, _: header["accounts"].update({part: {}}))
    with pytest.raises(UserError, match=r"accounts( of the last checkpoint)? cannot be read"):
        gapbeam.run(DEMO, RUBBING, folder, resume=True)


def test_compiled_loops_with_another_state(reduced: Stopped, tmp_path: Path) -> None:
    """The modal coordinates of a compiled loop belong to its state."""
    folder = reduced.copied(tmp_path / "out")
    spoil(folder, lambda _, arrays: arrays.update(modal_0=2.0 * arrays["modal_0"]))
    with pytest.raises(UserError, match="the state of the compiled loop is another one"):
        reduced.last(folder)


@pytest.mark.parametrize(
    ("name", "factor", "words"),
    [
        ("stiffness", 2.0, "respond otherwise"),
        ("mass", 1.01, "respond otherwise"),
        ("restraint", 1.5, "respond otherwise"),
        ("patterns", 3.0, "respond otherwise"),
        ("contact.gap_matrix.data", -1.0, "respond otherwise"),
        ("contact.initial_gap", 2.0, "other places, areas or gaps"),
        (EXPANSION, 2.0, "moves otherwise"),
        ("stiffness", float("nan"), "other things than finite numbers"),
        ("mass", 0.0, "other things than finite numbers"),
        ("mass", -1.0, "those of this model"),
        ("contact.faces", 9.0, "do not fit"),
    ],
)
def test_kept_matrices_of_another_model(name: str, factor: float, words: str, reduced: Stopped, tmp_path: Path) -> None:
    """The matrices that another number of ranks goes on with are those of the case, in whatever basis."""
    folder = reduced.copied(tmp_path / "out")
    path = folder / "checkpoint" / "model.checkpoint"
    header, arrays = parts_of(path)
    if name != EXPANSION:  # its checksum is not among those that decide
        arrays["patterns"] = arrays["patterns"] * (1.0 + 1e-9)
    arrays[name] = arrays[name] * factor if factor else np.zeros(arrays[name].shape, "M8[s]")
    changed = sum_of({key: array for key, array in arrays.items() if key not in (NODES, POINTS, EXPANSION)})
    if name == EXPANSION:
        changed = header["basis"]
    path.write_bytes(sealed(json.dumps(header | {"basis": changed}).encode(), closed(arrays)))
    spoil(folder, lambda header, _: header.update(basis=changed))
    if name == EXPANSION:
        reduced.last(folder)  # the basis found anew is the same one: what was kept is not looked at
        return
    with pytest.raises(UserError, match=words):
        reduced.last(folder)


def test_arrays_that_are_larger_than_their_file(rubbing: Stopped, tmp_path: Path) -> None:
    """Zeros of 8 GB packed into some kilobytes, shapes that are claimed, and pickles: refused, none of it is made."""
    folder = rubbing.copied(tmp_path / "out")
    [path] = (folder / "checkpoint").glob("step-*")
    header, arrays = parts_of(path)
    text = json.dumps(header).encode()
    for block, words in ((bomb(), "larger than it is"), (claimed(arrays), "claimed|reshape|size|EOF|memory|read|array"),
                        (closed(arrays | {"u": np.array([{}], dtype=object)}), "pickled objects")):  # fmt: skip
        path.write_bytes(sealed(text, block))
        with pytest.raises(UserError, match=words):
            rubbing.last(folder)


def bomb() -> bytes:
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive, archive.open("u.npy", "w") as file:
        np.lib.format.write_array_header_1_0(file, {"descr": "<f8", "fortran_order": False, "shape": (10**9,)})  # type: ignore[arg-type]
        for _ in range(200):
            file.write(bytes(10**6))
    return packed.getvalue()


def claimed(arrays: Mapping[str, NDArray[Any]]) -> bytes:
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as archive:
        for name, array in arrays.items():
            content = io.BytesIO()
            np.save(content, array)
            shape = repr(array.shape).encode()
            archive.writestr(
                f"{name}.npy", content.getvalue().replace(shape, b"(3, 1000000000000000)"[: len(shape)], 1)
            )
    return packed.getvalue()


@pytest.mark.parametrize("text", ['{"status": "completed"}', "[" * 100_000, '{"status": "completed", "message": []}'])
def test_summaries_that_are_none_do_not_end_a_run(text: str, rubbing: Stopped, tmp_path: Path) -> None:
    """A summary that says done without a word, or is no JSON: the checkpoint decides."""
    folder = rubbing.copied(tmp_path / "out")
    (folder / "summary.json").write_text(text, encoding="utf-8")
    assert isinstance(find_left(folder, rubbing.case, rubbing.model, MPI.COMM_SELF), Left)


@pytest.mark.parametrize(
    "name",
    ["run.log", "run.lock", "history.h5", "summary.json", "case.toml", "fields.h5", "checkpoint", "fields", "history",
     "checkpoint/step-000000000099.checkpoint", "checkpoint/model.checkpoint", "history/000000000100.h5"],
)  # fmt: skip
@pytest.mark.parametrize("kind", ["link", "pipe", "folder"])
def test_nothing_is_written_or_read_elsewhere(name: str, kind: str, rubbing: Stopped, tmp_path: Path) -> None:
    """Links, pipes and folders instead of what a run writes: refused before anything is opened or changed."""
    folder, precious = rubbing.copied(tmp_path / "out"), tmp_path / "precious"
    precious.write_text("precious", encoding="utf-8")
    path = folder / name
    if kind == "folder" and name in ("checkpoint", "fields", "history"):
        kind = "file"
    if path.is_dir():
        shutil.rmtree(path)
    path.unlink(missing_ok=True)
    path.parent.mkdir(exist_ok=True)
    match kind:
        case "link":
            path.symlink_to(precious)
        case "pipe":
            os.mkfifo(path)
        case "folder":
            path.mkdir()
        case "file":
            path.touch()
    with pytest.raises(UserError, match=rf"{name}: found a {kind}, expected a f"):
        check_folder(folder, True)
    assert precious.read_text(encoding="utf-8") == "precious"


def _huge(file: h5py.File) -> None:
    del file["contact_force"]
    file.create_dataset("contact_force", shape=(10**12, 2), dtype="f8", maxshape=(None, 2), chunks=(256, 2))


def _linked(file: h5py.File) -> None:
    del file["contact_force"]
    file["contact_force"] = h5py.ExternalLink("/etc/passwd", "/x")


def _shaped(file: h5py.File) -> None:
    del file["contact_force"]
    file.create_dataset("contact_force", shape=(1000, 7), dtype="f8", maxshape=(None, 7))


def _missing(file: h5py.File) -> None:
    del file["contact_force"]


def _timeless(file: h5py.File) -> None:
    file["time"][2] = 0.0


@pytest.mark.parametrize("change", [_huge, _linked, _shaped, _missing, _timeless])
def test_histories_of_another_form(change: Callable[[h5py.File], None], rubbing: Stopped, tmp_path: Path) -> None:
    """Data of another shape or in another file, 16 TB that are not there, times that stand still: not gone on after."""
    folder = rubbing.copied(tmp_path / "out")
    with h5py.File(folder / "history.h5", "r+") as file:
        change(file)
    case: Case = rubbing.case
    assert case.title
    with pytest.raises(UserError, match=r"history\.h5 cannot be read \((contact_force|its times)"):
        HistoryWriter(folder, Recorder(rubbing.case, rubbing.model).labels, 3)
