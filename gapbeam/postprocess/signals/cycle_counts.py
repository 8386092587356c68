"""Counts of a run: rainflow cycles of records with their fatigue damage, and impacts of each face in a span of time.

Damage follows Miner's rule,

    D = sum n_i (range_i / R)^m / N

for an S-N curve with exponent m on which a range of R lasts N cycles. There is no limit of endurance and no influence
of the mean stress.

Source: ASTM E1049-85, section 5.4.4, as the library rainflow counts; Miner, J. Appl. Mech. 12 (1945) A159.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from rainflow import extract_cycles

from gapbeam.postprocess.display_units import shown
from gapbeam.postprocess.results_errors import OptionError
from gapbeam.postprocess.signals.signal import record_columns, units_of

if TYPE_CHECKING:
    import xarray as xr

STRESS = "Pa"


@dataclass(frozen=True)
class SNCurve:
    """Cycles to failure over stress range, N (range / R)^-m.

    Attributes:
        exponent: m.
        range: R, Pa.
        cycles: N.

    Raises:
        OptionError: A parameter is not positive.
    """

    exponent: float
    range: float
    cycles: float

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not (np.isfinite(value) and value > 0.0):
                raise OptionError(f"S-N curve: {name} = {value:g}; expected a positive number, as in 3 100e6 2e6")

    def damage(self, ranges: np.ndarray, counts: np.ndarray) -> float:
        """Return the damage of so many cycles of these ranges, Pa; 1 is failure."""
        return float(np.sum(counts * (ranges / self.range) ** self.exponent)) / self.cycles


@dataclass(frozen=True)
class CycleCounts:
    """The cycles of a record.

    Attributes:
        record: Its name.
        unit: SI unit of record and ranges.
        seconds: Span of the record, s.
        cycles: Range, mean and count (1 or 1/2) of each cycle, (3, k), by label.
        curve: The S-N curve; None: no damage was asked for.
    """

    record: str
    unit: str
    seconds: float
    cycles: dict[str, np.ndarray]
    curve: SNCurve | None = None

    def damage(self, label: str) -> float | None:
        """Return the damage of a column over the record; None without a curve."""
        ranges, _, counts = self.cycles[label]
        return None if self.curve is None else self.curve.damage(ranges, counts)


def cycle_counts(history: xr.Dataset, record: str, curve: SNCurve | None = None) -> CycleCounts:
    """Return the rainflow cycles of the columns of a record.

    Args:
        history: History that holds the record.
        record: Its name.
        curve: S-N curve for damage, of stresses only.

    Raises:
        OptionError: Damage of a record that is no stress.
        SignalError: Values that are not finite.
    """
    unit = str(history[record].attrs.get("units", "1"))
    if curve is not None and unit != STRESS:
        raise OptionError(
            f"{record} is in {unit}, and an S-N curve is of stresses; expected axial_stress or von_mises_stress of a "
            "probe with `stress = true`, or no S-N curve"
        )
    columns = record_columns(history, record)
    found = {label: cycles_of(one.values) for label, one in columns.items()}
    time = next(iter(columns.values())).time
    return CycleCounts(record, units_of(columns.values()), float(time[-1] - time[0]), found, curve)


def cycles_of(values: np.ndarray) -> np.ndarray:
    """Return range, mean and count of each rainflow cycle of values (n,), (3, k); half cycles count 1/2."""
    rows = [(size, mean, count) for size, mean, count, _, _ in extract_cycles(values.tolist()) if size > 0.0]
    return np.array(rows, dtype=float).reshape(-1, 3).T


def cycle_rows(found: CycleCounts) -> list[str]:
    """Return lines of text: cycles, largest range and damage of every column."""
    title = f"Rainflow cycles of {found.record} in {found.seconds:.4g} s, {found.unit}"
    if found.curve is not None:
        one = found.curve
        title += f"; S-N curve with exponent {one.exponent:g} through {one.range:g} Pa at {one.cycles:g} cycles"
    rows = [title, f"  {'':32}{'cycles':>12}{'largest range':>15}{'damage':>12}{'s to failure':>14}"]
    for label, (ranges, _, counts) in found.cycles.items():
        harm = found.damage(label)
        life = "-" if not harm else f"{found.seconds / harm:.4g}"
        cells = f"{counts.sum():12.5g}{ranges.max(initial=0.0):15.5g}{'-' if harm is None else f'{harm:.4g}':>12}"
        rows.append(f"  {label:32}{cells}{life:>14}")
    return rows


def cycle_data(found: CycleCounts) -> dict[str, object]:
    """Return the counts as plain data."""
    return {
        "unit": found.unit,
        "seconds": found.seconds,
        "sn_curve": None if found.curve is None else vars(found.curve),
        "columns": {
            label: {"range": one[0].tolist(), "mean": one[1].tolist(), "count": one[2].tolist(),
                    "damage": found.damage(label)}
            for label, one in found.cycles.items()
        },
    }  # fmt: skip


QUANTITIES = {"approach speed": ("m/s", "rad/s"), "impulse": ("N s", "N m s"), "duration": ("s", "s")}
"""Units, and those of faces between rotations, in the order of the columns behind the time."""
PERCENTILES = (5.0, 50.0, 95.0)
HEADS = ("face", "", "mean", "5 %", "median", "95 %", "largest")


def in_span(impacts: Mapping[str, np.ndarray], begin: float, end: float) -> dict[str, np.ndarray]:
    """Return the impacts that began in a span of time, (k, 5) by face; faces without any are left out."""
    kept = {face: rows[(rows[:, 0] >= begin) & (rows[:, 0] <= end)] for face, rows in impacts.items()}
    return {face: rows for face, rows in kept.items() if len(rows)}


def rates(impacts: Mapping[str, np.ndarray], seconds: float) -> dict[str, float]:
    """Return the impacts per second at each face."""
    return {face: float(rows[:, 4].sum()) / seconds for face, rows in impacts.items()}


def impact_units(
    impacts: Mapping[str, np.ndarray], turning: Collection[str] = ()
) -> dict[str, dict[str, tuple[str, float]]]:
    """Return the units shown and the factors to them by face and quantity: one for all faces of a kind.

    Args:
        impacts: Impacts by face, (k, 5).
        turning: Faces between rotations.
    """
    found = dict[str, dict[str, tuple[str, float]]]()
    for turns in (False, True):
        faces = [face for face in impacts if (face in turning) is turns]
        if faces:
            largest = np.max([impacts[face][:, 1:4].max(axis=0) for face in faces], axis=0)
            sizes = zip(QUANTITIES.items(), largest, strict=True)
            units = {name: shown(both[turns], float(size)) for (name, both), size in sizes}
            found |= dict.fromkeys(faces, units)
    return {face: found[face] for face in impacts}


def distributions(rows: np.ndarray) -> dict[str, np.ndarray]:
    """Return mean, percentiles and largest value, (5,), of speed, impulse and duration of impacts (k, 5), in SI."""
    return {
        name: np.array([values.mean(), *np.percentile(values, PERCENTILES), values.max()])
        for name, values in zip(QUANTITIES, rows[:, 1:4].T, strict=True)
    }


def impact_rows(impacts: Mapping[str, np.ndarray], seconds: float, turning: Collection[str] = ()) -> list[str]:
    """Return lines of text: the rate and the distributions of every face; `turning`: faces between rotations."""
    rows = [f"Impacts in {seconds:.4g} s", f"  {'':32}" + "".join(f"{head:>12}" for head in HEADS[2:])]
    units = impact_units(impacts, turning)
    for face, rate in rates(impacts, seconds).items():
        every = int(impacts[face][0, 4])
        rest = f", distributions from one in {every}" if every > 1 else ""
        rows.append(f"  {face}: {rate:.4g} in a second{rest}")
        for name, values in distributions(impacts[face]).items():
            unit, factor = units[face][name]
            label = f"{name}, {unit}"
            rows.append(f"    {label:30}" + "".join(f"{value:12.4g}" for value in factor * values))
    return rows


def impact_data(impacts: Mapping[str, np.ndarray], seconds: float) -> dict[str, object]:
    """Return the rates, and the distributions in SI units, as plain data."""
    return {
        face: {"rate": rate}
        | {
            name.replace(" ", "_"): dict(zip(HEADS[2:], values.tolist(), strict=True))
            for name, values in distributions(impacts[face]).items()
        }
        for face, rate in rates(impacts, seconds).items()
    }
