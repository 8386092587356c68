"""Records as columns for other programs: what is written comes back to the same bits."""

from __future__ import annotations

import csv
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import loadmat

import gapbeam
from gapbeam.solver.schema.record_table import POINTS_FILE, WEAR_COLUMNS, WEAR_FILE
from tests.shared.command import DEMO, called
from tests.unit.test_contact_map import ring, run_with

BRIEF = ("time.end=0.004", "model={type='beam', elements=12}")


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the results of a short run."""
    folder = tmp_path_factory.mktemp("export") / "run"
    assert gapbeam.run(DEMO, BRIEF, folder).exit_status == 0
    return folder


def test_a_table_has_every_record(results: Path) -> None:
    """All records of all probes, faces, loads and components, with their units, to the same bits."""
    history = gapbeam.open_results(results).history
    path = gapbeam.export(results)
    assert path == results / "history.csv"
    with path.open(encoding="utf-8", newline="") as file:
        heads, *rows = list(csv.reader(file))
    table = dict(zip(heads, np.array(rows, dtype=float).T, strict=True))
    assert len(heads) == 1 + sum(record[0].size for record in history.data_vars.values())
    np.testing.assert_array_equal(table["time (s)"], history["time"].values)
    tip = history["displacement"].sel(probe="tip", component="y")
    np.testing.assert_array_equal(table["displacement tip y (m)"], tip.values)
    np.testing.assert_array_equal(table["contact_force base (N)"], history["contact_force"].sel(face="base").values)
    np.testing.assert_array_equal(table["active_points gland"], history["active_points"].sel(face="gland").values)


def test_some_records_in_a_span_of_time(results: Path, tmp_path: Path) -> None:
    """Two records from 1 to 2 ms, every third; MATLAB's names and units."""
    chosen = ("contact_force", "kinetic_energy")
    found = loadmat(gapbeam.export(results, tmp_path / "new" / "part.mat", chosen, 1e-3, 2e-3, 3))
    history = gapbeam.open_results(results).history.sel(time=slice(1e-3, 2e-3)).isel(time=slice(None, None, 3))
    names = {name for name in found if not name.startswith("_")}
    assert names == {"time", "contact_force_base", "contact_force_gland", "kinetic_energy", "units"}
    np.testing.assert_array_equal(found["time"][:, 0], history["time"].values)
    np.testing.assert_array_equal(found["contact_force_base"][:, 0], history["contact_force"].sel(face="base").values)
    assert found["units"]["contact_force_base"][0, 0][0] == "N"


def test_parquet_comes_back_to_the_same_bits(results: Path, tmp_path: Path) -> None:
    """The columns of MAT files, as doubles, with their units; read by pyarrow itself."""
    parquet = pytest.importorskip("pyarrow.parquet")
    history = gapbeam.open_results(results).history
    table = parquet.read_table(gapbeam.export(results, tmp_path / "new" / "all.parquet"))
    assert table.num_columns == 1 + sum(record[0].size for record in history.data_vars.values())
    tip = history["displacement"].sel(probe="tip", component="y")
    np.testing.assert_array_equal(table["displacement_tip_y"].to_numpy(), tip.values)
    np.testing.assert_array_equal(table["time"].to_numpy(), history["time"].values)
    assert table.schema.field("displacement_tip_y").metadata == {b"unit": b"m"}


def test_parquet_of_contact_points_has_words_and_numbers(tmp_path: Path) -> None:
    """The columns of the MAT file of the same table, the names of faces as text."""
    parquet = pytest.importorskip("pyarrow.parquet")
    run = run_with(tmp_path / "run", {"collar_hole": ring(), "stop_below": ring()[:3]})
    found = loadmat(gapbeam.export(run, tmp_path / "points.mat", table="points"))
    table = parquet.read_table(gapbeam.export(run, tmp_path / "points.parquet", table="points"))
    assert table["face"].to_pylist() == 36 * ["collar_hole"] + 3 * ["stop_below"]
    numbers = {name for name in found if not name.startswith("_")} - {"units", "face"}
    assert set(table.column_names) == {"face", *numbers}
    for name in numbers:
        np.testing.assert_array_equal(table[name].to_numpy(), found[name][:, 0])


def test_tables_without_times_are_written_whole(tmp_path: Path) -> None:
    """Contact points as MAT and CSV: the face in words, numbers to the same bits, nothing where nothing is known."""
    run = run_with(tmp_path / "run", {"collar_hole": ring(), "stop_below": ring()[:3]})
    rows = np.concatenate([ring(), ring()[:3]])
    found = loadmat(gapbeam.export(run, tmp_path / "points.mat", table="points"))
    assert [str(face[0]) for face in found["face"][:, 0]] == 36 * ["collar_hole"] + 3 * ["stop_below"]
    np.testing.assert_array_equal(found["first_touch"][:, 0], rows[:, 7])
    np.testing.assert_array_equal(found["deepest"][:, 0], rows[:, 5])
    assert found["units"]["deepest"][0, 0][0] == "m"
    text = gapbeam.export(run, tmp_path / "points.csv", table="points").read_text(encoding="utf-8").splitlines()
    assert text[0].split(",")[:2] + text[0].split(",")[5:] == [
        "face", "x (m)", "contact share", "deepest (m)", "impulse (N s)", "first touch (s)",
    ]  # fmt: skip
    assert text[1:] == (run / POINTS_FILE).read_text(encoding="utf-8").splitlines()[1:]


def test_wear_without_statistics_is_written(tmp_path: Path) -> None:
    """A run too short for statistics leaves up to four last cells of a row empty: they are not known."""
    run = run_with(tmp_path / "run", {"stop_below": ring()[:3]})
    known = len(WEAR_COLUMNS) - 4
    rows = [",".join(["stop_below", *map(str, range(known)), "", "", "", ""])]
    (run / WEAR_FILE).write_text("\n".join([",".join(["face", *WEAR_COLUMNS]), *rows]), encoding="utf-8")
    found = loadmat(gapbeam.export(run, tmp_path / "wear.mat", table="wear"))
    assert found["x"][0, 0] == 0.0
    assert np.isnan(found["depth_rate"][0, 0])
    assert np.isnan(found["high"][0, 0])


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"table": "wear", "output": "a.mat"}, r"no wear\.csv with rows; it takes `\[wear\]`"),
        ({"table": "point", "output": "a.mat"}, r"no table 'point'; expected one of history, points, wear, impacts"),
        ({"table": "points"}, r"points\.csv is the table points as CSV already; name another file"),
        (
            {"table": "points", "output": "a.mat", "every": 2},
            r"belong to the table history; the table points is written",
        ),
    ],
)
def test_tables_that_cannot_be_written_are_refused(options: dict[str, Any], said: str, tmp_path: Path) -> None:
    """A table that the run did not write, a name that is none, no other file, and records of what has none."""
    run = run_with(tmp_path / "run", {"collar_hole": ring()})
    if "output" in options:
        options = options | {"output": tmp_path / options["output"]}
    with pytest.raises(gapbeam.OptionError, match=said):
        gapbeam.export(run, **options)
    assert [path.name for path in tmp_path.iterdir()] == ["run"]


def test_parquet_without_its_library_is_refused(results: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The message says how to install it, and what goes without; nothing is written."""
    monkeypatch.setitem(sys.modules, "pyarrow.parquet", None)
    with pytest.raises(gapbeam.OptionError, match=r"python3 -m pip install pyarrow.*or write \.csv or \.mat"):
        gapbeam.export(results, tmp_path / "all.parquet")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--output", "a.xls"), "a.xls has another suffix; expected one of .csv, .mat, .parquet"),
        (("--record", "contact_forc"), "no record 'contact_forc'; expected one of: contact_force"),
        (("--from", "5"), "no record from 5 s to the end; the run has records from 0 to 0.004 s"),
        (("--every", "0"), "Invalid value for '--every'"),
        (("--table", "poin"), "'poin' is not one of 'history', 'points', 'wear', 'impacts'"),
        (("--output", "."), ". is a folder"),
    ],
)
def test_bad_options_are_explained(results: Path, words: tuple[str, ...], said: str) -> None:
    """Status 2, what was found and what is there; nothing is written."""
    before = sorted(results.iterdir())
    done = called("export", results, *words)
    assert done.returncode == 2
    assert said in " ".join(done.stderr.split())
    assert sorted(results.iterdir()) == before
