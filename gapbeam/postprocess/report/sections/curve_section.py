"""Reports on periodic responses with multipliers and curves, on comparisons of two runs, and on lives under wear."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from gapbeam.postprocess.display_units import shown, shown_by, size_words
from gapbeam.postprocess.figures.curve_figures import SUFFIX
from gapbeam.postprocess.report.blocks import (
    Block,
    Cell,
    Command,
    Picture,
    ReportSection,
    TableBlock,
    Verdict,
    Words,
    number,
    warnings_of,
)
from gapbeam.postprocess.report.charts import Chart, ChartCurve
from gapbeam.postprocess.report.html_page import sentence
from gapbeam.postprocess.report.study_json import read_object
from gapbeam.postprocess.results.bounded_files import branch_parts, stable_parts
from gapbeam.postprocess.results.columns_of_run import distinct
from gapbeam.postprocess.shell_command import shell_command

_REPORTED = (
    ("method", "method"), ("periods", "forcing periods of the response"),
    ("forcing_frequency", "forcing frequency (Hz)"),
    ("steps_per_period", "steps in a period"), ("harmonics", "harmonics"), ("residual", "residual"),
    ("iterations", "iterations"), ("largest_multiplier", "largest multiplier"), ("stability", "stability"),
    ("change_when_marched", "change when marched over a period"),
)  # fmt: skip


def periodic_section(found: Mapping[str, Any], command: str) -> ReportSection:
    """Return the section on a search for a periodic response.

    Args:
        found: `summary["periodic"]`.
        command: Command that makes the figures.
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
    return ReportSection("Periodic response", "periodic", blocks)


def curve_section(curve: Mapping[str, Any], command: str) -> ReportSection:
    """Return a curve of periodic responses, stable parts drawn through, all others dashed, events marked.

    Args:
        curve: Contents of curve.json.
        command: Command that makes the figures.
    """
    points: list[dict[str, Any]] = curve["points"]
    probes = [name.removesuffix(SUFFIX) for name in points[0] if name.endswith(SUFFIX)]
    length, factor = shown("m", max(point[probe + SUFFIX] for point in points for probe in probes))
    axis = f"{curve['key']} ({curve['unit']})"
    texts = [_point_words(point, curve) for point in points]
    motion, multiplier = list[ChartCurve](), list[ChartCurve]()
    for branch, part in branch_parts(points):
        suffix = "" if branch == 1 else f", branch {branch}"
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
    return ReportSection("Response curve", "response-curve", blocks)


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
        f"{name.removesuffix(SUFFIX)}: {size_words(point[name], 5)} peak to peak" for name in point if SUFFIX in name
    ]
    text += [
        f"{name.removesuffix('.peak_force')}: {point[name]:.5g} N" for name in point if name.endswith(".peak_force")
    ]
    text.append(f"{point['kind']}, largest multiplier {point['largest_multiplier']:.4g}")
    return "\n".join([*text, *([point["event"]] if point["event"] else [])])


def _probes(probes: Mapping[str, Mapping[str, Any]]) -> TableBlock:
    unit, factor = shown("m", max(max(abs(one["mean"]), one["peak_to_peak"]) for one in probes.values()))
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


COMPARISON_FILE, PICTURE = "comparison.json", "comparison.png"
_KEYS = ("a", "b", "agree", "verdict", "tolerance", "runs", "figures", "waveforms", "costs", "notes")


def comparison_sections(folder: Path, command: str) -> list[ReportSection]:
    """Return the sections on a comparison by `gapbeam compare`.

    Args:
        folder: As `gapbeam compare` left it.
        command: Command that makes the report.

    Raises:
        ResultsError: The file cannot be read, or is no comparison.
    """
    found = read_object(folder / COMPARISON_FILE, _KEYS)
    blocks = comparison_blocks(found, command)
    pair = Path(found["a"]), Path(found["b"])
    if (folder / PICTURE).is_file():
        words = "Waveforms of A and B over each other, and their harmonics."
        blocks.append(Picture(folder / PICTURE, words, shell_command("gapbeam", "compare", *pair)))
    blocks.append(Command(shell_command("gapbeam", "report", *pair)))
    return [ReportSection("A against B", "comparison", blocks)]


def comparison_blocks(found: Mapping[str, Any], command: str) -> list[Block]:
    """Return verdict and tables of a comparison.

    Args:
        found: As `gapbeam.postprocess.comparison_report.as_data` gives it.
        command: Command that makes the report.
    """
    blocks: list[Block] = [Verdict("passed" if found["agree"] else "warning", sentence(str(found["verdict"])))]
    blocks += warnings_of([str(note) for note in found["notes"]])
    runs = [
        (
            name.upper(), found[name], run["periodicity"], run["windows"], run["forcing_periods_in_a_window"],
            float(run["start"]), float(run["end"]),
        )
        for name, run in found["runs"].items()
    ]  # fmt: skip
    heads = ("", "results", "response", "windows", "forcing periods in a window", "from (s)", "to (s)")
    blocks.append(TableBlock("The runs, and the windows over which they are compared", heads, runs))
    figures: list[tuple[Cell, ...]] = []
    for row in found["figures"]:
        unit, factor = shown_by(row["unit"], (row["a"], row["b"]))
        difference = row["difference"]
        figures.append(
            (
                f"{row['name']} ({unit})", factor * row["a"], factor * row["b"],
                None if difference is None else 100.0 * difference, "" if row["decides"] else "reported only",
            )
        )  # fmt: skip
    blocks.append(
        TableBlock(
            f"Figures over the windows; more than {100 * found['tolerance']:g} % is a difference",
            ("", "A", "B", "difference (%)", ""),
            figures,
            command=command,
        )
    )
    waves = [(one["name"], 100.0 * one["rms"], 100.0 * one["largest"]) for one in found["waveforms"]]
    if waves:
        blocks.append(TableBlock("Waveforms, A − B over the range", ("", "rms (%)", "largest (%)"), waves, digits=3))
    costs = [(one["name"], one["a"], one["b"]) for one in found["costs"]]
    if costs:
        blocks.append(TableBlock("Costs", ("", "A", "B"), costs))
    return blocks


LIFE_FILE = "life.json"
KEYS = ("reached", "message", "limit", "faces", "states", "relative_chance", "block_error", "verdict")
HOUR = 3600.0
HEADER = ("time (s)", "face", "depth (m)", "depth rate (m/s)", "95 % interval", "judged")


def life_sections(folder: Path, command: str) -> list[ReportSection]:
    """Return the life, charts of depths and rates, and their table.

    Args:
        folder: As `gapbeam life` left it.
        command: Command that makes the report.

    Raises:
        ResultsError: The file cannot be read, or is no such study.
    """
    found = read_object(folder / LIFE_FILE, KEYS)
    faces, states = found["faces"], found["states"]
    good = found["reached"] and found["verdict"] == "good"
    summary: list[Block] = [Verdict("passed" if good else "warning", str(found["message"]))]
    if found["reached"]:
        summary.append(
            Words(
                f"Chance in the rates: half of the 95 % interval is {100.0 * found['relative_chance']:.2g} %. "
                f"Length of the blocks: {number(found['block_error'])} s. Coefficients and areas count as exact."
            )
        )
    rows = [
        (state["time"], face, depth, rate, f"{number(low)} to {number(high)}", verdict)
        for state in states
        for face, depth, rate, low, high, verdict in zip(
            faces, *(state[key] for key in ("depths", "depth_rates", "low", "high", "verdicts")), strict=True
        )
    ]
    unit, factor = shown_by("m", (depth for state in states for depth in state["depths"]))
    charts = [
        Chart("Depths of the faces", "time (h)", f"depth ({unit})", _curves(states, faces, "depths", factor), command),
        Chart(
            "How fast they wear", "time (h)", "depth rate (m/s)", _curves(states, faces, "depth_rates", 1.0), command
        ),
    ]
    charts += _profiles(found.get("profiles", {}), command)
    return [
        ReportSection("Life", "life", summary),
        ReportSection("Over time", "over-time", charts),
        ReportSection("Runs", "runs", [TableBlock("Depths and rates at the end of each block", HEADER, rows)]),
    ]


def _profiles(profiles: Mapping[str, Mapping[str, Sequence[float]]], command: str) -> list[Chart]:
    """Return charts of the final wear depth along the beam and, for faces all around it, around it."""
    charts = []
    unit, factor = shown_by("m", (depth for one in profiles.values() for depth in one["depth"]))
    for key, title, label in (
        ("x", "Worn profiles along the beam", "x (m)"),
        ("angle", "Worn profiles around the beam", "angle from straight down (deg)"),
    ):
        curves = []
        for face, one in profiles.items():
            places, owners = distinct(one[key])
            if key == "x" or len(places) > 1:
                deepest = np.zeros(len(places))
                np.maximum.at(deepest, owners, factor * np.array(one["depth"]))
                curves.append(ChartCurve(face, places, deepest, "lines+markers"))
        if curves:
            charts.append(Chart(title, label, f"depth of the deepest point ({unit})", curves, command))
    return charts


def _curves(states: Sequence[dict[str, Any]], faces: Sequence[str], key: str, factor: float) -> list[ChartCurve]:
    hours = [state["time"] / HOUR for state in states]
    values = [[factor * value for value in state[key]] for state in states]
    return [
        ChartCurve(face, hours, [row[place] for row in values], "lines+markers") for place, face in enumerate(faces)
    ]
