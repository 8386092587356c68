"""Results folder of a run: opened lazily, checked when read, readable also during the run."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, runtime_checkable

import h5py
import numpy as np

from gapbeam.postprocess.results.bounded_files import check_hdf5, printable, read_json, read_plain
from gapbeam.postprocess.results_errors import ResultsError
from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.schema.record_table import (
    CASE_FILE,
    FIELDS_DATA_FILE,
    FIELDS_FILE,
    FORMAT_VERSION,
    HISTORY,
    HISTORY_FILE,
    KEY_OF_MANY_PARTS,
    SMOOTHING_WINDOW,
    SUMMARY_FILE,
    history_pieces,
)

if TYPE_CHECKING:
    import xarray as xr

    from gapbeam.postprocess.results.field_reader import Fields

__all__ = ["Results", "ResultsError", "open_results"]


@runtime_checkable
class InFolder(Protocol):
    """Result of `run` or of a study, which knows its folder."""

    @property
    def folder(self) -> Path:
        """The folder of the results."""


Given = str | PathLike[str] | InFolder


def folder_of(results: Given) -> Path:
    """Return the folder of results.

    Raises:
        UserError: The argument is no folder, and knows none.
    """
    if not isinstance(results, str | PathLike | InFolder):
        raise UserError(f"found {printable(results)}, expected a results folder, or what `gapbeam.run` returned")
    return results.folder if isinstance(results, InFolder) else Path(results)


LARGEST_CASE = 4_000_000  # bytes: with every default, larger than what may be read
READINGS = 10
"""Attempts to read a history whose files a run gathers or takes back: once at its end, or when resumed."""


@dataclass(frozen=True)
class Results:
    """Results of a run; every file is read on first use.

    Attributes:
        folder: The results folder.
    """

    folder: Path

    @cached_property
    def history(self) -> xr.Dataset:
        """The records of `history.h5` in SI units, all loaded; dimensions time, probe, face, load, component.

        Of a run that goes on or was killed, the complete records.

        Raises:
            ResultsError: The file is missing, truncated, of another format, or its units are not ours.
        """
        self._existing(HISTORY_FILE)
        for _ in range(READINGS - 1):
            before = _marks(self.folder)
            try:
                return self._with_window(_history_of(self.folder))
            except ResultsError:
                if _marks(self.folder) == before:
                    raise
        return self._with_window(_history_of(self.folder))

    def _with_window(self, history: xr.Dataset) -> xr.Dataset:
        """Return records with the time over which the run asks for the smoothed acceleration."""
        window = (self.summary.get("smoothing") or {}).get("window")
        return history if window is None else history.assign_attrs({SMOOTHING_WINDOW: float(window)})

    @cached_property
    def summary(self) -> dict[str, Any]:
        """The contents of `summary.json`; empty while the file is not there (run killed or not yet that far).

        Raises:
            ResultsError: The file is truncated or of another format version.
        """
        path = self.folder / SUMMARY_FILE
        if not path.is_file():
            return {}
        summary = read_json(path, "repeat the run")
        if not isinstance(summary, dict):
            raise ResultsError(path, type(summary).__name__, "a JSON object", "repeat the run")
        _check_version(path, summary.get("format", FORMAT_VERSION))
        return summary

    @cached_property
    def case_text(self) -> str:
        """Text of `case.toml`.

        Raises:
            ResultsError: The file is missing, too large, or not UTF-8.
        """
        path = self._existing(CASE_FILE)
        content = read_plain(path, "the case as run", "repeat the run", LARGEST_CASE)
        try:
            return content.decode("utf-8")
        except UnicodeDecodeError as fault:
            raise ResultsError(path, printable(fault), "text in UTF-8", "repeat the run") from fault

    @cached_property
    def case(self) -> dict[str, Any]:
        """The case as run, with every default; empty for the run of a scene, which has none.

        Raises:
            ResultsError: `case.toml` is missing or cannot be read.
        """
        if self.summary.get("scene"):
            return {}
        path = self.folder / CASE_FILE
        try:
            text = self.case_text
            if KEY_OF_MANY_PARTS.search(text):
                raise ValueError("a key of many parts")
            return tomllib.loads(text)
        except (ValueError, RecursionError) as fault:
            found = f"text that is not TOML ({printable(fault)})"
            raise ResultsError(path, found, "the case as run", "repeat the run") from fault

    @property
    def status(self) -> str:
        """End of the run: "completed", "failed" or "running"; "unknown" without a summary."""
        return str(self.summary.get("status", "unknown"))

    @property
    def title(self) -> str:
        """The title of the case, or the name of the folder where it has none."""
        return str(self.summary.get("title") or self.folder.name)

    @property
    def forcing_frequency(self) -> float | None:
        """Frequency in Hz at which the forcing repeats; None without forcing or with incommensurate loads.

        From the summary; without one, from the loads of the case when all harmonic ones share one frequency.
        """
        if "forcing" in self.summary:
            forcing = self.summary["forcing"] or {}
            if forcing.get("period"):
                return 1.0 / float(forcing["period"])
            return float(forcing["frequency"]) if forcing.get("frequency") else None
        loads = self.case.get("load", ())
        if any(str(load.get("type")).startswith("recorded_") for load in loads):
            return None
        frequencies = {float(load["frequency"]) for load in loads if load.get("frequency") and load.get("amplitude")}
        return frequencies.pop() if len(frequencies) == 1 else None

    def fields(self) -> Fields:
        """The fields of `fields.xdmf`, to be read one time after the other.

        Raises:
            ResultsError: One of its two files is missing or cannot be read, or the run is one of a scene.
        """
        if self.summary.get("scene"):
            raise ResultsError(
                self.folder,
                found="a run of structures",
                expected="a run of a case with a mesh, for fields",
                remedy="`gapbeam plot` and `gapbeam render` draw its records and shapes",
            )
        from gapbeam.postprocess.results.field_reader import Fields

        self._existing(FIELDS_DATA_FILE)
        return Fields(self._existing(FIELDS_FILE))

    def _existing(self, name: str) -> Path:
        path = self.folder / name
        if not path.is_file():
            there = ", ".join(sorted(entry.name for entry in self.folder.iterdir())) or "nothing"
            ended = self.status in ("failed", "interrupted")
            reason = f"; the run was not completed: {self.summary.get('message')}" if ended else ""
            alone = "" if (self.folder / SUMMARY_FILE).is_file() or name == SUMMARY_FILE else f", nor {SUMMARY_FILE}"
            raise ResultsError(
                path,
                found=f"no such file{alone}, in the folder: {there}{reason}",
                expected="the results folder of a run",
                remedy="give the folder that `gapbeam run` named, or run the case first; studies have `gapbeam report`",
            )
        return path


def open_results(folder: str | Path) -> Results:
    """Open the results folder of a run, finished or not.

    Args:
        folder: `results/<name>`, as `gapbeam run` left it.

    Returns:
        Results whose files are read when asked for.

    Raises:
        ResultsError: There is no such folder, it holds no results, or its format version is not ours.
    """
    path = Path(folder)
    if not path.is_dir():
        raise ResultsError(
            path,
            found="a file" if path.exists() else "no such folder",
            expected="the results folder of a run",
            remedy="run the case first, or check the spelling",
        )
    results = Results(path)
    if not (path / HISTORY_FILE).is_file() and not (path / SUMMARY_FILE).is_file():
        results._existing(HISTORY_FILE)
    _check_version(path / SUMMARY_FILE, results.summary.get("format", FORMAT_VERSION))
    return results


def records_in(folder: Path) -> tuple[dict[str, np.ndarray], dict[str, list[str]]]:
    """Return the records that a run has just left, by name, and the names along their dimensions, without xarray.

    Raises:
        ResultsError: There are no records, or none that can be read.
    """
    if len(history_pieces(folder)) > 1:  # it was stopped
        from gapbeam.solver.case.figure_table import labels_of

        history = Results(folder).history
        return {str(name): history[name].values for name in history.variables}, labels_of(history)
    path = Results(folder)._existing(HISTORY_FILE)
    try:
        with h5py.File(path, "r", locking=False) as file:
            found = {name: data[()] for name, data in file.items()}
    except OSError as fault:
        raise ResultsError(path, printable(fault)[:200], "a closed HDF5 file", "repeat the run") from fault
    names = {dimension for record in HISTORY for dimension in record.dims[1:]}
    return found, {name: [one.decode() for one in found[name]] for name in names if name in found}


def _history_of(folder: Path) -> xr.Dataset:
    """Return the records of all files of a history."""
    return _joined([(first, _history_in(piece)) for first, piece in history_pieces(folder)], folder / HISTORY_FILE)


def _marks(folder: Path) -> list[tuple[Path, int, int] | None]:
    """Return marks that distinguish the files of a history from others under the same names."""
    marks: list[tuple[Path, int, int] | None] = []
    for _, path in history_pieces(folder):
        try:
            status = path.stat()
            marks.append((path, status.st_ino, status.st_mtime_ns))
        except OSError:
            marks.append(None)
    return marks


def _history_in(path: Path) -> xr.Dataset:
    """Return the records of one file."""
    import xarray as xr

    try:
        with h5py.File(path, "r", locking=False) as file:
            check_hdf5(path, file)
        with xr.open_dataset(path, engine="h5netcdf", decode_times=False, driver_kwds={"locking": False}) as stored:
            history = stored.load()
    except ResultsError:
        raise
    except Exception as fault:  # of four libraries
        raise ResultsError(
            path,
            found=f"a file that cannot be read ({printable(fault)[:200]})",
            expected="a closed HDF5 file",
            remedy="if the run was killed while it wrote, resume or repeat it",
        ) from fault
    _check_version(path, history.attrs.get("format", FORMAT_VERSION))
    return _checked(path, _complete_records(_named(history)))


def _joined(parts: list[tuple[int, xr.Dataset]], path: Path) -> xr.Dataset:
    """Return one history of several, each with the number of its first record; a later one counts."""
    if len(parts) == 1:
        return parts[0][1]
    taken = []
    for (first, history), (following, _) in pairwise(parts):
        if history.sizes["time"] < following - first:
            raise ResultsError(
                path,
                found=f"{history.sizes['time']} records from number {first} on, and the next ones from {following} on",
                expected="one after the other",
                remedy="resume or repeat the run",
            )
        taken.append(history.isel(time=slice(following - first)))
    import xarray as xr

    try:
        return xr.concat([*taken, parts[-1][1]], dim="time", data_vars="minimal", coords="minimal", compat="identical")
    except ValueError as fault:
        raise ResultsError(
            path,
            found=f"pieces of a history that do not fit together ({printable(fault)[:200]})",
            expected="those of one run",
            remedy="repeat the run",
        ) from fault


def _check_version(path: Path, version: object) -> None:
    if str(version) != str(FORMAT_VERSION):
        raise ResultsError(
            path,
            found=f"format version {printable(version)[:50]}",
            expected=f"format version {FORMAT_VERSION}",
            remedy="read it with the gapbeam that wrote it (see the summary), or repeat the run",
        )


def _named(history: xr.Dataset) -> xr.Dataset:
    """Give the names along all labeled dimensions as str, whether stored as str or bytes."""
    for dimension in dict.fromkeys(dimension for record in HISTORY for dimension in record.dims[1:]):
        if dimension in history.coords:
            names = [
                printable(name.decode(errors="replace") if isinstance(name, bytes) else name)
                for name in np.atleast_1d(history[dimension].values).tolist()
            ]
            history = history.assign_coords({dimension: np.array(names, dtype=object)})
    return history


def _complete_records(history: xr.Dataset) -> xr.Dataset:
    """Drop records from the first one whose time does not grow: space reserved but not yet written."""
    if "time" not in history.coords:
        return history
    time = np.asarray(history["time"].values, dtype=float)
    grows = np.concatenate([[True], np.diff(time) > 0.0])[: time.size] & np.isfinite(time)
    stop = time.size if grows.all() else int(np.argmin(grows))
    return history.isel(time=slice(0, stop))


def _checked(path: Path, history: xr.Dataset) -> xr.Dataset:
    if "time" not in history.coords or history.sizes["time"] == 0:
        raise ResultsError(path, "no records", "at least one record along `time`", "look into run.log")
    for record in HISTORY:
        if record.name not in history:
            continue
        variable = history[record.name]
        unit = variable.attrs.get("units", record.unit)
        if str(unit) != record.unit or variable.dims != record.dims:
            raise ResultsError(
                path,
                found=f"{record.name} in {printable(unit)} over {printable(variable.dims)}",
                expected=f"{record.unit} over {record.dims}",
                remedy="read it with the gapbeam that wrote it",
            )
    return history
