"""The picture of a sweep: titles apart, and one column where the keys vary side by side."""

from __future__ import annotations

from itertools import combinations
from pathlib import Path

import pytest
from matplotlib.figure import Figure

from gapbeam.postprocess.report.sections.sweep_section import axis_of
from gapbeam.postprocess.study_figures.sweep_branches import Branch, SweepPoint, draw_branches

FIGURES = {"tip smoothed acceleration": {"mean": 30.0, "scatter": 1.0, "unit": "m/s^2"}}
LONG = "load.shaker.amplitude"


def drawn(path: Path, points: list[dict[str, str]], monkeypatch: pytest.MonkeyPatch) -> Figure:
    """Draw a sweep with one response at every point, and return the figure as it was saved."""
    figures: list[Figure] = []
    save = Figure.savefig

    def kept(self: Figure, *arguments: object, **options: object) -> None:
        figures.append(self)
        save(self, *arguments, **options)  # type: ignore[arg-type]

    monkeypatch.setattr(Figure, "savefig", kept)
    record = {"figures": FIGURES, "direction": "", "start": "seat", "verdict": "passed"}
    draw_branches([SweepPoint(one, (Branch(one, "period 1", (record,)),), ()) for one in points], path)
    figures[0].draw_without_rendering()  # at the resolution of the window, in which extents are given
    return figures[0]


def overlapping(figure: Figure) -> list[tuple[str, str]]:
    """Return pairs of titles and names of axes that are printed over each other."""
    texts = [text for panel in figure.axes for text in (panel.title, panel.xaxis.label, panel.yaxis.label)]
    boxes = [(text.get_text(), text.get_window_extent()) for text in texts if text.get_text()]
    return [(one, other) for (one, a), (other, b) in combinations(boxes, 2) if a.overlaps(b)]


def test_keys_side_by_side_share_one_panel(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    points = [{LONG: str(5 * n), "support.clearance": f"{n}e-5"} for n in range(1, 13)]
    figure = drawn(tmp_path / "a.png", points, monkeypatch)
    [panel] = figure.axes
    assert len(panel.collections) >= 12
    assert panel.get_xlabel().split("\n") == ["support.clearance (mm)", f"with {LONG} = 5 to 60"]
    assert overlapping(figure) == []
    assert axis_of(points).choices == ()


@pytest.mark.parametrize("count", [2, 5, *(pytest.param(one, marks=pytest.mark.slow(minutes=0.1)) for one in (4, 12))])
def test_titles_of_a_grid_are_apart(tmp_path: Path, count: int, monkeypatch: pytest.MonkeyPatch) -> None:
    points = [
        {LONG: f"{n}.125", "contact.law.restitution": "0.75", "support.clearance": f"{m}e-5"}
        for n in range(count)
        for m in range(3)
    ]
    figure = drawn(tmp_path / "a.png", points, monkeypatch)
    assert len(figure.axes) == count
    assert overlapping(figure) == []
    assert len(axis_of(points).choices) == count


def test_the_axis_is_a_key_that_varies(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    points = [{LONG: f"{n}", "support.clearance": "1e-4"} for n in range(6)]
    figure = drawn(tmp_path / "a.png", points, monkeypatch)
    assert [panel.get_xlabel() for panel in figure.axes] == [LONG]
    assert axis_of(points).key == LONG
