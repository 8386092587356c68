"""Pictures and reports of cases of any size: axes have units in which their numbers can be read."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import gapbeam
from gapbeam.postprocess.display_units import POWERS, PREFIXES
from gapbeam.postprocess.report import html_page
from gapbeam.postprocess.report.charts import Chart
from gapbeam.postprocess.scene.sheet import Sheet
from tests.shared.scaled_cases import SIMILAR_CASES, SIZES, scaled_tables

UNITS = {prefix + unit for unit in PREFIXES for prefix in POWERS}
LEAST, MOST = 1e-3, 2e4  # of the largest number on an axis
ROUND_OFF = 1e-12  # in SI units, whose powers of ten stand beside the axis
FORCE = {"name": "force", "quantity": "contact_force", "place": "gland", "statistic": "maximum"}
FOUND = list[tuple[str, np.ndarray]]


def on_panel(panel: Axes) -> FOUND:
    """Return labels and numbers of both axes of a panel without logarithms."""
    lines = [line for line in panel.get_lines() if line.get_transform() == panel.transData]
    found: FOUND = []
    for label, scale, parts in (
        (panel.get_xlabel(), panel.get_xscale(), [line.get_xdata() for line in lines]),
        (panel.get_ylabel(), panel.get_yscale(), [line.get_ydata() for line in lines]),
    ):
        if scale == "linear" and parts:
            found.append((label, np.concatenate([np.ravel(np.asarray(part, dtype=float)) for part in parts])))
    return found


def on_chart(chart: Chart) -> FOUND:
    """Return the same of a chart of a report."""
    found: FOUND = []
    if chart.curves and not chart.log_x:
        found.append((chart.x, np.concatenate([np.asarray(one.x, dtype=float) for one in chart.curves])))
    if chart.curves and not chart.log_y:
        found.append((chart.y, np.concatenate([np.asarray(one.y, dtype=float) for one in chart.curves])))
    return found


def unreadable(found: FOUND) -> Iterator[str]:
    """Yield labels of axes whose largest number has many zeros behind or before the point."""
    for label, values in found:
        unit, sizes = re.findall(r"\(([^()]*)\)$", label), np.abs(values[np.isfinite(values)])
        nothing = not sizes.size or sizes.max() == 0.0 or (unit and unit[0] in PREFIXES and sizes.max() < ROUND_OFF)
        if unit and unit[0] in UNITS and not nothing and not LEAST <= sizes.max() < MOST:
            yield f"{label}: {sizes.max():.3g}"


@pytest.fixture
def found(monkeypatch: pytest.MonkeyPatch) -> FOUND:
    """Labels and numbers of all axes that a test draws: of pictures, films and charts of reports."""
    found: FOUND = []
    save, chart_figure, fill = Figure.savefig, html_page.chart_figure, Sheet.fill

    def saved(figure: Figure, *args: Any, **options: Any) -> None:
        for panel in figure.axes:
            found.extend(on_panel(panel))
        save(figure, *args, **options)

    def filled(sheet: Sheet, *args: Any, **options: Any) -> Any:
        picture = fill(sheet, *args, **options)
        for panel in sheet.figure.axes:
            found.extend(on_panel(panel))
        return picture

    def charted(chart: Chart) -> Any:
        found.extend(on_chart(chart))
        return chart_figure(chart)

    monkeypatch.setattr(Figure, "savefig", saved)
    monkeypatch.setattr(Sheet, "fill", filled)
    monkeypatch.setattr(html_page, "chart_figure", charted)
    return found


def shipped(name: str, size: float) -> dict[str, Any]:
    """Return the tables of a shipped case at a size."""
    return scaled_tables(next(one for one in SIMILAR_CASES if one.name == name).case(), size)


@pytest.mark.parametrize("size", SIZES)
def test_numbers_on_axes_of_a_sweep_can_be_read(size: float, found: FOUND, tmp_path: Path) -> None:
    """Of its picture and of its report, over two clearances."""
    keys = {"support.clearance": [0.107e-3 * size, 0.16e-3 * size]}
    gapbeam.sweep(shipped("stability", size) | {"figure": [FORCE]}, keys, output=tmp_path / "sweep", workers=1)
    gapbeam.report(tmp_path / "sweep")
    assert {"clearance", "force"} <= {re.split(r"[\n ]", label)[0].rsplit(".")[-1] for label, _ in found}
    assert sorted(set(unreadable(found))) == []


@pytest.mark.parametrize("size", [SIZES[0], pytest.param(1.0, marks=pytest.mark.slow(minutes=0.1)), SIZES[1]])
@pytest.mark.parametrize("name", ["cantilever-stop", "stability"])
def test_numbers_on_axes_can_be_read(name: str, size: float, found: FOUND, tmp_path: Path) -> None:
    """Nothing on an axis is a thousandth of its unit, or twenty thousand of it, at any size."""
    gapbeam.run(shipped(name, size), output=tmp_path / "run")
    gapbeam.plot(tmp_path / "run")
    gapbeam.report(tmp_path / "run")
    gapbeam.render(tmp_path / "run", frames=2)
    assert len({label for label, _ in found}) > 8
    assert sorted(set(unreadable(found))) == []
