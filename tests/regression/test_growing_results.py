"""Histories in pieces and a series that grows in place: whole at every moment, and no dearer late than early."""

from __future__ import annotations

import os
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from gapbeam.postprocess.results.results import ResultsError, open_results
from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.run.output import hdf5_files as growing_series
from gapbeam.solver.run.output import history_file as histories
from gapbeam.solver.run.output.hdf5_files import HEAD, SECTOR, SWITCH, TAIL, GrowingSeries
from gapbeam.solver.run.output.history_file import HistoryWriter
from gapbeam.solver.schema.record_table import HISTORY, history_pieces
from tests.shared.history_labels import LABELS as SLICE

LABELS = {**SLICE, "load": ("shaker",)}


def rows(first: int, count: int, factor: float = 1.0) -> dict[str, np.ndarray]:
    """Return records whose values follow from their numbers."""
    time = np.arange(first, first + count) * 1e-3
    found = {"time": time}
    for number, record in enumerate(HISTORY):
        shape = tuple(len(LABELS[dimension]) for dimension in record.dims[1:])
        if 0 not in shape:
            found[record.name] = np.broadcast_to(
                (factor * (number + time)).reshape(-1, *(1 for _ in shape)), (count, *shape)
            )
    return found


def check(folder: Path, count: int, factor_after: tuple[int, float] = (10**9, 1.0)) -> None:
    """Check that a folder holds so many records, those from a number on times a factor."""
    history = open_results(folder).history
    assert history.sizes["time"] == count
    begin, factor = factor_after
    expected = {name: value.copy() for name, value in rows(0, count).items()}
    for name, value in rows(0, count, factor).items():
        expected[name][begin:] = value[begin:]
    for name, value in expected.items():
        np.testing.assert_array_equal(history[name].values, value, err_msg=name)


def three_pieces(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Write 1500 records in three pieces, and leave them as a run does that is killed."""
    monkeypatch.setattr(histories, "SMALL", 0)
    writer = HistoryWriter(folder, LABELS)
    for first in (0, 500, 1000):
        writer.append(rows(first, 500))
        writer.commit()


@pytest.mark.slow(minutes=0.1)
def test_history_in_pieces_is_whole_at_every_checkpoint(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Committed again and again: readable each time, small pieces are continued, and one file is left at the end."""
    monkeypatch.setattr(histories, "SMALL", 200_000)
    writer, done = HistoryWriter(tmp_path, LABELS), 0
    for count in (1, 1000, 3, 2000):
        writer.append(rows(done, count))
        done += count
        writer.commit()
        check(tmp_path, done)
    assert 2 <= len(history_pieces(tmp_path)) < 5
    writer.append(rows(done, 5))
    writer.close()
    check(tmp_path, done + 5)
    assert [path.name for path in tmp_path.iterdir()] == ["history.h5"]


@pytest.mark.slow(minutes=0.1)
def test_history_goes_on_within_a_piece(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Cut back to a checkpoint in the middle, twice, and killed in between: what is written again counts."""
    three_pieces(tmp_path, monkeypatch)
    again = HistoryWriter(tmp_path, LABELS, kept=700)
    check(tmp_path, 1500)
    again.append(rows(700, 300, 2.0))
    again.commit()
    check(tmp_path, 1000, (700, 2.0))
    last = HistoryWriter(tmp_path, LABELS, kept=900)
    last.append(rows(900, 50, 2.0))
    last.flush()  # and killed
    check(tmp_path, 1000, (700, 2.0))
    last.close()
    check(tmp_path, 950, (700, 2.0))
    assert [path.name for path in tmp_path.iterdir()] == ["history.h5"]


def test_pieces_that_are_gone_are_reported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A piece that is missing in the middle: reported when it is read, and by --resume, which then changes nothing."""
    three_pieces(tmp_path, monkeypatch)
    (tmp_path / "history" / "000000000500.h5").unlink()
    with pytest.raises(ResultsError, match="500 records from number 0 on, and the next ones from 1000 on"):
        _ = open_results(tmp_path).history
    with pytest.raises(UserError, match="holds 500 records; expected at least 1000"):
        HistoryWriter(tmp_path, LABELS, kept=1400)


def test_commit_writes_what_is_new(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Bytes written by the last of many commits do not follow from the records before."""
    monkeypatch.setattr(histories, "SMALL", 2**18)
    writer, written = HistoryWriter(tmp_path, LABELS), []
    for number in range(12):
        writer.append(rows(2000 * number, 2000))
        before = {path: path.stat().st_mtime_ns for _, path in history_pieces(tmp_path) if path.exists()}
        writer.commit()
        changed = [path for _, path in history_pieces(tmp_path) if before.get(path) != path.stat().st_mtime_ns]
        written.append(sum(path.stat().st_size for path in changed))
    assert max(written[2:]) <= 2**18 + 1.5 * written[0]
    assert sum(path.stat().st_size for _, path in history_pieces(tmp_path)) > 6 * written[-1]


def grid(number: int) -> str:
    return f'<Grid Name="step {number}"><Time Value="{number}"/></Grid>' + " " * (number * 37 % 900)


def numbers(path: Path) -> list[str]:
    return [one.attrib["Value"] for one in ElementTree.parse(path).iter("Time")]


def test_series_is_whole_after_every_write(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Cut off after any of its writes, at any byte of the long one: a document with all grids but perhaps the last."""
    monkeypatch.setattr(growing_series, "ROOM", 4096)
    path, grids = tmp_path / "fields.xdmf", [grid(0)]
    series, write, seen = GrowingSeries(path), os.pwrite, []

    def in_parts(place: int, data: bytes, at: int) -> int:
        assert len(data) > len(SWITCH) or at // SECTOR == (at + len(data) - 1) // SECTOR
        for end in range(0, len(data), max(1, len(data) // 3)) if len(data) > len(SWITCH) else ():
            write(place, data[:end], at)
            seen.append(numbers(path))
        return write(place, data, at)

    series.write(grids)
    monkeypatch.setattr(os, "pwrite", in_parts)
    whole = 0
    for number in range(1, 60):
        seen.clear()
        before = path.stat().st_ino
        grids.append(grid(number))
        series.add(grids)
        whole += path.stat().st_ino != before
        assert all(one == [str(k) for k in range(number)] for one in seen)
        assert numbers(path) == [str(k) for k in range(number + 1)]
    assert 2 <= whole <= 5
    series.finish(grids)
    assert path.read_text(encoding="utf-8") == f"{HEAD}{''.join(grids)}{TAIL}\n"


def test_series_on_a_full_disk_stays(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A write that comes to nothing is an error, and the document is as it was."""
    path, grids = tmp_path / "fields.xdmf", [grid(0)]
    series = GrowingSeries(path)
    series.write(grids)
    before = path.read_bytes()
    monkeypatch.setattr(os, "pwrite", lambda *_: 0)
    with pytest.raises(OSError, match="no room"):
        series.add([*grids, grid(1)])
    assert path.read_bytes() == before
