"""The picture of a sweep: titles apart, and one column where the keys vary side by side."""

from __future__ import annotations

import csv
from itertools import combinations, pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure
from PIL import Image

import gapbeam as gb
import gapbeam.studies
from gapbeam.postprocess.figures.figure_style import panels, write_figure
from gapbeam.postprocess.study_figures.study_axis import axis_of, cell_edges, is_logarithmic
from gapbeam.postprocess.study_figures.sweep_branches import Branch, SweepPoint, census, draw_branches, draw_map
from gapbeam.solver.scene_file.scene_reader import scene_file
from gapbeam.studies.atlas.run_atlas import give_units
from gapbeam.studies.sweep.sweep_tables import write_tables

FIGURES = {"tip smoothed acceleration": {"mean": 30.0, "scatter": 1.0, "unit": "m/s^2"}}
LONG = "load.shaker.amplitude"
UNITS = {"support.clearance": "m", LONG: "N", "contact.law.restitution": "no unit"}


def drawn(path: Path, points: list[dict[str, str]], monkeypatch: pytest.MonkeyPatch) -> Figure:
    """Draw a sweep with one response at every point, and return the figure as it was saved."""
    figures: list[Figure] = []
    save = Figure.savefig

    def kept(self: Figure, *arguments: object, **options: object) -> None:
        figures.append(self)
        save(self, *arguments, **options)  # type: ignore[arg-type]

    monkeypatch.setattr(Figure, "savefig", kept)
    record = {"figures": FIGURES, "direction": "", "start": "seat", "verdict": "passed"}
    entries = [SweepPoint(one, (Branch("period 1", (record,)),), (), UNITS) for one in points]
    draw_branches(entries, path)
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
    assert panel.get_xlabel().split("\n") == ["support.clearance (mm)", f"with {LONG} = 5 N to 60 N"]
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
    assert [panel.get_xlabel() for panel in figure.axes] == [f"{LONG} (N)"]
    assert axis_of(points).key == LONG


@pytest.mark.parametrize("seed", range(5))
def test_axes_follow_the_spacing_of_their_values(seed: int) -> None:
    """Values even in the logarithm over a decade or more have a logarithmic axis, even ones none; cells hold them."""
    random = np.random.default_rng(seed)
    first, count = 10.0 ** random.uniform(-6.0, 9.0), int(random.integers(3, 12))
    spread = np.geomspace(first, first * 10.0 ** random.uniform(1.1, 6.0), count)
    even = np.linspace(first, first * random.uniform(20.0, 500.0), count)
    assert is_logarithmic(spread)
    assert not is_logarithmic(even)
    assert not is_logarithmic(-spread)
    assert not is_logarithmic(spread[:2])
    for values in (spread, even):
        edges = cell_edges(values)
        assert len(edges) == count + 1
        assert np.all(edges[:-1] < values)
        assert np.all(values < edges[1:])
        assert is_logarithmic(values) == bool(edges[0] > 0.0 and np.allclose(np.diff(np.log(edges), 2), 0.0))


def test_a_wide_range_fills_its_axis(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    points = [{"support.clearance": f"{n}e-5", LONG: f"1e{m}"} for n in (1, 2, 3) for m in range(4)]
    figure = drawn(tmp_path / "a.png", points, monkeypatch)
    for panel in figure.axes:
        low, high = panel.get_xlim()
        assert panel.get_xscale() == "log"
        assert 0.1 < low < 1.0
        assert 1e3 < high < 1e4
    assert [panel.get_title() for panel in figure.axes] == [f"support.clearance = 0.0{n} mm" for n in (1, 2, 3)]
    assert draw_map([SweepPoint(one, (), (), UNITS) for one in points[:2]], tmp_path / "b.png") is None


def test_a_figure_drawn_elsewhere_has_the_dots_of_its_style(tmp_path: Path) -> None:
    figure, _ = panels(1, width=4.0)
    write_figure(figure, tmp_path / "a.png")
    assert Image.open(tmp_path / "a.png").width == 1200
    written = Path(gapbeam.studies.__file__).parent.rglob("*.py")
    assert [path.name for path in written if ".savefig(" in path.read_text()] == []


@pytest.mark.parametrize(
    ("key", "unit"),
    [
        ("pair.gap.region.clearance", "m"), ("gap.clearance", "m"), ("g*.stiffness", "N/m"), ("soft.stiffness", "N/m"),
        ("load.shaker.frequency", "Hz"), ("shaker.amplitude", "N"), ("structure.a.model.mass", "kg"),
        ("gap.nothing", ""), ("time.end", "s"),
    ],
)  # fmt: skip
def test_keys_of_structures_have_units(key: str, unit: str) -> None:
    """By tables, by names of entries, and by paths of the scene, with the law of a pair or of all."""
    law = {"type": "kelvin-voigt", "stiffness": 1e6}
    slot = {"type": "slot", "clearance": 1e-3}
    tables = {
        "structure": [{"name": "a", "model": {"type": "mass", "mass": 1.0, "stiffness": 1e4}}],
        "contact": {"law": law},
        "pair": [
            {"name": "gap", "between": ["a.at"], "region": slot, "law": law},
            {"name": "soft", "between": ["a.at"], "region": slot},
        ],
        "load": [{"type": "harmonic_force", "name": "shaker", "point": "a.at", "amplitude": 1.0, "frequency": 9.0}],
        "time": {"end": 1.0},
    }
    assert scene_file(tables).unit_of(key) == unit


@pytest.mark.parametrize(("windows", "own", "known"), [(1, False, False), (3, False, True), (3, True, False)])
def test_one_window_has_no_scatter(windows: int, own: bool, known: bool, tmp_path: Path) -> None:
    """A standard deviation of one number, or of a figure over the whole record, is unknown and not 0."""
    figure = {"mean": 1.0, "scatter": 0.0, "unit": "m"} | ({"own": True} if own else {})
    record = {
        "values": {"support.clearance": "1e-4"}, "direction": "", "start": "seat", "verdict": "passed", "message": "",
        "notes": [], "response": "period 1", "windows": windows, "figures": {"tip displacement": figure},
    }  # fmt: skip
    write_tables(tmp_path, [record], census([record], 0.02))
    [row] = csv.DictReader((tmp_path / "sweep.csv").open(encoding="utf-8"))
    assert row["tip displacement (m)"] == "1.0"
    assert row["tip displacement scatter (m)"] == ("0.0" if known else "")


def panel_heights(figure: Figure) -> list[float]:
    """Return the heights of the panels as they are drawn, over the height of the figure."""
    figure.draw_without_rendering()
    return [panel.get_position().height for panel in figure.axes]


@pytest.mark.parametrize("values", [[0.5], [-2.0], [0.0], [0.5, 0.6]])
def test_an_atlas_at_any_number_of_values_is_drawn(values: list[float]) -> None:
    """A single value has a band of its own; without it the panels had no height. Starts at one place are dots."""
    body = gb.mass(1.0, stiffness=1.0, damping=0.4, name="body")
    stop = gb.Contact(body["at"], gb.HalfPlane(4.0), gb.KelvinVoigt(stiffness=3.0), name="stop")
    push = gb.Force(body["at"], lambda t, size: np.cos(2.6 * t) + size, name="push", size=0.0)
    scene = gb.Scene(body, contacts=[stop], loads=[push])
    starts = gb.drawn_starts(scene, 5, velocity={"at": (-1.0, 1.0)})
    asked: dict[str, Any] = {"period": 2.0 * np.pi / 2.6, "starts": starts, "steps": 60, "settle": 20}
    found = gb.atlas(scene, over={"push.size": np.array(values)}, **asked)
    assert min(panel_heights(gb.draw_responses(found, "at"))) > 0.3
    [panel] = gb.draw_basins(found, ("at", "velocity"), ("at", "displacement"), scene).axes
    assert len(panel.collections[0].get_offsets()) == 5
    assert panel.get_xlabel() == "at: velocity at the start (m/s)"


@pytest.mark.parametrize("size", [1e-3, 1.0, 1e6])
def test_names_of_ticks_of_a_map_are_apart(size: float) -> None:
    body = gb.mass(1.0, stiffness=1.0, damping=0.4, name="body")
    load = {"size": 0.0, "more": 0.0}
    push = gb.Force(body["at"], lambda t, size, more: np.cos(2.6 * t) + 0.0 * (size + more), name="push", **load)
    over = {"push.size": size * np.array([0.5, 1.0, 1.5]), "push.more": size * np.array([0.5, 0.75, 1.25])}
    scene = gb.Scene(body, loads=[push])
    found = gb.atlas(scene, over=over, period=2.0 * np.pi / 2.6, starts=scene.state(), steps=40, settle=20)
    figure = gb.draw_responses(found, "at")
    give_units(figure, over, {"push.size": "N"})
    figure.draw_without_rendering()
    for panel in figure.axes[:2]:
        assert (panel.get_xlabel(), panel.get_ylabel()) == ("push.size (N)", "push.more")
        boxes = [label.get_window_extent() for label in panel.get_xticklabels() if label.get_text()]
        assert not any(one.overlaps(other) for one, other in pairwise(boxes))
