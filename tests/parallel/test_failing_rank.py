"""What goes wrong on one rank ends all of them at once; what all ranks know is reported once."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from gapbeam.postprocess.results.results import open_results
from gapbeam.solver.messages.errors import NotFinite, OutOfMemory
from tests.shared.case_texts import spoiled, written
from tests.shared.command import DEMO, alone, called, on_ranks, programmed, settings

pytestmark = [alone, pytest.mark.versions]
SHORT = settings("time.end=0.004", "output.fields_interval=0.002")
LONGER = settings("time.end=0.02", "output.fields_interval=0.01", "output.checkpoint_interval=0.01")

BROKEN, ENDED, WITH_NAN = (f"tests.programs.{name}" for name in ("broken_rank", "ended_rank", "calls_with_nan"))


@pytest.mark.slow(minutes=0.2)
@pytest.mark.parametrize(
    ("module", "place", "error"),
    [
        pytest.param("gapbeam.solver.march.simulation", "find_seat", "RuntimeError", marks=pytest.mark.slow),
        pytest.param("gapbeam.solver.run.run_case", "build_model", "KeyError", marks=pytest.mark.slow),
        ("gapbeam.solver.integrators.midpoint", "Midpoint.advance", "ZeroDivisionError"),
        pytest.param("gapbeam.solver.diagnostics.march_diagnostics", "Tally.see", "SystemExit", marks=pytest.mark.slow),
        pytest.param("gapbeam.solver.run.output.field_files", "FieldWriter.write", "OSError", marks=pytest.mark.slow),
        pytest.param("gapbeam.solver.run.run_case", "judge_run", "ValueError", marks=pytest.mark.slow),
    ],
    ids=["seat", "mesh", "step", "exit", "output", "verdict"],
)
def test_error_on_one_rank_ends_all(module: str, place: str, error: str, tmp_path: Path) -> None:
    """An error of rank 1 in mesh, seat or march: the job ends within seconds, not zero, with that rank's trace."""
    words = (module, place, error, "run", DEMO, *SHORT, "--output", tmp_path / "out")
    done = on_ranks(2, *words, program=BROKEN)
    assert done.returncode not in (0, 2, 3, 4)
    assert "gapbeam: rank 1 failed; ending all ranks" in done.stderr
    assert re.search(rf"{error}: '?rank 1 has had enough", done.stderr)
    assert "Traceback" in done.stderr
    assert "in broken" in done.stderr
    assert "done:" not in done.stdout


@pytest.mark.slow(minutes=0.2)
@pytest.mark.parametrize(
    ("module", "place", "error", "status"),
    [
        pytest.param("run_case", "build_model", "UserError", 2, marks=pytest.mark.slow),
        ("verdict", "figures", "NotFinite", 4),
    ],
    ids=["set-up", "figures"],
)
def test_reported_error_of_one_rank_ends_all(module: str, place: str, error: str, status: int, tmp_path: Path) -> None:
    """An error with a status of its own that only one rank has, the other waits for it: ended with that status."""
    words = (f"gapbeam.solver.run.{module}", place, error, "run", DEMO, *SHORT, "--output", tmp_path / "out")
    done = on_ranks(2, *words, program=BROKEN)
    assert done.returncode == status
    assert "gapbeam: rank 1 failed; ending all ranks" in done.stderr
    assert "rank 1 has had enough" in done.stderr
    assert "Traceback" not in done.stderr


Printed = dict[str, list[tuple[int, str, str]]]


@pytest.fixture(scope="module")
def text(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Printed]:
    """Faults that all ranks know, on two ranks: status, standard output and standard error of each rank."""
    folder = tmp_path_factory.mktemp("messages")
    (folder / "damaged.msh").write_bytes(b"$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Nodes\n1 1 1 1\n$EndNodes\n")
    case = written(folder, spoiled("[mesh]\ndimension = 2\n", '[mesh]\nfile = "damaged.msh"\n'))
    (folder / "there").mkdir()
    (folder / "there" / "history.h5").write_bytes(b"precious")
    calls = {
        "nowhere": ("plot", "nowhere"),
        "study": ("sweep", DEMO, "support.clearance=1e-4", "--output", folder / "out"),
        "argument": ("run",),
        "case": ("run", DEMO, *settings("beam.length=-1"), "--output", folder / "out"),
        "mesh": ("run", case, "--output", folder / "out"),
        "there": ("run", DEMO, "--output", folder / "there"),
        "nan": ("run", DEMO, *SHORT, "--output", folder / "nan"),
    }
    words = {name: list(map(str, arguments)) for name, arguments in calls.items()}
    done = on_ranks(2, json.dumps(words), program=WITH_NAN)
    assert done.returncode == 0, done.stderr
    return folder, json.loads(done.stdout)


@pytest.mark.slow(minutes=0.3)
def test_nan_of_one_rank_is_reported_by_all(text: tuple[Path, Printed]) -> None:
    """A NaN in the state of rank 1 alone: all ranks stop with status 4, reported once; earlier results are on disk."""
    folder, ranks = text
    assert [status for status, _, _ in ranks["nan"]] == [NotFinite.exit_status] * 2
    assert not any("Traceback" in errors for _, _, errors in ranks["nan"])
    assert sum(errors.count("is not finite") for _, _, errors in ranks["nan"]) == 1, ranks["nan"]
    summary = json.loads((folder / "nan" / "summary.json").read_text(encoding="utf-8"))
    assert (summary["status"], summary["exit_status"]) == ("failed", NotFinite.exit_status)


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("nowhere", "takes one process"),
        ("study", "gapbeam sweep takes one process"),
        ("study", "call it without mpirun"),
        ("argument", "Missing argument"),
    ],
)
def test_fault_of_a_command_on_ranks_has_no_trace(name: str, words: str, text: tuple[Path, Printed]) -> None:
    """A command or a study for one process, a missing argument: status 2 on two ranks as on one."""
    ranks = text[1][name]
    assert [status for status, _, _ in ranks] == [2, 2]
    assert sum(errors.count(words) for _, _, errors in ranks) == 1
    assert not any("Traceback" in errors for _, _, errors in ranks)


@pytest.mark.parametrize(
    ("name", "words"), [("case", "has a fault"), ("mesh", "damaged.msh"), ("there", "already holds results")]
)
def test_fault_of_the_input_is_reported_once(name: str, words: str, text: tuple[Path, Printed]) -> None:
    """A faulty case, a damaged mesh, results that are there: exit status 2, one message, no trace, nothing written."""
    folder, ranks = text
    assert [status for status, _, _ in ranks[name]] == [2, 2]
    errors = "".join(errors for _, _, errors in ranks[name])
    assert (errors.count("gapbeam: "), errors.count(words)) == (1, 1)
    assert "Traceback" not in errors
    assert "".join(output for _, output, _ in ranks[name]) == ""
    assert not (folder / "out").exists()
    there = {path.name: path.read_bytes() for path in (folder / "there").iterdir()}
    assert there == {"history.h5": b"precious"}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("end", "status"), [("memory", OutOfMemory.exit_status), ("signal", 143)], ids=["memory", "signal"]
)
def test_end_of_one_rank_in_set_up_ends_all(end: str, status: int, tmp_path: Path) -> None:
    """Rank 1 may not take more memory, not even to report it, or receives SIGTERM: all ranks end within seconds."""
    done = on_ranks(2, end, "run", DEMO, *SHORT, "--output", tmp_path / "out", program=ENDED)
    assert done.returncode == status, done.stderr
    assert "gapbeam: rank 1 failed; ending all ranks: " in done.stderr
    assert "done:" not in done.stdout
    assert not (tmp_path / "out").exists()


@pytest.mark.slow
def test_kill_of_one_rank_ends_all(tmp_path: Path) -> None:
    """Kill -9 of one rank of two: the other one ends with it, and --resume continues from the last checkpoint."""
    words = ("run", DEMO, *LONGER, "--output", tmp_path / "out")
    done = on_ranks(2, "killed", *words, program=ENDED)
    assert done.returncode == 128 + 9, done.stderr
    assert open_results(tmp_path / "out").history["time"].values[-1] > 0.0
    again = called(*words, "--resume")
    assert again.returncode == 0, again.stderr
    assert 0.0 < open_results(tmp_path / "out").summary["resumed"][0] <= 0.011


def test_error_without_ranks_has_its_trace(tmp_path: Path) -> None:
    """The same error without mpirun: status 1 and the trace, and no word of ranks."""
    place = ("gapbeam.solver.march.simulation", "find_seat", "RuntimeError")
    done = programmed(BROKEN, *place, "run", DEMO, "--output", tmp_path / "out")
    assert done.returncode == 1
    assert "RuntimeError: rank 1 has had enough" in done.stderr
    assert "ending all ranks" not in done.stderr
