"""Section 4 of the paper: the experiment, with what it does not print identified from its Table 4."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from gapbeam.postprocess.report.blocks import Block, Cell, ReportSection, TableBlock, Verdict, Words
from gapbeam.postprocess.report.sections.identification_section import identification_blocks
from gapbeam.studies.paper.clearance_series import SAMPLING, ClearanceResponse, motions
from gapbeam.studies.paper.experiment_figures import (
    extremes,
    figure_seventeen,
    harmonics,
    rises,
    sampling,
    spectra,
    table_four,
    waveforms,
)
from gapbeam.studies.paper.identified_values import ALL, CASE, FITTED, WIDE, by_place, copied, identified, settings_of
from gapbeam.studies.paper.other_responses import other_responses
from gapbeam.studies.paper.printed_figures import printed

COMMAND = "environment/run gapbeam paper"
TOLERANCE = 0.06  # rms of log10, 15 %
FINE: Mapping[str, object] = {"time.step": SAMPLING, "output.history_interval": SAMPLING}
MODELS: Mapping[str, Mapping[str, object]] = {
    "reduced slice, 16 cells along the support": {},
    "reduced slice, 40 cells": {"mesh.support_size": 1.25e-3, "mesh.edge_size": 1.25e-3},
    "Timoshenko beam, 51 elements": {"model": {"type": "beam", "elements": 51}},
    "reduced solid": {"mesh.dimension": 3, "mesh.cells_across_width": 4, "mesh.cells_through_thickness": 4},
}


def section_four(folder: Path) -> ReportSection:
    """Compute section 4 of the paper: identification from Table 4, Figs. 15 to 20, other responses.

    Args:
        folder: Where the case files, identifications and sweeps are kept; made if it is not there, and gone on with.

    Raises:
        RunError: A run of the identified case did not pass.
    """
    copied(folder)
    found = {name: identified(name, folder) for name in (FITTED, ALL, WIDE)}
    settings = settings_of(found[FITTED])
    clearances = [1e-3 * value for value in printed()["experiment"]["clearance_mm"]]
    held_out = [row["set"]["support.clearance"] for row in found[FITTED]["measurements"] if row["use"] == "predict"]
    moved = motions(folder / CASE, clearances, {**settings, **FINE})
    identify = "environment/run gapbeam identify studies/paper/{}.toml"
    blocks: list[Block] = [
        Words(
            "Printed are the beam, the pads, 20 Hz, and the acceleration at 370 mm after a moving average over five "
            "points. Not printed are place, force and suspension of the exciter, the stiffness of the contact, the "
            "damping and the sampling rate. A force alone on stiff contact cannot give Table 4: it either leaves the "
            "beam on its seat, whatever the clearance, or lets it fly through the gap at tens of g. What gives the "
            "whole table is **contact of finite stiffness** and **the moving mass of the exciter**, which rides on "
            "the beam.\n\nIt is not the only beam that does. On springs at the edges of its support alone, under an "
            "exciter whose suspension nearly carries it, it gives the table as well, with six unknowns "
            "(`environment/run gapbeam identify cases/studies/identify-li2013.toml`, "
            "docs/benchmarks/identification.md). Seven values do not decide between them: a second point, or the force "
            "of the exciter, measured, would."
        ),
        _verdict(found),
        table_four(moved, held_out, COMMAND),
        rises(moved),
        *figure_seventeen(moved, held_out, COMMAND),
        extremes(moved, COMMAND),
        waveforms(moved, COMMAND),
        spectra(moved, COMMAND),
        *harmonics(moved, COMMAND),
        *sampling(moved, COMMAND),
        _pads(),
        ReportSection(
            "Three unknowns from four clearances, three predicted",
            "section-4-fitted",
            (Words(f"`{identify.format(FITTED)}`"), *identification_blocks(folder / FITTED)),
        ),
        ReportSection(
            "The same from all seven clearances, each predicted from the other six",
            "section-4-all",
            (Words(f"`{identify.format(ALL)} --leave-one-out`"), *identification_blocks(folder / ALL)),
        ),
        ReportSection(
            "Six unknowns: what the table does not determine",
            "section-4-unknowns",
            (Words(f"`{identify.format(WIDE)}`"), *identification_blocks(folder / WIDE)),
        ),
        ReportSection("The place of the exciter", "section-4-place", _places(folder, found[ALL])),
        ReportSection(
            "How much model it needs", "section-4-models", _models(folder / CASE, moved, clearances, settings)
        ),
        ReportSection(
            "Other responses of the same beam", "section-4-others", other_responses(folder, clearances, settings)
        ),
    ]
    return ReportSection("Section 4: the experiment", "section-4", tuple(blocks))


def _verdict(found: Mapping[str, dict[str, Any]]) -> Verdict:
    rms = [found[name]["rms_log10"]["fit"] for name in (FITTED, ALL, WIDE)]
    held, left = found[FITTED]["rms_log10"]["predict"], found[ALL]["rms_left_out"]
    passed = all(one is not None and one <= TOLERANCE for one in (*rms, held, left))
    percent = [_percent(one) for one in (rms[0], held, rms[1], left)]
    return Verdict(
        "passed" if passed else "error",
        f"Three unknowns, fitted on four clearances: rms of log10(computed/measured) "
        f"{_rms_words(rms[0])} ({percent[0]}), and {_rms_words(held)} ({percent[1]}) for the three that are "
        f"**predicted**. Fitted on all seven: {_rms_words(rms[1])} ({percent[2]}); each predicted from the other six: "
        f"{_rms_words(left)} ({percent[3]}). Asked for: {TOLERANCE:g}.",
    )


def _rms_words(rms: float | None) -> str:
    return "not found" if rms is None else f"{rms:.4f}"


def _percent(rms: float | None) -> str:
    return "-" if rms is None else f"{100.0 * (10.0**rms - 1.0):.1f} %"


def _pads() -> TableBlock:
    experiment, thickness = printed()["experiment"], 1e3 * printed()["beam"]["thickness"]
    rows: list[tuple[Cell, ...]] = [
        (number, pad, clearance, pad - thickness)
        for number, (pad, clearance) in enumerate(
            zip(experiment["pad_thickness_mm"], experiment["clearance_mm"], strict=True), start=1
        )
    ]
    heads = ("group", "pad, paper (mm)", "clearance, paper (mm)", "pad less 12 mm (mm)")
    return TableBlock("Table 3: pads and clearances", heads, rows, digits=5)


def _places(folder: Path, found: dict[str, Any]) -> list[Block]:
    pairs = by_place(folder, found)
    keys = [unknown["key"] for unknown in found["unknowns"]]
    units = [unknown["unit"] for unknown in found["unknowns"]]
    rows: list[tuple[Cell, ...]] = []
    for place, fit in pairs:
        values = [unknown["value"] for unknown in fit["unknowns"]]
        rows.append((1e3 * place, *values, fit["rms_log10"]["fit"]))
    heads = ("place (mm)", *(f"{key} ({unit})" for key, unit in zip(keys, units, strict=True)), "rms of log10")
    good = [place for place, fit in pairs if (fit["rms_log10"]["fit"] or np.inf) <= TOLERANCE]
    words = (
        f"Of {len(pairs)} places of the exciter from {1e3 * pairs[0][0]:g} to {1e3 * pairs[-1][0]:g} mm, {len(good)} "
        "give the table, each with another force and another mass: "
    )
    answer = "the table does not determine the place." if len(good) > 1 else "the table determines the place."
    table = TableBlock("Refitted for several places of the exciter", heads, rows, (), 4, COMMAND)
    return [Verdict("note" if len(good) == len(pairs) else "warning", words + answer), table]


def _models(
    case: Path, moved: Sequence[ClearanceResponse], clearances: Sequence[float], settings: Mapping[str, object]
) -> list[Block]:
    found = {name: moved if not changes else motions(case, clearances, {**settings, **FINE, **changes})
             for name, changes in MODELS.items()}  # fmt: skip
    peaks = {name: np.array([one.smoothed_peak_to_peak for one in group]) for name, group in found.items()}
    reference = peaks[list(MODELS)[-1]]
    rows: list[tuple[Cell, ...]] = [
        (name, *map(float, values), 100.0 * float(np.max(np.abs(values / reference - 1.0))))
        for name, values in peaks.items()
    ]
    heads = ("model", *(f"{1e3 * one:g} mm (g)" for one in clearances), "farthest from the solid (%)")
    return [TableBlock("Peak to peak of the identified beam in several models", heads, rows, (), 4, COMMAND)]
