"""Periodic responses: their multipliers, and the curve of them over a parameter."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from gapbeam.postprocess.display_units import shown
from gapbeam.postprocess.report.blocks import Block, Cell, ReportSection, TableBlock, Verdict
from gapbeam.postprocess.report.charts import Chart, ChartCurve
from gapbeam.postprocess.results.curve_parts import branch_parts, stable_parts

SUFFIX = ".peak_to_peak"
_REPORTED = (
    ("method", "method"), ("periods", "forcing periods of the response"),
    ("forcing_frequency", "forcing frequency (Hz)"),
    ("steps_per_period", "steps in a period"), ("harmonics", "harmonics"), ("residual", "residual"),
    ("iterations", "iterations"), ("largest_multiplier", "largest multiplier"), ("stability", "stability"),
    ("change_when_marched", "change when marched over a period"),
)  # fmt: skip


def periodic_section(found: Mapping[str, Any], command: str, anchor: str = "periodic") -> ReportSection:
    """Return what a search for a periodic response found.

    Args:
        found: `summary["periodic"]`.
        command: That makes the figures.
        anchor: Of the section.
    """
    blocks: list[Block] = []
    if found.get("stability") == "not known":
        blocks.append(Verdict("warning", "Whether the periodic response is stable is not known."))
    elif found.get("stable") is not None:
        word = "stable" if found["stable"] else f"unstable: {found.get('stability')}"
        blocks.append(Verdict("passed" if found["stable"] else "warning", f"The periodic response is {word}."))
    rows: list[tuple[Cell, ...]] = []
    for key, name in _REPORTED:
        value = found.get(key)
        if value is not None:
            rows.append((name, value if isinstance(value, str | int) else float(value)))
    blocks.append(TableBlock("The periodic response", ("", "value"), rows))
    blocks += [_probes(found["probes"])] if found.get("probes") else []
    blocks += [_multipliers(found["multipliers"], command)] if found.get("multipliers") else []
    return ReportSection("Periodic response", anchor, blocks)


def curve_section(curve: Mapping[str, Any], command: str, anchor: str = "response-curve") -> ReportSection:
    """Return a curve of periodic responses, stable parts drawn through, all others dashed, events marked.

    Args:
        curve: Contents of curve.json.
        command: That makes the figures.
        anchor: Of the section.
    """
    points: list[dict[str, Any]] = curve["points"]
    probes = [name.removesuffix(SUFFIX) for name in points[0] if name.endswith(SUFFIX)]
    length, factor = shown("m")
    axis = f"{curve['key']} ({curve['unit']})"
    texts = [_point_words(point, curve) for point in points]
    motion, multiplier = list[ChartCurve](), list[ChartCurve]()
    for number, part in branch_parts(points):
        suffix = "" if number == 1 else f", branch {number}"
        inside, said = points[part], texts[part]
        for probe in probes:
            heights = factor * np.array([point[probe + SUFFIX] for point in inside])
            motion += _branch(probe + suffix, inside, heights, said)
        largest = np.array([point["largest_multiplier"] for point in inside])
        multiplier += _branch("largest multiplier" + suffix, inside, largest, said)
    ends = [min(point["value"] for point in points), max(point["value"] for point in points)]
    multiplier.append(ChartCurve("limit of stability", ends, [1.0, 1.0], dashed=True))
    rows = [
        (point["event"], float(point["value"]), float(point["largest_multiplier"]))
        for point in points
        if point["event"]
    ]
    missing = [
        Verdict("warning", f"No response was followed from {gap['low']:.6g} to {gap['high']:.6g} {curve['unit']}.")
        for gap in curve.get("missing", ())
    ]
    blocks: list[Block] = [
        *missing,
        Chart(
            "Peak to peak along the curve of periodic responses; dashed where they are not known to be stable.",
            axis, f"peak to peak ({length})", motion, command,
        ),
        Chart("Largest multiplier along the curve.", axis, "largest |multiplier|", multiplier, command),
    ]  # fmt: skip
    if rows:
        blocks.append(TableBlock("Events along the curve", ("event", axis, "largest multiplier"), rows, digits=6))
    return ReportSection("Response curve", anchor, blocks)


def _branch(
    name: str, points: Sequence[Mapping[str, Any]], heights: np.ndarray, texts: Sequence[str]
) -> list[ChartCurve]:
    """Return the stable and the unstable parts of a curve, and its events."""
    values = np.array([float(point["value"]) for point in points])
    curves = []
    for wanted, words in ((True, name), (False, f"{name}, unstable"), (None, f"{name}, stability not known")):
        parts = [part for stable, part in stable_parts(points) if stable is wanted]
        if parts:
            x = np.concatenate([np.append(values[part], np.nan) for part in parts])  # a gap between two parts
            y = np.concatenate([np.append(heights[part], np.nan) for part in parts])
            said = [text for part in parts for text in (*texts[part], "")]
            curves.append(ChartCurve(words, x, y, "lines", dashed=not wanted, texts=said, like=name))
    events = [place for place, point in enumerate(points) if point["event"]]
    if events:
        text = [texts[place] for place in events]
        curves.append(ChartCurve(f"{name}, events", values[events], heights[events], "markers", texts=text, like=name))
    return curves


def _point_words(point: Mapping[str, Any], curve: Mapping[str, Any]) -> str:
    text = [f"{curve['key']} = {point['value']:.6g} {curve['unit']}"]
    text += [
        f"{name.removesuffix(SUFFIX)}: {1e3 * point[name]:.5g} mm peak to peak" for name in point if SUFFIX in name
    ]
    text += [
        f"{name.removesuffix('.peak_force')}: {point[name]:.5g} N" for name in point if name.endswith(".peak_force")
    ]
    text.append(f"{point['kind']}, largest multiplier {point['largest_multiplier']:.4g}")
    return "\n".join([*text, *([point["event"]] if point["event"] else [])])


def _probes(probes: Mapping[str, Mapping[str, Any]]) -> TableBlock:
    unit, factor = shown("m")
    most = max(len(one["harmonics"]) for one in probes.values())
    heads = (
        "probe",
        f"mean ({unit})",
        f"peak to peak ({unit})",
        *(f"harmonic {n} ({unit})" for n in range(1, most + 1)),
    )
    rows: list[tuple[Cell, ...]] = []
    for name, one in probes.items():
        amplitudes = [factor * value for value in one["harmonics"]]
        amplitudes += [float("nan")] * (most - len(amplitudes))
        rows.append((name, factor * one["mean"], factor * one["peak_to_peak"], *amplitudes))
    return TableBlock("The probes over a period", heads, rows)


def _multipliers(multipliers: Sequence[Mapping[str, float]], command: str) -> Chart:
    angle = np.linspace(0.0, 2.0 * np.pi, 181)
    x = np.array([one["real"] for one in multipliers])
    y = np.array([one["imaginary"] for one in multipliers])
    return Chart(
        "Leading Floquet multipliers and the unit circle: inside it disturbances die out.",
        "real part", "imaginary part",
        [
            ChartCurve("multipliers", x, y, "markers"),
            ChartCurve("unit circle", np.cos(angle), np.sin(angle), dashed=True),
        ],
        command, equal=True,
    )  # fmt: skip
