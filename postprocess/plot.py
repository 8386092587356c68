"""Draw all figures of a run and write its tables."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path

from matplotlib.figure import Figure

from gapbeam.postprocess.figures.amplitude_spectrum import draw_amplitude_spectrum
from gapbeam.postprocess.figures.contact_figure import draw_contact
from gapbeam.postprocess.figures.energy_figure import draw_energy
from gapbeam.postprocess.figures.figure_style import journal_style, save
from gapbeam.postprocess.figures.orbits_figure import (
    draw_orbits,
    farthest,
    moves_in_space,
    rooms_at_probes,
    shifts_at_probes,
)
from gapbeam.postprocess.figures.period_peaks import draw_period_peaks
from gapbeam.postprocess.figures.phase_portrait import draw_phase_portrait
from gapbeam.postprocess.figures.response_curve import draw_response_curve
from gapbeam.postprocess.figures.time_history import draw_time_history
from gapbeam.postprocess.results.bounded_json import read_json
from gapbeam.postprocess.results.repeated_period import is_periodic, motion_of
from gapbeam.postprocess.results.results import Results, open_results
from gapbeam.postprocess.results.supports_of_run import supports_of
from gapbeam.postprocess.results_errors import OptionError
from gapbeam.postprocess.signals.analysis_tables import as_data, as_text
from gapbeam.postprocess.signals.periodicity import TOLERANCE
from gapbeam.postprocess.signals.probe_analysis import Acceleration, Analysis, Options, analyze
from gapbeam.postprocess.signals.smoothing import POINTS, RATE, Sampling
from gapbeam.postprocess.signals.spectra import Window
from gapbeam.solver.record_table import CURVE_FILE, HISTORY

FOLDER = "figures"
TABLES_FILE = "tables.txt"
DATA_FILE = "figures.json"
FORMATS = ("png", "pdf", "svg")

# Records of runs before there was friction hold the others.
_ENERGIES = tuple(
    record.name
    for record in HISTORY
    if record.unit == "J" and record.dims == ("time",) and record.name != "friction_dissipation"
)


def plot(
    folder: str | Path,
    output: str | Path | None = None,
    formats: Sequence[str] = ("png",),
    probe: str | None = None,
    component: str | None = None,
    acceleration: Acceleration = "absolute",
    rate: float = RATE,
    points: int = POINTS,
    sampling: Sampling = "mean",
    periods: int | None = None,
    window: Window | None = None,
    harmonics: int = 10,
    tolerance: float = TOLERANCE,
    zoom: int = 3,
) -> list[Path]:
    """Draw every figure that the results allow, and write `tables.txt` and `figures.json`.

    Args:
        folder: The results folder of a run.
        output: Where to write; default `figures` in the results folder.
        formats: Of the figures: "png", "pdf", "svg".
        probe: Name of the probe; default the first.
        component: "x", "y" or "z"; default the bending direction.
        acceleration: "absolute" or "relative" to the support.
        rate: Sampling rate in Hz for the smoothed acceleration.
        points: Points of its moving average.
        sampling: "mean" over the sampling interval, or "pick" the value at its end.
        periods: Forcing periods in the spectra; default the most of 12, 24, ... after the transient.
        window: "rectangular", "hann", "flattop" or "blackman"; default rectangular over whole periods.
        harmonics: Highest harmonic in figures and tables.
        tolerance: Of the periodicity, as a fraction of the range.
        zoom: Forcing periods in the enlarged panels.

    Returns:
        The files written: figures, `tables.txt`, `figures.json`.

    Raises:
        ResultsError: The results cannot be read.
        SignalError: No such probe or component, or a value that is not finite.
        OptionError: A format that is not one of the three.
    """
    unknown = [name for name in formats if name not in FORMATS]
    if unknown:
        raise OptionError(f"formats {', '.join(unknown)}: expected some of {', '.join(FORMATS)}")
    results = open_results(folder)
    options = Options(probe, component, acceleration, rate, points, sampling, periods, window, harmonics, tolerance)
    analysis = analyze(results, options, motion_of(results, results.forcing_frequency))
    target = Path(output) if output is not None else results.folder / FOLDER
    return plot_analysis(results, analysis, target, formats, harmonics, zoom)


def plot_analysis(
    results: Results,
    analysis: Analysis,
    output: Path,
    formats: Sequence[str],
    harmonics: int = 10,
    zoom: int = 3,
) -> list[Path]:
    """Draw the figures of an analysis that is already there; see `plot`."""
    paths: list[Path] = []
    drawn: dict[str, list[str]] = {}
    with journal_style():
        for name, draw in _figures(results, analysis, harmonics, zoom).items():
            written = save(draw(), output, name, formats)
            drawn[name] = [path.name for path in written]
            paths += written
    output.mkdir(parents=True, exist_ok=True)
    text, data = output / TABLES_FILE, output / DATA_FILE
    text.write_text(as_text(analysis, _heading(results)), encoding="utf-8")
    contents = {"status": results.status, "figures": drawn, **as_data(analysis)}
    data.write_text(json.dumps(contents, indent=1, allow_nan=False) + "\n", encoding="utf-8")
    return [*paths, text, data]


def _heading(results: Results) -> str:
    if is_periodic(results):
        return f"{results.title}\none period of the response was computed; it is shown as it repeats"
    if results.status == "completed":
        return results.title
    message = results.summary.get("message")
    return f"{results.title}\nrun {results.status}{f': {message}' if message else ''}"


def _figures(results: Results, analysis: Analysis, harmonics: int, zoom: int) -> dict[str, Callable[[], Figure]]:
    """The figures for which the results hold enough."""
    history, frequency = results.history, analysis.forcing_frequency
    signals = analysis.signals.values()
    figures: dict[str, Callable[[], Figure]] = {}
    if analysis.displacement is not None:
        figures["time_history"] = lambda: draw_time_history(analysis, zoom)
        figures["phase_portrait"] = lambda: draw_phase_portrait(analysis)
        if moves_in_space(history):
            supports = supports_of(results.summary, results.case)
            rooms = rooms_at_probes(results.case, supports, farthest(history))
            shifts = shifts_at_probes(results.case, supports, history)
            figures["orbits"] = lambda: draw_orbits(history, analysis.settled_since(), rooms, shifts)
    if any(one.per_period is not None for one in signals):
        figures["period_peaks"] = lambda: draw_period_peaks(analysis)
    if any(one is not None and one.spectrum is not None for one in (analysis.displacement, analysis.acceleration)):
        figures["spectrum"] = lambda: draw_amplitude_spectrum(analysis, harmonics)
    if "contact_force" in history and "penetration" in history:
        figures["contact"] = lambda: draw_contact(history, frequency, zoom)
    if all(name in history for name in (*_ENERGIES, "energy_residual")):
        figures["energy"] = lambda: draw_energy(history, frequency, zoom)
    curve = results.folder / CURVE_FILE
    if curve.is_file():
        figures["response_curve"] = lambda: draw_response_curve(read_json(curve, "repeat the run"))
    return figures
