"""Kills, full disks, vanished folders, other cases, damaged checkpoints: nothing is lost, and it is reported."""

from __future__ import annotations

import json
import os
import random
import resource
import signal
import socket
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import xarray as xr
from mpi4py import MPI

import gapbeam
from gapbeam.postprocess.results.results import open_results
from gapbeam.solver.march import simulation as gathered_steps
from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.run import run_consumers
from gapbeam.solver.run.checkpoint.checkpoint_files import VERSION
from gapbeam.solver.run.interruption import Interruption, Wish
from gapbeam.solver.run.output.results_folder import locked
from gapbeam.solver.run.verdict import describe_march
from tests.shared.command import CASE_FOLDER, DEMO, RATTLE, alone, called, settings
from tests.shared.interrupted import differing, run_in_parts, stopped_after
from tests.shared.processes import beside, command, ended, often, until

pytestmark = alone

BRIEF = (*RATTLE, "time.end=0.012", "output.fields_interval=2e-3")
SLOW = pytest.mark.slow
LONGER = (*RATTLE, "time.end=0.04", "output.fields_interval=5e-3", "output.checkpoint_interval=0.05")


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The longer run without interruption."""
    folder = tmp_path_factory.mktemp("whole") / "out"
    assert gapbeam.run(DEMO, LONGER, folder).exit_status == 0
    return folder


def until_killed(*arguments: str | Path, steps: int, within: float) -> Callable[[], int]:
    """Return the command line as work that is ended by the system, s after so many steps; at its end at the latest.

    With no steps it is ended so long after its start, or at its first step. The process sets its own alarm, which
    nothing hears: a test that is kept waiting would kill it late.
    """

    def end() -> None:
        os.kill(os.getpid(), signal.SIGKILL)

    def alarm() -> None:
        signal.signal(signal.SIGALRM, signal.SIG_DFL)
        signal.setitimer(signal.ITIMER_REAL, within)

    def first() -> None:
        often()
        if steps:
            after(steps, alarm)
        else:
            alarm()
            after(1, end)

    def work() -> int:
        status = command(*arguments, first=first)()
        if status == 0:
            end()
        return status

    return work


def kill_and_resume(folder: Path, keys: tuple[str, ...], whole: Path, kills: int, seed: int) -> None:
    """Kill a run at random moments, one in four of them in its set-up; look at what is left, and resume each time."""
    chance, shown = random.Random(seed), folder.parent / "messages"
    expected, summary = open_results(whole).history, open_results(whole).summary
    set_up = summary["wall_time"]["total"] - summary["wall_time"]["march"]
    words = ("run", DEMO, *settings(*keys), "--output", folder, "--resume")
    for _ in range(kills):
        steps = chance.randint(1, round(1.4 * summary["convergence"]["steps"] / kills))
        steps, within = (0, set_up) if chance.random() < 0.25 else (steps, 0.02)
        process = beside(until_killed(*words, steps=steps, within=chance.uniform(1e-6, within)), shown)
        assert ended(process) in (-signal.SIGKILL, -signal.SIGALRM), shown.read_text(encoding="utf-8")
        if (folder / "history.h5").exists():
            check_is_part_of(open_results(folder).history, expected)
        if (folder / "fields.xdmf").exists():
            with open_results(folder).fields() as fields:
                assert len(list(fields)) == len(fields)
    assert ended(beside(command(*words), shown)) == 0, shown.read_text(encoding="utf-8")
    assert differing(whole, folder) == []
    assert len(set(open_results(folder).summary["resumed"])) >= kills // 3
    assert {path.name for path in folder.iterdir()} - {path.name for path in whole.iterdir()} <= {"run.log"}


def check_is_part_of(history: xr.Dataset, expected: xr.Dataset) -> None:
    """Check that the records of a history are the first ones of another, to the last bit."""
    for name, variable in history.variables.items():
        first = expected[name].isel(time=slice(len(history["time"]))) if "time" in variable.dims else expected[name]
        assert variable.equals(first.variable), name


@pytest.mark.slow(minutes=0.3)
def test_killed_run_goes_on(whole: Path, tmp_path: Path) -> None:
    """Three kills at random moments: everything on disk can be read after each, the end is the same to the last bit."""
    kill_and_resume(tmp_path / "out", LONGER, whole, 3, 1)


@pytest.mark.slow
def test_run_survives_thirty_kills(tmp_path: Path) -> None:
    """Thirty of them over a longer run."""
    keys = (*LONGER, "time.end=0.9", "output.checkpoint_interval=0.02")
    assert gapbeam.run(DEMO, keys, tmp_path / "whole").exit_status == 0
    kill_and_resume(tmp_path / "out", keys, tmp_path / "whole", 30, 2)


def limited(size: int) -> Callable[[], None]:
    """Return what lets no file of this process grow beyond a size after the first steps of a march, bytes."""

    def first() -> None:
        often()
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        after(20, lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (size, size)))

    return first


def after(steps: int, change: Callable[[], None]) -> None:
    """Let something change in this process after the first steps of a march, which come one by one then."""
    gathered_steps.MOST_STEPS = 1
    agreed, passed = Interruption.agreed, []

    def changing(self: Interruption, own: Wish = Wish.NONE) -> Wish:
        passed.append(own)
        if len(passed) == steps:
            change()
        return agreed(self, own)

    Interruption.agreed = changing  # type: ignore[method-assign]


@pytest.mark.slow(minutes=0.1)
@pytest.mark.parametrize(
    ("size", "kept"),
    [pytest.param(8_000, None, marks=SLOW), (70_000, 6)],
    ids=["field and summary", "history or checkpoint"],
)
def test_full_disk_is_reported_and_survived(size: int, kept: int | None, whole: Path, tmp_path: Path) -> None:
    """Files that cannot grow: exit status 6, where and what to try; what is there is whole, and the run goes on.

    Where not even the summary can be written, the summary of the start stays, which has no exit status.
    """
    folder, shown = tmp_path / "out", tmp_path / "messages"
    words = ("run", DEMO, *settings(*LONGER), "--output", folder)
    assert ended(beside(command(*words, first=limited(size)), shown)) == 6
    errors = shown.read_text(encoding="utf-8")
    assert "could not be written: File too large" in errors
    assert "--resume" in errors
    assert "Traceback" not in errors
    left = open_results(folder)
    assert left.summary["exit_status"] == kept
    assert left.history.sizes["time"] >= 1
    with left.fields() as fields:
        assert len(list(fields)) == len(fields)
    assert ended(beside(command(*words, "--resume"), shown)) == 0, shown.read_text(encoding="utf-8")
    assert differing(whole, folder) == []


@pytest.mark.slow(minutes=0.2)
def test_vanished_folder_is_reported(whole: Path, tmp_path: Path) -> None:
    """A folder that is moved away during a march: exit status 6; what was moved is whole, and the run goes on there."""
    folder, moved, shown = tmp_path / "out", tmp_path / "moved", tmp_path / "messages"
    words = ("run", DEMO, *settings(*LONGER, "time.end=300.0"))
    process = beside(command(*words, "--output", folder), shown)
    until(lambda: any(folder.glob("checkpoint/*.checkpoint")), "there is a checkpoint")
    folder.rename(moved)
    assert ended(process) == 6
    errors = shown.read_text(encoding="utf-8")
    assert str(folder) in errors
    assert "could not be written" in errors
    assert "Traceback" not in errors
    assert open_results(moved).history.sizes["time"] > 1
    assert ended(beside(command("run", DEMO, *settings(*LONGER), "--output", moved, "--resume"), shown)) == 0
    assert differing(whole, moved) == []


def without_rights_after(steps: int) -> Callable[[], None]:
    """Return what takes the right to write from this process after some steps: root gives itself up."""

    def first() -> None:
        often()
        after(steps, lambda: os.seteuid(65534))

    return first


@pytest.mark.slow(minutes=0.2)
@pytest.mark.skipif(os.geteuid() != 0, reason="only root can give its rights up")
def test_folder_that_becomes_read_only_is_reported(whole: Path, tmp_path: Path) -> None:
    """The right to write goes during the march: exit status 6, nothing half-written, and the run goes on later."""
    folder, shown = tmp_path / "out", tmp_path / "messages"
    words = ("run", DEMO, *settings(*LONGER), "--output", folder)
    assert ended(beside(command(*words, first=without_rights_after(20)), shown)) == 6
    errors = shown.read_text(encoding="utf-8")
    assert "could not be written: Permission denied" in errors
    assert "Traceback" not in errors
    assert open_results(folder).history.sizes["time"] >= 1
    assert ended(beside(command(*words, "--resume"), shown)) == 0, shown.read_text(encoding="utf-8")
    assert differing(whole, folder) == []


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can give its rights up")
def test_read_only_folder_is_refused(tmp_path: Path) -> None:
    """Another user's folder: exit status 2 before anything is computed, and nothing is written."""
    folder, shown = tmp_path / "out", tmp_path / "messages"
    folder.mkdir(mode=0o755)
    shown.touch(mode=0o666)
    shown.chmod(0o666)

    def without_rights() -> None:
        for place in (tmp_path, *tmp_path.parents[:3]):
            place.chmod(place.stat().st_mode | 0o055)
        command("run", tmp_path / "none.toml", "--output", folder)()  # loads the rest of typer from a folder of root's
        os.setuid(65534)

    assert ended(beside(command("run", DEMO, "--output", folder, first=without_rights), shown)) == 2
    assert "cannot be written (permission denied or read-only)" in shown.read_text(encoding="utf-8")
    assert list(folder.iterdir()) == []


def test_folder_that_nobody_can_write_is_refused() -> None:
    """A folder of the kernel: exit status 2, before anything is computed."""
    with pytest.raises(UserError, match=r"is no place for files|does not lie on your disk"):
        gapbeam.run(DEMO, BRIEF, "/proc/gapbeam/out")


def test_folder_is_written_by_one_run(tmp_path: Path) -> None:
    """A folder that a run holds is refused by its process and host; one whose holder is gone is not."""
    folder = tmp_path / "out"
    with (
        locked(folder, MPI.COMM_SELF),
        pytest.raises(UserError, match=rf"process {os.getpid()} on {socket.gethostname()}"),
    ):
        gapbeam.run(DEMO, BRIEF, folder)
    assert not (folder / "run.lock").exists()
    (folder / "run.lock").write_text(json.dumps({"host": socket.gethostname(), "pid": os.getpid()}), encoding="utf-8")
    assert gapbeam.run(DEMO, BRIEF, folder).exit_status == 0
    (folder / "run.lock").write_text(json.dumps({"host": "elsewhere", "pid": 1}), encoding="utf-8")
    with pytest.raises(UserError, match=r"process 1 on elsewhere.*delete .*run\.lock"):
        gapbeam.run(DEMO, BRIEF, folder, overwrite=True)
    (folder / "run.lock").write_bytes(b"\x00\xff")
    assert gapbeam.run(DEMO, BRIEF, folder, overwrite=True).exit_status == 0


@pytest.fixture
def left(tmp_path: Path) -> Path:
    """A run that was stopped twice, with two checkpoints."""
    for number, stop in enumerate((30, 40)):
        with stopped_after(stop):
            assert gapbeam.run(DEMO, BRIEF, tmp_path / "out", resume=number > 0).exit_status == 143
    return tmp_path / "out"


def checkpoints_of(folder: Path) -> list[Path]:
    return sorted((folder / "checkpoint").glob("step-*"))


def bytes_of(folder: Path) -> dict[Path, bytes]:
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_other_case_is_refused_key_by_key(left: Path, tmp_path: Path) -> None:
    """Every key that differs, what was found and what was expected; what does not change the result may differ."""
    before = bytes_of(left)
    other = (*BRIEF, "support.clearance=0.2e-3", "load.shaker.amplitude=400.0", "contact.stiffness=1e12")
    with pytest.raises(UserError) as refused:
        gapbeam.run(DEMO, other, left, resume=True)
    shown = str(refused.value)
    for line in (
        "support.clearance: found 0.0002, expected 0.000107",
        "load.shaker.amplitude: found 400.0, expected 500.0",
        "contact.stiffness: found 1000000000000.0, expected 'auto'",
    ):
        assert line in shown
    assert shown.count("expected") == 3
    with pytest.raises(UserError, match=r"time\.end: found 0\.005, expected more than 0\.007"):
        gapbeam.run(DEMO, (*BRIEF, "time.end=0.005"), left, resume=True)
    assert bytes_of(left) == before
    longer = (*BRIEF, "time.end=0.016", "output.checkpoint_interval=0.0", "title=Longer")
    assert gapbeam.run(DEMO, longer, left, resume=True).exit_status == 0
    gapbeam.run(DEMO, longer, tmp_path / "whole")
    assert differing(tmp_path / "whole", left) == []


def test_broken_checkpoint_falls_back(left: Path, tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """The last one truncated: it is reported, the one before it is taken, and the result is the same."""
    first, second = checkpoints_of(left)
    second.write_bytes(second.read_bytes()[:-100])
    with caplog.at_level("INFO", logger="gapbeam"):
        assert gapbeam.run(DEMO, BRIEF, left, resume=True).exit_status == 0
    assert f"{second} cannot be read: it has " in caplog.text
    gapbeam.run(DEMO, BRIEF, tmp_path / "whole")
    assert differing(tmp_path / "whole", left) == []
    assert not first.exists()


@pytest.mark.parametrize(
    ("damage", "shown"),
    [
        (lambda _: b"", "it is empty or no checkpoint"),
        (lambda _: os.urandom(1000), "it is empty or no checkpoint"),
        (lambda data: data[: len(data) // 2], "expected"),
        (lambda data: data[:-1] + bytes([data[-1] ^ 1]), "the checksum differs"),
        (lambda data: data.replace(b"checkpoint %d " % VERSION, b"checkpoint 7 ", 1), "it is of version 7"),
    ],
    ids=["empty", "noise", "half", "one bit", "another version"],
)
def test_damaged_checkpoints_are_refused(damage: Callable[[bytes], bytes], shown: str, left: Path) -> None:
    """None that can be read: exit status 2, every one named with its reason, and nothing changed."""
    for path in checkpoints_of(left):
        path.write_bytes(damage(path.read_bytes()))
    before = bytes_of(left)
    with pytest.raises(UserError) as refused:
        gapbeam.run(DEMO, BRIEF, left, resume=True)
    assert str(refused.value).count(shown) == 2
    assert "`overwrite=True`" in str(refused.value)
    assert bytes_of(left) == before


@pytest.mark.parametrize("name", ["history.h5", "fields.h5"])
def test_results_that_are_gone_are_reported(name: str, left: Path) -> None:
    """A checkpoint beside a history, or fields, that are damaged: exit status 2, the way out, and no byte changes."""
    (left / name).write_bytes(b"\x89HDF\r\n\x1a\nno more")
    before = bytes_of(left)
    with pytest.raises(UserError, match=rf"{name} cannot be read.*`overwrite=True`"):
        gapbeam.run(DEMO, BRIEF, left, resume=True)
    assert bytes_of(left) == before


def test_run_that_is_written_is_refused_to_others(left: Path) -> None:
    """--resume in a folder that another run holds: exit status 2, and no byte changes."""
    with locked(left, MPI.COMM_SELF):
        before = bytes_of(left)
        with pytest.raises(UserError, match="is being written by another run"):
            gapbeam.run(DEMO, BRIEF, left, resume=True)
        assert bytes_of(left) == before


@pytest.mark.slow(minutes=0.1)
@pytest.mark.parametrize("name", ["summary.json.part", "history.h5.part", "fields/000004.part", "checkpoint/*.part"])
def test_nothing_is_written_through_links(name: str, left: Path, tmp_path: Path) -> None:
    """Links where files are about to be written: they go, what they lead to stays as it is, and the run goes on."""
    precious = tmp_path / "precious"
    precious.write_bytes(b"precious")
    place = left / name.replace("*", "step-000000000101.checkpoint")
    place.parent.mkdir(exist_ok=True)
    place.unlink(missing_ok=True)
    place.symlink_to(precious)
    with stopped_after(31):
        assert gapbeam.run(DEMO, BRIEF, left, resume=True).exit_status == 143
    assert not place.is_symlink()
    assert gapbeam.run(DEMO, BRIEF, left, resume=True).exit_status == 0
    assert precious.read_bytes() == b"precious"


@pytest.mark.parametrize("name", ["run.log", "run.lock", "fields", "checkpoint"])
def test_links_instead_of_results_are_refused(name: str, tmp_path: Path) -> None:
    """A link with the name of a file or folder of a run: exit status 2, before anything is computed or written."""
    precious, folder = tmp_path / "precious", tmp_path / "out"
    (precious if "." not in name else folder).mkdir()
    folder.mkdir(exist_ok=True)
    if "." in name:
        precious.write_bytes(b"precious")
    (folder / name).symlink_to(precious)
    for options in ({"resume": True}, {"overwrite": True}):
        with pytest.raises(UserError, match=rf"{name}: found a link, expected a f"):
            gapbeam.run(DEMO, BRIEF, folder, **options)
    assert precious.is_dir() or precious.read_bytes() == b"precious"
    assert not precious.is_dir() or not list(precious.iterdir())


def test_periodic_search_is_not_resumed(tmp_path: Path) -> None:
    """Its runs have no checkpoints: exit status 2."""
    with pytest.raises(UserError, match="a search has no checkpoints"):
        gapbeam.run((CASE_FOLDER / "periodic.toml"), (), tmp_path / "out", resume=True)
    assert not (tmp_path / "out").exists()


def test_complete_run_is_not_changed(tmp_path: Path) -> None:
    """--resume without results starts; a complete run is reported and not changed; a longer or cut one is refused."""
    folder = tmp_path / "out"
    assert gapbeam.run(DEMO, BRIEF, folder, resume=True).exit_status == 0
    before = {path: path.read_bytes() for path in folder.iterdir()}
    again = gapbeam.run(DEMO, BRIEF, folder, resume=True)
    assert (again.exit_status, again.message.startswith("was done before: 120 steps")) == (0, True)
    with pytest.raises(UserError, match=r"time\.end: found 0\.02, expected 0\.012"):
        gapbeam.run(DEMO, (*BRIEF, "time.end=0.02"), folder, resume=True)
    assert {path: path.read_bytes() for path in folder.iterdir()} == before
    for name in ("history.h5", "fields.h5"):
        for part in (0.0, 0.4, 0.99):
            os.truncate(folder / name, int(part * len(before[folder / name])))
            with pytest.raises(UserError, match=rf"{name} cannot be read .*overwrite=True"):
                gapbeam.run(DEMO, BRIEF, folder, resume=True)
        (folder / name).write_bytes(before[folder / name])
    (folder / "history.h5").unlink()
    with pytest.raises(UserError, match=r"history\.h5 cannot be read"):
        gapbeam.run(DEMO, BRIEF, folder, resume=True)


@pytest.mark.slow(minutes=0.1)
def test_wall_time_limit_stops_in_order(tmp_path: Path) -> None:
    """The limit: exit status 124 and a checkpoint; without it, the run goes on to the same end."""
    shown = tmp_path / "messages"
    for limit in (3, 12, 48, 192, 768):  # until it is longer than the set-up
        folder = tmp_path / f"out {limit}"
        words = ("run", DEMO, *settings(*BRIEF, "time.end=600.0"), "--output", folder, "--wall-time", f"0m{limit}s")
        assert ended(beside(command(*words), shown)) == 124
        if "before the march" not in shown.read_text(encoding="utf-8"):
            break
    assert "the wall-time limit was reached at t = " in shown.read_text(encoding="utf-8")
    assert len(checkpoints_of(folder)) == 1
    summary = open_results(folder).summary
    assert summary["status"] == "interrupted"
    assert summary["wall_time"]["total"] >= limit


@pytest.mark.parametrize("text", ["0s", "-3s", "soon", "3x", "1m2h"])
def test_wall_times_that_are_none_are_refused(text: str) -> None:
    """Exit status 2, what was found and what is expected."""
    done = called("run", DEMO, "--wall-time", text)
    assert done.returncode == 2
    assert "expected a time such as 2h30m" in done.stderr


def test_interrupt_and_termination_have_statuses_of_their_own(tmp_path: Path) -> None:
    """SIGINT 130, SIGTERM 143, the wall-time limit 124; each with a checkpoint to continue from."""
    for wish, status in ((Wish.INTERRUPT, 130), (Wish.TERMINATE, 143), (Wish.WALL_TIME, 124)):
        with stopped_after(9, wish):
            assert gapbeam.run(DEMO, BRIEF, tmp_path / str(status)).exit_status == status
        assert len(checkpoints_of(tmp_path / str(status))) == 1


SET_UP = {
    "mesh": ("run.run_case.build_model", signal.SIGTERM, 143),
    "seat": ("march.simulation.find_seat", signal.SIGINT, 130),
}


@pytest.mark.parametrize(("place", "number", "status"), SET_UP.values(), ids=SET_UP)
def test_signal_in_set_up_ends_at_once(
    place: str, number: int, status: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A status of its own, the folder reports it, --resume starts; with earlier results, these stay as they are."""
    folder = tmp_path / "out"
    with monkeypatch.context() as patch:
        patch.setattr(f"gapbeam.solver.{place}", lambda *_: os.kill(os.getpid(), number))
        stopped = gapbeam.run(DEMO, BRIEF, folder)
        assert stopped.exit_status == status
        assert stopped.message.endswith("before the march began; there is nothing to keep, `resume=True` starts it")
        shown = open_results(folder).summary
        assert (shown["status"], shown["exit_status"], shown["message"]) == ("interrupted", status, stopped.message)
        assert {path.name for path in folder.iterdir()} <= {"summary.json", "case.toml", "run.log"}
    assert signal.getsignal(number) == (signal.default_int_handler if number == signal.SIGINT else signal.SIG_DFL)
    assert gapbeam.run(DEMO, BRIEF, folder, resume=True).exit_status == 0
    before = bytes_of(folder)
    monkeypatch.setattr("gapbeam.solver.run.run_case.build_model", lambda *_: os.kill(os.getpid(), number))
    again = gapbeam.run(DEMO, BRIEF, folder, overwrite=True)
    assert (again.exit_status, "is as it was" in again.message) == (status, True)
    assert bytes_of(folder) == before


BEFORE_THE_FIRST_STEP = {
    "first field": ("run.run_consumers.FieldWriter.write", signal.SIGTERM, 143),
    "first records": ("run.run_consumers.RunConsumers._begin_history", signal.SIGINT, 130),
}


@pytest.mark.parametrize(("place", "number", "status"), BEFORE_THE_FIRST_STEP.values(), ids=BEFORE_THE_FIRST_STEP)
def test_signal_between_set_up_and_march_is_heard(
    place: str, number: int, status: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """No moment without a listener: the run ends in order after its first step, with a checkpoint."""
    folder, name = tmp_path / "out", place.rpartition(".")[2]
    owner = getattr(run_consumers, place.split(".")[2])
    work, sent = getattr(owner, name), []

    def interrupted(*words: Any) -> Any:
        if not sent:
            sent.append(number)
            os.kill(os.getpid(), number)
        return work(*words)

    with monkeypatch.context() as patch:
        patch.setattr(owner, name, interrupted)
        assert gapbeam.run(DEMO, BRIEF, folder).exit_status == status
    assert open_results(folder).summary["convergence"]["steps"] == 1
    assert len(checkpoints_of(folder)) == 1
    assert gapbeam.run(DEMO, BRIEF, folder, resume=True).exit_status == 0


def test_signal_after_the_march_changes_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Everything is done but for the summary: the run is completed."""

    def late(*words: Any) -> Any:
        os.kill(os.getpid(), signal.SIGTERM)
        return describe_march(*words)

    monkeypatch.setattr("gapbeam.solver.run.run_case.describe_march", late)
    assert gapbeam.run(DEMO, BRIEF, tmp_path / "out").exit_status == 0
    assert open_results(tmp_path / "out").summary["status"] == "completed"


def test_wall_time_that_ends_in_set_up(tmp_path: Path) -> None:
    """The limit counts from the start: exit status 124 before the march, and --resume starts."""
    stopped = gapbeam.run(DEMO, (*BRIEF, "output.wall_time=0.03"), tmp_path / "out")
    assert stopped.exit_status == 124
    assert stopped.message.startswith("the wall-time limit was reached before the march began")
    assert signal.getitimer(signal.ITIMER_REAL) == (0.0, 0.0)
    assert gapbeam.run(DEMO, BRIEF, tmp_path / "out", resume=True).exit_status == 0


def test_checkpoints_cost_little(tmp_path: Path) -> None:
    """At the default interval a short run writes none."""
    run_in_parts(DEMO, BRIEF, tmp_path / "parts", (10, 10, 10))
    summary = open_results(tmp_path / "parts").summary
    assert len(summary["resumed"]) == 3
    assert summary["checkpoints"] == {"count": 0, "seconds": 0.0}
