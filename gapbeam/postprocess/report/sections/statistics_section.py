"""The statistics of a run under random loads, with intervals."""

from __future__ import annotations

from typing import Any

from gapbeam.postprocess.report.blocks import ReportSection, TableBlock, Words
from gapbeam.postprocess.report.number_text import number, percent

HEADER = ("figure", "value", "unit", "95 % interval", "effective samples", "judged", "s for 2 %")
TIME_NEEDED = "time_for_2_percent"


def statistics_section(summary: dict[str, Any], anchor: str = "statistics") -> ReportSection | None:
    """Return the statistics of a run; None for a run without any.

    Args:
        summary: Of a run.
        anchor: Of the section.
    """
    found = summary.get("statistics")
    if not found:
        return None
    if not found["figures"]:
        words = f"The record of {number(found['seconds'])} s is too short for statistics."
        return ReportSection("Statistics", anchor, [Words(words)])
    words = (
        f"Over {number(found['seconds'] - found['burn_in'])} s behind the first {number(found['burn_in'])} s. Only "
        "intervals judged good can be relied on."
    )
    until = found.get("until")
    if until is not None:
        met = "ended the run" if until.get("narrow", until["met"]) else "was not reached"
        words += f" The error of {percent(until['relative_error'], signed=False)} asked for `{until['figure']}` {met}."
        if "doubt_words" in until:
            words += f" The figure is in doubt: {until['doubt_words']}."
    energy = found.get("scheme_bias", {}).get("energy")
    if energy:
        side = "less" if energy < 0.0 else "more"
        words += (
            f" The scheme leaves the motion {percent(abs(energy), signed=False)} {side} energy than the noise gives."
        )
    rows = [_row(one) for one in found["figures"]]
    return ReportSection("Statistics", anchor, [Words(words), TableBlock("Figures of the motion", HEADER, rows)])


def _row(one: dict[str, Any]) -> tuple[str, float, str, str, str, str, str]:
    needed = one[TIME_NEEDED]
    return (
        one["name"],
        one["value"],
        "" if one["unit"] == "1" else one["unit"],
        f"{number(one['low'])} to {number(one['high'])}",
        f"{one['effective_samples']:.0f}",
        one["verdict"],
        "" if needed is None else number(needed),
    )
