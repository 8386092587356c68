"""Signals at any moment, closed and full streams: the documented status, soon, and no trace."""

from __future__ import annotations

import ctypes
import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gapbeam
from gapbeam.postprocess.results.results import open_results
from gapbeam.solver.integrators.midpoint import DiscreteGradient
from gapbeam.solver.messages.errors import Interrupted
from gapbeam.solver.run import interruption
from gapbeam.solver.run.interruption import Signals
from gapbeam.solver.system.semi_discrete import Step
from tests.shared.command import DEMO, GAPBEAM, PROJECT, alone, process_environment, settings
from tests.shared.processes import LONGEST

pytestmark = [alone]

STATUS = {signal.SIGINT: 130, signal.SIGTERM: 143, signal.SIGUSR1: 143}
SHORT = {"time.end": 0.004, "output.errors": "none", "output.fields_interval": 0.001, "load.shaker.ramp": 0.0}


@pytest.mark.parametrize("number", STATUS)
def test_an_error_that_a_library_drops_is_raised_again(
    number: signal.Signals, capfd: pytest.CaptureFixture[str]
) -> None:
    """Libraries such as ctypes print what callbacks raise, and go on: nothing is printed, and the error comes again."""
    called = ctypes.CFUNCTYPE(None)(lambda: os.kill(os.getpid(), number))

    def work() -> None:
        called()
        for _ in range(100_000):
            time.sleep(0.01)

    with pytest.raises(Interrupted) as stopped, Signals(None):
        work()
    assert stopped.value.exit_status == STATUS[number]
    assert capfd.readouterr().err == ""


DROPPED = """
import sys
sys.argv[0] = "gapbeam"
import ctypes, os, signal, time
import gapbeam
called = ctypes.CFUNCTYPE(None)(lambda: os.kill(os.getpid(), signal.SIGINT))
try:
    called()
    time.sleep(20.0)
except KeyboardInterrupt:
    print("heard")
"""


def test_an_interrupt_of_a_command_that_a_library_drops_comes_again() -> None:
    """Between libraries and march as well, where commands have no handler of their own."""
    done = subprocess.run([sys.executable, "-c", DROPPED], capture_output=True, text=True, timeout=LONGEST, check=False)
    assert (done.stdout, done.stderr) == ("heard\n", "")


@pytest.mark.parametrize("number", STATUS)
def test_what_a_library_makes_of_it_is_an_interruption(number: signal.Signals) -> None:
    """PETSc makes an error of its own of what a callback raises; errors without a signal stay what they are."""

    def call() -> None:
        try:
            os.kill(os.getpid(), number)
            time.sleep(1.0)
        except Interrupted:
            raise RuntimeError("error code 101") from None

    with pytest.raises(Interrupted) as stopped, Signals(None) as signals, signals.turned():
        call()
    assert stopped.value.exit_status == STATUS[number]
    with pytest.raises(RuntimeError, match="own"), Signals(None) as signals, signals.turned():
        raise RuntimeError("own")


@pytest.mark.slow(minutes=0.1)
@pytest.mark.parametrize("after", [0, 1, 7])
def test_a_step_without_end_is_given_up(after: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The run ends at the step before, with its checkpoint, and goes on as if it had not."""
    advance, count = DiscreteGradient.advance, 0

    def endless(self: DiscreteGradient, *arguments: Any, **options: Any) -> Step:
        nonlocal count
        count += 1
        if count == after + 1:
            os.kill(os.getpid(), signal.SIGTERM)
            for _ in range(100_000):
                time.sleep(0.01)
        return advance(self, *arguments, **options)

    monkeypatch.setattr(interruption, "PATIENCE", 0.2)
    with monkeypatch.context() as patch:
        patch.setattr(DiscreteGradient, "advance", endless)
        outcome = gapbeam.run(DEMO, SHORT, tmp_path / "stopped")
    assert (outcome.exit_status, outcome.summary["status"]) == (143, "interrupted")
    assert open_results(tmp_path / "stopped").history.sizes["time"] == after + 1
    assert gapbeam.run(DEMO, SHORT, tmp_path / "stopped", resume=True).exit_status == 0
    gapbeam.run(DEMO, SHORT, tmp_path / "whole")
    one, other = (open_results(tmp_path / name).history["displacement"].values for name in ("stopped", "whole"))
    assert np.ptp(other) > 0.0
    assert one == pytest.approx(other, rel=1e-9, abs=1e-9 * float(np.ptp(other)))


STREAMS = {
    "both": ">&- 2>&-",
    "all": "<&- >&- 2>&-",
    "output": ">&-",
    "errors": "2>&- >/dev/null",
    "reading": f"2<{DEMO} >/dev/null",
}
"""How streams are closed; the last one has the descriptor of another file in its place, open for reading."""


@pytest.mark.parametrize("closed", STREAMS)
def test_closed_streams_do_no_harm(closed: str) -> None:
    """As some schedulers and daemons start programs."""
    assert in_a_shell("schema", STREAMS[closed]) == 0


def test_faults_keep_their_status_without_streams() -> None:
    """What cannot be said is said by the status."""
    assert in_a_shell("check nothing.toml", STREAMS["reading"]) == 2


@pytest.mark.slow(minutes=0.2)
@pytest.mark.parametrize("closed", STREAMS)
def test_runs_are_done_without_streams(closed: str, tmp_path: Path) -> None:
    """Results are complete, and none of their files is taken for a stream."""
    words = f"run {DEMO} --set time.end=1e-3 --error none --output {tmp_path / 'out'}"
    assert in_a_shell(words, STREAMS[closed]) == 0
    assert open_results(tmp_path / "out").summary["status"] == "completed"


def in_a_shell(words: str, streams: str) -> int:
    """Return the exit status of a command whose streams a shell has closed."""
    command = f"{subprocess.list2cmdline(GAPBEAM)} {words} {streams}"
    return subprocess.run(["sh", "-c", command], cwd=PROJECT, env=process_environment()).returncode


@pytest.mark.parametrize(("words", "status"), [(("schema",), 6), (("nothing",), 2)], ids=["schema", "fault"])
def test_a_full_disk_behind_a_stream_is_no_trace(words: tuple[str, ...], status: int) -> None:
    """What a command was asked for is lost where standard output is full; on standard error nothing is."""
    with open("/dev/full", "w") as full:  # noqa: PTH123
        done = subprocess.run(
            [*GAPBEAM, *words], stdout=full, stderr=subprocess.PIPE, text=True, cwd=PROJECT, env=process_environment()
        )
        assert (done.returncode, "Traceback" in done.stderr) == (status, False)
        deaf = subprocess.run([*GAPBEAM, "nothing"], stderr=full, cwd=PROJECT, env=process_environment())
        assert deaf.returncode == 2


SCENES = {
    "slice": ("run", DEMO),
    "basis": ("run", DEMO, *settings("model.type=reduced")),
    "eigensolver": ("run", PROJECT / "cases" / "tube-baffles.toml"),
    "modes": ("modes", PROJECT / "cases" / "li2013-2d.toml"),
    "check": ("check", PROJECT / "cases" / "tube-holes.toml"),
}


@pytest.mark.slow(minutes=0.5)
@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("seed", range(4))
def test_signals_at_any_moment(name: str, seed: int, tmp_path: Path) -> None:
    """Libraries load, set-up, eigensolver, seat, march: ended by the signal or with its status, no trace."""
    chance = random.Random(f"{name} {seed}")
    number = chance.choice((signal.SIGINT, signal.SIGTERM))
    words = SCENES[name]
    where = ("--output", tmp_path / "out") if words[0] != "check" else ()
    command = ["env", "--default-signal=INT,TERM", *GAPBEAM, *map(str, (*words, *where))]
    process = subprocess.Popen(
        command, cwd=PROJECT, env=process_environment(), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    try:
        time.sleep(chance.uniform(0.05, 8.0))
        process.send_signal(number)
        _, said = process.communicate(timeout=LONGEST)
    finally:
        process.kill()
        process.wait()
    assert process.returncode in (0, 5, -number, STATUS[number]), said
    assert "Traceback" not in said
    assert "Exception ignored" not in said
    assert "PETSC ERROR" not in said
