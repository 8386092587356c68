"""The job script for Slurm: statuses that it distinguishes, and a run requeued until it is done; Slurm is simulated."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

import pytest

import gapbeam
from gapbeam.solver.messages import errors
from gapbeam.solver.run.interruption import Wish
from tests.shared.command import DEMO, PROJECT, RATTLE, alone, process_environment, settings
from tests.shared.interrupted import differing
from tests.shared.processes import LONGEST

pytestmark = alone
SCRIPT = PROJECT / "environment" / "slurm" / "gapbeam.sbatch"
GOES_ON = {124, 138, 143}

SRUN = """#!/usr/bin/env bash
while [[ $1 == --* ]]; do shift; done
echo "$OMP_NUM_THREADS $OPENBLAS_NUM_THREADS $MKL_NUM_THREADS $*" >>"$PLAY/calls"
exec "$@"
"""
SCONTROL = """#!/usr/bin/env bash
echo "$*" >>"$PLAY/queued"
"""
STATUS = """#!/usr/bin/env bash
exit "$STATUS"
"""
# Of two ranks one is killed, and the other waits for its messages, for ever where srun was not given a limit; a
# second for each minute.
KILLED = """#!/usr/bin/env bash
waits=0
while [[ $1 == --* ]]; do [[ $1 != --wait=* ]] || waits=${1#--wait=}; shift; done
sleep infinity &
other=$!
echo "$other" >"$PLAY/other"
sh -c 'kill -9 $$' 2>/dev/null
status=$?
((waits == 0)) || { sleep $((waits / 60)); kill -9 "$other"; }
wait "$other"
exit "$status"
"""
# Slurm sends SIGUSR1 some time before the limit: here a moment after the march has begun.
WARNED = """#!/usr/bin/env bash
while [[ $1 == --* ]]; do shift; done
touch "$PLAY/start"
"$@" &
rank=$!
if (($(wc -l <"$PLAY/queued") < 2)); then
  while kill -0 "$rank" && [[ -z $(find "$PLAY/out" -newer "$PLAY/start" -name 'history.h5*' 2>/dev/null) ]]; do
    sleep 0.05
  done
  kill -USR1 "$rank"
fi
wait "$rank"
"""


def program(folder: Path, name: str, text: str) -> None:
    (folder / name).write_text(text, encoding="utf-8")
    (folder / name).chmod(0o755)


def submitted(folder: Path, *words: str | Path, **variables: str) -> subprocess.CompletedProcess[str]:
    """Start the job script with the programs of a folder instead of Slurm's."""
    own = process_environment()
    played = {**own, "PATH": f"{folder}:{os.environ['PATH']}", "PLAY": str(folder), "SLURM_JOB_ID": "42"}
    return subprocess.run(
        [SCRIPT, *map(str, words)], env=played | variables, capture_output=True, text=True, timeout=LONGEST, check=False
    )


def test_job_script_is_one() -> None:
    """Bash and shellcheck have nothing against it; signal, requeue and one thread a rank are asked for."""
    assert subprocess.run(["bash", "-n", SCRIPT], check=False).returncode == 0
    text = SCRIPT.read_text(encoding="utf-8")
    for asked in ("--signal=USR1@120", "--requeue", "--cpus-per-task=1", "--open-mode=append"):
        assert f"#SBATCH {asked}" in text


def test_statuses_are_the_documented_ones() -> None:
    """The script distinguishes what the reference lists, and every status that an error of a run has."""
    labels = re.findall(r"^  ([\d |]+)\)", SCRIPT.read_text(encoding="utf-8"), re.MULTILINE)
    message = {int(number) for label in labels for number in label.split("|")}
    page = (PROJECT / "docs" / "reference" / "command-line.md").read_text(encoding="utf-8")
    rows = re.findall(r"^([\d, ]+) \|", page, re.MULTILINE)
    documented = {int(number) for row in rows for number in row.split(",")}
    assert documented <= message
    assert message - documented <= {137, 138}  # killed by signals that no program hears
    kinds = [kind for kind in vars(errors).values() if isinstance(kind, type) and issubclass(kind, errors.RunError)]
    assert {kind.exit_status for kind in kinds} - {1} <= message
    assert {wish.exit_status for wish in Wish if wish.ends} <= message


@pytest.mark.parametrize("status", [0, 1, 2, 3, 4, 5, 6, 7, 124, 130, 137, 138, 143])
def test_job_goes_on_only_where_time_ran_out(status: int, tmp_path: Path) -> None:
    """It is queued again after 124, 138 and 143, and ends with the status of the run in any case."""
    for name, text in (("srun", SRUN), ("scontrol", SCONTROL), ("gapbeam", STATUS)):
        program(tmp_path, name, text)
    done = submitted(tmp_path, "a case.toml", "--set", "title=two words", STATUS=str(status))
    assert done.returncode == status
    assert (tmp_path / "calls").read_text() == "1 1 1 gapbeam run a case.toml --set title=two words --resume\n"
    assert (tmp_path / "queued").exists() == (status in GOES_ON)
    assert done.stdout + done.stderr != ""
    if status in GOES_ON:
        assert (tmp_path / "queued").read_text() == "requeue 42\n"
        (tmp_path / "queued").unlink()
        last = submitted(tmp_path, "x", STATUS=str(status), SLURM_RESTART_COUNT="4", GAPBEAM_MOST_STARTS="5")
        assert "started 5 times and not done" in last.stderr
        assert not (tmp_path / "queued").exists()


def test_job_ends_where_a_rank_is_killed(tmp_path: Path) -> None:
    """The other ranks, which wait for the one that is gone, are ended; the job is not queued again, and says so."""
    for name, text in (("srun", KILLED), ("scontrol", SCONTROL)):
        program(tmp_path, name, text)
    try:
        done = submitted(tmp_path, "case.toml")
    finally:
        with suppress(ProcessLookupError):
            os.kill(int((tmp_path / "other").read_text()), signal.SIGKILL)
    assert done.returncode == 137
    assert "out of memory, or killed" in done.stderr
    assert not (tmp_path / "queued").exists()


def test_job_without_a_case_says_how(tmp_path: Path) -> None:
    """Nothing is started without a case."""
    done = submitted(tmp_path)
    assert (done.returncode, done.stderr.startswith("Usage: sbatch")) == (2, True)


@pytest.mark.slow
def test_job_resumes_until_it_is_done(tmp_path: Path) -> None:
    """A run that is warned twice is queued twice, and ends the same to the last bit as one that had the time."""
    keys = (*RATTLE, "time.end=0.9", "output.fields_interval=5e-3")
    assert gapbeam.run(DEMO, keys, tmp_path / "whole").exit_status == 0
    program(tmp_path, "srun", WARNED)
    program(tmp_path, "scontrol", SCONTROL)
    program(tmp_path, "gapbeam", f'#!/usr/bin/env bash\ncd {PROJECT} && exec {sys.executable} -m gapbeam "$@"\n')
    (tmp_path / "queued").touch()
    ends = []
    for start in range(5):
        words = (DEMO, *settings(*keys), "--output", tmp_path / "out")
        done = submitted(tmp_path, *words, SLURM_RESTART_COUNT=str(start))
        ends.append(done.returncode)
        if len((tmp_path / "queued").read_text().splitlines()) != start + 1:
            break
    assert ends == [143, 143, 0], done.stderr
    assert differing(tmp_path / "whole", tmp_path / "out") == []
