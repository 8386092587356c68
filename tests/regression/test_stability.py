"""The grid of trials: axes, verdicts that agree with single runs, map and tables."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import pytest
from PIL import Image

import gapbeam
from gapbeam.postprocess.study_figures.stability_map import QUANTITIES, draw_stability_map
from gapbeam.solver.messages.errors import CaseError, UserError
from gapbeam.studies.engine.workers import Workers
from gapbeam.studies.run_stability import usual_axes
from gapbeam.studies.trials.axes import Axis, read_axis
from gapbeam.studies.trials.response import run_grid, try_case
from tests.shared.command import DEMO, PROJECT, alone, called
from tests.shared.models import beam_case

CASE = PROJECT / "cases" / "stability.toml"
pytestmark = alone
SHORT = ["time.end=0.02", "load.shaker.amplitude=1000", "load.shaker.frequency=50"]


def test_axes_are_lists_and_ranges() -> None:
    """Commas inside braces belong to a value; ranges are even in the logarithm."""
    assert read_axis("contact.stiffness=1e8:1e12:3") == Axis("contact.stiffness", ("1e+08", "1e+10", "1e+12"))
    given = 'time.scheme=newmark,{type="generalized-alpha",rho_inf=0.1}'
    assert read_axis(given).values == ("newmark", '{type="generalized-alpha",rho_inf=0.1}')


@pytest.mark.parametrize("text", ["time.step", "time.step=", "=1,2", "time.step=1:2:x", "time.step=0:1:3", "a=1:2:0"])
def test_faulty_axes_are_explained(text: str) -> None:
    """Neither of the two forms: the error says what was given and what is expected."""
    with pytest.raises(UserError, match="expected"):
        read_axis(text)


@pytest.mark.slow(minutes=0.3)
def test_the_default_scheme_passes_where_newmark_creates_energy() -> None:
    """Stiff contact under hard shaking: the discrete gradient closes its balance to 1e-6, Newmark is caught.

    The stiffness lies well above 1e12 Pa/m, where round-off decides whether Newmark creates or loses energy.
    """
    axes = [read_axis("contact.stiffness=1e13,1e16"), read_axis("time.scheme=discrete-gradient,newmark")]
    shaken = ["load.shaker.amplitude=500", "load.shaker.frequency=100", "load.shaker.ramp=0", "time.end=0.05"]
    records = run_grid(DEMO, shaken, axes)
    assert [record["time.scheme"] for record in records] == ["discrete-gradient", "newmark"] * 2
    for record in records[::2]:
        assert record["verdict"] == "passed"
        assert abs(record["residual"]) < 1e-6
        assert abs(record["created"]) < 1e-6
        assert record["peak_force"] > 60.0  # it did move against its faces
    for record in records[1::2]:
        assert record["verdict"] == "energy created"
        assert record["created"] > 0.0025


def test_a_point_with_faults_is_refused_and_all_refused_is_a_fault() -> None:
    """A step over half the forcing period is refused at its point; when no point is left, the faults are reported."""
    axes = [read_axis("time.step=1e-4,1.2e-2")]
    rows = run_grid(CASE, SHORT, axes, Workers(1))
    assert [row["verdict"] for row in rows] == ["passed", "refused"]
    assert "time.step" in rows[1]["message"]
    with pytest.raises(CaseError):
        run_grid(CASE, SHORT, [read_axis("time.step=1.2e-2,1.3e-2")], Workers(1))


def test_a_trial_that_cannot_converge_is_a_result() -> None:
    """Two iterations, no halving: the verdict says so, with the time that was reached."""
    loads = (
        {"type": "gravity"},
        {"type": "harmonic_force", "point": 0.15, "amplitude": 800.0, "frequency": 50.0, "ramp": 0.01},
    )
    case = beam_case({"time": {"end": 0.02, "step": 1e-4, "max_iterations": 2, "max_halvings": 0}}, loads)
    trial = try_case(case)
    assert trial.verdict == "not converged"
    assert 0.0 < trial.reached < 0.02
    assert "Try" in trial.message


SCHEMES = Axis("time.scheme", ("discrete-gradient",))


def sized(size: float, file: Path) -> Path:
    """Return a case whose lengths and times grow with a size, and whose forces grow with its square."""
    file.write_text(
        f"[beam]\nlength = {size}\nthickness = {0.02 * size}\nwidth = {0.04 * size}\n"
        "[material]\nyoung_modulus = 2.1e11\npoisson_ratio = 0.3\ndensity = 7850.0\n"
        f"[support]\nlength = {0.1 * size}\nclearance = {2e-4 * size}\n"
        '[model]\ntype = "beam"\nelements = 8\n[[load]]\ntype = "harmonic_force"\n'
        f"point = {size}\namplitude = {1e4 * size**2}\nfrequency = {20.0 / size}\n[time]\nend = {0.1 * size}\n",
        encoding="utf-8",
    )
    return file


@pytest.mark.parametrize("size", [1e-4, 0.03, 40.0])
def test_what_is_tried_follows_the_size_of_the_case(size: float, tmp_path: Path) -> None:
    """From 0.1 mm to 40 m: K times size and step over size are those of a meter, with the case's own among them."""
    file = sized(size, tmp_path / "case.toml")
    found, meter = (
        [tuple(map(float, axis.values)) for axis in usual_axes(one, [SCHEMES])]
        for one in (file, sized(1.0, tmp_path / "meter.toml"))
    )
    assert found[0] == pytest.approx([one / size for one in meter[0]], rel=1e-3)
    assert found[1] == pytest.approx([one * size for one in meter[1]], rel=1e-3)
    model = gapbeam.model(file).model
    assert model.step == pytest.approx(found[1][1], rel=1e-3)
    assert {one.key: one.value for one in model.defaults}["contact.stiffness"] == pytest.approx(found[0][2], rel=1e-3)
    (given,) = usual_axes(file, [SCHEMES, Axis("time.step", (f"{0.01 * model.step}",))])
    assert given.key == "contact.stiffness"


def test_a_stiffness_that_acts_nowhere_is_not_varied(tmp_path: Path) -> None:
    """Supports with a stiffness of their own, and exact contact, have one column."""
    own = "support=[{name='a', from=0.0, to=0.1, clearance=2e-4, support_stiffness=1e6}]"
    exact = ["contact.formulation=unilateral", "model={type='reduced', contact='all'}", "mesh.dimension=2"]
    file = sized(1.0, tmp_path / "case.toml")
    assert usual_axes(file, [SCHEMES], [own])[0].values == ("auto",)
    assert usual_axes(file, [Axis("time.scheme", ("moreau-jean",))], exact)[0].values == ("auto",)


@pytest.mark.slow(minutes=0.3)
def test_the_command_writes_map_and_tables(tmp_path: Path) -> None:
    """`gapbeam stability` ends with 0 and leaves a picture, JSON and CSV of every point."""
    arguments = ["stability", str(CASE), *(part for text in SHORT for part in ("--set", text))]
    grid = ["--stiffness", "1e10,1e14", "--step", "1e-4,1e-3", "--scheme", "discrete-gradient,newmark"]
    done = called(*arguments, *grid, "--output", tmp_path / "map")
    assert done.returncode == 0, done.stderr
    assert "discrete-gradient: 4 passed" in done.stdout
    records = json.loads((tmp_path / "map" / "stability.json").read_text(encoding="utf-8"))
    with (tmp_path / "map" / "stability.csv").open(encoding="utf-8") as file:
        assert len(records) == len(list(csv.DictReader(file))) == 8
    for name in ("energy", "residual", "penetration", "iterations"):
        with Image.open(tmp_path / "map" / f"stability-{name}.png") as picture:
            assert len(picture.convert("RGB").getcolors(1 << 24) or []) > 50


@pytest.mark.slow(minutes=0.1)
def test_every_quantity_colors_its_map(tmp_path: Path) -> None:
    """A figure that differs between two records changes its own map; a refused point stays white."""
    base = {"contact.stiffness": "1e10", "time.step": "1e-4", "time.scheme": "newmark", "verdict": "passed"}
    low = base | {"created": 1e-5, "residual": -1e-12, "relative_penetration": 1e-4, "iterations": 1.5}
    high = base | {"created": 1e-2, "residual": 1e-6, "relative_penetration": 0.5, "iterations": 20.0}
    for quantity in QUANTITIES.values():
        pictures = []
        for number, record in enumerate((low, high, low | {quantity.key: high[quantity.key]}, low)):
            path = draw_stability_map([record], tmp_path / f"{number}.png", shown=quantity)
            pictures.append(path.read_bytes())
        assert pictures[1] == pictures[2] != pictures[0] == pictures[3]
    refused = draw_stability_map([high | {"verdict": "refused"}], tmp_path / "refused.png")
    with Image.open(refused) as picture:
        width, height = picture.size
        assert picture.convert("RGB").getpixel((width // 3, int(height * 0.35))) == (255, 255, 255)


def test_map_shows_the_worst_of_other_keys(tmp_path: Path) -> None:
    """Two records at a point: the one that failed decides mark and color, so the picture changes with it."""
    good = {
        "contact.stiffness": "1e10",
        "time.step": "1e-4",
        "time.scheme": "newmark",
        "verdict": "passed",
        "created": 0.0,
    }
    bad = good | {"verdict": "energy created", "created": 0.5}
    pictures = []
    for name, records in (("good", [good, good]), ("mixed", [good, bad]), ("bad", [bad, bad])):
        draw_stability_map(records, tmp_path / f"{name}.png")
        pictures.append((tmp_path / f"{name}.png").read_bytes())
    assert pictures[1] == pictures[2] != pictures[0]
