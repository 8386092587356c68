"""Results from Python: open, compare, plot, render, export, report."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Literal, Protocol, runtime_checkable

from gapbeam.process.failing_ranks import refuse_ranks

if TYPE_CHECKING:
    from gapbeam.postprocess.results.results import Results
    from gapbeam.studies.compare_folders import ComparisonResult


@runtime_checkable
class InFolder(Protocol):
    """Result of `run` or of a study, which knows its folder."""

    @property
    def folder(self) -> Path:
        """The folder of the results."""


Given = str | PathLike[str] | InFolder


def open_results(results: Given) -> Results:
    """Open a results folder, complete or not; needs neither DOLFINx nor MPI.

    Args:
        results: Results folder of a run, or what `run` returned.

    Raises:
        ResultsError: There are no readable results.
    """
    from gapbeam.postprocess.results.results import open_results as open_folder

    return open_folder(folder_of(results))


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


def plot(
    results: Given,
    output: str | PathLike[str] | None = None,
    formats: Sequence[str] = ("png",),
    probe: str | None = None,
    component: str | None = None,
    *,
    acceleration: Literal["absolute", "relative"] = "absolute",
    rate: float | None = None,
    points: int = 5,
    sampling: Literal["mean", "pick"] = "mean",
    periods: int | None = None,
    window: Literal["rectangular", "hann", "flattop", "blackman"] | None = None,
    harmonics: int = 10,
    tolerance: float = 0.01,
    zoom: int = 3,
    begin: float | None = None,
    end: float | None = None,
    psd: Sequence[str] = (),
    resolution: float | None = None,
    shock: Sequence[str] = (),
    damping: float = 0.05,
    rainflow: Sequence[str] = (),
    sn_curve: tuple[float, float, float] | None = None,
) -> list[Path]:
    """Draw peaks, time histories, spectrum and contact forces of a run, and write its tables.

    Args:
        results: Results folder of a run, or what `run` returned.
        output: Folder; default: figures in the results folder.
        formats: "png", "pdf", "svg".
        probe: Name of a probe; None: the first.
        component: "x", "y" or "z"; None: the bending direction.
        acceleration: Absolute, or relative to the support.
        rate: Sampling rate of the smoothed acceleration, Hz; default points over `output.smoothing_window`.
        points: Points of its moving average.
        sampling: Mean over an interval, or its last value.
        periods: Forcing periods in the spectra; None: as many as there are.
        window: Window of the spectra; None: rectangular over whole periods.
        harmonics: Highest harmonic in figures and tables.
        tolerance: Tolerance of the period, as a fraction of the range.
        zoom: Forcing periods in the enlarged panels.
        begin: First time that is looked at, s; None: from the start.
        end: Last time, s; None: to the end.
        psd: Names of records to draw the power spectral density of, such as "contact_force".
        resolution: Frequency resolution of these densities, Hz; None: from the length of the record.
        shock: Names of records to draw the shock response spectrum of, accelerations or forces.
        damping: Damping of the oscillators, as a part of critical damping.
        rainflow: Names of records to count the cycles of.
        sn_curve: Exponent, range, Pa, and cycles at this range of the S-N curve for damage; None: none is asked for.

    Returns:
        The figures and tables.

    Raises:
        ResultsError: The results cannot be read.
        OptionError: An argument is out of its range.
        UserError: The folder cannot be written.
    """
    refuse_ranks("plot")
    from gapbeam.postprocess.plot import FOLDER
    from gapbeam.postprocess.plot import plot as draw
    from gapbeam.postprocess.results.bounded_files import as_written

    folder = folder_of(results)
    place = _place(folder, output, FOLDER)
    with as_written(folder):
        return draw(
            folder, place, tuple(formats), probe, component, acceleration=acceleration, rate=rate, points=points,
            sampling=sampling, periods=periods, window=window, harmonics=harmonics, tolerance=tolerance, zoom=zoom,
            begin=begin, end=end, psd=tuple(psd), resolution=resolution,
            shock=tuple(shock), damping=damping, rainflow=tuple(rainflow), sn_curve=sn_curve,
        )  # fmt: skip


def render(
    results: Given,
    output: str | PathLike[str] | None = None,
    scale: Literal["auto"] | float = "auto",
    film: bool = True,
    frames: int | None = None,
    size: tuple[int, int] = (1600, 900),
    frames_per_second: float = 20.0,
    progress: Callable[[int, int], None] | None = None,
    stress: Literal["axial", "von-mises"] | None = None,
) -> list[Path]:
    """Draw the deformed beam in its support, off-screen: pictures and a film.

    Args:
        results: Results folder of a run, or what `run` returned.
        output: Folder; default: pictures in the results folder.
        scale: Enlargement of displacements.
        film: Also make a film.
        frames: The last frames of the run; None: 300.
        size: Width and height in pixels.
        frames_per_second: Speed of the film.
        progress: Called with the number of frames that are drawn, and of all.
        stress: Color the beam by this stress; None: by the contact pressure on its faces.

    Returns:
        The pictures and the film.

    Raises:
        ResultsError: The results cannot be read.
        OptionError: An argument is out of its range.
        UserError: The folder cannot be written.
    """
    refuse_ranks("render")
    from gapbeam.postprocess.render import FOLDER
    from gapbeam.postprocess.render import render as draw
    from gapbeam.postprocess.results.bounded_files import as_written

    folder = folder_of(results)
    place = _place(folder, output, FOLDER)
    with as_written(folder):
        return draw(folder, place, scale, film, frames, size, frames_per_second, progress, stress)


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
    with as_written(folder):
        return write(folder, path, records, begin, end, every, table)


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

    several = [results] if isinstance(results, str | PathLike | InFolder) else list(results)
    page = None if output is None else Path(output)
    return write_report(
        [folder_of(one) for one in several], report_kinds(), page, pdf, overwrite, begin, end, live_model
    )


def folder_of(results: Given) -> Path:
    """Return the folder of results."""
    return results.folder if isinstance(results, InFolder) else Path(results)


def _place(folder: Path, output: str | PathLike[str] | None, name: str) -> Path | None:
    """Return the folder that was asked for, after refusing one that nothing should be written into."""
    from gapbeam.postprocess.results.bounded_files import as_written
    from gapbeam.solver.run.output.results_folder import check_place
    from gapbeam.studies.study_folder import refuse_links

    place = None if output is None else Path(output)
    if place is not None:
        check_place(place)
    with as_written(folder):
        refuse_links(place or folder / name, places=() if place else (folder / name,))
    return place
