"""Reports on atlases (stable responses with their shares, chaos), on searches for a least figure, and on libraries."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

from gapbeam.postprocess.display_units import sized_columns
from gapbeam.postprocess.report.blocks import (
    Block,
    Cell,
    ReportSection,
    TableBlock,
    Verdict,
    Words,
    number,
    picture_section,
)
from gapbeam.postprocess.report.study_json import read_object, read_records
from gapbeam.postprocess.study_figures.study_axis import si_key
from gapbeam.solver.messages.wording import counted
from gapbeam.solver.schema.record_table import faces_of, unit_of_places, unit_where

ATLAS_FILE, ATLAS_PICTURE = "atlas.json", "atlas-responses.png"
ATLAS_KEYS = ("values", "responses", "chaotic", "unsettled", "failed")
Record = Mapping[str, Any]


def responses_of(records: Sequence[Record]) -> tuple[tuple[str, ...], list[tuple[Cell, ...]]]:
    """Return heads and rows of a table: one row for each response, and for chaotic and unsettled starts."""
    keys = tuple(records[0]["values"])
    probes = tuple(dict.fromkeys(name for one in records for r in one["responses"] for name in r["peak"]))
    own = tuple(dict.fromkeys(name for one in records for r in one["responses"] for name in r.get("figures", ())))
    turning = records[0].get("turning", ())
    pressed = faces_of(dict.fromkeys(name for one in records for r in one["responses"] for name in r["peak_force"]))
    heads = (*keys, "response", "share", "from", "to", "largest multiplier", "impacts a period",
             f"force ({unit_of_places('N', (names[0] for names in pressed.values()), turning)})",
             *(f"{name}: peak ({unit_where('m', name in turning)})" for name in probes), *own)  # fmt: skip
    rows: list[tuple[Cell, ...]] = []
    for one in records:
        values = tuple(float(one["values"][key]) for key in keys)
        for r in one["responses"]:
            forces, impacts = ([r[key][name] for name in _whole(r[key])] for key in ("peak_force", "impacts"))
            peaks = (float(r["peak"][name]) if name in r["peak"] else None for name in probes)
            rows.append((
                *values, _kind(r), float(r["share"]), *map(float, r["interval"]),
                float(r["largest_multiplier"]), float(max(impacts, default=0.0)), float(max(forces, default=0.0)),
                *peaks, *(r.get("figures", {}).get(name) for name in own),
            ))  # fmt: skip
        for word in ("chaotic", "unsettled", "failed"):
            if one[word]:
                rows.append((*values, word, float(one[word]), *(None for _ in range(5 + len(probes) + len(own)))))
    return heads, rows


def shown_responses(records: Sequence[Record]) -> tuple[tuple[str, ...], list[tuple[Cell, ...]]]:
    """Return the table for readers: keys and figures of one's own with their units, in units that follow the size."""
    heads, rows = responses_of(records)
    return sized_columns([si_key(head, records[0].get("units", {})) for head in heads], rows)


def _whole(contacts: Iterable[str]) -> list[str]:
    """Return the faces that have an entry, and contacts of no such face."""
    return [face if face in names else str(name) for face, names in faces_of(contacts).items() for name in names]


def _kind(response: Record) -> str:
    """Return the kind of a response in words."""
    if response["order"] == 0:
        return "rest"
    if response.get("frequencies"):
        return f"two frequencies, {' and '.join(f'{float(one):.4g}' for one in response['frequencies'])} Hz"
    period = response.get("period")
    return f"order {response['order']}" if period is None else f"cycle of {1.0 / float(period):.4g} Hz"


def atlas_sections(folder: Path, command: str) -> list[ReportSection]:
    """Return the verdict, the picture and the table of all responses.

    Args:
        folder: As `gapbeam atlas` left it.
        command: Command that makes the report.

    Raises:
        ResultsError: The file cannot be read, or is no such study.
    """
    del command
    records = read_records(folder / ATLAS_FILE, ATLAS_KEYS)
    left = sum(float(one["unsettled"]) + float(one["failed"]) for one in records) / len(records)
    several = sum(len(one["responses"]) + bool(one["chaotic"]) > 1 for one in records)
    found = sum(len(one["responses"]) for one in records)
    text = f"{counted(found, 'stable response')} at {counted(len(records), 'point')}; several at {several}."
    blocks: list[Block] = [
        Verdict("warning", f"{text} {left:.1%} of the starts did not settle.") if left else Verdict("passed", text)
    ]
    heads, rows = shown_responses(records)
    blocks.append(
        TableBlock(
            "All responses: shares with 95 % intervals; impacts and force of the support face that has most",
            heads,
            rows,
            digits=4,
        )
    )
    caption = "Responses over the keys, or over the starts; gray: chaotic, yellow: not settled."
    return [
        ReportSection("Summary", "summary", blocks),
        *picture_section(folder / ATLAS_PICTURE, caption, "gapbeam atlas"),
    ]


ALIKE = 0.03
"""Largest difference of peaks, relative to the largest of them, up to which a response lies on a curve."""


def beside_curve(curve: Mapping[str, Any], records: Sequence[Record]) -> ReportSection | None:
    """Return the responses of an atlas over the key of a response curve that do not lie on it, also chaotic ones.

    A response lies on the curve where a branch passes its value with the same largest displacements of all probes, and
    the period of the branch is a multiple of its own.

    Args:
        curve: Contents of curve.json.
        records: Contents of atlas.json.

    Returns:
        None: the atlas is not over that key alone, or at no value of the curve.
    """
    key, points = curve["key"], curve["points"]
    ends = [float(point["value"]) for point in points]
    inside = [one for one in records if list(one["values"]) == [key] and min(ends) <= one["values"][key] <= max(ends)]
    if not inside:
        return None
    others = [
        one | {"responses": [r for r in one["responses"] if not _is_on(r, float(one["values"][key]), curve)]}
        for one in map(dict, inside)
    ]
    left = [one for one in others if one["responses"] or one["chaotic"]]
    at = f"at {counted(len(inside), 'value')} of {key}"
    if not left:
        text = f"All responses that the atlas knows {at} lie on the curve."
        return ReportSection("Other responses", "other-responses", [Verdict("passed", text)])
    count, chaos = sum(len(one["responses"]) for one in left), sum(bool(one["chaotic"]) for one in left)
    found = ", ".join([counted(count, "response")] * bool(count) + [f"chaos at {chaos}"] * bool(chaos))
    words = f"Of what the atlas knows {at}, not on the curve: {found}."
    heads, rows = shown_responses(left)
    table = TableBlock("Responses beside the curve: shares of the starts with 95 % intervals", heads, rows, digits=4)
    return ReportSection("Other responses", "other-responses", [Verdict("warning", words), table])


def _is_on(response: Record, value: float, curve: Mapping[str, Any]) -> bool:
    """Return whether a response lies on a curve."""
    if response["order"] < 1 or curve["periods"] % response["order"]:
        return False
    known = curve["points"][0]
    peaks = {f"{name}.peak": float(one) for name, one in response["peak"].items() if f"{name}.peak" in known}
    for a, b in pairwise(curve["points"]):
        low, high = float(a["value"]), float(b["value"])
        if a["branch"] != b["branch"] or (low - value) * (high - value) > 0.0:
            continue
        part = (value - low) / (high - low) if high != low else 0.0
        off = [abs((1.0 - part) * a[name] + part * b[name] - peak) for name, peak in peaks.items()]
        if max(off, default=1.0) <= ALIKE * max(peaks.values(), default=0.0):
            return True
    return False


OPTIMUM_FILE, OPTIMUM_PICTURE = "optimum.json", "optimum.png"
Rows = list[tuple[Cell, ...]]


def optimum_tables(record: Mapping[str, Any]) -> list[tuple[str, tuple[str, ...], Rows]]:
    """Return caption, heads and rows of the values, and of the figures with their derivatives."""
    values, figures = record["values"], record["figures"]
    names = ("lower", "first", "found", "upper")
    rows: Rows = [(_with_unit(one, "path"), *(float(one[name]) for name in names)) for one in values]
    heads = ("figure", "first", "found", "limit", *(f"by {one['path']}" for one in values))
    found: Rows = []
    for one in figures:
        limit = None if one["limit"] is None else float(one["limit"])
        slopes = (float(one["slopes"][other["path"]]) for other in values)
        found.append((_with_unit(one, "figure"), float(one["first"]), float(one["found"]), limit, *slopes))
    return [
        ("Values of the search", ("value", *names), rows),
        ("Figures of the response at the first and at the found values, and their derivatives there", heads, found),
    ]


def _with_unit(record: Mapping[str, Any], name: str) -> str:
    """Return the name in a record with the unit beside it."""
    return si_key(str(record[name]), {str(record[name]): str(record.get("unit", ""))})


def optimum_sections(folder: Path, command: str) -> list[ReportSection]:
    """Return the verdict, the tables and the picture.

    Args:
        folder: As `gapbeam optimize` left it.
        command: Command that makes the report.

    Raises:
        ResultsError: The file cannot be read, or is no such study.
    """
    del command
    (record,) = read_records(folder / OPTIMUM_FILE, ("headline", "stable", "values", "figures"))
    blocks: list[Block] = [Verdict("passed" if record["stable"] else "warning", str(record["headline"]))]
    blocks += [TableBlock(caption, heads, rows, digits=5) for caption, heads, rows in optimum_tables(record)]
    caption = "Figures, over their limits or first values, and values, in their ranges, of all responses on the way."
    return [
        ReportSection("Summary", "summary", blocks),
        *picture_section(folder / OPTIMUM_PICTURE, caption, "gapbeam optimize"),
    ]


LIBRARY_FILE = "library.json"
LIBRARY_KEYS = ("headline", "rows", "units", "point", "quantity", "period", "periods", "members", "failed", "noise")
LIBRARY_HEADS = ("value", "from", "to", "median relative error", "19 of 20 below")


def library_sections(folder: Path, command: str) -> list[ReportSection]:
    """Return the values that a library estimates with their errors, and the recordings that it takes.

    Args:
        folder: As `gapbeam library` left it.
        command: Command that makes the report.

    Raises:
        ResultsError: The file cannot be read, or is no such study.
    """
    del command
    record = read_object(folder / LIBRARY_FILE, LIBRARY_KEYS)
    rows: Rows = [(si_key(str(path), record["units"]), *map(float, numbers)) for path, *numbers in record["rows"]]
    words = (
        f"Of recordings of the {record['quantity']} at `{record['point']}` over {record['periods']} periods of "
        f"{number(float(record['period']))} s, with noise of up to {100.0 * record['noise']:.3g} % of their rms."
    )
    blocks: list[Block] = [
        Verdict("warning" if record["failed"] or record.get("doubt") else "passed", str(record["headline"])),
        TableBlock("Errors of estimates of members that were held out", LIBRARY_HEADS, rows),
        Words(f"{words} `gapbeam estimate {folder} RECORDING` takes such a recording."),
    ]
    return [ReportSection("Summary", "summary", blocks)]
