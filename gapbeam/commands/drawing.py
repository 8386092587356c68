"""The commands `gapbeam view`, `plot`, `render`, `export`, `fmu`, `report`, and `watch`: a run, seen from elsewhere."""

from __future__ import annotations

import re
import time
from collections.abc import Iterator
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, get_args

import typer

from gapbeam.commands.terminal import CaseArgument, Overrides, progress_bar
from gapbeam.process.terminal_text import harmless, with_options
from gapbeam.process.usage_errors import BadParameter

if TYPE_CHECKING:
    from rich.console import RenderableType

    from gapbeam.postprocess.results.run_watch import RunWatch
PictureFormat = StrEnum("PictureFormat", ["png", "pdf", "svg"])
AccelerationChoice = StrEnum("AccelerationChoice", ["absolute", "relative"])
SamplingChoice = StrEnum("SamplingChoice", ["mean", "pick"])
WindowChoice = StrEnum("WindowChoice", ["rectangular", "hann", "flattop", "blackman"])
StressChoice = StrEnum("StressChoice", {"axial": "axial", "von_mises": "von-mises"})
TableChoice = StrEnum("TableChoice", ["history", "points", "wear", "impacts"])

ResultsArgument = Annotated[Path, typer.Argument(metavar="RESULTS", help="results folder of a run")]


def plot(
    results: ResultsArgument,
    output: Annotated[Path | None, typer.Option(help="folder; by default RESULTS/figures")] = None,
    format_: Annotated[
        list[PictureFormat] | None,
        typer.Option("--format", help="may be repeated; default png"),
    ] = None,
    probe: Annotated[str | None, typer.Option(help="name of a probe; by default the first")] = None,
    component: Annotated[str | None, typer.Option(help="x, y or z; by default the bending direction")] = None,
    acceleration: Annotated[
        AccelerationChoice, typer.Option(help="relative: to the support")
    ] = AccelerationChoice.absolute,
    rate: Annotated[
        float | None,
        typer.Option(
            min=1e-6,
            help="sampling rate of the smoothed acceleration, Hz; by default its points span output.smoothing_window",
        ),
    ] = None,
    points: Annotated[int, typer.Option(min=1, help="points of its moving average")] = 5,
    sampling: Annotated[
        SamplingChoice, typer.Option(help="mean over an interval, or its last value")
    ] = SamplingChoice.mean,
    periods: Annotated[int | None, typer.Option(min=1, help="forcing periods in the spectra")] = None,
    window: Annotated[
        WindowChoice | None, typer.Option(help="of the spectra; by default rectangular over whole periods")
    ] = None,
    harmonics: Annotated[int, typer.Option(min=1, help="highest harmonic in figures and tables")] = 10,
    tolerance: Annotated[float, typer.Option(min=0.0, help="of the period, as a fraction of the range")] = 0.01,
    zoom: Annotated[int, typer.Option(min=1, help="forcing periods in the enlarged panels")] = 3,
    begin: Annotated[float | None, typer.Option("--from", help="first time that is looked at, s")] = None,
    end: Annotated[float | None, typer.Option("--to", help="last time, s")] = None,
    psd: Annotated[
        list[str] | None,
        typer.Option(
            metavar="RECORD", help="draw the power density of a record, such as contact_force; may be repeated"
        ),
    ] = None,
    resolution: Annotated[
        float | None, typer.Option(min=1e-9, help="of power densities, Hz; by default a 9th of what the record allows")
    ] = None,
    shock: Annotated[
        list[str] | None,
        typer.Option(
            "--shock-spectrum",
            metavar="RECORD",
            help="draw the shock response spectrum of an acceleration or force; may be repeated",
        ),
    ] = None,
    damping: Annotated[
        float, typer.Option(min=0.0, max=0.99, help="of shock spectra, as a part of critical damping; 0.05 is Q = 10")
    ] = 0.05,
    rainflow: Annotated[
        list[str] | None,
        typer.Option(metavar="RECORD", help="count the cycles of a record, such as axial_stress; may be repeated"),
    ] = None,
    sn_curve: Annotated[
        tuple[float, float, float] | None,
        typer.Option(
            metavar="EXPONENT RANGE CYCLES",
            help="S-N curve for the damage of these cycles: cycles at a stress range, Pa",
        ),
    ] = None,
) -> int:
    """Draw peaks, time histories, spectrum and contact forces of a run, and print its tables."""
    from gapbeam.interface.drawn_results import plot as draw
    from gapbeam.postprocess.plot import TABLES_FILE

    chosen: dict[str, Any] = {
        "acceleration": acceleration.value,
        "sampling": sampling.value,
        "window": None if window is None else window.value,
    }
    paths = draw(
        results,
        output,
        tuple(one.value for one in format_ or [PictureFormat.png]),
        probe,
        component,
        rate=rate,
        points=points,
        periods=periods,
        harmonics=harmonics,
        tolerance=tolerance,
        zoom=zoom,
        begin=begin,
        end=end,
        psd=psd or (),
        resolution=resolution,
        shock=shock or (),
        damping=damping,
        rainflow=rainflow or (),
        sn_curve=sn_curve,
        **chosen,
    )
    print(next(path for path in paths if path.name == TABLES_FILE).read_text(encoding="utf-8"))
    _print_paths(paths)
    return 0


def render(
    results: ResultsArgument,
    output: Annotated[Path | None, typer.Option(help="folder; by default RESULTS/pictures")] = None,
    scale: Annotated[str, typer.Option(metavar="auto|FACTOR", help="enlargement of displacements")] = "auto",
    film: Annotated[bool, typer.Option("--film/--no-film", help="also make a film")] = True,
    frames: Annotated[int | None, typer.Option(min=1, help="the last frames of the run; by default 300")] = None,
    size: Annotated[str, typer.Option(metavar="WIDTHxHEIGHT", help="in pixels")] = "1600x900",
    frames_per_second: Annotated[float, typer.Option(min=0.1, help="speed of the film")] = 20.0,
    stress: Annotated[
        StressChoice | None, typer.Option(help="color the beam by this stress; by default by contact pressure")
    ] = None,
) -> int:
    """Draw the deformed beam in its support, off-screen: pictures and a film."""
    from gapbeam.interface.drawn_results import render as draw

    factor, pixels = _scale(scale), _size(size)
    colored: Any = None if stress is None else stress.value
    with progress_bar("drawing") as bar:
        paths = draw(results, output, factor, film, frames, pixels, frames_per_second, bar.show, colored)
    _print_paths(paths)
    return 0


def view(
    case: CaseArgument,
    override: Overrides = None,
    output: Annotated[Path | None, typer.Option(help="picture, *.png; by default results/<case>-view.png")] = None,
    size: Annotated[str, typer.Option(metavar="WIDTHxHEIGHT", help="in pixels")] = "1600x900",
) -> int:
    """Draw a case before it runs: mesh, supports with enlarged gaps, loads, joints, masses, probes."""
    from gapbeam.interface.case_picture import view as draw

    print(draw(case, override or [], output, _size(size)))
    return 0


def export(
    results: ResultsArgument,
    output: Annotated[
        Path | None, typer.Option(help="file, *.csv, *.mat or *.parquet; by default RESULTS/history.csv")
    ] = None,
    record: Annotated[
        list[str] | None, typer.Option(help="a record, such as contact_force; may be repeated; by default all")
    ] = None,
    begin: Annotated[float | None, typer.Option("--from", help="first time, s")] = None,
    end: Annotated[float | None, typer.Option("--to", help="last time, s")] = None,
    every: Annotated[int, typer.Option(min=1, help="write one record of so many")] = 1,
    table: Annotated[
        TableChoice, typer.Option(help="records over time, or contact points, wear or impacts, one a row")
    ] = TableChoice.history,
) -> int:
    """Write records as columns over time, for spreadsheets (CSV), MATLAB (MAT) or data frames (Parquet)."""
    from gapbeam.interface.shown_results import export as write

    chosen: Any = table.value
    print(write(results, output, record or (), begin, end, every, chosen))
    return 0


def fmu(
    case: CaseArgument,
    override: Overrides = None,
    output: Annotated[
        Path | None, typer.Option(help="file to write, *.fmu; by default CASE.fmu, in this folder")
    ] = None,
    value_of: Annotated[
        list[str] | None,
        typer.Option("--input", metavar="LOAD", help="load whose value the importer gives; may be repeated"),
    ] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="replace a file that is there")] = False,
) -> int:
    """Write a case as a unit for other simulators: FMI 3.0, co-simulation, x86-64 Linux, with its source.

    For reduced, beam and rigid models with half planes or slots, Kelvin-Voigt or Hunt-Crossley contact and the default
    scheme; anything else is refused by name.

    Exit status: 0 written, 2 a fault of the input, 4 nothing holds the beam at the start.
    """
    from gapbeam.interface.case_fmu import fmu as write

    print(write(case, output, override or [], value_of or [], overwrite))
    return 0


def report(
    results: Annotated[list[Path], typer.Argument(metavar="RESULTS...", help="folders of runs, sweeps or studies")],
    output: Annotated[Path | None, typer.Option(help="page to write, *.html; by default RESULTS/report.html")] = None,
    pdf: Annotated[
        bool | None, typer.Option("--pdf/--no-pdf", help="print it too; by default where a browser is found")
    ] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="replace an earlier report")] = False,
    begin: Annotated[float | None, typer.Option("--from", help="first time of a run that is looked at, s")] = None,
    end: Annotated[float | None, typer.Option("--to", help="last time, s")] = None,
) -> int:
    """Write a report on results: one page that works offline, and a PDF.

    Exit status: 0 written, 2 a fault of the input, or no browser for a PDF that was asked for.
    """
    from gapbeam.commands.study_choice import report_kinds
    from gapbeam.interface.case_fmu import live_model
    from gapbeam.studies.write_report import write_report

    print(*write_report(results, report_kinds(), output, pdf, overwrite, begin, end, live_model), sep="\n")
    return 0


def _scale(given: str) -> Literal["auto"] | float:
    if given in get_args(Literal["auto"]):
        return "auto"
    try:
        return float(given)
    except ValueError:
        raise BadParameter(f'"{given}" is neither auto nor a number', param_hint="--scale") from None


def _size(given: str) -> tuple[int, int]:
    match = re.fullmatch(r"(\d{1,5})[xX×](\d{1,5})", given)
    if match is None:
        raise BadParameter(f'"{given}" is not like 1600x900', param_hint="--size")
    return int(match[1]), int(match[2])


def _print_paths(paths: list[Path]) -> None:
    for path in paths:
        print(path)


GONE = 4
WIDTH = 100  # of a frame where there is no terminal
BAR = 40
MINUTE, HOUR = 60, 3600  # s


def watch(
    results: ResultsArgument,
    once: Annotated[bool, typer.Option("--once", help="print one frame and end")] = False,
    interval: Annotated[float, typer.Option(min=0.2, max=3600.0, help="time between two looks, s")] = 2.0,
) -> int:
    """Watch a run from another terminal: time left, contact, energy, peaks, last warning; ends when the run does.

    Exit status: the run's own once it has ended; 0 with --once while it goes on; 4 where its process is gone.
    """
    from rich.console import Console
    from rich.live import Live

    from gapbeam.postprocess.results.run_watch import look_at

    console = Console(highlight=False)
    if not console.is_terminal:
        console.width = max(console.width, WIDTH)
    seen = look_at(results)
    if not once and seen.state in ("starting", "running"):
        if console.is_terminal:
            with Live(frame(seen), console=console, transient=True, auto_refresh=False) as live:
                for seen in _looks(results, interval):
                    live.update(frame(seen), refresh=True)
        else:
            for seen in _looks(results, interval):
                console.print(line(seen), markup=False, soft_wrap=True)
    console.print(frame(seen))
    if seen.state == "gone":
        return GONE
    return seen.exit_status or 0


def _looks(results: Path, interval: float) -> Iterator[RunWatch]:
    """Yield looks at a run until it has ended; a run that is over is looked at once more, for its last words."""
    from gapbeam.postprocess.results.run_watch import look_at

    while True:
        time.sleep(interval)
        seen = look_at(results)
        yield seen
        if seen.state in ("ended", "gone"):
            return


def line(seen: RunWatch) -> str:
    """Return a run in one line, for logs."""
    if not seen.progress:
        return harmless(f"{seen.state}: {seen.last}")
    return f"{_marched(seen.progress)}, {_left(seen)}"


def frame(seen: RunWatch) -> RenderableType:
    """Return a run as rows of name and value."""
    from rich.console import Group
    from rich.table import Table
    from rich.text import Text

    rows = Table.grid(padding=(0, 2))
    rows.add_column(style="bold")
    rows.add_column(overflow="fold")
    for name, value in _rows(seen):
        rows.add_row(name, Text(harmless(value)) if isinstance(value, str) else value)
    return Group(Text(harmless(seen.title or seen.folder), style="bold"), rows)


def _rows(seen: RunWatch) -> Iterator[tuple[str, RenderableType]]:
    progress = seen.progress
    if seen.state == "ended":
        yield from _verdict(seen)
    elif seen.state == "gone":
        reached = f" at t = {progress['time']:.6g} s of {progress['end']:g} s" if progress else ""
        yield "state", f"its process is gone{reached}; gapbeam run --resume continues from the last checkpoint"
    elif not progress:
        yield "state", "setting up, or searching: no march yet" + _where(seen)
        yield "last line", seen.last or "none yet"
    else:
        share = min(1.0, progress["time"] / progress["end"])
        yield "marched", _marched(progress)
        from rich.progress_bar import ProgressBar

        yield "", ProgressBar(total=1.0, completed=share, width=BAR)
        yield "time left", _left(seen) + _where(seen)
    if seen.state != "ended" and progress:
        yield from _figures(progress)
    if seen.warning:
        yield "last warning", seen.warning


def _verdict(seen: RunWatch) -> Iterator[tuple[str, RenderableType]]:
    summary = seen.summary
    reason = f", {summary['reason']}" if summary.get("reason") else ""
    yield "state", f"{summary.get('status')}, exit status {summary.get('exit_status')}{reason}"
    yield "verdict", with_options(summary.get("message") or "none")
    if seen.errors_pending:
        yield "errors", "being estimated, or switched off"
    peaks, depth = summary.get("peak_contact_force"), (summary.get("penetration") or {}).get("largest")
    if peaks and depth is not None:
        yield from _peaks("peaks", peaks, depth)
    if summary.get("energy"):
        yield "energy", _energy(summary["energy"])
    yield "warnings", str(len(summary.get("warnings") or []))


def _figures(progress: Any) -> Iterator[tuple[str, RenderableType]]:
    """Yield contact, peaks and energy so far."""
    shares = [f"{name} {100.0 * one:.3g} %" for name, one in progress["contact_share"].items() if one is not None]
    yield (
        "in contact",
        f"{', '.join(shares) or 'nothing'} of the time; now {' and '.join(progress['closed']) or 'none'}",
    )
    yield from _peaks("peaks so far", progress["peak_contact_force"], progress["largest_penetration"])
    yield "energy", _energy(progress["energy"])


def _peaks(name: str, forces: Any, depth: float | None) -> Iterator[tuple[str, RenderableType]]:
    from gapbeam.studies.error_estimate.closing_table import with_unit

    words = ", ".join(f"{face} {with_unit(force, 'N', 4)}" for face, force in forces.items() if force is not None)
    yield name, f"{words}; penetration {with_unit(depth, 'm')}" if depth is not None else words


def _energy(energy: Any) -> str:
    from gapbeam.studies.error_estimate.closing_table import with_unit

    now = with_unit((energy["kinetic"] or 0.0) + (energy["strain"] or 0.0) + (energy["contact"] or 0.0), "J", 4)
    left = energy["relative_residual"]
    return now if left is None else f"{now} now; not accounted for {left:.2g} of what was exchanged"


def _marched(progress: Any) -> str:
    share = 100.0 * progress["time"] / progress["end"]
    return f"t = {progress['time']:.6g} of {progress['end']:g} s, {share:.3g} %, {progress['steps']} steps"


def _left(seen: RunWatch) -> str:
    """Return the time left at the mean speed so far, and how old that is."""
    left, speed = seen.progress.get("seconds_left"), seen.progress.get("steps_per_second")
    if left is None or speed is None:
        return "not known yet"
    from gapbeam.postprocess.results.run_watch import SILENT

    old = f"; no news for {_duration(seen.age)}" if seen.age is not None and seen.age > SILENT else ""
    return f"{_duration(left)} at the mean of {speed:.4g} steps/s so far, error estimate not included{old}"


def _where(seen: RunWatch) -> str:
    return f" (on {seen.elsewhere})" if seen.elsewhere else ""


def _duration(seconds: float) -> str:
    whole = round(seconds)
    if whole < MINUTE:
        return f"{whole} s"
    if whole < HOUR:
        return f"{whole // MINUTE} min {whole % MINUTE} s"
    return f"{whole // HOUR} h {whole % HOUR // MINUTE} min"
