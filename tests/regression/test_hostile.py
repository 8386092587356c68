"""Hostile input ends with exit status 2 and a message: what fuzzing found, and what it is likely to find again."""

from __future__ import annotations

import json
import logging
import os
import random
import re
import time
import tomllib
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import reduce
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from benchmarks.fuzz.mutations import spoil_bytes, spoil_json, spoil_text
from benchmarks.fuzz.sandbox import Limits, attempt
from gapbeam.command_line import _dispatch, _terminal_handler
from gapbeam.meshes.mesh_errors import MeshError
from gapbeam.meshes.user_mesh.user_mesh import load_msh
from gapbeam.postprocess.results.bounded_files import as_written, read_json
from gapbeam.postprocess.results.results import open_results
from gapbeam.postprocess.results_errors import ResultsError
from gapbeam.process.terminal_text import harmless
from gapbeam.solver.case.reading.case_reader import read_case, read_case_tables
from gapbeam.solver.diagnostics.history_rows import Recorder
from gapbeam.solver.messages.errors import CaseError, UserError
from gapbeam.solver.run.output.disk_space import check_space, size_of_results
from gapbeam.solver.run.output.history_file import HistoryWriter
from gapbeam.solver.scene_file.scene_reader import read_scene
from gapbeam.solver.schema.record_table import (
    CASE_FILE,
    FIELDS_DATA_FILE,
    FIELDS_FILE,
    HISTORY,
    HISTORY_FILE,
    SUMMARY_FILE,
)
from gapbeam.studies.study_folder import StoredPiece, StoredResponse, checked, refuse_links, study_folder
from gapbeam.studies.sweep.sweep_plan import Sweep, chains_of, plan_of, point_file, prepare, read_points
from gapbeam.studies.tradeoff.run_tradeoff import stored_choice, study_key
from gapbeam.studies.trials.axes import points_of, read_axis
from gapbeam.studies.trials.subject import Subject
from tests.regression.test_postprocess_plot import sine_records
from tests.shared.case_texts import GOOD, written
from tests.shared.command import DEMO, PROJECT, alone
from tests.shared.models import beam_model
from tests.unit.test_postprocess_synthetic import write_fields, write_results

pytestmark = alone

BOMBS = {
    "json lists": b"[" * 200_000,
    "json objects": b'{"a":' * 100_000,
    "json number": b'{"format": ' + b"9" * 100_000 + b"}",
    "json nan": b'{"format": 1, "title": NaN}',
    "binary": bytes(range(256)) * 40,
    "empty": b"",
    "other": b'{"format": 99}',
    "list": b"[]",
}


IDENTIFIED = {
    "measurements": [], "unknowns": [], "notes": [], "tolerance": None, "rms": {"fit": None, "predict": None},
    "residual": "log10", "confidence": 0.95, "standard_deviation": 1.0, "standard_deviation_from": "nothing",
    "bound_of_misfit": 1.0, "sensitivity": [],
}  # fmt: skip


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the results of a run of two probes, with fields."""
    time = np.linspace(0.0, 0.25, 1251)
    folder = write_results(tmp_path_factory.mktemp("run") / "run", time, sine_records(time), probes=("middle", "tip"))
    points = np.array([[0.0, 0.0, 0.0], [0.5, 0.0, 0.0], [0.5, 0.1, 0.0], [0.0, 0.1, 0.0]])
    frames = [(time, np.zeros((4, 3)), np.zeros(4)) for time in (0.0, 0.1)]
    write_fields(folder, points, np.array([[0, 1, 2, 3]]), "Quadrilateral", frames)
    return folder


@pytest.fixture
def copy(run: Path, tmp_path: Path) -> Path:
    """Return a copy of the results that a test may spoil."""
    folder = tmp_path / "copy"
    folder.mkdir()
    for path in run.iterdir():
        (folder / path.name).write_bytes(path.read_bytes())
    return folder


def answer(folder: Path, *words: str | Path) -> str:
    """Return what a command says that must refuse its input: status 2, in bounded time and memory, no trace."""
    found = attempt(lambda: _dispatch([*map(str, words)], True), folder.parent / "said.txt", Limits(160.0, 2**31))
    assert found.kind == "refused", f"{found.kind}, status {found.status}: {found.printed[-1500:]}"
    return found.printed


@pytest.mark.parametrize("name", BOMBS)
def test_summaries_that_are_none(name: str, copy: Path) -> None:
    """Nested without end, numbers of any length, NaN, binary, another format: each reported in one error."""
    (copy / SUMMARY_FILE).write_bytes(BOMBS[name])
    with pytest.raises(ResultsError, match=r"summary\.json: found"):
        open_results(copy)


def _grown(file: h5py.File) -> None:
    del file["contact_force"]
    file.create_dataset("contact_force", shape=(10**12, 2), dtype="f8", chunks=(1000, 2))


def _linked(file: h5py.File) -> None:
    del file["displacement"]
    file["displacement"] = h5py.ExternalLink("/etc/passwd", "/x")


def _looped(file: h5py.File) -> None:
    del file["displacement"]
    file["displacement"] = h5py.SoftLink("/displacement")


def _outside(file: h5py.File) -> None:
    del file["penetration"]
    file.create_dataset("penetration", shape=(1251, 2), dtype="u1", external=[("/etc/passwd", 0, 2502)])


def _shaped(file: h5py.File) -> None:
    del file["time"]
    file["time"] = np.zeros((3, 3))


def _worded(file: h5py.File) -> None:
    del file["time"]
    file["time"] = [b"a", b"b"]


SPOILED: dict[str, tuple[Callable[[h5py.File], None], str]] = {
    "huge": (_grown, "data that are all there"),
    "link": (_linked, "a link to somewhere else"),
    "loop": (_looped, "a link to somewhere else"),
    "outside": (_outside, "another file"),
    "shape": (_shaped, "expected"),
    "words": (_worded, "expected"),
}


@pytest.mark.parametrize("name", SPOILED)
def test_histories_that_are_none(name: str, copy: Path) -> None:
    """Data of 16 TB that are not there, links out of the file and in circles, times in two dimensions or in words."""
    spoil, message = SPOILED[name]
    with h5py.File(copy / HISTORY_FILE, "r+") as file:
        spoil(file)
    said = answer(copy, "plot", copy)
    assert message in said
    assert not (copy / "figures").exists()


@pytest.mark.parametrize("keep", [0, 1, 100, 2048, 0.3, 0.6, 0.99])
def test_truncated_histories(keep: float, copy: Path) -> None:
    """Cut off anywhere: reported, without any of it being believed."""
    content = (copy / HISTORY_FILE).read_bytes()
    (copy / HISTORY_FILE).write_bytes(content[: int(keep * len(content) if isinstance(keep, float) else keep)])
    with pytest.raises(ResultsError, match=r"history\.h5: found"):
        _ = open_results(copy).history


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (f"{FIELDS_DATA_FILE}:/points", "../../etc/passwd:/points", "expected them from fields.h5"),
        (f"{FIELDS_DATA_FILE}:/points", "/dev/zero", "expected them from fields.h5"),
        ('Format="HDF"', 'Format="Binary"', "expected them from fields.h5"),
        ('Format="HDF"', 'Format="XML"', "expected them from fields.h5"),
        ("<Xdmf", '<!DOCTYPE x [<!ENTITY a SYSTEM "/etc/passwd">]><Xdmf', "document type"),
        (
            "<Domain>",
            '<Domain><xi:include href="/etc/passwd" xmlns:xi="http://www.w3.org/2001/XInclude"/>',
            "inclusion",
        ),
        (f"{FIELDS_DATA_FILE}:/points", f"{FIELDS_DATA_FILE}:/nowhere", "KeyError"),
        (f"{FIELDS_DATA_FILE}:/cells", f"{FIELDS_DATA_FILE}:/points", "corners"),
        ("Quadrilateral", "Nonsense", "cannot be read"),
        ("</Xdmf>", "", "cannot be read"),
    ],
)
def test_fields_from_elsewhere(old: str, new: str, message: str, copy: Path) -> None:
    """Files outside of the folder, devices, entities and inclusions are not opened; misfits are reported."""
    text = (copy / FIELDS_FILE).read_text(encoding="utf-8")
    assert old in text
    (copy / FIELDS_FILE).write_text(text.replace(old, new), encoding="utf-8")
    with pytest.raises(ResultsError, match=message), open_results(copy).fields():
        pass


@pytest.mark.parametrize("name", [SUMMARY_FILE, HISTORY_FILE, CASE_FILE, FIELDS_FILE, FIELDS_DATA_FILE])
@pytest.mark.parametrize("instead", ["folder", "pipe", "device", "loop", "nowhere"])
def test_other_things_instead_of_files(name: str, instead: str, copy: Path) -> None:
    """A folder, a pipe that nobody writes to, an endless device, a link to itself: no hang, no trace."""
    path = copy / name
    path.unlink()
    match instead:
        case "folder":
            path.mkdir()
        case "pipe":
            os.mkfifo(path)
        case "device":
            path.symlink_to("/dev/zero")
        case "loop":
            path.symlink_to(path)
        case "nowhere":
            path.symlink_to(copy / "nowhere")

    def work() -> int:
        with as_written(copy):
            results = open_results(copy)
            _ = results.history, results.case
            with results.fields() as fields:
                return len(fields) - 2

    found = attempt(work, copy.parent / "said.txt", Limits(80.0))
    assert found.kind == ("done" if name == SUMMARY_FILE else "refused"), found.printed[-1000:]


def _unbounded(folder: Path, instead: str, name: str) -> str:
    """Put something that has no end, or nearly none, instead of a file, and read the folder."""
    (folder / name).unlink()
    if instead == "device":
        (folder / name).symlink_to("/dev/zero")
    else:
        with (folder / name).open("wb") as file:
            file.truncate(2**40)
    return answer(folder, "report", folder, "--no-pdf")


@pytest.mark.parametrize("instead", ["device", "hole of 1 TB"])
@pytest.mark.parametrize("name", ["evaluations.csv", "identification.json"])
def test_identifications_without_end(name: str, instead: str, tmp_path: Path) -> None:
    """The table of the evaluations is read in bounded memory: a device in its place took 5 GB and half a minute."""
    folder = tmp_path / "identified"
    folder.mkdir()
    (folder / "identification.json").write_text(json.dumps(IDENTIFIED), encoding="utf-8")
    (folder / "evaluations.csv").write_text("x,sum of squares,status\n1.0,2.0,done\n", encoding="utf-8")
    said = _unbounded(folder, instead, name)
    assert name in said or (name == "identification.json" and instead == "device"), said
    assert "MemoryError" not in said


@pytest.mark.parametrize("name", [CASE_FILE, SUMMARY_FILE])
def test_runs_with_files_of_a_terabyte(name: str, copy: Path) -> None:
    """They are refused by their size."""
    assert re.search(rf"{name}: found {2**40} bytes; expected .* of at most \d+ bytes", _unbounded(copy, "hole", name))


def test_cases_as_run_with_keys_of_many_parts(copy: Path) -> None:
    """The reader of TOML takes gigabytes for one, also in results."""
    (copy / CASE_FILE).write_text(f"[x]\n{'a.' * 30_000}a = 1\n", encoding="utf-8")
    said = answer(copy, "report", copy, "--no-pdf")
    assert f"{CASE_FILE}: found text that is not TOML (a key of many parts)" in said


@pytest.mark.parametrize("name", [*BOMBS, "rungs"])
def test_tradeoffs_that_name_no_level(name: str, tmp_path: Path) -> None:
    """What `gapbeam run --tolerance` finds in a folder is reported, whatever it holds."""
    case = read_case(DEMO)
    levels = {"key": study_key(case), "fixed": {}, "rungs": [{"verdict": "passed"}], "end": case.time.end}
    content = json.dumps(levels).encode() if name == "rungs" else BOMBS[name]
    (tmp_path / "tradeoff.json").write_bytes(content)
    with pytest.raises(ResultsError, match=r"tradeoff\.json: found"):
        stored_choice(tmp_path, case, 0.1)


def test_json_of_millions_of_empty_lists(tmp_path: Path) -> None:
    """It is refused by what it would take in memory, 25 times its size."""
    path = tmp_path / "sweep.json"
    path.write_bytes(b"[" + b"[]," * 6_100_000 + b"0]")
    with pytest.raises(ResultsError, match="more than 12000000 entries"):
        read_json(path, "nothing")


@pytest.mark.parametrize(("link", "command"), [("figures", "plot"), ("pictures", "render"), ("report.html", "report")])
def test_nothing_is_written_through_links(link: str, command: str, copy: Path) -> None:
    """A results folder that came from elsewhere does not decide where we write."""
    (copy.parent / "precious").mkdir()
    (copy / link).symlink_to(copy.parent / "precious" / ("" if command != "report" else "page"))
    assert "link" in answer(copy, command, copy)
    assert not list((copy.parent / "precious").iterdir())


def test_names_of_files_do_not_command_the_terminal(copy: Path) -> None:
    """Escape sequences in the names of probes and the title come out as text."""
    with h5py.File(copy / HISTORY_FILE, "r+") as file:
        file["probe"][0] = "\x1b]0;owned\x07"
    summary = json.loads((copy / SUMMARY_FILE).read_text(encoding="utf-8")) | {"title": "\x1b[2J\u202egone"}
    (copy / SUMMARY_FILE).write_text(json.dumps(summary), encoding="utf-8")
    results = open_results(copy)
    assert results.history["probe"].values.tolist() == ["\\x1b]0;owned\\x07", "tip"]
    assert results.title == "\\x1b[2J\\u202egone"
    assert harmless("a\x1b[2J\nb\tc") == "a\\x1b[2J\nb\tc"
    line = logging.LogRecord("gapbeam", logging.INFO, "", 0, "results in %s", ("a\x1b[2J\u202eb",), None)
    assert _terminal_handler().format(line) == "INFO    results in a\\x1b[2J\\u202eb"


RESPONSE: dict[str, Any] = {
    "values": {"k": "1"}, "direction": "", "start": "seat", "verdict": "passed", "exit_status": 0, "message": "",
    "notes": [], "response": "period 1", "figures": {"x": {"unit": "m", "mean": 1.0, "scatter": 0.0}},
}  # fmt: skip
PIECE: dict[str, Any] = {
    "values": [1.0], "experiment": 0, "start": 0, "verdict": "passed", "response": "modes", "exit_status": 0,
    "message": "", "figures": {},
}  # fmt: skip


@pytest.mark.parametrize(
    "change",
    [
        {"values": 3}, {"exit_status": "0"}, {"exit_status": 1e400}, {"notes": [3]}, {"message": None},
        {"figures": {"x": {"unit": "m", "mean": float("nan"), "scatter": 0.0}}}, {"figures": [1]}, {"verdict": {}},
    ],
)  # fmt: skip
def test_stored_records_are_checked(change: dict[str, Any]) -> None:
    """What another program, or a full disk, has left is not gone on with."""
    assert checked(RESPONSE, StoredResponse, Path("x")) is RESPONSE
    assert checked(PIECE, StoredPiece, Path("x")) is PIECE
    for record, kind in ((RESPONSE, StoredResponse), (PIECE, StoredPiece)):
        if change.keys() <= record.keys():
            with pytest.raises(ResultsError, match="a record as gapbeam writes it"):
                checked(record | change, kind, Path("x"))


def kept(sweep: Sweep, folder: Path, subjects: list[Subject]) -> int:
    """Return the number of responses of a sweep that are on disk."""
    with study_folder(folder, plan=plan_of(sweep, subjects, False)):
        return prepare(sweep, folder)


@pytest.fixture
def sweep(tmp_path: Path) -> tuple[Sweep, list[Subject], Path]:
    """Return a sweep of two points, their subjects, and its folder with both responses on disk."""
    sweep = Sweep(DEMO, (), (read_axis("support.clearance=1e-4,2e-4", "linear"),))
    subjects = [one for one in read_points(sweep).values() if not isinstance(one, CaseError)]
    assert kept(sweep, tmp_path / "sweep", subjects) == 0
    for chain in chains_of(sweep, tmp_path / "sweep"):
        for task in chain.tasks:
            record = RESPONSE | {"values": {"support.clearance": task.values[0]}}
            point_file(tmp_path / "sweep", task).write_text(json.dumps(record), encoding="utf-8")
    return sweep, subjects, tmp_path / "sweep"


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("plan.json", "[]", "JSON object"),
        ("plan.json", "{", "not JSON"),
        ("plan.json", "[" * 100_000, "not JSON"),
        ("plan.json", "{}", "holds a study of other inputs: "),
        ("points/000000.json", "", "remove this file, and its response is computed again"),
        ("points/000001.json", json.dumps(RESPONSE), "the response at {'support.clearance': '2e-4'}"),
        ("points/000007.json", json.dumps(RESPONSE), "at most 2 responses"),
        ("points/000000.json", json.dumps({"values": 1}), "a record as gapbeam writes it. To try: remove this file"),
    ],
)
def test_sweeps_that_are_not_gone_on_with(
    name: str, content: str, message: str, sweep: tuple[Sweep, list[Subject], Path]
) -> None:
    """Another plan, responses at other values, more of them than the sweep has, files cut off."""
    wanted, subjects, folder = sweep
    (folder / "points" / "notes.json").write_text("not a record, and none of ours", encoding="utf-8")
    assert kept(wanted, folder, subjects) == 2
    (folder / name).write_text(content, encoding="utf-8")
    with pytest.raises((ResultsError, UserError), match=re.escape(message)):
        kept(wanted, folder, subjects)
    if "remove this file" in message:
        (folder / name).unlink()
        assert kept(wanted, folder, subjects) == 1


@pytest.mark.parametrize("instead", ["folder", "pipe", "device"])
def test_meshes_that_are_no_files(instead: str, tmp_path: Path) -> None:
    """A pipe that nobody writes to, an endless device: refused before they are read."""
    path = {"folder": tmp_path, "pipe": tmp_path / "pipe.msh", "device": Path("/dev/zero")}[instead]
    if instead == "pipe":
        os.mkfifo(path)
    with pytest.raises(MeshError, match="found a"):
        load_msh(path)


def test_links_in_a_folder_to_be_written(tmp_path: Path) -> None:
    """An entry that leads elsewhere is named."""
    refuse_links(tmp_path, tmp_path / "missing")
    (tmp_path / "evaluations.jsonl").symlink_to("/etc/passwd")
    with pytest.raises(UserError, match=r"evaluations\.jsonl"):
        refuse_links(tmp_path)


@pytest.mark.parametrize(
    "text", ["k=0:1:1e12", "k=0:1:999999999999", "k=0:1:-1", "k=nan:1:3", "k=0:1e400:3", "k=:::", "="]
)
def test_axes_without_bounds(text: str) -> None:
    """Ranges of any number of points, or of none."""
    with pytest.raises(UserError):
        read_axis(text, "linear")


def test_grids_without_bounds() -> None:
    """A grid is refused before it is made."""
    axes = [read_axis(f"k{number}=0:1:100000", "linear") for number in range(5)]
    with pytest.raises(UserError, match="at most 100000"):
        points_of(axes)


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(seed=st.integers(0, 2**32))
def test_case_files_of_any_kind(seed: int, tmp_path: Path) -> None:
    """A case file spoiled in any way is read or refused, never more."""
    chance = random.Random(seed)
    path = tmp_path / "case.toml"
    path.write_bytes(chance.choice((spoil_text, spoil_bytes))(GOOD.encode(), chance))
    try:
        read_case(path)
    except CaseError as error:
        message = str(error)
        assert len(message) < 50_000
        assert "\x1b" not in message


FILES = sorted(path for place in ("cases", "cases/scenes") for path in (PROJECT / place).glob("*.toml"))
EXTREMES = (1e300, -1e300, 1e-300, 1e30, -1e30, 1e-30, 10**40, 0, -1)


def numbers_of(value: object, way: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Yield the way to every number of a file."""
    if isinstance(value, dict | list):
        for key, inner in value.items() if isinstance(value, dict) else enumerate(value):
            yield from numbers_of(inner, (*way, key))
    elif isinstance(value, int | float) and not isinstance(value, bool):
        yield way


@settings(max_examples=100, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data(), path=st.sampled_from(FILES), extreme=st.sampled_from(EXTREMES))
def test_no_number_of_a_shipped_file_ends_in_a_traceback(
    data: st.DataObject, path: Path, extreme: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Any number may be huge, tiny, 0 or negative: the file is read or refused."""
    tables = tomllib.loads(path.read_text())
    *way, last = data.draw(st.sampled_from(list(numbers_of(tables))))
    reduce(lambda table, key: table[key], way, tables)[last] = extreme
    with monkeypatch.context() as here, suppress(CaseError, UserError):
        here.chdir(path.parent)
        (read_scene if "structure" in tables else read_case_tables)(tables)


LEAVES = st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=20)
TREES = st.recursive(
    LEAVES,
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=10), inner, max_size=4),
    max_leaves=20,
)


@settings(max_examples=100, deadline=None)
@given(
    value=TREES,
    name=st.sampled_from(["support.clearance", "load", "mesh", "time.scheme", "contact.stiffness", "title"]),
)
def test_overrides_of_any_kind(value: Any, name: str) -> None:
    """Any Python value instead of a key is taken or refused."""
    with suppress(CaseError):
        read_case(DEMO, {name: value})


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(seed=st.integers(0, 2**32))
def test_json_of_any_kind(seed: int, tmp_path: Path) -> None:
    """JSON spoiled in any way is read without characters that command a terminal, or refused."""
    path = tmp_path / "some.json"
    path.write_bytes(spoil_json(json.dumps(RESPONSE).encode(), random.Random(seed)))
    with suppress(ResultsError):
        assert "\\u001b" not in json.dumps(read_json(path, "nothing"))


@pytest.mark.parametrize(
    "content",
    [
        b"a = " + b"[" * 100_000,
        b"[a]\n" * 240_000,
        b"\0" * 1000,
        GOOD.encode("utf-16"),
        b"x = 1e400\n",
        b"x = " + b"9" * 9000,
    ],
    ids=["deep", "tables", "nul", "utf-16", "infinite", "digits"],
)
def test_case_files_that_are_none(content: bytes, tmp_path: Path) -> None:
    """Deep, long, binary and in another coding: refused within seconds."""
    path = tmp_path / "case.toml"
    path.write_bytes(content)
    with pytest.raises(CaseError):
        read_case(path)


@pytest.mark.parametrize(
    ("more", "found"),
    [
        ('[[probe]]\nname = "a"\npoint = 0.1\n' * 900, "the name of number 2"),
        ('[[probe]]\nname = "a"\npoint = 0.1\n' * 30_000, "30001 entries"),
        ("[extra]\n" + ".".join("a" * 40) + " = 1\n", "more than 20 levels"),
        ("[extra]\n" + ".".join("a" * 400_000) + " = 1\n", "nested too deep"),
        ("[extra]\na = " + "{a = " * 90 + "1" + "}" * 90 + "\n", "more than 20 levels"),
        ("[extra]\na = [" + "0.1, " * 100_000 + "]\n", "100000 entries"),
        ("".join(f"[a{number}]\n" for number in range(90_000)), "tables and keys"),
    ],
    ids=["namesakes", "entries", "dots", "many dots", "tables", "list", "headers"],
)
def test_endless_case_files_are_answered_soon(more: str, found: str, tmp_path: Path) -> None:
    """A case file of up to a megabyte of entries or levels: at most 100 faults, within seconds."""
    path = written(tmp_path, GOOD.replace("[output]", "") + more)
    started = time.process_time()
    with pytest.raises(CaseError) as caught:
        read_case(path)
    assert time.process_time() - started < 15.0
    assert found in str(caught.value)
    assert len(caught.value.faults) <= 100


@pytest.mark.parametrize("start", [b"\xef\xbb\xbf", b""])
def test_byte_order_marks_and_line_ends_do_no_harm(start: bytes, tmp_path: Path) -> None:
    """A case file saved by an editor of another system is the same case."""
    plain, other = tmp_path / "plain.toml", tmp_path / "other.toml"
    plain.write_bytes(GOOD.encode())
    other.write_bytes(start + GOOD.encode().replace(b"\n", b"\r\n"))
    assert read_case(plain) == read_case(other)


def test_absurd_sizes_are_refused_before_anything_is_made(tmp_path: Path) -> None:
    """Cells of a nanometer, steps of a femtosecond: refused with how many that would be."""
    with pytest.raises(CaseError, match=r"makes 6e\+14 steps"):
        read_case(DEMO, {"time.step": 1e-15})
    said = answer(tmp_path / "x", "check", DEMO, "--set", "mesh.size=1e-9")
    assert "which makes about 4.6058e+08 layers" in said


@pytest.mark.parametrize(
    ("key", "value"),
    [("load.shaker.phase", 1e300), ("support.clearance", -1e31), ("mesh.size", 1e-300), ("beam.length", 1e-31)],
)
def test_numbers_beyond_reason(key: str, value: float) -> None:
    """Numbers whose squares overflow are reported at their key; round-off instead of 0 is not."""
    with pytest.raises(CaseError) as caught:
        read_case(DEMO, {key: value, "load.shaker.ramp": 1e-300})
    assert any(f"`overrides=` {key}" in fault.where and "1e" in fault.expected for fault in caught.value.faults)
    assert not any("ramp" in fault.where for fault in caught.value.faults)


def test_results_that_the_disk_has_no_room_for(tmp_path: Path) -> None:
    """The size agrees with the files that are written; too large, it is refused before anything is."""
    model = beam_model({"time": {"end": 0.02, "step": 1e-4}}, ({"type": "gravity"},), {"tip": 0.51})
    history, fields = size_of_results(model.case, model)
    writer, labels = HistoryWriter(tmp_path, Recorder(model.case, model).labels), Recorder(model.case, model).labels
    sizes = {record.name: [len(labels[dimension]) for dimension in record.dims[1:]] for record in HISTORY}
    writer.append({"time": np.zeros(1)} | {name: np.zeros((1, *size)) for name, size in sizes.items()})
    writer.close()
    with h5py.File(tmp_path / HISTORY_FILE) as file:
        values = sum(int(np.prod(data.shape[1:])) for data in file.values() if data.maxshape[0] is None)
    assert history == pytest.approx(8 * values * 200)
    check_space(tmp_path / "not" / "there", history, fields)
    with pytest.raises(UserError, match=r"history\.h5 will take about 1e\+09 GB and .* has room for"):
        check_space(tmp_path / "not" / "there", 1e18, fields)
    assert not (tmp_path / "not").exists()
