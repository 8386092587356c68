"""A disk that is full at any byte, and results that are cut or changed anywhere: said, survived, never waited for."""

from __future__ import annotations

import errno
import os
import re
import resource
import signal
import threading
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

import gapbeam
from gapbeam import command_line
from gapbeam.postprocess.results.bounded_files import as_written
from gapbeam.postprocess.results.results import open_results
from gapbeam.solver.memory.memory_check import is_out_of_memory
from gapbeam.solver.run.output import atomic_files, output_thread
from gapbeam.solver.run.output import hdf5_files as repeated_hdf5
from gapbeam.solver.run.output.parallel_tables import Pieces
from gapbeam.solver.schema.record_table import SUMMARY_FILE
from tests.shared.command import DEMO, RATTLE, alone
from tests.shared.command import settings as options
from tests.shared.interrupted import differing
from tests.shared.processes import beside, command, ended, often, until

pytestmark = alone

LONGEST = 120.0  # s: only what hangs takes longer
KEYS = (
    *RATTLE, "model.type=rigid", "time.end=0.02", "output.fields_interval=2e-3", "output.checkpoint_interval=0.0",
    "output.errors=none",
)  # fmt: skip
FEW = settings(deadline=None, max_examples=8, derandomize=True, suppress_health_check=list(HealthCheck))
NUMBERS = (errno.ENOSPC, errno.EFBIG, errno.EDQUOT, errno.EIO)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The run without faults."""
    folder = tmp_path_factory.mktemp("whole") / "out"
    assert gapbeam.run(DEMO, KEYS, folder).exit_status == 0
    return folder


def no_larger_file(size: int) -> Callable[[], None]:
    """Return what lets no file of this process grow beyond a size, bytes."""

    def first() -> None:
        often()
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))

    return first


def disk_of(size: int, number: int) -> Callable[[], None]:
    """Return what makes the disk of this process take so many bytes of results, and then fail with an error."""

    def first() -> None:
        often()
        left, write = [size], os.write

        def taking(place: int, data: bytes | memoryview) -> int:
            some = memoryview(data)[: left[0]]
            if len(data) and not len(some):
                raise OSError(number, os.strerror(number))
            left[0] -= (done := write(place, some))
            return done

        into = atomic_files.Sink.write

        def sink(self: atomic_files.Sink, data: bytes | memoryview) -> int:
            if len(data) > left[0] and self.trouble is None:
                self.trouble = OSError(number, os.strerror(number))
            left[0] -= len(data)
            return into(self, data)

        repeated_hdf5.os = SimpleNamespace(write=taking, close=os.close)  # type: ignore[assignment]
        atomic_files.Sink.write = sink  # type: ignore[method-assign]

    return first


def said_by(work: Callable[[], int]) -> tuple[int, str]:
    """Return the exit status of a process and what it said, through a pipe: a file would be limited as well."""
    reading, writing = os.pipe()
    status = ended(beside(work, Path(f"/dev/fd/{writing}")), LONGEST)
    os.close(writing)
    with os.fdopen(reading, encoding="utf-8") as pipe:
        return status, pipe.read()


def check_survived(folder: Path, first: Callable[[], None], whole: Path) -> None:
    """Check what a run that met a full disk says and leaves, and that it goes on to the same end."""
    run = ("run", DEMO, *options(*KEYS), "--output", folder)
    status, words = said_by(command(*run, first=first))
    assert "Traceback" not in words
    if status != 0:  # 0: all was smaller
        assert status == 6, words
        assert "could not be written" in words or "has room for" in words
        assert "full disk" in words
        if (folder / "history.h5").exists():
            assert open_results(folder).history.sizes["time"] >= 1
    status, words = said_by(command(*run, "--resume"))
    assert status == 0, words
    assert differing(whole, folder) == []


@FEW
@given(size=st.integers(0, 200_000))
@example(size=0)
@example(size=20_000)
@pytest.mark.slow(minutes=0.3)
def test_files_that_cannot_grow_end_a_run_with_a_message(
    size: int, whole: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    """Whatever the limit of file sizes: status 6, where, what to try, nothing lost."""
    check_survived(tmp_path_factory.mktemp("limited") / "out", no_larger_file(size), whole)


@pytest.mark.slow(minutes=0.5)
@FEW
@given(size=st.integers(1, 150_000), number=st.sampled_from(NUMBERS))
@example(size=40_000, number=errno.EDQUOT)
def test_a_disk_that_is_full_ends_a_run_with_a_message(
    size: int, number: int, whole: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    """After any number of bytes, by any of the errors of a disk."""
    check_survived(tmp_path_factory.mktemp("full") / "out", disk_of(size, number), whole)


def test_a_disk_that_neither_writes_nor_fails_does_not_keep_a_run_that_is_to_end(tmp_path: Path) -> None:
    """SIGTERM while the output is stuck in a file: status 6, where to look, and the first field is there."""
    write, written, stuck = repeated_hdf5.RepeatedFile.write, list[Path](), tmp_path / "stuck"

    def never_ending(self: repeated_hdf5.RepeatedFile, path: Path, pieces: Pieces) -> None:
        if written:
            stuck.touch()
            threading.Event().wait()
        written.append(path)
        write(self, path, pieces)

    def first() -> None:
        often()
        output_thread.PATIENCE = 0.2
        repeated_hdf5.RepeatedFile.write = never_ending  # type: ignore[method-assign]

    words = tmp_path / "words"
    process = beside(command("run", DEMO, *options(*KEYS), "--output", tmp_path / "out", first=first), words)
    until(stuck.exists, "the output is stuck", LONGEST)
    os.kill(process, signal.SIGTERM)
    assert ended(process, LONGEST) == 6
    assert "the disk has taken nothing for" in words.read_text(encoding="utf-8")
    with open_results(tmp_path / "out").fields() as fields:
        assert len(list(fields)) == 1


@pytest.mark.parametrize("number", NUMBERS)
def test_a_disk_is_reported_whoever_meets_it(number: int) -> None:
    """A write that no run knows of: a message with the file and status 6, no trace."""

    def failing(*_: object, **__: object) -> int:
        raise OSError(number, os.strerror(number), "/some/file")

    def first() -> None:
        command_line._application = lambda _: failing  # type: ignore[assignment,return-value]

    status, words = said_by(command("schema", first=first))
    assert status == 6
    assert words.startswith(f"gapbeam: /some/file could not be written: {os.strerror(number)}; look for")


@pytest.mark.parametrize("number", NUMBERS[:3])
def test_a_full_disk_is_no_fault_of_what_is_read(number: int, tmp_path: Path) -> None:
    """The picture of a sweep met it while its points were read: status 2, "files that can be read"."""
    with pytest.raises(OSError, match=re.escape(os.strerror(number))) as caught, as_written(tmp_path):
        raise OSError(number, os.strerror(number))
    assert (caught.value.errno, caught.value.filename) == (number, str(tmp_path))


@pytest.mark.parametrize("wanted", ["a/report.html", "figures", "b.csv"])
def test_a_full_disk_is_that_of_what_is_written(wanted: str, tmp_path: Path) -> None:
    """A page, a folder of pictures, columns: their own place, not the results that they are drawn from."""
    place = tmp_path / wanted
    with pytest.raises(OSError, match="No space") as caught, as_written(tmp_path / "run", into=place):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    assert caught.value.filename == str(place)


@pytest.mark.parametrize("command", [gapbeam.plot, gapbeam.render, gapbeam.report, gapbeam.export])
def test_what_is_drawn_elsewhere_names_its_own_disk(
    command: Callable[..., Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each command on a run, whose output stands on another disk, which is full."""
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / SUMMARY_FILE).write_text("{}")

    def full(*_: object, **__: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    for name in ("gapbeam.interface.drawn_results.refuse_links", "gapbeam.studies.write_report.report_on",
                 "gapbeam.postprocess.export.export"):  # fmt: skip
        monkeypatch.setattr(name, full)
    with pytest.raises(OSError, match="No space") as caught:
        command(tmp_path / "run", output=tmp_path / "out.html")
    assert caught.value.filename == str(tmp_path / "out.html")


def test_an_error_that_is_its_own_cause_is_looked_at_once() -> None:
    """A ring of causes and contexts, as an error makes that is kept and raised again."""
    kept = OSError(errno.EFBIG, "File too large")
    first = ValueError("first")
    first.__cause__, kept.__context__ = kept, first
    assert not is_out_of_memory(first)
    first.__context__, kept.__context__ = None, MemoryError()
    assert is_out_of_memory(first)
