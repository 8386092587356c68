"""Opening results: what is there is read, what is not is said with a remedy."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest

from gapbeam.postprocess.results.results import ResultsError, open_results
from gapbeam.solver.schema.record_table import FIELDS_DATA_FILE, FIELDS_FILE, HISTORY_FILE, SUMMARY_FILE
from tests.unit.test_postprocess_synthetic import plane_beam, write_fields, write_results

TIME = np.linspace(0.0, 0.1, 101)


def test_missing_folder_says_where_what_and_what_to_try(tmp_path: Path) -> None:
    with pytest.raises(ResultsError, match=r"nowhere: found no such folder; expected .* To try: "):
        open_results(tmp_path / "nowhere")


def test_folder_without_results_lists_what_is_there(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("")
    with pytest.raises(ResultsError, match=r"no such file, nor summary\.json, in the folder: notes\.txt"):
        open_results(tmp_path)


def test_a_run_that_failed_before_its_first_record_says_why(tmp_path: Path) -> None:
    summary = {"format": 1, "status": "failed", "message": "no static seat was found"}
    (tmp_path / SUMMARY_FILE).write_text(json.dumps(summary))
    with pytest.raises(ResultsError, match=r"history\.h5: .*the run was not completed: no static seat was found"):
        _ = open_results(tmp_path).history


def test_other_format_version_is_refused_with_both_numbers(tmp_path: Path) -> None:
    folder = write_results(tmp_path, TIME)
    summary = json.loads((folder / SUMMARY_FILE).read_text())
    (folder / SUMMARY_FILE).write_text(json.dumps({**summary, "format": 99}))
    with pytest.raises(ResultsError, match=r"format version 99; expected format version 1"):
        open_results(folder)
    (folder / SUMMARY_FILE).unlink()
    with h5py.File(folder / HISTORY_FILE, "a") as file:
        file.attrs["format"] = 98
    with pytest.raises(ResultsError, match="format version 98"):
        _ = open_results(folder).history


def test_truncated_files_are_named(tmp_path: Path) -> None:
    folder = write_results(tmp_path, TIME)
    whole = (folder / HISTORY_FILE).read_bytes()
    (folder / HISTORY_FILE).write_bytes(whole[: len(whole) // 3])
    with pytest.raises(ResultsError, match=r"history\.h5: found a file that cannot be read"):
        _ = open_results(folder).history
    (folder / SUMMARY_FILE).write_text('{"format": 1, ')
    with pytest.raises(ResultsError, match="not JSON"):
        open_results(folder)


def test_foreign_units_are_refused(tmp_path: Path) -> None:
    folder = write_results(tmp_path, TIME)
    with h5py.File(folder / HISTORY_FILE, "a") as file:
        file["displacement"].attrs["units"] = "mm"
    with pytest.raises(ResultsError, match="displacement in mm"):
        _ = open_results(folder).history


def test_a_running_run_is_readable_while_the_writer_holds_the_file(tmp_path: Path) -> None:
    folder = write_results(tmp_path, TIME, {"displacement": TIME}, status="running")
    with subprocess.Popen(
        [sys.executable, "-m", "tests.programs.held_file", str(folder / HISTORY_FILE)],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
    ) as writer:  # fmt: skip
        assert writer.stdout is not None
        assert writer.stdout.readline() == "open\n"
        results = open_results(folder)
        assert results.status == "running"
        assert results.history.sizes["time"] == TIME.size
        writer.communicate("")


def test_records_reserved_but_not_written_are_left_out(tmp_path: Path) -> None:
    time = np.concatenate([TIME[:40], np.zeros(20)])
    results = open_results(write_results(tmp_path, time))
    np.testing.assert_array_equal(results.history["time"], TIME[:40])


def test_without_summary_the_forcing_is_read_from_the_case(tmp_path: Path) -> None:
    folder = write_results(tmp_path, TIME)
    (folder / SUMMARY_FILE).unlink()
    results = open_results(folder)
    assert results.summary == {}
    assert results.status == "unknown"
    assert results.forcing_frequency == 20.0


def test_forcing_frequency_comes_from_the_common_period(tmp_path: Path) -> None:
    assert open_results(write_results(tmp_path / "a", TIME, frequency=50.0)).forcing_frequency == 50.0
    assert open_results(write_results(tmp_path / "b", TIME, frequency=None)).forcing_frequency is None


def test_fields_are_read_frame_by_frame(tmp_path: Path) -> None:
    folder = write_results(tmp_path, TIME)
    points, cells = plane_beam(10, 2)
    frames = [(0.1 * k, np.full(points.shape, float(k)), np.arange(len(points)) * float(k)) for k in range(3)]
    write_fields(folder, points, cells, "Quadrilateral", frames)
    with open_results(folder).fields() as fields:
        assert len(fields) == 3
        assert fields.dimension == 2
        np.testing.assert_array_equal(fields.points, points)
        assert [frame.time for frame in fields] == pytest.approx([0.0, 0.1, 0.2])
        np.testing.assert_array_equal(fields.frame(-1).displacement, frames[2][1])
        np.testing.assert_array_equal(fields.frame(2).contact_pressure, frames[2][2])


def test_fields_that_are_missing_or_cut_off_are_named(tmp_path: Path) -> None:
    folder = write_results(tmp_path, TIME)
    with pytest.raises(ResultsError, match=r"fields\.h5: found no such file"):
        open_results(folder).fields()
    points, cells = plane_beam(10, 2)
    write_fields(folder, points, cells, "Quadrilateral", [(0.0, 0 * points, 0 * points[:, 0])])
    with h5py.File(folder / FIELDS_DATA_FILE, "a") as data:
        del data["displacement/0"]
    with open_results(folder).fields() as fields, pytest.raises(ResultsError, match=r"fields\.xdmf"):
        fields.frame(0)
    (folder / FIELDS_FILE).write_text("<Xdmf>")
    with pytest.raises(ResultsError, match=r"fields\.xdmf"):
        open_results(folder).fields()


@pytest.mark.parametrize("status", ["failed", "interrupted"])
def test_runs_that_did_not_get_to_a_history_say_why(status: str, tmp_path: Path) -> None:
    """The message of the summary stands beside what is missing."""
    summary = {"format": 1, "status": status, "message": "terminated before the march began"}
    (tmp_path / SUMMARY_FILE).write_text(json.dumps(summary), encoding="utf-8")
    with pytest.raises(ResultsError, match=r"no such file.*not completed: terminated before the march"):
        _ = open_results(tmp_path).history
