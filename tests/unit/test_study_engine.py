"""The engine of studies: results, lost workers, faults, what is refused, and the time that is left."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from gapbeam.solver.messages.errors import OutOfMemory, UserError
from gapbeam.studies.engine import workers as workers_module
from gapbeam.studies.engine.study_engine import Engine
from gapbeam.studies.engine.workers import TimeLeft, Workers, as_workers, duration_words, read_job_options
from tests.programs.points_of_a_study import deadly, faulty, hungry, squared
from tests.shared.command import PROJECT, alone, process_environment
from tests.shared.processes import LONGEST

pytestmark = alone


def test_one_worker_is_this_process() -> None:
    """No other process, results in the order of the points, and Dask is not loaded."""
    program = """
import os, sys
from gapbeam.studies.engine.study_engine import Engine
from gapbeam.studies.engine.workers import Workers
from tests.programs.points_of_a_study import squared
with Engine(Workers(1)) as engine:
    found = list(engine.done(squared, [1.0, 2.0, 3.0]))
assert found == [(0, (1.0, os.getpid())), (1, (4.0, os.getpid())), (2, (9.0, os.getpid()))], found
assert "distributed" not in sys.modules
"""
    done = subprocess.run(
        [sys.executable, "-c", program],
        cwd=PROJECT, env=process_environment(), capture_output=True, text=True, timeout=LONGEST, check=False,
    )  # fmt: skip
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.slow(minutes=0.3)
def test_a_lost_worker_costs_its_points_only(tmp_path: Path) -> None:
    """Of twelve points one kills its worker once, and is tried again; one kills each, and is given up; ten are done."""
    works = [(number, tmp_path, {3: 1, 5: 99}.get(number, 0)) for number in range(12)]
    with Engine(Workers(2)) as engine:
        found = dict(engine.done(squared, [2.0] * 60))
        assert {square for square, _ in found.values()} == {4.0}
        assert len(found) == 60
        processes = {process for _, process in found.values()}
        assert os.getpid() not in processes
        results = dict(engine.done(deadly, works, lost=lambda work, words: -work[0] if "lost" in words else 0))
        assert results == {number: -5 if number == 5 else number for number in range(12)}
        assert 3 <= len(list(tmp_path.glob("5-*"))) <= 6  # at most three times beside others, three times alone
        assert len(list(tmp_path.glob("3-*"))) >= 2  # more often where the worker of 5 held its result
        with pytest.raises(OutOfMemory, match="3 workers that computed nothing else were lost"):
            list(engine.done(deadly, [(20, tmp_path, 99)]))
        with pytest.raises(ValueError, match="a fault of this point"):
            list(engine.done(faulty, [1]))
        assert dict(engine.done(squared, [3.0]))[0][0] == 9.0  # it goes on after all that
    assert not any(Path(f"/proc/{process}").exists() for process in processes)


@pytest.mark.slow(minutes=0.3)
def test_a_worker_takes_no_more_memory_than_it_may() -> None:
    """Predicted are 0.4 GB, allowed twice that: 0.1 GB more is computed, 1.5 GB more end each worker that tries."""
    with Engine(Workers(2), memory=0.4e9) as engine:
        sizes = [100_000_000, 1_500_000_000, 100_000_000]
        found = dict(engine.done(hungry, sizes, lost=lambda work, words: -work if "may take 0.8 GB" in words else 0))
    assert found[0] > 0
    assert found[1] == -1_500_000_000
    assert found[2] > 0


def test_what_contradicts_itself_is_refused() -> None:
    """Each message says what was found and what to give."""
    for given, words in (
        ({"count": 0}, "expected at least 1"),
        ({"count": 2, "scheduler": "tcp://a:1"}, "give one"),
        ({"scheduler": "tcp://a:1", "slurm": "-t 10"}, "give one"),
        ({"scheduler": "node7"}, "an address such as tcp://node7:8786"),
        ({"slurm": "run.sh"}, "options of sbatch alone"),
        ({"slurm": "--ntasks=4"}, "expected --cpus-per-task"),
        ({"slurm": "-c many"}, "a number of cores"),
        ({"slurm": "--mem=lots"}, "a memory such as 2G"),
        ({"slurm": "'-c 4"}, "No closing quotation"),
    ):
        with pytest.raises(UserError, match=words):
            Workers(**given)
    assert as_workers(3) == Workers(3)
    assert as_workers(None) == Workers()


def test_options_of_sbatch_are_read_as_it_reads_them() -> None:
    """Long and short, with a sign of equality, a blank or nothing between; memory in its units."""
    job = read_job_options('--time=2:00:00 -c16 --account chair --exclusive --mem-per-cpu=2G --comment="two words"')
    assert job.directives == ("--time=2:00:00", "--account=chair", "--exclusive", "--comment='two words'")
    assert (job.workers, job.memory) == (16, 32.0e9)
    assert read_job_options("--mem 500").memory == 500.0e6
    assert read_job_options("") == ((), 1, None)


def test_without_dask_one_worker_remains(monkeypatch: pytest.MonkeyPatch) -> None:
    """The default falls back to this process; more workers are refused with what to install."""
    monkeypatch.setattr(workers_module, "dask_is_here", lambda: False)
    assert Workers().here(100) == 1
    for given in ({"count": 2}, {"scheduler": "tcp://a:1"}, {"slurm": "-t 10"}):
        with pytest.raises(UserError, match=r"pip install 'gapbeam\[workers\]'"):
            Workers(**given)
    assert Workers(1).here(100) == 1


def test_no_more_workers_than_points_or_memory() -> None:
    """Three points take three workers; a worker as large as all memory is alone."""
    assert Workers(8).here(3) == 3
    assert Workers(8).here(100, 2.7) == 2
    assert Workers(8).here(100, 0.5) == 1
    assert Engine(Workers(4), memory=1.0e15).count == 1


def test_time_left_is_unbiased_from_the_first_points_on() -> None:
    """200 points of exponential times on 8 workers: after 40 are done, the mean estimate is the mean of what follows.

    The mean time of the points that are done is far too small after the first few: the quick ones are done first.
    """
    generator = np.random.default_rng(1)
    ratios = []
    for _ in range(200):
        times = generator.exponential(1.0, 200)
        free, ends = np.zeros(8), []
        for one in times:  # each point goes to the worker that is free first
            worker = int(np.argmin(free))
            free[worker] += one
            ends.append(free[worker])
        ends.sort()
        clock = iter([0.0, ends[39]])
        left = TimeLeft(lambda: next(clock))  # noqa: B023 - called within this pass
        assert left.words(0, 200) == ""
        words = left.words(40, 200)
        assert words.startswith("about ")
        ratios.append(ends[39] * 160 / 40 / (ends[-1] - ends[39]))
    assert np.mean(ratios) == pytest.approx(1.0, abs=0.08)  # the last worker works alone for a while


def test_time_left_says_how_little_it_knows() -> None:
    """Nothing before a point is done, a range after the first few; what was done before does not count as quick."""
    times = iter([0.0, 10.0, 40.0])
    left = TimeLeft(lambda: next(times))
    assert left.words(90, 100) == ""
    assert left.words(90, 100) == ""
    assert left.words(91, 100) == "45 s to 3 min left"  # 90 s, give or take a factor of two
    assert left.words(94, 100) == "40 s to 90 s left"
    assert left.words(100, 100) == ""
    assert [duration_words(one) for one in (0.1, 99.0, 150.0, 7200.0)] == ["1 s", "99 s", "2 min", "2.0 h"]
