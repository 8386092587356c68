"""Results from Python: open, compare, export, report."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from gapbeam.postprocess.results.results import Given, InFolder, folder_of
from gapbeam.process.failing_ranks import refuse_ranks
from gapbeam.solver.scene.argument_checks import checked

if TYPE_CHECKING:
    from gapbeam.postprocess.results.results import Results
    from gapbeam.studies.compare_folders import ComparisonResult


def open_results(results: Given) -> Results:
    """Open a results folder, complete or not; needs neither DOLFINx nor MPI.

    Args:
        results: Results folder of a run, or what `run` returned.

    Raises:
        ResultsError: There are no readable results.
    """
    from gapbeam.postprocess.results.results import open_results as open_folder

    return open_folder(folder_of(results))


@checked
def compare(
    a: Given,
    b: Given,
    tolerance: float = 0.01,
    after: float | None = None,
    output: str | PathLike[str] | None = None,
) -> ComparisonResult:
    """Compare two runs: waveforms, figures, costs and a verdict.

    Args:
        a: Results folder of a run, or what `run` returned.
        b: The other.
        tolerance: Largest difference that counts as agreement, as a fraction.
        after: End of the transient, s; None: found in the records.
        output: Folder; by default results/<A>-against-<B>.

    Raises:
        ResultsError: A folder has no readable results.
        ComparisonError: The runs cannot be compared.
        UserError: The folder of the comparison cannot be written.
    """
    refuse_ranks("compare")
    from gapbeam.interface.case_source import check_fraction  # with all that cases are made of
    from gapbeam.studies.compare_folders import compare_folders, comparison_folder

    check_fraction("tolerance", tolerance)
    one, other = folder_of(a), folder_of(b)
    folder = Path(output) if output is not None else comparison_folder(one, other)
    return compare_folders(one, other, folder, tolerance, after)


@checked
def export(
    results: Given,
    output: str | PathLike[str] | None = None,
    records: Sequence[str] = (),
    begin: float | None = None,
    end: float | None = None,
    every: int = 1,
    table: Literal["history", "points", "wear", "impacts"] = "history",
) -> Path:
    """Write records of a run as columns over time, or another of its tables, for other programs.

    Args:
        results: Results folder of a run, or what `run` returned.
        output: The file, *.csv, *.mat or *.parquet; by default history.csv in the folder of the results. To be given
            for other tables, which are CSV files in the folder already.
        records: Names of records, such as "contact_force"; empty: all.
        begin: First time, s; None: from the start.
        end: Last time, s; None: to the end.
        every: One record of so many.
        table: "history"; "points", "wear" or "impacts" have a row for each contact point or impact.

    Returns:
        The file.

    Raises:
        ResultsError: The results cannot be read, or the file cannot be written.
        OptionError: Another suffix, a record or a table that the run does not have, a time span without records,
            records or times asked of a table that has none, or such a table without a file to write.
        UserError: The file is a link or a folder.
    """
    refuse_ranks("export")
    from gapbeam.postprocess.export import FILE
    from gapbeam.postprocess.export import export as write
    from gapbeam.postprocess.results.bounded_files import as_written
    from gapbeam.postprocess.results.columns_of_run import HISTORY_TABLE
    from gapbeam.postprocess.results_errors import OptionError
    from gapbeam.solver.messages.errors import UserError

    folder = folder_of(results)
    if output is None and table != HISTORY_TABLE:
        raise OptionError(f"{folder / f'{table}.csv'} is the table {table} as CSV already; name another file to write")
    path = folder / FILE if output is None else Path(output)
    if path.is_symlink() or path.is_dir():
        raise UserError(f"{path} is a {'link' if path.is_symlink() else 'folder'}; choose another `output=`")
    with as_written(folder, into=path):
        return write(folder, path, records, begin, end, every, table)


@checked
def report(
    results: Given | Sequence[Given],
    output: str | PathLike[str] | None = None,
    pdf: bool | None = None,
    overwrite: bool = False,
    begin: float | None = None,
    end: float | None = None,
) -> list[Path]:
    """Write a report on results: one page that works offline, and a PDF.

    Args:
        results: Results folders of runs, sweeps or studies, or what these returned; one or several.
        output: Page to write, *.html; by default report.html in the folder of the results.
        pdf: Whether to print the page too; None: where a browser is found.
        overwrite: Replace an earlier report.
        begin: First time of a run that is looked at, s; None: from the start.
        end: Last time, s; None: to the end.

    Returns:
        The page and, where there is one, its PDF.

    Raises:
        ResultsError: A folder that is not there, holds nothing that is known, or a file that cannot be read.
        OptionError: Another suffix, a report that is there, or a span of time that there is not.
        UserError: A place that cannot be written.
        BrowserError: No browser for a PDF that was asked for, or one that printed nothing.
    """
    refuse_ranks("report")
    from gapbeam.commands.study_choice import report_kinds
    from gapbeam.interface.case_fmu import live_model
    from gapbeam.studies.write_report import write_report

    one = isinstance(results, str | PathLike | InFolder) or not isinstance(results, Iterable)
    several: list[Any] = [results] if one else list(results)  # type: ignore[arg-type]
    page = None if output is None else Path(output)
    return write_report(
        [folder_of(one) for one in several], report_kinds(), page, pdf, overwrite, begin, end, live_model
    )
