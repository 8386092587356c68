"""Records made to fit a response spectrum, as seismic analyses of supports take them.

Noise under an envelope, or a recorded motion, is scaled by its Fourier transform until its spectrum is near the given
one. Then the largest responses R_j of oscillators j, at their times t_j, are put at the spectrum by the least change of
the record,

    da = e sum_j b_j h_j(t_j - t),    (sum_k <h_j, e h_k> b_k) = +-S_j - R_j,

with the impulse responses h and the envelope e. Velocity and displacement at the end are two such responses of 0. Other
peaks of the same height keep theirs, and a share of the diagonal is added, so that close frequencies share the change.
The envelope of a recorded motion is its root mean square over three periods of the lowest frequency.

Source: Lilhanand and Tseng, Nucl. Eng. Des. 110 (1988) 157; Al Atik and Abrahamson, Earthq. Spectra 26 (2010) 601.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, log, log2
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
import scipy
import scipy.ndimage

from gapbeam.postprocess.signals.shock_spectrum import DAMPING, HIGHEST, responses
from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.scene.argument_checks import checked, finite

PER_OCTAVE = 24
"""Frequencies that a pass corrects, of the worst in each share of an octave."""
APART = 0.2
"""Largest distance of frequencies at which spectra are compared, over the damping: peaks between them are near."""
SCALINGS, CORRECTIONS = 6, 40
CLOSE = 0.5
"""Misfit over the tolerance at which no better one is sought."""
RISE, DECAY = 0.15, 0.6
"""Ends of the growth and of the strong part of a record, over its duration."""
RELAXED, SHARED, NEAR, PEAKS = 0.7, 0.03, 0.9, 6
MOST_STEPS = 50_000
FEWEST_PERIODS = 3.0
QUIETEST = 0.05
"""Least envelope of a recorded motion, over its largest: where it is quiet, it changes little."""
HEADER = "time (s),acceleration (m/s^2)"


@dataclass(frozen=True, eq=False)
class FittedRecord:
    """A record with the spectrum that it was made for.

    Attributes:
        time: Even times from 0 on, (n,), s.
        acceleration: Accelerations, (n,), m/s^2; velocity and displacement end at 0.
        frequency: Frequencies at which the spectra were compared, (k,), Hz.
        spectrum: Largest pseudo-accelerations of the record, (k,), m/s^2.
        wanted: The given pseudo-accelerations, (k,), m/s^2.
        damping: Ratio of the oscillators.
    """

    time: np.ndarray
    acceleration: np.ndarray
    frequency: np.ndarray
    spectrum: np.ndarray
    wanted: np.ndarray
    damping: float

    @property
    def misfit(self) -> float:
        """Largest relative difference of the spectra."""
        return float(np.abs(self.spectrum / self.wanted - 1.0).max())

    def write(self, path: str | PathLike[str]) -> Path:
        """Write time and acceleration in two columns, as loads from recorded signals read them."""
        rows = np.column_stack([self.time, self.acceleration])
        np.savetxt(path, rows, delimiter=",", header=HEADER, comments="", fmt="%.9g")
        return Path(path)


@checked
def fitted_record(
    frequency: Any,
    acceleration: Any,
    *,
    duration: float | None = None,
    start: Any = None,
    step: float | None = None,
    damping: float = DAMPING,
    seed: int = 0,
    tolerance: float = 0.1,
) -> FittedRecord:
    """Return an acceleration of the ground whose response spectrum is the given one.

    Args:
        frequency: Corners of the spectrum, ascending, Hz; lines between them in a log-log plot.
        acceleration: Pseudo-accelerations there, w^2 max|z|, m/s^2.
        duration: s; the strong part ends at 0.6 of it. Default the duration of `start`.
        start: Recorded motion to change, (times, accelerations), s and any unit: its phases stay. Default noise.
        step: Time between values, s; default 20 in a period of the highest frequency.
        damping: Ratio of the oscillators.
        seed: Seed of the noise that it starts from, without `start`.
        tolerance: Largest misfit: relative difference at frequencies at most 0.2 dampings apart, 24 in an octave or
            more.

    Raises:
        UserError: A value is out of range, or the record does not meet the tolerance.
    """
    corners, levels = (finite(one, f"fitted_record: {name}") for one, name in _named(frequency, acceleration))
    times, motion = (np.zeros(0),) * 2 if start is None else _recorded(start)
    if duration is None:
        if start is None:
            raise UserError("fitted_record: found neither duration nor start, expected one: a time, s, or a motion")
        duration = float(np.ptp(times))
    faults = list(_faults(corners, levels, duration, damping, tolerance, step))
    if len(times) and duration > np.ptp(times) * (1.0 + 1e-9):
        faults.append(f"found duration {duration:g} s, expected at most that of start, {np.ptp(times):g} s")
    if faults:
        raise UserError("fitted_record: " + "; ".join(faults))
    h = 0.05 / float(corners[-1]) if step is None else step
    finer = ceil(log(2.0) / (PER_OCTAVE * APART * damping))
    count = ceil(PER_OCTAVE * log2(corners[-1] / corners[0])) * finer + 1
    f: np.ndarray = np.geomspace(corners[0], corners[-1], count)
    wanted = np.exp(np.interp(np.log(f), np.log(corners), np.log(levels)))
    part = np.arange(round(duration / h) + 1) * h / duration
    if start is None:
        shape = _envelope(part)
        raw = shape * np.random.default_rng(seed).standard_normal(len(shape))
    else:
        raw = np.interp(times[0] + part * duration, times, motion)
        shape = _envelope_of(raw, part, round(FEWEST_PERIODS / corners[0] / h))
    started = _scaled(raw, h, f[::finer], wanted[::finer], damping, shape)
    a = _corrected(started, h, f, wanted, damping, shape, finer, CLOSE * tolerance)
    found = FittedRecord(np.arange(len(a)) * h, a, f, _spectrum(a, h, f, damping), wanted, damping)
    if found.misfit > tolerance:
        worst = float(f[np.argmax(np.abs(found.spectrum / wanted - 1.0))])
        raise UserError(
            f"fitted_record: found a misfit of {100.0 * found.misfit:.3g} % at {worst:.3g} Hz, expected at most "
            f"{100.0 * tolerance:.3g} %; "
            f"try {'another seed' if start is None else 'another start'}, a longer duration, or a spectrum without "
            "steep flanks"
        )
    return found


def _named(frequency: Any, acceleration: Any) -> tuple[tuple[Any, str], tuple[Any, str]]:
    return (np.atleast_1d(frequency), "frequency"), (np.atleast_1d(acceleration), "acceleration")


def _faults(
    corners: np.ndarray, levels: np.ndarray, duration: float, damping: float, tolerance: float, step: float | None
) -> Any:
    """Yield the faults of a spectrum and its record, in words."""
    if corners.ndim > 1 or corners.shape != levels.shape or len(corners) < 2:
        yield f"found {corners.size} frequencies and {levels.size} accelerations, expected as many, at least two"
    elif not (np.all(corners > 0.0) and np.all(np.diff(corners) > 0.0)):
        yield "found frequencies that do not ascend from above 0, expected Hz; a table over periods is turned around"
    elif not np.all(levels > 0.0):
        yield f"found an acceleration of {levels.min():g}, expected all above 0, m/s^2; start the table where it begins"
    else:
        if not duration * corners[0] >= FEWEST_PERIODS:
            least = FEWEST_PERIODS / corners[0]
            yield f"found duration {duration:g} s, expected at least {least:.3g} s, three periods at the start"
        if step is not None and not 0.0 < step * corners[-1] <= HIGHEST:
            most = HIGHEST / corners[-1]
            yield f"found step {step:g} s, expected at most {most:.3g} s, ten values in a period of the last frequency"
        elif duration * corners[-1] > MOST_STEPS * (0.05 if step is None else step * corners[-1]):
            yield f"found more than {MOST_STEPS} steps, expected fewer; try a shorter duration, a lower last frequency"
    if not 0.0 < damping < 1.0:
        yield f"found damping {damping:g}, expected a ratio above 0 and below 1, such as 0.05"
    if not tolerance > 0.0:
        yield f"found tolerance {tolerance:g}, expected a share above 0, such as 0.1"


def _recorded(start: Any) -> tuple[np.ndarray, np.ndarray]:
    """Return times and accelerations of a recorded motion, without its mean.

    Raises:
        UserError: There are not as many times as accelerations, times do not ascend, or nothing moves.
    """
    given = [finite(one, "fitted_record: start") for one in start] if isinstance(start, tuple | list) else []
    if len(given) != 2 or given[0].ndim != 1 or given[0].shape != given[1].shape or len(given[0]) < 2:
        raise UserError("fitted_record: start: expected (times, accelerations), as many of both, at least two")
    times, motion = given
    if not np.all(np.diff(times) > 0.0):
        raise UserError("fitted_record: start: found times that do not ascend, expected s")
    if not np.ptp(motion) > 0.0:
        raise UserError(f"fitted_record: start: found {motion[0]:g} at all times, expected a motion")
    return times, motion - np.trapezoid(motion, times) / np.ptp(times)


def _envelope_of(a: np.ndarray, part: np.ndarray, window: int) -> np.ndarray:
    """Return the root mean square of a motion over windows, over its largest, which falls to 0 at both ends."""
    square = scipy.ndimage.uniform_filter1d(a * a, max(window, 1), mode="nearest")
    shape = np.sqrt(np.maximum(square, 0.0) / square.max())
    ends = np.minimum(np.minimum(part, 1.0 - part) / 0.05, 1.0)
    return np.asarray(np.maximum(shape, QUIETEST) * ends)


def _envelope(part: np.ndarray) -> np.ndarray:
    """Return growth with the square of time, a strong part, and decay to 0, at shares of the duration."""
    grown = np.minimum(part / RISE, 1.0) ** 2
    decayed = np.exp(-3.0 * np.maximum(part - DECAY, 0.0) / (1.0 - DECAY))
    return np.asarray(grown * decayed * np.minimum((1.0 - part) / 0.05, 1.0))


def _seen(a: np.ndarray, h: float, f: np.ndarray, damping: float) -> np.ndarray:
    """Return the pseudo-accelerations of all oscillators over time, (k, n)."""
    return np.array([responses(a, h, float(one), damping, "pseudo") for one in f])


def _spectrum(a: np.ndarray, h: float, f: np.ndarray, damping: float) -> np.ndarray:
    """Return the largest pseudo-accelerations of all oscillators, (k,)."""
    return np.array([np.abs(responses(a, h, float(one), damping, "pseudo")).max() for one in f])


def _scaled(
    a: np.ndarray, h: float, f: np.ndarray, wanted: np.ndarray, damping: float, shape: np.ndarray
) -> np.ndarray:
    """Return a record whose Fourier transform was scaled by what its spectrum lacks."""
    lines = np.maximum(np.fft.rfftfreq(len(a), h), 1e-3 * f[0])
    low = np.minimum(lines / f[0], 1.0) ** 2
    for _ in range(SCALINGS):
        lacking = wanted / _spectrum(a, h, f, damping)
        factor = low * np.exp(np.interp(np.log(lines), np.log(f), np.log(lacking)))
        a = np.where(shape > 0.0, np.fft.irfft(np.fft.rfft(a) * factor, len(a)), 0.0)
    return a


def _corrected(
    a: np.ndarray, h: float, f: np.ndarray, wanted: np.ndarray, damping: float, shape: np.ndarray, finer: int,
    enough: float,
) -> np.ndarray:  # fmt: skip
    """Return the best record of all passes; each moves peaks of the worst of `finer` responses onto the spectrum."""
    n, struck = len(a), np.zeros(len(a))
    struck[0] = 1.0
    ends = np.stack([np.ones(n), 1.0 - np.arange(n) / n]) / (np.sqrt(n) * wanted.max())
    best, least = a, np.inf
    for number in range(CORRECTIONS):
        off = np.abs(_spectrum(a, h, f, damping) / wanted - 1.0)
        misfit = float(off.max())
        if number > 0 and misfit < least:  # the ends of the first one move on
            best, least = a, misfit
        if least < enough:
            break
        worst = [int(j + off[j : j + finer].argmax()) for j in range(0, len(f), finer)]
        seen, back = (_seen(one, h, f[worst], damping) / wanted[worst, None] for one in (a, struck))
        peaks = [(j, i, lacks) for j, row in enumerate(seen) for i, lacks in _peaks(row)]
        rows = np.zeros((len(peaks) + 2, n))
        for row, (j, i, _) in zip(rows, peaks, strict=False):
            row[: i + 1] = back[j, i::-1]
        rows[-2:] = ends
        change = np.append([RELAXED * lacks for _, _, lacks in peaks], -ends @ a)
        products = (rows * shape) @ rows.T
        size = np.sqrt(np.diag(products))
        shared = np.append(np.full(len(peaks), SHARED), [1e-6, 1e-6])
        weights = scipy.linalg.solve(products / size[:, None] / size + np.diag(shared), change / size, assume_a="pos")
        a = a + shape * ((weights / size) @ rows)
    return best


def _peaks(seen: np.ndarray) -> list[tuple[int, float]]:
    """Return places of the highest peaks of a response over its spectrum, and what each lacks; lower ones lack 0."""
    size = np.abs(seen)
    places = scipy.signal.argrelmax(size)[0]
    places = places[np.argsort(-size[places])][:PEAKS] if len(places) else np.array([size.argmax()])
    near = [int(i) for i in places[1:] if size[i] > NEAR]
    found = [(int(places[0]), float(np.sign(seen[places[0]]) * (1.0 - size[places[0]])))]
    return found + [(i, float(np.sign(seen[i]) * min(1.0 - size[i], 0.0))) for i in near]
