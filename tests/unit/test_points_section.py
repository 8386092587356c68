"""The section of reports on contact points: what was touched first, where most is pressed, and nothing made up."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from gapbeam.postprocess.report.blocks import TableBlock
from gapbeam.postprocess.report.charts import Chart
from gapbeam.postprocess.report.html_page import html_of
from gapbeam.postprocess.report.sections.statistics_section import points_section
from gapbeam.postprocess.results.columns_of_run import points_of
from tests.shared.reports import report_on
from tests.unit.test_contact_map import AREA, map_of, ring, run_with


def plane(x: np.ndarray, share: np.ndarray) -> np.ndarray:
    """Return rows of points of a stop, two across the beam at each place."""
    count, pressed = 2 * len(x), np.repeat(share, 2)
    touched = np.where(pressed > 0.0, 0.01 / np.maximum(pressed, 1e-9), np.nan)
    across = np.tile([-1e-3, 1e-3], len(x))
    columns = (
        np.repeat(x, 2),
        across,
        np.zeros(count),
        np.full(count, AREA),
        pressed,
        1e-6 * pressed,
        0.1 * pressed,
        touched,
    )
    return np.column_stack(columns)


STOP = plane(np.array([0.9, 0.95, 1.0]), np.array([0.0, 0.5, 0.25]))


def test_tables_name_the_points(tmp_path: Path) -> None:
    """The first touch and the largest impulse per area stand where the rows have them; a plane has no angle."""
    section = points_section(points_of(run_with(tmp_path, {"collar_hole": ring(), "stop_below": STOP})), "c")
    assert section is not None
    first, pressed = (block for block in section.blocks if isinstance(block, TableBlock))
    assert first.rows[0][:5] == ("collar_hole", "18 of 36", pytest.approx(1.45e-3), pytest.approx(450.0), -135.0)
    assert first.rows[1] == (
        "stop_below", "4 of 6", pytest.approx(0.02), pytest.approx(950.0), None, pytest.approx(50.0), pytest.approx(0.5)
    )  # fmt: skip
    assert pressed.rows[1][:2] == ("stop_below", pytest.approx(0.15))
    assert pressed.rows[1][2:4] == (pytest.approx(0.05 / AREA), pytest.approx(2.0))


def test_charts_have_the_means_by_area(tmp_path: Path) -> None:
    """Along the beam for all faces, around it for those that are met in several directions."""
    section = points_section(points_of(run_with(tmp_path, {"collar_hole": ring(), "stop_below": STOP})), "c")
    assert section is not None
    charts = [block for block in section.blocks if isinstance(block, Chart)]
    assert [(chart.x.split(" (")[0], [curve.name for curve in chart.curves]) for chart in charts] == 2 * [
        ("x", ["collar_hole", "stop_below"]), ("angle from straight down", ["collar_hole"]),
    ]  # fmt: skip
    stop = charts[0].curves[1]
    assert stop.x == pytest.approx([900.0, 950.0, 1000.0])
    assert stop.y == pytest.approx([0.0, 50.0, 25.0])


def test_what_is_not_known_is_left_out() -> None:
    """Faces without impulses have no such row; without contact there is one sentence, without points no section."""
    rows = ring()
    rows[:, 6] = np.nan
    section = points_section({"collar_hole": map_of(rows)})
    assert section is not None
    assert [block.caption for block in section.blocks if isinstance(block, TableBlock)] == ["What was touched"]
    rows[:, 4], rows[:, 7] = 0.0, np.nan
    quiet = points_section({"collar_hole": map_of(rows)})
    assert quiet is not None
    assert len(quiet.blocks) == 1
    assert points_section({}) is None


def test_the_page_has_them(tmp_path: Path) -> None:
    """Behind the contact forces and before the energy; a run without points has none."""
    text = html_of(report_on([run_with(tmp_path, {"stop_below": STOP})], "c"))
    places = [text.index(f'id="{name}"') for name in ("contact", "contact-points", "energy")]
    assert places == sorted(places)
    assert re.search(r"What was touched", text)
