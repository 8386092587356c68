"""Records and tables of a run as columns: CSV for spreadsheets, MAT for MATLAB, Parquet for data frames."""

from __future__ import annotations

from collections.abc import Sequence
from importlib import import_module
from itertools import product
from pathlib import Path

import numpy as np
import xarray as xr
from scipy.io import savemat

from gapbeam.postprocess.results.columns_of_run import HISTORY_TABLE, Column, chosen_records, columns_of_table
from gapbeam.postprocess.results.results import open_results
from gapbeam.postprocess.results_errors import OptionError
from gapbeam.postprocess.signals.signal import unit_at

FILE = "history.csv"
SUFFIXES = (".csv", ".mat", ".parquet")
_BLOCK = 65536  # records formatted at a time


def export(
    results: str | Path,
    output: str | Path,
    records: Sequence[str] = (),
    begin: float | None = None,
    end: float | None = None,
    every: int = 1,
    table: str = HISTORY_TABLE,
) -> Path:
    """Write records of a run as columns over time, or another of its tables.

    Arguments are those of `gapbeam.export`, where they are described.

    Returns:
        The file.

    Raises:
        ResultsError: The results cannot be read.
        OptionError: Another suffix, a record or a table that the run does not have, a time span without records,
            records or times asked of a table that has none, or Parquet without pyarrow.
        OSError: The file cannot be written.
    """
    path = Path(output)
    if path.suffix.lower() not in SUFFIXES:
        raise OptionError(f"the file {path} has another suffix; expected one of {', '.join(SUFFIXES)}")
    if path.suffix.lower() == ".parquet":
        _refuse_without_pyarrow(path)
    if every < 1:
        raise OptionError(f"every = {every}; expected a whole number of at least 1")
    if table == HISTORY_TABLE:
        history = chosen_records(open_results(Path(results)).history, records, begin, end)
        columns = columns_of(history.isel(time=slice(None, None, every)))
    elif records or begin is not None or end is not None or every != 1:
        raise OptionError(f"records, times and every belong to the table history; the table {table} is written whole")
    else:
        columns = columns_of_table(Path(results), table)
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_name(path.name + ".part")
    if path.suffix.lower() == ".csv":
        _write_csv(part, columns, "nan" if table == HISTORY_TABLE else "")
    elif path.suffix.lower() == ".parquet":
        _write_parquet(part, columns)
    else:
        names = {
            column.variable: column.values.astype(object) if column.words_in_it else column.values for column in columns
        }
        units = {column.variable: column.unit for column in columns}
        with part.open("wb") as file:
            savemat(file, {**names, "units": units}, long_field_names=True, oned_as="column")
    part.replace(path)
    return path


def columns_of(history: xr.Dataset) -> list[Column]:
    """Return the time and every record of a history as columns, by probe, face, load and component."""
    found = [Column(("time",), "s", np.asarray(history["time"].values))]
    for name, record in history.data_vars.items():
        labels = [[str(label) for label in record[dim].values] for dim in record.dims[1:]]
        values = record.values.reshape(record.shape[0], -1)
        for number, words in enumerate(product(*labels)):
            found.append(Column((str(name), *words), unit_at(history, str(name), words), values[:, number]))
    return found


def _refuse_without_pyarrow(path: Path) -> None:
    """Refuse Parquet where its library, which is larger than all others together, is not installed.

    Raises:
        OptionError: The library is not installed.
    """
    try:
        import_module("pyarrow.parquet")
    except ImportError as lacking:
        raise OptionError(
            f"{path}: Parquet needs pyarrow, which is not installed; install it with `python3 -m pip install pyarrow` "
            "(`environment/run python3 -m pip install pyarrow`), or write .csv or .mat"
        ) from lacking


def _write_parquet(path: Path, columns: Sequence[Column]) -> None:
    """Write columns of doubles or words, named as in MAT files, each with its unit in the metadata of its field."""
    import pyarrow as pa
    from pyarrow import parquet

    kinds = [pa.string() if one.words_in_it else pa.float64() for one in columns]
    fields = [
        pa.field(one.variable, kind, metadata={"unit": one.unit}) for one, kind in zip(columns, kinds, strict=True)
    ]
    values = [
        pa.array(one.values.tolist() if one.words_in_it else np.asarray(one.values, dtype=float)) for one in columns
    ]
    parquet.write_table(pa.table(values, schema=pa.schema(fields)), path)


def _write_csv(path: Path, columns: Sequence[Column], absent: str) -> None:
    """Write columns with a line of heads; numbers come back to the same bits, NaN is written as `absent`."""
    with path.open("w", encoding="utf-8", newline="") as file:
        file.write(",".join(column.title for column in columns) + "\r\n")
        for first in range(0, len(columns[0].values), _BLOCK):
            rows = zip(*(column.values[first : first + _BLOCK].tolist() for column in columns), strict=True)
            file.writelines(",".join(_cell(value, absent) for value in row) + "\r\n" for row in rows)


def _cell(value: object, absent: str) -> str:
    """Return a word as it is, and a number that comes back to the same bits."""
    if isinstance(value, str):
        return value
    return absent if value != value else repr(value)
