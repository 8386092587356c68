"""The first run with a compiled march: signals are heard while it compiles, and what was compiled is used."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import threading
import time
from pathlib import Path

import pytest

from gapbeam.commands.compile_ahead import WORK
from gapbeam.solver.compilation.jit import (
    cache_folder,
    compile_in_another_process,
    compiled,
    compiled_apart,
    entry,
    is_kept,
)
from tests.shared.command import DEMO, GAPBEAM, PROJECT, alone, process_environment, settings
from tests.shared.processes import LONGEST, until

pytestmark = alone
REDUCED = settings("model.type=reduced", "time.end=0.02")


def first_run(folder: Path, *options: str) -> subprocess.Popen[str]:
    """Start a run whose cache of machine code is empty."""
    return subprocess.Popen(
        [*GAPBEAM, "run", str(DEMO), *REDUCED, *options, "--output", str(folder / "out")],
        cwd=PROJECT,
        env={**process_environment(), "NUMBA_CACHE_DIR": str(folder / "cache")},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def kernels(folder: Path) -> list[Path]:
    """Return the files of the march's machine code."""
    return list(folder.rglob("march_kernel.march_*-*.nbc"))


@pytest.mark.slow(minutes=0.1)
@pytest.mark.parametrize("options", [(), ("--set", 'analysis={type="periodic",start="seat"}')], ids=["march", "search"])
def test_a_signal_is_heard_while_the_march_compiles(options: tuple[str, ...], tmp_path: Path) -> None:
    """SIGTERM ends the run before compilation does: status 143, the summary says so, no child goes on.

    So it does in a search for a periodic response, whose marches compiled in the process that shall hear it.
    """
    log = tmp_path / "out" / "run.log"
    process = first_run(tmp_path, *options)
    until(lambda: log.exists() and "time loop is compiled" in log.read_text("utf-8"), "compilation")
    until(lambda: process.poll() is not None or bool(children_of(process.pid)), "the process that compiles")
    children = children_of(process.pid)
    for number in children:
        os.kill(number, signal.SIGSTOP)  # on a busy machine it could end before the signal is sent
    process.send_signal(signal.SIGTERM)
    _, errors = process.communicate(timeout=LONGEST)
    assert process.returncode == 143, errors
    assert not kernels(tmp_path)
    summary = json.loads((tmp_path / "out" / "summary.json").read_text("utf-8"))
    assert (summary["status"], summary["exit_status"]) == ("interrupted", 143)
    assert "terminated before the march began" in summary["message"]
    assert len(children) == 1
    for number in children:
        with pytest.raises(ProcessLookupError):
            os.kill(number, 0)


@entry
def doubled(x: float) -> float:
    """Return 2 x."""
    return 2.0 * x


def test_code_of_another_installation_is_not_ones_own() -> None:
    """It has the same sources and lies in the same folder; a signal would wait for a compilation that is not seen."""
    folder = cache_folder()
    assert folder is not None
    own = [path for path in folder.rglob("test_compilation.doubled-*") if path.parent.name != "elsewhere"]
    other = folder / "elsewhere" / "test_compilation.doubled-1.py313.1.nbc"
    other.parent.mkdir(exist_ok=True)
    other.touch()
    try:
        for path in own:
            path.unlink()
        assert not is_kept(doubled)
        assert doubled(2.0) == 4.0
        assert is_kept(doubled)
    finally:
        other.unlink()
        other.parent.rmdir()


def test_a_signal_that_another_thread_takes_during_the_fork_leaves_no_process(monkeypatch: pytest.MonkeyPatch) -> None:
    """The handler acts once the child can be ended: one that raised at once left the child behind."""
    began, fork = [], os.fork

    def fork_and_signal() -> int:
        child = fork()
        if child:
            began.append(child)
            thread = threading.Thread(target=os.kill, args=(os.getpid(), signal.SIGTERM))
            thread.start()
            thread.join()
        return child

    def stop(number: int, _: object) -> None:
        raise InterruptedError(number)

    monkeypatch.setattr(os, "fork", fork_and_signal)
    before = signal.signal(signal.SIGTERM, stop)
    try:
        with pytest.raises(InterruptedError):
            compile_in_another_process(lambda: time.sleep(LONGEST), lambda: None)
        assert signal.getsignal(signal.SIGTERM) is stop
    finally:
        signal.signal(signal.SIGTERM, before)
    with pytest.raises(ProcessLookupError):
        os.kill(began[0], 0)


@pytest.mark.slow(minutes=2)
@pytest.mark.parametrize("scheme", ["discrete-gradient", "newmark"])
def test_the_march_uses_what_was_compiled(scheme: str, tmp_path: Path) -> None:
    """One variant of the kernel is compiled, once: by the child for the march."""
    process = first_run(tmp_path, *settings(f"time.scheme.type={scheme}"))
    _, errors = process.communicate(timeout=LONGEST)
    assert process.returncode == 0, errors
    assert errors.count("the time loop is compiled") == 1
    assert len(kernels(tmp_path)) == 1


@pytest.mark.slow(minutes=3)
def test_runs_find_what_was_compiled_ahead(tmp_path: Path) -> None:
    """After `gapbeam compile` neither a beam between faces, nor one in holes, nor shooting compiles anything."""
    environment = {**process_environment(), "NUMBA_CACHE_DIR": str(tmp_path / "cache")}

    def called(*words: str) -> str:
        done = subprocess.run([*GAPBEAM, *words], cwd=PROJECT, env=environment, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        return done.stderr + done.stdout

    assert called("compile").count(" s\n") == len(WORK)
    before = sorted((tmp_path / "cache").rglob("*.nbc"))
    for number, words in enumerate(
        (
            (str(DEMO), *REDUCED),
            ("cases/tube-holes.toml", *settings("model.type=beam", "time.end=0.02")),
            ("cases/periodic.toml",),
        )
    ):
        assert "compiled, which takes" not in called("run", *words, "--output", str(tmp_path / str(number)))
    march = "march_kernel", "tangent_kernel"
    after = sorted((tmp_path / "cache").rglob("*.nbc"))
    assert [path for path in after if path.name.startswith(march)] == [
        path for path in before if path.name.startswith(march)
    ]


@compiled
def squared(x: float) -> float:
    return x * x


@compiled_apart
def quartic(x: float) -> float:
    return squared(squared(x))


@entry
def sum_of_powers(x: float) -> float:
    return squared(x) + quartic(x)


def test_what_only_compiled_code_calls_is_optimized_with_its_callers(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """LLVM optimizes the module of the entry alone; Python calls a copy of a part, with machine code of its own."""
    from numba.core.codegen import CPUCodeLibrary

    optimize, seen = CPUCodeLibrary._optimize_final_module, list[str]()

    def counted(library: CPUCodeLibrary) -> None:
        seen.append(library.name)
        optimize(library)

    monkeypatch.setattr(CPUCodeLibrary, "_optimize_final_module", counted)
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    cache_folder.cache_clear()
    try:
        made = entry(sum_of_powers.py_func)  # type: ignore[attr-defined]  # pytest has asked the other for attributes
        assert made(3.0) == 90.0
    finally:
        cache_folder.cache_clear()
    assert "sum_of_powers" in seen
    assert not {"squared", "quartic"} & set(seen)
    assert quartic(2.0) == 16.0
    assert "quartic" in seen


def test_a_cache_that_cannot_be_written_is_reported(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    environment = {**process_environment(), "NUMBA_CACHE_DIR": str(tmp_path / "file" / "cache")}
    done = subprocess.run([*GAPBEAM, "compile"], cwd=PROJECT, env=environment, capture_output=True, text=True)
    assert done.returncode == 6
    assert "XDG_CACHE_HOME" in done.stderr
    assert "Traceback" not in done.stderr


def children_of(process: int) -> list[int]:
    """Return the numbers of the children of a process."""
    return [int(number) for number in Path(f"/proc/{process}/task/{process}/children").read_text().split()]
