"""Power densities, shock response spectra and rainflow cycles as CSV files, one beside each of their pictures.

The first line holds the heads, each with its unit: "tip y absolute (m/s^2)". Numbers come back to the same bits.
"""

from __future__ import annotations

import csv
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from gapbeam.postprocess.signals.cycle_counts import CycleCounts
from gapbeam.postprocess.signals.shock_spectrum import PowerDensity, ShockSpectrum

FREQUENCY = "frequency (Hz)"


@dataclass(frozen=True)
class AnalysisTable:
    """A table of numbers.

    Attributes:
        name: Of its file, without suffix: the name of the picture.
        heads: Heads of the columns, with units.
        rows: As many cells each as there are heads.
    """

    name: str
    heads: tuple[str, ...]
    rows: Sequence[Sequence[str | float]]


def density_table(found: PowerDensity) -> AnalysisTable:
    """Return frequencies, Hz, and the density of each column, its unit squared over Hz."""
    heads = tuple(f"{label} (({found.unit})^2/Hz)".strip() for label in found.densities)
    columns = [found.frequency.tolist(), *(one.tolist() for one in found.densities.values())]
    return AnalysisTable(f"psd_{found.record}", (FREQUENCY, *heads), list(zip(*columns, strict=True)))


def shock_table(found: ShockSpectrum) -> AnalysisTable:
    """Return natural frequencies, Hz, and the largest response of each kind and column, in the unit of the record."""
    heads = tuple(f"{label} {kind} ({found.unit})".strip() for kind, label in found.responses)
    columns = [found.frequency.tolist(), *(one.tolist() for one in found.responses.values())]
    return AnalysisTable(f"shock_{found.record}", (FREQUENCY, *heads), list(zip(*columns, strict=True)))


def cycle_table(found: CycleCounts) -> AnalysisTable:
    """Return a row for each cycle: its column, range and mean in the unit of the record, and 1 or 1/2 as its count."""
    heads = ("column", f"range ({found.unit})", f"mean ({found.unit})", "count")
    rows = [(label, *cycle) for label, cycles in found.cycles.items() for cycle in cycles.T.tolist()]
    return AnalysisTable(f"cycles_{found.record}", heads, rows)


def write_tables(tables: Iterable[AnalysisTable], folder: Path) -> list[Path]:
    """Write tables as CSV files into a folder, and return the files.

    Args:
        tables: With different names.
        folder: That is there.

    Raises:
        OSError: A file cannot be written.
    """
    paths = []
    for table in tables:
        path = folder / f"{table.name}.csv"
        with path.open("w", encoding="utf-8", newline="") as file:
            writer = csv.writer(file)
            writer.writerow(table.heads)
            writer.writerows(table.rows)
        paths.append(path)
    return paths
