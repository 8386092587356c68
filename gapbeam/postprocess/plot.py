"""Draw all figures of a run and write its tables.

Power densities, shock response spectra and rainflow cycles as CSV files, one beside each of their pictures.

The first line holds the heads, each with its unit: "tip y absolute (m/s^2)". Numbers come back to the same bits.
"""

from __future__ import annotations

import csv
import json
from collections.abc import Callable, Sequence
from functools import partial
from os import PathLike
from pathlib import Path
from typing import Any

import xarray as xr
from matplotlib.figure import Figure

from gapbeam.postprocess.figures.curve_figures import (
    draw_coefficients,
    draw_impacts,
    draw_response_curve,
    draw_wear,
)
from gapbeam.postprocess.figures.figure_style import journal_style, save
from gapbeam.postprocess.figures.motion_figures import (
    draw_contact,
    draw_contact_map,
    draw_energy,
    draw_orbits,
    farthest,
    moves_in_space,
    rooms_at_probes,
    shifts_at_probes,
)
from gapbeam.postprocess.figures.shape_figures import draw_shapes, shapes_of
from gapbeam.postprocess.figures.signal_figures import (
    draw_amplitude_spectrum,
    draw_cycles,
    draw_period_peaks,
    draw_phase_portrait,
    draw_power_density,
    draw_shock_spectrum,
    draw_time_history,
)
from gapbeam.postprocess.results.bounded_files import read_json
from gapbeam.postprocess.results.columns_of_run import chosen_records, impacts_of, points_of, supports_of, wear_of
from gapbeam.postprocess.results.results import Given, Results, folder_of, open_results
from gapbeam.postprocess.results.run_watch import is_periodic, motion_of
from gapbeam.postprocess.results_errors import OptionError
from gapbeam.postprocess.signals.cycle_counts import (
    CycleCounts,
    SNCurve,
    cycle_counts,
    cycle_data,
    cycle_rows,
    impact_data,
    impact_rows,
    in_span,
)
from gapbeam.postprocess.signals.probe_analysis import Acceleration, Analysis, Options, analyze, as_data, as_text
from gapbeam.postprocess.signals.shock_spectrum import (
    PowerDensity,
    ShockSpectrum,
    density_data,
    density_rows,
    power_density,
    shock_data,
    shock_rows,
    shock_spectrum,
)
from gapbeam.postprocess.signals.signal import turning_in
from gapbeam.postprocess.signals.spectra import Sampling, Window
from gapbeam.solver.scene.argument_checks import checked
from gapbeam.solver.schema.record_table import CURVE_FILE, HISTORY

RecordAnalysis = PowerDensity | ShockSpectrum | CycleCounts


def table_of(found: RecordAnalysis) -> list[Sequence[str | float]]:
    """Return the heads of a table, with units, and its rows.

    Frequencies, Hz, and each density, in its unit squared over Hz, or response, in its unit; or a row for each cycle:
    its column, range and mean in the unit of the record, and 1 or 1/2 as its count.
    """
    if isinstance(found, CycleCounts):
        heads = ("column", f"range ({found.unit})", f"mean ({found.unit})", "count")
        return [heads, *((label, *cycle) for label, cycles in found.cycles.items() for cycle in cycles.T.tolist())]
    if isinstance(found, PowerDensity):
        columns = {f"{label} (({found.unit})^2/Hz)".strip(): one for label, one in found.densities.items()}
    else:
        columns = {f"{label} {kind} ({found.unit})".strip(): one for (kind, label), one in found.responses.items()}
    series = (found.frequency, *columns.values())
    return [("frequency (Hz)", *columns), *zip(*(one.tolist() for one in series), strict=True)]


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


@checked
def plot(
    results: Given,
    output: str | PathLike[str] | None = None,
    formats: Sequence[str] = ("png",),
    probe: str | None = None,
    component: str | None = None,
    *,
    acceleration: Acceleration = "absolute",
    rate: float | None = None,
    points: int = 5,
    sampling: Sampling = "mean",
    periods: int | None = None,
    window: Window | None = None,
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
    """Draw every figure that the results of a run allow, and write `tables.txt` and `figures.json`.

    Power densities, shock response spectra and cycles also become CSV files, named as their pictures.

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
        The files written: figures, CSV files, `tables.txt`, `figures.json`.

    Raises:
        ResultsError: The results cannot be read.
        SignalError: No such probe or component, or a value that is not finite.
        OptionError: A format that is not one of the three, a record that is not there, or a span without records.
        UserError: The folder cannot be written.
    """
    unknown = [name for name in formats if name not in FORMATS]
    if unknown:
        raise OptionError(f"formats {', '.join(unknown)}: expected some of {', '.join(FORMATS)}")
    run = open_results(folder_of(results))
    options = Options(probe, component, acceleration, rate, points, sampling, periods, window, harmonics, tolerance)
    whole = begin is None and end is None
    if is_periodic(run) and not whole:
        raise OptionError("the run computed one period of its response: no span of time can be chosen from it")
    history = chosen_records(run.history, (), begin, end)
    chosen_records(history, [*psd, *shock, *rainflow])
    if sn_curve is not None and not rainflow:
        raise OptionError("an S-N curve, and no record to count the cycles of; expected one, such as axial_stress")
    curve = None if sn_curve is None else SNCurve(*sn_curve)
    shocks = [shock_spectrum(history, name, damping) for name in dict.fromkeys(shock)]
    cycles = [cycle_counts(history, name, curve) for name in dict.fromkeys(rainflow)]
    densities = [power_density(history, name, resolution) for name in dict.fromkeys(psd)]
    motion = motion_of(run, run.forcing_frequency) if is_periodic(run) else history
    analysis = analyze(run, options, motion)
    target = Path(output) if output is not None else run.folder / FOLDER
    span = None if whole else (float(history["time"][0]), float(history["time"][-1]))
    figures = _figures(run, history, analysis, harmonics, zoom)
    first, last, turning = float(history["time"][0]), float(history["time"][-1]), turning_in(history)
    impacts = {} if is_periodic(run) or not last > first else in_span(impacts_of(run.folder), first, last)
    if impacts:
        figures["impacts"] = partial(draw_impacts, impacts, turning)
    texts = [impact_rows(impacts, last - first, turning)] if impacts else []
    data: dict[str, dict[str, object]] = {"impacts": impact_data(impacts, last - first)} if impacts else {}
    tables: dict[str, RecordAnalysis] = {}
    kinds: tuple[tuple[Any, ...], ...] = (
        ("psd", densities, draw_power_density, density_rows, "power_densities", density_data),
        ("shock", shocks, draw_shock_spectrum, shock_rows, "shock_spectra", shock_data),
        ("cycles", cycles, draw_cycles, cycle_rows, "cycle_counts", cycle_data),
    )
    for prefix, found, draw, rows_of, kind, data_of in kinds:
        for one in found:
            name = f"{prefix}_{one.record}"
            figures[name], tables[name] = partial(draw, one), one
            texts.append(rows_of(one))
            data.setdefault(kind, {})[one.record] = data_of(one)
    drawn: dict[str, list[Path]] = {}
    with journal_style():
        for name, make in figures.items():
            drawn[name] = save(make(), target, name, formats)
    target.mkdir(parents=True, exist_ok=True)
    written = [path for paths in drawn.values() for path in paths]
    for name, one in tables.items():
        written.append(target / f"{name}.csv")
        with written[-1].open("w", encoding="utf-8", newline="") as file:
            csv.writer(file).writerows(table_of(one))
    text, values = target / TABLES_FILE, target / DATA_FILE
    lines = [as_text(analysis, _heading(run, span)), *("\n".join([*rows, ""]) for rows in texts)]
    text.write_text("\n".join(lines), encoding="utf-8")
    names = {name: [path.name for path in paths] for name, paths in drawn.items()}
    contents = {"status": run.status, "figures": names, **as_data(analysis)} | data
    values.write_text(json.dumps(contents, indent=1, allow_nan=False) + "\n", encoding="utf-8")
    return [*written, text, values]


def _heading(results: Results, span: tuple[float, float] | None) -> str:
    title = _title(results)
    return title if span is None else f"{title}\nrecords from t = {span[0]:.6g} to {span[1]:.6g} s"


def _title(results: Results) -> str:
    if is_periodic(results):
        return f"{results.title}\none period of the response was computed; it is shown as it repeats"
    if results.status == "completed":
        return results.title
    message = results.summary.get("message")
    return f"{results.title}\nrun {results.status}{f': {message}' if message else ''}"


def _figures(
    results: Results, history: xr.Dataset, analysis: Analysis, harmonics: int, zoom: int
) -> dict[str, Callable[[], Figure]]:
    """The figures for which the results hold enough."""
    frequency = analysis.forcing_frequency
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
    if maps := wear_of(results.folder):
        figures["wear"] = lambda: draw_wear(maps)
    feedbacks = (results.summary.get("scene") or {}).get("feedbacks")
    for one in feedbacks if isinstance(feedbacks, list) else ():
        if one.get("coefficients"):
            figures[f"coefficients_{one['name']}"] = partial(draw_coefficients, one["coefficients"])
    if shapes := shapes_of(results.folder):
        figures["shapes"] = lambda: draw_shapes(shapes)
    points = points_of(results.folder)
    for support in supports_of(results.summary, results.case) if points else ():
        met = {face.face: points[face.face] for face in support.faces if face.face in points}
        if any(one.touched for one in met.values()):
            figures[f"contact_map_{support.name}"] = partial(draw_contact_map, met)
    curve = results.folder / CURVE_FILE
    if curve.is_file():
        figures["response_curve"] = lambda: draw_response_curve(read_json(curve, "repeat the run"))
    return figures
