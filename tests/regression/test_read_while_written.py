"""Results that are read while a run writes them: whole at any moment, never fewer, and open as long as one reads."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

import gapbeam
import gapbeam.postprocess.results.results
from gapbeam.postprocess.results.field_reader import Fields
from gapbeam.postprocess.results.results import open_results
from gapbeam.postprocess.results_errors import ResultsError
from gapbeam.solver.run.output.field_files import FieldWriter
from gapbeam.solver.run.output.history_file import HistoryWriter
from tests.shared.command import DEMO, RATTLE, alone, called_anew, settings
from tests.shared.interrupted import stopped_after
from tests.shared.processes import appears, beside, ended, often

pytestmark = alone
BRIEF = (*RATTLE, "time.end=0.012", "output.fields_interval=2e-3")
LOOKS = 5  # before the run may end
KEYS = (*RATTLE, "time.end=0.08", "output.fields_interval=2e-3", "output.checkpoint_interval=0.05")


def run_that_waits(folder: Path, what: str, *keys: str) -> Callable[[], int]:
    """Return a run that waits for the reader before it gathers what it wrote: its fields, or its history."""
    writer = {"fields": FieldWriter, "history": HistoryWriter}[what]

    def work() -> int:
        often()
        close = writer.close

        def wait_and_close(self: Any) -> None:
            if what == "history":
                self.commit()
            (folder.parent / "written").touch()
            appears(folder.parent / "opened")
            close(self)

        with pytest.MonkeyPatch.context() as patch:
            if what == "history":
                patch.setattr("gapbeam.solver.run.output.history_file.SMALL", 0)  # bytes: a piece for every checkpoint
            patch.setattr(writer, "close", wait_and_close)
            return gapbeam.run(DEMO, (*BRIEF, *keys), folder).exit_status

    return work


@pytest.mark.slow(minutes=0.3)
def test_reader_beside_a_run(tmp_path: Path) -> None:
    """A reader that looks all the time sees finite records and fields that only become more, or none at all."""
    folder, text = tmp_path / "out", tmp_path / "messages"
    process = beside(run_that_waits(folder, "fields", *KEYS), text)
    looks, records, shown = 0, 0, 0
    while (
        Path(f"/proc/{process}").exists() and os.waitid(os.P_PID, process, os.WEXITED | os.WNOHANG | os.WNOWAIT) is None
    ):
        try:
            results = open_results(folder)
            found = results.history["contact_force"].values
            assert np.all(np.isfinite(found))
            assert len(found) >= records
            records = len(found)
            with results.fields() as fields:
                assert len(fields) >= shown
                shown = len([frame for frame in fields if np.all(np.isfinite(frame.displacement))])
                assert shown == len(fields)
            looks += 1
            if looks == LOOKS:
                (tmp_path / "opened").touch()
        except ResultsError:
            assert looks == 0, "results that were there could not be read any more"
        time.sleep(0.02)
    assert ended(process) == 0, text.read_text(encoding="utf-8")
    assert looks >= LOOKS
    assert open_results(folder).history.sizes["time"] == 801


@pytest.fixture
def opened(tmp_path: Path) -> Iterator[Fields]:
    """The fields of a run, opened, and the first one read, before the run gathered them."""
    folder, text = tmp_path / "out", tmp_path / "messages"
    process = beside(run_that_waits(folder, "fields"), text)
    appears(tmp_path / "written")
    with open_results(folder).fields() as fields:
        assert fields.frame(0).time == 0.0
        assert (folder / "fields" / "000006.h5").exists()
        (tmp_path / "opened").touch()
        assert ended(process) == 0, text.read_text(encoding="utf-8")
        assert not (folder / "fields").exists()
        yield fields


def test_fields_that_were_gathered_since(opened: Fields, tmp_path: Path) -> None:
    """The series that was opened goes on, with the same fields."""
    with open_results(tmp_path / "out").fields() as whole:
        assert len(opened) == len(whole) == 7
        for frame, same in zip(opened, whole, strict=True):
            assert frame.time == same.time
            np.testing.assert_array_equal(frame.displacement, same.displacement)
            np.testing.assert_array_equal(frame.contact_pressure, same.contact_pressure)
    assert opened.frame(-1).time == pytest.approx(0.012)


def test_damage_is_reported_after_gathering(opened: Fields, tmp_path: Path) -> None:
    """A field that is gone for good, another run instead of this one: reported, not tried for ever."""
    with h5py.File(tmp_path / "out" / "fields.h5", "a") as file:
        del file["displacement/5"]
    with pytest.raises(ResultsError, match="KeyError"):
        opened.frame(5)
    assert opened.frame(6).time == pytest.approx(0.012)


@pytest.mark.slow(minutes=0.2)
def test_another_run_instead_of_one(opened: Fields, tmp_path: Path) -> None:
    """A folder that was written anew, with another mesh."""
    words = ("run", DEMO, *settings(*BRIEF, "mesh.size=0.03"), "--output", tmp_path / "out", "--overwrite")
    assert called_anew(*words).returncode == 0
    with pytest.raises(ResultsError, match=r"other points .* another one has taken its place"):
        opened.frame(1)


def test_fields_that_a_resume_takes_back(tmp_path: Path) -> None:
    """Fields after the checkpoint go while they are open: it is said, and they are read once they are there again."""
    folder, text = tmp_path / "out", tmp_path / "messages"
    with stopped_after(30):
        assert gapbeam.run(DEMO, BRIEF, folder).exit_status == 143
    with pytest.MonkeyPatch.context() as patch, stopped_after(40):
        patch.setattr(FieldWriter, "close", lambda _: None)  # as where a run is killed
        assert gapbeam.run(DEMO, BRIEF, folder, resume=True).exit_status == 143
    sorted((folder / "checkpoint").glob("step-*"))[-1].unlink()

    def resumed() -> int:
        appears(tmp_path / "opened")
        with stopped_after(11):
            gapbeam.run(DEMO, BRIEF, folder, resume=True)
        (tmp_path / "cut").touch()
        appears(tmp_path / "looked")
        return gapbeam.run(DEMO, BRIEF, folder, resume=True).exit_status

    process = beside(resumed, text)
    with open_results(folder).fields() as fields:
        assert len(fields) == 4
        (tmp_path / "opened").touch()
        appears(tmp_path / "cut")
        for _ in range(2):
            with pytest.raises(ResultsError, match="field number 3, which a resumed run has taken back"):
                fields.frame(3)
        assert [fields.frame(number).time for number in range(3)] == pytest.approx([0.0, 0.002, 0.004])
        (tmp_path / "looked").touch()
        assert ended(process) == 0, text.read_text(encoding="utf-8")
        assert [frame.time for frame in fields] == pytest.approx([0.0, 0.002, 0.004, 0.006])


@pytest.mark.slow(minutes=0.3)
@pytest.mark.parametrize("race", ["gathered", "there again"])
def test_history_that_changes_while_it_is_read(race: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Pieces that go, or go and come, between being found and being read: the history is read anew."""
    folder, text = tmp_path / "out", tmp_path / "messages"
    process = beside(run_that_waits(folder, "history", "output.checkpoint_interval=0.02"), text)
    appears(tmp_path / "written")
    load, raced = gapbeam.postprocess.results.results._history_in, []

    def overtaken(path: Path) -> object:
        if path.parent.name != "history" or raced:
            return load(path)
        raced.append(path)
        if race == "gathered":
            (tmp_path / "opened").touch()
            assert ended(process) == 0, text.read_text(encoding="utf-8")
            return load(path)
        content = path.read_bytes()
        path.unlink()
        with pytest.raises(ResultsError) as refused:
            load(path)
        path.write_bytes(content)
        raise refused.value

    monkeypatch.setattr(gapbeam.postprocess.results.results, "_history_in", overtaken)
    assert open_results(folder).history.sizes["time"] == 121
    assert raced
    if race == "there again":
        raced[0].write_bytes(b"no more")
        with pytest.raises(ResultsError, match=f"{raced[0].name}: found a file that cannot be read"):
            _ = open_results(folder).history
        os.kill(process, signal.SIGKILL)
        assert ended(process) == -signal.SIGKILL
