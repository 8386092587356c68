"""Studies in several workers: the same bits, kills, full disks, simulated Slurm, a scheduler that runs."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import pytest

import gapbeam
from gapbeam.solver.messages.errors import UserError
from gapbeam.studies.engine import dask_pool
from tests.parallel.test_slurm import program
from tests.regression.test_sweep import CASE, QUICK
from tests.shared.command import GAPBEAM, PROJECT, alone, called_anew, process_environment, settings
from tests.shared.processes import LONGEST, until

pytestmark = [alone, pytest.mark.slow(minutes=0.5)]
VALUES = "support.clearance=0.05e-3:0.2e-3:{}"

SBATCH = """#!/usr/bin/env bash
cp "$1" "$PLAY/job-$$.sh"
setsid bash "$PLAY/job-$$.sh" >"$PLAY/job-$$.out" 2>&1 &
echo "Submitted batch job $$"
echo "$!" >"$PLAY/group-$$"
"""
SCANCEL = """#!/usr/bin/env bash
for job in "$@"; do
  echo "$job" >>"$PLAY/canceled"
  kill -- "-$(cat "$PLAY/group-$job")"
done
"""


def words(folder: Path, points: int, *options: str) -> list[str]:
    """Return the words that sweep a quick case over some clearances."""
    values = VALUES.format(points)
    return list(map(str, ["sweep", CASE, values, *settings(*QUICK), *options, "--output", folder]))


def figures(folder: Path) -> list[dict]:
    """Return what a sweep found, without its wall times."""
    records = json.loads((folder / "sweep.json").read_text(encoding="utf-8"))
    return [{key: value for key, value in record.items() if key != "seconds"} for record in records]


def descendants(process: int) -> list[int]:
    """Return the processes that a process has started, and those that these have started."""
    found = []
    for task in Path(f"/proc/{process}/task").glob("*/children"):
        with suppress(OSError):  # the thread may have ended meanwhile
            for child in map(int, task.read_text(encoding="ascii").split()):
                found += [child, *descendants(child)]
    return found


def spawned(process: int) -> list[int]:
    """Return the workers that a process has started."""
    found = []
    for one in descendants(process):
        with suppress(OSError):  # it may have ended meanwhile
            if b"spawn_main" in Path(f"/proc/{one}/cmdline").read_bytes():
                found.append(one)
    return found


def lives(process: int) -> bool:
    """Return whether a process is there, and no zombie that only waits to be asked for."""
    try:
        return Path(f"/proc/{process}/stat").read_text(encoding="ascii").rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


@contextmanager
def sweeping(folder: Path, points: int, *options: str, **variables: str) -> Iterator[subprocess.Popen[str]]:
    """Start a sweep gently, and yield it once its first response is on disk."""
    command = ["nice", "-n", "19", *GAPBEAM, *words(folder, points, *options)]
    process = subprocess.Popen(
        command, cwd=PROJECT, env=process_environment() | variables, start_new_session=True, text=True,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE,
    )  # fmt: skip
    try:
        first = folder / "points"
        until(lambda: any(first.glob("*.json")) or process.poll() is not None, "the first response is there")
        assert process.poll() is None, process.communicate()[1]
        yield process
    finally:
        if process.poll() is None:
            process.kill()
        process.communicate()


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The sweep of 40 points in one process, undisturbed."""
    folder = tmp_path_factory.mktemp("alone")
    assert called_anew(*words(folder, 40, "--workers", "1")).returncode == 0
    return folder


def test_two_workers_find_the_same_bits_and_a_lost_one_costs_nothing(whole: Path, tmp_path: Path) -> None:
    """One of two workers is killed in the middle: every response is there, to the last bit as in one process."""
    with sweeping(tmp_path, 40, "--workers", "2") as process:
        until(lambda: len(spawned(process.pid)) >= 2, "both workers are there")
        os.kill(spawned(process.pid)[-1], signal.SIGKILL)
        _, errors = process.communicate(timeout=LONGEST)
    assert (process.returncode, "Traceback" in errors) == (0, False), errors
    assert figures(tmp_path) == figures(whole)


@pytest.mark.parametrize(("number", "status"), [(signal.SIGTERM, 143), (signal.SIGINT, 130), (signal.SIGKILL, -9)])
def test_a_study_that_ends_takes_its_workers_along_and_goes_on(
    number: signal.Signals, status: int, whole: Path, tmp_path: Path
) -> None:
    """Terminated, interrupted (all processes hear a Ctrl-C) or killed: no worker stays, and the rest is done later."""
    with sweeping(tmp_path, 40, "--workers", "2") as process:
        workers = descendants(process.pid)
        if number == signal.SIGINT:
            os.killpg(process.pid, number)
        else:
            process.send_signal(number)
        _, errors = process.communicate(timeout=LONGEST)
    assert (process.returncode, "Traceback" in errors) == (status, False), errors
    until(lambda: not any(map(lives, workers)), "no worker outlives its study")
    kept = {path.name: path.stat().st_mtime_ns for path in (tmp_path / "points").glob("*.json")}
    assert 0 < len(kept) < 40, "too late to test anything"
    again = called_anew(*words(tmp_path, 40, "--workers", "1"))
    assert again.returncode == 0, again.stderr
    assert f"{len(kept)} of 40 responses are on disk already" in again.stderr
    assert {name: (tmp_path / "points" / name).stat().st_mtime_ns for name in kept} == kept
    assert figures(tmp_path) == figures(whole)


@pytest.mark.parametrize("count", [1, 2])
def test_a_full_disk_is_named(count: int, tmp_path: Path) -> None:
    """Files may hold 6 kB, the plan does and a response does not: status 6, which file, what to try; no trace."""
    command = " ".join(map(repr, [*GAPBEAM, *words(tmp_path, 4, "--workers", str(count))]))
    done = subprocess.run(
        ["bash", "-c", f"ulimit -f 6; exec {command}"],
        cwd=PROJECT, env=process_environment(), capture_output=True, text=True, timeout=LONGEST, check=False,
    )  # fmt: skip
    assert done.returncode == 6, done.stderr
    assert "points/00000" in done.stderr
    assert "could not be written: File too large" in done.stderr
    assert "Traceback" not in done.stderr


def test_workers_in_jobs_of_slurm(whole: Path, tmp_path: Path) -> None:
    """Two jobs are submitted with what was asked for, their workers find the same bits, and they are canceled."""
    play, folder = tmp_path / "play", tmp_path / "swept"
    play.mkdir()
    program(play, "sbatch", SBATCH)
    program(play, "scancel", SCANCEL)
    own = process_environment()
    variables = own | {"PATH": f"{play}:{own['PATH']}", "PLAY": str(play)}
    asked = "--time=0:30:00 --account=chair --mem-per-cpu=3G"
    command = [*GAPBEAM, *words(folder, 40, "--slurm", asked, "--workers", "2")]
    try:
        done = subprocess.run(
            command, cwd=PROJECT, env=variables, capture_output=True, text=True, timeout=LONGEST, check=False
        )
    finally:
        left = [int(path.read_text()) for path in play.glob("group-*") if path.read_text().strip()]
        alive = [group for group in left if lives(group)]
        for group in alive:
            os.killpg(group, signal.SIGKILL)
    jobs = [path.read_text(encoding="utf-8") for path in play.glob("job-*.sh")]
    assert done.returncode == 0, done.stderr + "".join(path.read_text() for path in play.glob("job-*.out"))
    assert len(jobs) == 2
    for job in jobs:
        for line in ("#SBATCH --time=0:30:00", "#SBATCH --account=chair", "#SBATCH --cpus-per-task=1"):
            assert line in job
        assert "#SBATCH --mem=3G" in job
        assert "#SBATCH -t" not in job
        assert "--nthreads 1" in job
        assert "--preload gapbeam.studies.engine.workers" in job
    assert len((play / "canceled").read_text().split()) == 2
    assert figures(folder) == figures(whole)


def test_a_job_that_ends_before_its_study_is_submitted_again(whole: Path, tmp_path: Path) -> None:
    """The only job is ended from outside, as at its time limit: another one goes on, to the same bits."""
    play, folder = tmp_path / "play", tmp_path / "swept"
    play.mkdir()
    program(play, "sbatch", SBATCH)
    program(play, "scancel", SCANCEL)
    own = {"PATH": f"{play}:{os.environ['PATH']}", "PLAY": str(play)}
    try:
        with sweeping(folder, 40, "--slurm", "--mem=3G", **own) as process:
            (first,) = [int(path.read_text()) for path in play.glob("group-*")]
            os.killpg(first, signal.SIGKILL)
            _, errors = process.communicate(timeout=LONGEST)
    finally:
        for group in [int(path.read_text()) for path in play.glob("group-*")]:
            with suppress(ProcessLookupError):
                os.killpg(group, signal.SIGKILL)
    assert process.returncode == 0, errors
    assert len(list(play.glob("job-*.sh"))) == 2
    assert figures(folder) == figures(whole)


def test_workers_of_a_scheduler_that_runs(whole: Path, tmp_path: Path) -> None:
    """A scheduler and a worker with two threads, started by hand as a user does: the same bits, and they stay."""
    found = tmp_path / "scheduler.json"
    commands = (
        [
            "distributed.cli.dask_scheduler",
            "--host",
            "127.0.0.1",
            "--port",
            "0",
            "--no-dashboard",
            "--scheduler-file",
            found,
        ],
        ["distributed.cli.dask_worker", "--scheduler-file", found, "--nthreads", "2", "--no-dashboard"],
    )
    started = []
    try:
        for command in commands:
            started.append(
                subprocess.Popen(
                    [sys.executable, "-m", *map(str, command)], cwd=tmp_path, env=process_environment(),
                    stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                )
            )  # fmt: skip
            until(found.exists, "the scheduler listens")
        address = json.loads(found.read_text(encoding="utf-8"))["address"]
        done = called_anew(*words(tmp_path / "swept", 40, "--scheduler", address))
        assert done.returncode == 0, done.stderr
        assert all(process.poll() is None for process in started)
    finally:
        for process in reversed(started):
            process.terminate()
            process.wait()
    assert figures(tmp_path / "swept") == figures(whole)


def test_a_scheduler_that_does_not_answer(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Nobody listens at the port: an error that names the address, within the time that is allowed."""
    monkeypatch.setattr(dask_pool, "ANSWER", 1.0)
    nobody = gapbeam.Workers(scheduler="tcp://127.0.0.1:9")
    with pytest.raises(UserError, match=r"tcp://127\.0\.0\.1:9: no scheduler of Dask answered within 1 s"):
        gapbeam.sweep(CASE, {"support.clearance": [1e-4, 2e-4]}, list(QUICK), output=tmp_path / "out", workers=nobody)


def test_a_killed_map_of_stability_goes_on(tmp_path: Path) -> None:
    """What a journal holds is not computed again, what is cut off is; another grid is refused, or begun anew."""
    grid = {"stiffness": [1e10, 1e12], "step": [5e-4], "scheme": ["newmark", "discrete-gradient"]}
    found = gapbeam.stability(CASE, **grid, overrides=list(QUICK), output=tmp_path / "whole", workers=2)
    assert not (tmp_path / "whole" / "trials.jsonl").exists()
    verdicts = [record["verdict"] for record in found.records]
    kept: list[str] = []

    def stop(done: int, _total: int) -> None:
        if done == 2:
            kept.extend((tmp_path / "killed" / "trials.jsonl").read_text(encoding="utf-8").splitlines())
            raise KeyboardInterrupt

    killed = {"overrides": list(QUICK), "output": tmp_path / "killed", "workers": 1}
    with pytest.raises(KeyboardInterrupt):
        gapbeam.stability(CASE, **grid, **killed, progress=stop)
    assert len(kept) == 2
    path = tmp_path / "killed" / "trials.jsonl"
    place, record = json.loads(kept[0])
    marked = "\n".join([json.dumps([place, record | {"verdict": "kept"}]), kept[1][:20]])
    path.write_text(marked, encoding="utf-8")
    again = gapbeam.stability(CASE, **grid, **killed)
    assert [record["verdict"] for record in again.records] == ["kept", *verdicts[1:]]
    for one, other in zip(found.records, again.records, strict=True):
        assert all(one[key] == other[key] for key in one if key not in ("seconds", "verdict"))
    path.write_text(marked, encoding="utf-8")
    with pytest.raises(UserError, match="holds a study of other inputs"):
        gapbeam.stability(CASE, **{**grid, "step": [1e-3]}, **killed)
    anew = gapbeam.stability(CASE, **grid, **killed, overwrite=True)
    assert [record["verdict"] for record in anew.records] == verdicts


@pytest.mark.parametrize("guard", ["", 'if __name__ == "__main__": pass'])
def test_workers_run_no_script_that_would_begin_their_study_again(guard: str, tmp_path: Path) -> None:
    """A script without a guard runs once; each worker ran it, and started others. One that looks is imported."""
    script = tmp_path / "study.py"
    text = (PROJECT / "tests/programs/study_without_guard.py").read_text(encoding="utf-8")
    if guard:  # as users write it: the study stands below
        head, study = text.split("found = ")
        text = head + 'if __name__ == "__main__":\n    found = ' + study.replace("\n", "\n    ")
    script.write_text(text, encoding="utf-8")
    words = [sys.executable, str(script), str(CASE), str(tmp_path), *QUICK]
    said = subprocess.run(
        words, env=process_environment(), cwd=PROJECT, capture_output=True, text=True, timeout=LONGEST
    )
    assert said.returncode == 0, said.stderr
    assert "2 of 2 responses passed" in said.stdout
    assert (tmp_path / "runs.txt").read_text(encoding="utf-8").count("run") == (3 if guard else 1)


def test_what_options_contradict_is_refused(tmp_path: Path) -> None:
    """In the words of the command line, with status 2, before anything is written."""
    for options, said in (
        (("--workers", "0"), "Invalid value for '--workers'"),
        (("--workers", "2", "--scheduler", "tcp://a:1"), "--scheduler takes those that run already"),
        (("--scheduler", "tcp://a:1", "--slurm", "-t 9"), "give one"),
        (("--slurm", "job.sh"), "options of sbatch alone"),
    ):
        done = called_anew(*words(tmp_path / "out", 2, *options))
        assert (done.returncode, said in done.stderr) == (2, True), done.stderr
    assert not (tmp_path / "out").exists()
