"""Comparison of the figures of an error estimate with a reference."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from gapbeam.postprocess.signals.figure_names import MEAN_FORCE
from gapbeam.studies.error_estimate.force_peaks import Averages, Span, key_figures
from gapbeam.studies.error_estimate.motion_record import MotionRecord


def true_errors(summary: Mapping[str, Any], other: MotionRecord) -> Iterator[tuple[dict[str, Any], float]]:
    """Yield each figure that has an error, a row of the summary, with its distance from a reference.

    Args:
        summary: Summary of the run, with its errors.
        other: The motion of the reference.
    """
    errors = summary["errors"]
    for described in errors["spans"]:
        span = Span(**described)
        rows = [row for row in errors["figures"] if row["span"] == span.name]
        means = [row for row in rows if row["name"].endswith(f" {MEAN_FORCE}")]
        forces = {row["name"].removesuffix(f" {MEAN_FORCE}"): row["window"] for row in means}
        exact = key_figures(other, span, Averages(summary["smoothing"]["window"], forces))
        for row in rows:
            if row["error"] is not None:
                yield row, abs(row["value"] - exact[row["name"]].mean)
