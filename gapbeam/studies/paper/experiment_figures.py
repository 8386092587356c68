"""Figs. 15 to 20 and Table 4 of the paper from computed motions."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gapbeam.postprocess.report.blocks import Block, Cell, Compared, ComparisonBlock, TableBlock, Verdict, Words
from gapbeam.postprocess.report.charts import Chart, ChartCurve
from gapbeam.postprocess.signals.spectra import spectrum
from gapbeam.solver.record_table import STANDARD_GRAVITY as G
from gapbeam.studies.paper.clearance_series import ClearanceResponse
from gapbeam.studies.paper.printed_figures import printed

PERIODS_SHOWN = 5
HIGHEST = 300.0  # Hz, of the spectra
SHOWN_HARMONICS = 6
RATES = (1000.0, 2000.0, 5000.0, 10000.0)  # Hz
NOTHING = 1.0e-3  # of the first harmonic: what is below it is not distinguished from zero


def millimeters(motion: ClearanceResponse) -> str:
    """Return the clearance of a motion in words."""
    return f"{1e3 * motion.clearance:.3f} mm"


def _is_among(motion: ClearanceResponse, clearances: Sequence[float]) -> bool:
    return any(abs(motion.clearance - other) < 1e-9 for other in clearances)


def table_four(motions: Sequence[ClearanceResponse], held_out: Sequence[float], command: str) -> ComparisonBlock:
    """Return Table 4 beside the peak to peak of computed motions, in g.

    Args:
        motions: One for each clearance of the table.
        held_out: Clearances that took no part in the fit, m.
        command: That makes them.
    """
    rows = []
    for motion, value in zip(motions, printed()["experiment"]["peak_to_peak_g"], strict=True):
        note = f"{'predicted' if _is_among(motion, held_out) else 'fitted'}; {motion.word}"
        rows.append(Compared(millimeters(motion), value, motion.smoothed_peak_to_peak, "g", note))
    return ComparisonBlock("Table 4: peak to peak of the smoothed acceleration at 370 mm", rows, command=command)


def extremes(motions: Sequence[ClearanceResponse], command: str) -> TableBlock:
    """Return the lowest and highest value about the mean beside the printed ones."""
    experiment = printed()["experiment"]
    rows: list[tuple[Cell, ...]] = [
        (millimeters(motion), low, here[0], high, here[1])
        for motion, low, high in zip(motions, experiment["lowest_g"], experiment["highest_g"], strict=True)
        for here in [motion.extremes(motion.smoothed())]
    ]
    heads = ("clearance", "lowest, paper (g)", "lowest, gapbeam (g)", "highest, paper (g)", "highest, gapbeam (g)")
    note = (
        "The printed extremes are not about the same zero: the middle between them moves between 0.02 and 0.10 g from "
        "row to row and not with the clearance, as a drifting zero of the measuring chain does. They were not fitted."
    )
    return TableBlock("Table 4: the extremes, about the mean of the signal", heads, rows, (note,), 3, command)


def rises(motions: Sequence[ClearanceResponse]) -> Verdict:
    """Say whether the peak to peak grows with the clearance, and where its relative rise is sharpest."""
    here = np.array([motion.smoothed_peak_to_peak for motion in motions])
    clearances = np.array([motion.clearance for motion in motions])
    measured = np.array(printed()["experiment"]["peak_to_peak_g"])
    words = []
    for name, values in (("measured", measured), ("computed", here)):
        steep = np.diff(np.log(values)) / (1e3 * np.diff(clearances))
        grows = "grows" if np.all(np.diff(values) > 0.0) else "does **not** grow"
        first = int(np.argmax(steep))
        words.append(
            f"{name}, it {grows} from each clearance to the next, with the sharpest relative rise, "
            f"{100.0 * (values[first + 1] / values[first] - 1.0):.0f} %, from {1e3 * clearances[first]:g} to "
            f"{1e3 * clearances[first + 1]:g} mm"
        )
    passed = bool(np.all(np.diff(here) > 0.0)) and int(np.argmax(np.diff(np.log(here)) / np.diff(clearances))) == 0
    return Verdict("passed" if passed else "error", "Peak to peak over the clearance: " + "; ".join(words) + ".")


def figure_seventeen(motions: Sequence[ClearanceResponse], held_out: Sequence[float], command: str) -> list[Chart]:
    """Return Fig. 17, the peak to peak over the clearance, and Fig. 20, the part of it that section 3 shares."""
    x = np.array([1e3 * motion.clearance for motion in motions])
    here = np.array([motion.smoothed_peak_to_peak for motion in motions])
    measured = np.array(printed()["experiment"]["peak_to_peak_g"])
    held = np.array([_is_among(motion, held_out) for motion in motions])

    def curves(part: np.ndarray) -> list[ChartCurve]:
        return [
            ChartCurve("gapbeam", x[part], here[part], "lines+markers"),
            ChartCurve("paper, fitted", x[part & ~held], measured[part & ~held], "markers"),
            ChartCurve("paper, predicted", x[part & held], measured[part & held], "markers"),
        ]

    shared = x > 0.1
    y = "peak to peak (g)"
    return [
        Chart("Fig. 17: peak to peak over the clearance.", "clearance (mm)", y, curves(x > -1.0), command),
        Chart("Fig. 20: the four clearances of section 3.", "clearance (mm)", y, curves(shared), command),
    ]


def waveforms(motions: Sequence[ClearanceResponse], command: str) -> Chart:
    """Return Figs. 15, 18 and 19: some periods of the acceleration, as recorded and smoothed, a button a clearance."""
    curves = []
    for motion in motions:
        begin = motion.windows.end - PERIODS_SHOWN / motion.windows.frequency
        for name, signal in (("as recorded", motion.raw), ("smoothed", motion.smoothed())):
            last = signal.since(begin)
            curves.append(ChartCurve(name, 1e3 * (last.time - begin), last.values / G, choice=millimeters(motion)))
    return Chart(
        "Figs. 15, 18 and 19: acceleration at 370 mm in the steady state, as recorded (every 0.1 ms) and averaged over "
        "five samples at 2 kHz. The paper shows 0.008 mm in Fig. 15 and 0.107 mm in Fig. 19.",
        "time (ms)",
        "acceleration (g)",
        curves,
        command,
        choices=[millimeters(motion) for motion in motions],
        choice="clearance",
    )


def spectra(motions: Sequence[ClearanceResponse], command: str) -> Chart:
    """Return Fig. 16: amplitude spectra of the smoothed signals, a button a clearance."""
    curves = []
    for motion in motions:
        found = spectrum(motion.smoothed(), motion.windows.frequency, after=motion.windows.start)
        shown = (found.frequency > 0.0) & (found.frequency <= HIGHEST)
        amplitude = np.maximum(found.amplitude[shown] / G, 1e-6)
        curves.append(ChartCurve("smoothed", found.frequency[shown], amplitude, "stems", millimeters(motion)))
    return Chart(
        "Fig. 16: amplitude spectra of the smoothed acceleration. The paper shows 0.008 and 0.243 mm.",
        "frequency (Hz)",
        "amplitude (g)",
        curves,
        command,
        log_y=True,
        choices=[millimeters(motion) for motion in motions],
        choice="clearance",
    )


def harmonics(motions: Sequence[ClearanceResponse], command: str) -> list[Block]:
    """Return the harmonics of the smoothed acceleration over the clearance, with what grows and what does not."""
    amplitudes = np.array([motion.harmonics() for motion in motions])[:, :SHOWN_HARMONICS]
    above = np.sqrt(np.sum(amplitudes[:, 3:] ** 2, axis=1))
    frequencies = [motions[0].windows.frequency * order for order in range(1, SHOWN_HARMONICS + 1)]
    rows: list[tuple[Cell, ...]] = [
        (millimeters(motion), *map(float, row), float(rest))
        for motion, row, rest in zip(motions, 1e3 * amplitudes, 1e3 * above, strict=True)
    ]
    heads = ("clearance", *(f"{f:g} Hz (mg)" for f in frequencies), f"{frequencies[3]:g} Hz and above (mg)")
    x = [1e3 * motion.clearance for motion in motions]
    curves = [
        ChartCurve(f"{frequency:g} Hz", x, amplitudes[:, place], "lines+markers")
        for place, frequency in enumerate(frequencies[:3])
    ]
    curves.append(ChartCurve(f"{frequencies[3]:g} Hz and above", x, above, "lines+markers"))
    open_ = np.array(x) > 0.0
    words, grow = [], True
    for name, values in (*((f"{f:g} Hz", amplitudes[:, k]) for k, f in enumerate(frequencies[:3])), ("above", above)):
        kept = values[open_]
        rises_ = bool(np.all(np.diff(kept) > -NOTHING * amplitudes[open_, 0][1:]))
        grow &= rises_ and kept[-1] > kept[0]
        words.append(
            f"{name} {'grows' if rises_ else 'does not grow at every step'} "
            f"({1e3 * kept[0]:.3g} to {1e3 * kept[-1]:.3g} mg, {kept[-1] / kept[0]:.1f} times)"
        )
    text = "From 0.008 to 0.243 mm, each at its own ratio: " + "; ".join(words) + "."
    pressed = (
        "At -0.006 mm the gland presses on the beam. The ends of the contact open and close in every period, and the "
        "40 Hz of that are more than those of the smallest play."
    )
    return [
        TableBlock("Harmonics of the smoothed acceleration", heads, rows, (pressed,), 3, command),
        Chart("Harmonics over the clearance.", "clearance (mm)", "amplitude (g)", curves, command, log_y=True),
        Verdict("passed" if grow else "warning", text),
    ]


def sampling(motions: Sequence[ClearanceResponse], command: str) -> list[Block]:
    """Return what the sampling rate, which is not printed, does to the peak to peak."""
    rows: list[tuple[Cell, ...]] = [
        (millimeters(motion), *map(motion.peak_to_peak, (motion.raw, *map(motion.smoothed, RATES))))
        for motion in motions
    ]
    heads = ("clearance", "as recorded (g)", *(f"five points at {rate:g} Hz (g)" for rate in RATES))
    return [
        Words("The sampling rate is not printed. With impacts as soft as these it matters little:"),
        TableBlock("Peak to peak for several sampling rates", heads, rows, (), 4, command),
    ]
