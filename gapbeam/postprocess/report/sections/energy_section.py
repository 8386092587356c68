"""The energies of a run: where they are, where they went, what the balance leaves over, and what the gates say."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr

from gapbeam.postprocess.display_units import shown
from gapbeam.postprocess.report.blocks import Block, Cell, ReportSection, TableBlock
from gapbeam.postprocess.report.charts import Chart, ChartCurve
from gapbeam.postprocess.report.envelope import envelope, thinning_words
from gapbeam.postprocess.signals.signal import SignalError
from gapbeam.solver.record_table import HISTORY

SMALL = 1.0e-4  # of the largest stored energy: what stays below is not drawn
_STORED = ("kinetic_energy", "strain_energy", "contact_energy", "restraint_energy")
_LOST = ("structural_dissipation", "contact_dissipation", "friction_dissipation", "algorithmic_dissipation")
_NAMES = {
    "algorithmic_dissipation": "lost to the scheme",
    "structural_dissipation": "lost to structural damping",
    "contact_dissipation": "lost to contact damping",
    "friction_dissipation": "lost to friction",
}
_GATES = (
    ("impacts", "impacts"),
    ("violations", "impacts outside the gates"),
    ("largest_growth", "largest growth in an impact"),
    ("largest_loss", "largest loss in an impact"),
)
_LIMITS = (("impact_growth", "growth allowed in an impact"), ("impact_loss", "loss allowed in an impact"),
           ("total_growth", "growth allowed in the whole run"))  # fmt: skip


def energy_section(
    history: xr.Dataset, summary: Mapping[str, Any], command: str, anchor: str = "energy", since: str = "t = 0"
) -> ReportSection | None:
    """Return the ledger of energies and the gates; None where neither is there.

    Args:
        history: `Results.history`.
        summary: `Results.summary`.
        command: That makes the figures.
        anchor: Of the section.
        since: When works and losses begin to count.

    Raises:
        SignalError: A value is not finite.
    """
    unit = shown("J")[0]
    size = history.sizes["time"]
    blocks: list[Block] = []
    there = {name: _values(history, name) for name in _STORED if name in history}
    most = max((float(values.max()) for values in there.values()), default=0.0)
    stored = [
        _curve(history, name, name.replace("_", " ")) for name, values in there.items() if values.max() >= SMALL * most
    ]
    spent = _work(history) + [_curve(history, name, _NAMES[name]) for name in _LOST if _any(history, name)]
    thin = thinning_words(size)
    if stored:
        blocks.append(Chart(f"Stored energy.{thin}", "time (s)", f"energy ({unit})", stored, command))
    if spent:
        blocks.append(Chart(f"Work of the loads and losses since {since}.{thin}", "time (s)", f"energy ({unit})", spent,
                            command))  # fmt: skip
    if "energy_residual" in history:
        residual = [_curve(history, "energy_residual", "residual")]
        blocks.append(
            Chart(f"What the balance of energy leaves over.{thin}", "time (s)", f"residual ({unit})", residual, command)
        )
    table = _gates_table(summary)
    if table is not None:
        blocks.append(table)
    return ReportSection("Energy", anchor, blocks) if blocks else None


def energy_of_span(history: xr.Dataset, command: str) -> ReportSection | None:
    """Return the energies of a span of a run: works and losses from its first record on, and their balance.

    Gates judge impacts and the whole run, and are left out.

    Args:
        history: Records of the span.
        command: That makes the figures.

    Raises:
        SignalError: A value is not finite.
    """
    summed = [name for name in ("load_work", *_LOST, "energy_residual") if name in history]
    changed = history.assign({name: history[name] - history[name].isel(time=0) for name in summed})
    first = f"t = {float(history['time'][0]):.6g} s"
    section = energy_section(changed, {}, command, since=first)
    if section is None:
        return None
    return ReportSection(section.title, section.anchor, [_balance(changed, first), *section.blocks])


def _balance(changed: xr.Dataset, first: str) -> TableBlock:
    """Return what came, went, and is stored more at the end of a span than at its first record."""
    there = [name for name in _STORED if name in changed]
    stored = float(sum(_values(changed, name)[-1] - _values(changed, name)[0] for name in there))
    rows: list[tuple[Cell, ...]] = []
    if "load_work" in changed:
        work = _values(changed, "load_work")[-1]
        rows += [(f"work of {name}", float(one)) for name, one in zip(changed["load"].values, work, strict=True)]
    rows += [(_NAMES[name], -float(_values(changed, name)[-1])) for name in _LOST if _any(changed, name)]
    if "energy_residual" in changed:
        rows.append(("residual", float(_values(changed, "energy_residual")[-1])))
    rows.append(("stored more than at the start of the span", stored))
    caption = f"Energy from {first} on: the last line is the sum of those above"
    return TableBlock(caption, ("", f"energy ({shown('J')[0]})"), rows)


def _values(history: xr.Dataset, name: str) -> np.ndarray:
    values = shown("J")[1] * np.asarray(history[name].values, dtype=float)
    if not np.isfinite(values).all():
        raise SignalError(f"{name}: a value is not finite")
    return values


def _curve(history: xr.Dataset, name: str, label: str) -> ChartCurve:
    return ChartCurve(label, *envelope(np.asarray(history["time"].values, dtype=float), _values(history, name)))


def _any(history: xr.Dataset, name: str) -> bool:
    return name in history and bool(np.any(history[name].values))


def _work(history: xr.Dataset) -> list[ChartCurve]:
    if "load_work" not in history:
        return []
    time, work = np.asarray(history["time"].values, dtype=float), _values(history, "load_work")
    names = [str(name) for name in history["load"].values]
    return [ChartCurve(f"work of {name}", *envelope(time, work[:, place])) for place, name in enumerate(names)]


def _gates_table(summary: Mapping[str, Any]) -> TableBlock | None:
    gates, energy = summary.get("gates") or {}, summary.get("energy") or {}
    limits = gates.get("limits") or {}
    rows: list[tuple[Cell, ...]] = []
    for key, name in _GATES:
        if gates.get(key) is not None:
            whole = isinstance(gates[key], int)
            rows.append((name, gates[key] if whole else 100.0 * gates[key], "" if whole else "%"))
    for key, name in _LIMITS:
        if limits.get(key) is not None:
            rows.append((name, 100.0 * float(limits[key]), "%"))
    if energy.get("relative_growth") is not None:
        rows.append(("created in the whole run, of the energy exchanged", 100.0 * energy["relative_growth"], "%"))
    if not rows:
        return None
    notes = [record.meaning for record in HISTORY if record.name == "algorithmic_dissipation"]
    return TableBlock("Gates on the energy", ("", "value", "unit"), rows, notes=[f"Scheme: {notes[0]}."])
