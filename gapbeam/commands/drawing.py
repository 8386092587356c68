"""The commands `gapbeam view`, `gapbeam plot`, `gapbeam render` and `gapbeam export`."""

from __future__ import annotations

import re
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any, Literal, get_args

import typer

from gapbeam.commands.terminal import progress_bar
from gapbeam.process.usage_errors import BadParameter

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
    from gapbeam.interface.shown_results import plot as draw
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
    from gapbeam.interface.shown_results import render as draw

    factor, pixels = _scale(scale), _size(size)
    colored: Any = None if stress is None else stress.value
    with progress_bar("drawing") as bar:
        paths = draw(results, output, factor, film, frames, pixels, frames_per_second, bar.show, colored)
    _print_paths(paths)
    return 0


def view(
    case: Annotated[Path, typer.Argument(metavar="CASE", help="case file (TOML)")],
    override: Annotated[
        list[str] | None, typer.Option("--set", metavar="KEY=VALUE", help="replace a key of the case; may be repeated")
    ] = None,
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
