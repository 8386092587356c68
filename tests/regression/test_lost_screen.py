"""What a command is started from goes, be it mpirun, a terminal or a pipe; and Ctrl-C before it has begun."""

from __future__ import annotations

import fcntl
import os
import signal
import subprocess
import sys
import termios
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from gapbeam.postprocess.results.results import open_results
from tests.shared.command import DEMO, GAPBEAM, PROJECT, alone, process_environment, ranks, settings
from tests.shared.processes import LONGEST, until

pytestmark = [alone, pytest.mark.versions]

ATTEMPTS = 5
LONG = settings("time.end=600.0", "output.fields_interval=1e-2")


@contextmanager
def started(*command: str | Path, **options: Any) -> Iterator[subprocess.Popen[bytes]]:
    """Start a command that hears interrupts, also where the tests do not; end it if it has not ended by itself."""
    hears = ("env", "--default-signal=INT,QUIT,HUP,TERM")  # a shell starts what goes on in the background deaf to INT
    process = subprocess.Popen([*hears, *map(str, command)], cwd=PROJECT, env=process_environment(), **options)
    try:
        yield process
    finally:
        process.kill()
        process.wait()


def marches(folder: Path, process: subprocess.Popen[bytes], fields: int = 1) -> None:
    """Wait until a run has written some fields."""

    def there() -> bool:
        assert process.poll() is None
        path = folder / "fields.xdmf"
        return path.is_file() and path.read_text(encoding="utf-8").count("<Time") >= fields

    until(there, f"there are {fields} fields")


def interrupted(folder: Path) -> int:
    """Return the exit status in the summary of a run that was interrupted and can be resumed."""
    summary = open_results(folder).summary
    assert summary["status"] == "interrupted"
    assert len(list((folder / "checkpoint").glob("step-*"))) == 1
    assert open_results(folder).history.sizes["time"] == summary["convergence"]["steps"] + 1
    return int(summary["exit_status"])


@pytest.mark.slow(minutes=0.2)
def test_ranks_end_without_mpirun(tmp_path: Path) -> None:
    """Kill -9 of mpirun: its ranks go, with a checkpoint unless Open MPI is quicker; they would run on for ever."""
    folder, pids = tmp_path / "out", tmp_path / "pids"
    pids.mkdir()
    command = (
        *ranks(2),
        sys.executable,
        "-m",
        "tests.programs.numbered_ranks",
        pids,
        "--apart",
        "run",
        DEMO,
        *LONG,
        "--output",
        folder,
    )
    with started(*command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as mpirun:
        marches(folder, mpirun)
        left = [Path("/proc", (pids / str(rank)).read_text()) for rank in range(2)]
        mpirun.kill()
        mpirun.wait()
        try:
            until(lambda: not any(path.exists() for path in left), "the ranks have ended")
        finally:
            for path in filter(Path.exists, left):
                os.kill(int(path.name), signal.SIGKILL)
    if open_results(folder).summary["status"] == "running":  # Open MPI may miss its server first, and abort
        assert any("PMIx" in path.read_text(encoding="utf-8") for path in pids.glob("said-*"))
        assert open_results(folder).history.sizes["time"] > 0
    else:
        assert interrupted(folder) == 143


def on_terminal(slave: int) -> None:
    """Make a terminal that of this process, as a shell does."""
    os.setsid()
    fcntl.ioctl(slave, termios.TIOCSCTTY, 0)


@pytest.mark.slow(minutes=0.1)
def test_closed_terminal_ends_a_run_in_order(tmp_path: Path) -> None:
    """SIGHUP while the bar is drawn, and nothing to draw on any more: a checkpoint, and exit status 143."""
    folder = tmp_path / "out"
    master, slave = os.openpty()
    streams = {"stdin": slave, "stdout": slave, "stderr": slave}
    with started(
        *GAPBEAM, "run", DEMO, *LONG, "--output", folder, **streams, preexec_fn=lambda: on_terminal(slave)
    ) as process:
        os.close(slave)
        os.set_blocking(master, False)

        def draws() -> bool:
            said = b""
            try:
                while more := os.read(master, 2**16):
                    said += more
            except BlockingIOError:
                pass
            return b"steps/s" in said

        until(draws, "the bar is drawn")
        os.close(master)
        assert process.wait(LONGEST) == 143
    assert interrupted(folder) == 143


@pytest.mark.slow(minutes=0.2)
def test_run_outlives_its_screen(tmp_path: Path) -> None:
    """Under nohup, its pipe closed: it goes on, and its log; an interrupt still ends it in order."""
    folder = tmp_path / "out"
    reader, writer = os.pipe()
    with started(
        "env", "--ignore-signal=HUP", *GAPBEAM, "run", DEMO, *LONG, "--output", folder, stdout=writer, stderr=writer,
    ) as process:  # fmt: skip
        os.close(writer)
        os.read(reader, 1)
        os.close(reader)
        process.send_signal(signal.SIGHUP)
        marches(folder, process, fields=4)
        process.send_signal(signal.SIGHUP)
        marches(folder, process, fields=8)
        process.send_signal(signal.SIGINT)
        assert process.wait(LONGEST) == 130
    assert interrupted(folder) == 130
    assert "interrupted at t = " in (folder / "run.log").read_text(encoding="utf-8")


@pytest.mark.slow(minutes=0.1)
@pytest.mark.parametrize("words", [("schema",), ("check", DEMO)], ids=["schema", "check"])
def test_closed_pipe_ends_short_commands_quietly(words: tuple[str | Path, ...]) -> None:
    """As with `| head -1`: no trace, no message."""
    reader, writer = os.pipe()
    os.close(reader)
    with started(*GAPBEAM, *words, stdout=writer, stderr=subprocess.PIPE) as process:
        os.close(writer)
        said = process.communicate(timeout=LONGEST)[1].decode()
    assert process.returncode == 0
    assert not [line for line in said.splitlines() if not line.startswith("INFO")]


@pytest.mark.slow(minutes=0.1)
@pytest.mark.parametrize("library", ["h5py", "libpetsc"])
def test_interrupt_while_libraries_load(library: str, tmp_path: Path) -> None:
    """Ctrl-C in the first seconds: exit status 130, one line, no trace, no abort, nothing written.

    PETSc loads when the results folder is there, with the files that every run begins with. On a busy machine the
    run may be past its libraries before the test looks again: then once more.
    """
    gently = ("nice", "-n", "10")
    for attempt in range(ATTEMPTS):
        out = tmp_path / str(attempt)
        words = (*gently, *GAPBEAM, "run", DEMO, *LONG, "--output", out)
        with started(*words, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE) as process:
            maps = Path(f"/proc/{process.pid}/maps")
            until(lambda maps=maps: library in maps.read_text(encoding="utf-8"), f"{library} is loaded")
            process.send_signal(signal.SIGINT)
            said = process.communicate(timeout=LONGEST)[1].decode()
        assert process.returncode == 130, said
        if library == "libpetsc":
            assert "interrupted before the march began" in said
            assert "Traceback" not in said
            return
        if not out.exists():
            break
    assert said == "gapbeam: interrupted\n"
    assert not out.exists()
