"""Fields of stress against beam theory and against the stress at probes, and pictures that are colored by them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

import gapbeam
from gapbeam.postprocess.render import render
from gapbeam.postprocess.results.field_reader import Fields
from gapbeam.postprocess.results_errors import OptionError, ResultsError
from gapbeam.postprocess.scene.film import RenderError, prepare_offscreen
from gapbeam.solver.march.simulation import Simulation
from gapbeam.solver.models.model import Model
from gapbeam.solver.run.assumptions.pose_rows import gauges_of
from gapbeam.solver.run.output.field_files import FieldWriter
from gapbeam.solver.schema.record_table import FIELDS, FIELDS_FILE, STRESS_FIELDS
from gapbeam.solver.system.semi_discrete import VALUE, Snapshots, State
from tests.verification.test_stress_at_probes import LENGTH, MODELS, PLACE, THICKNESS, WEIGHT, model_of

ASKED = {"output": {"stress": True}}


def written(model: Model, state: State, folder: Path) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the corners and both stresses of a state, as they are read from the files."""
    writer = FieldWriter(folder, model.case, model)
    writer.write(Snapshots.of_states([state]), model)
    writer.close()
    with Fields(folder / FIELDS_FILE) as fields:
        stress = fields.frame(0).stress
        return fields.points, stress["axial_stress"], stress["von_mises_stress"]


@pytest.mark.slow(minutes=0.3)
@pytest.mark.parametrize("name", MODELS)
def test_bending_under_weight(name: str, tmp_path: Path) -> None:
    """Everywhere away from the ends M z / I with M = w (L - x)^2 / 2, and the stress of probes at their places."""
    model = model_of(None, **MODELS[name], **ASKED)
    state = Simulation(model).seat().state
    points, axial, equivalent = written(model, state, tmp_path)
    height = points[:, 1 if model.case.mesh.dimension == 2 else 2]
    inside = (points[:, 0] > 0.1 * LENGTH) & (points[:, 0] < 0.9 * LENGTH)
    section = THICKNESS**2 / (16.0 if "round" in name else 12.0)  # I / A
    wanted = WEIGHT * 0.5 * (LENGTH - points[:, 0]) ** 2 * height / section
    size = np.abs(wanted[inside]).max()
    assert np.abs(axial - wanted)[inside].max() < 0.01 * size
    outside = inside & (np.abs(height) > 0.49 * THICKNESS)
    assert np.abs(equivalent - np.abs(wanted))[outside].max() < 0.015 * size
    probed = [int(np.argmin(np.linalg.norm(points - place, axis=1))) for place in _places(model)]
    assert np.abs(points[probed, 0] - PLACE).max() < 1e-12
    gauges = gauges_of(model.case, model)
    assert gauges is not None
    at_probes = gauges.stresses(state.u[VALUE][None])
    assert axial[probed] == pytest.approx(at_probes[0][0], rel=1e-9, abs=1e-9 * size)
    assert equivalent[probed] == pytest.approx(at_probes[1][0], rel=1e-9, abs=1e-9 * size)


def _places(model: Model) -> list[np.ndarray]:
    places = [np.asarray(probe.point, dtype=float) for probe in model.case.probe]
    return [np.pad(place, (0, 3 - len(place))) for place in places]


@pytest.mark.parametrize("name", ["full slice", "full solid"])
def test_tension_under_weight(name: str, tmp_path: Path) -> None:
    """A beam that hangs from its root carries its weight below, F / A = w (L - x), at every corner of the mesh."""
    along = [1.0, 0.0] if name == "full slice" else [1.0, 0.0, 0.0]
    model = model_of(along, **MODELS[name], **ASKED)
    points, axial, equivalent = written(model, Simulation(model).seat().state, tmp_path)
    inside = (points[:, 0] > 0.1 * LENGTH) & (points[:, 0] < 0.9 * LENGTH)
    wanted = WEIGHT * (LENGTH - points[inside, 0])
    assert axial[inside] == pytest.approx(wanted, rel=2e-3)
    assert equivalent[inside] == pytest.approx(wanted, rel=2e-3)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A released cantilever, reduced and compiled, with its fields."""
    folder = tmp_path_factory.mktemp("stress") / "run"
    changes: dict[str, Any] = {"analysis.start": "undeformed", "output.stress": True, "output.fields_interval": 2.0e-3}
    changes["support.s.clearance"] = 5.0e-3  # m, beyond its swing
    case = model_of(None, model={"type": "reduced"}).case
    assert gapbeam.run(case, changes, folder).exit_status == 0
    return folder


def test_fields_of_a_run_are_its_records(folder: Path) -> None:
    """At the times of the fields, the stress at the corner where a probe is, and zero before the release."""
    results = gapbeam.open_results(folder)
    place = results.case["probe"][0]["point"]
    with results.fields() as fields:
        corner = int(np.argmin(np.linalg.norm(fields.points - [*place, 0.0], axis=1)))
        frames = list(fields)
    assert len(frames) == 6
    assert not frames[0].stress["von_mises_stress"].any()
    for name in STRESS_FIELDS:
        record = results.history[name].sel(gauge="top")
        found = [frame.stress[name][corner] for frame in frames]
        wanted = [float(record.sel(time=frame.time, method="nearest")) for frame in frames]
        np.testing.assert_allclose(found, wanted, rtol=1e-8, atol=1e-8 * float(np.abs(record).max()))


@pytest.mark.slow(minutes=0.2)
def test_stress_colors_the_beam(folder: Path, tmp_path: Path) -> None:
    """Red above and blue below where the beam bends down; other pictures show it gray."""
    try:
        prepare_offscreen()
    except RenderError as fault:
        pytest.skip(str(fault))
    shares = {}
    for stress in (None, "axial", "von-mises"):
        paths = render(folder, tmp_path / str(stress), film=False, size=(800, 450), stress=stress)  # type: ignore[arg-type]
        red, _, blue = np.asarray(Image.open(paths[1]).convert("RGB"), dtype=float)[50:245, 20:700].transpose(2, 0, 1)
        shares[stress] = float(np.mean(red > blue + 60.0)), float(np.mean(blue > red + 60.0))
    assert shares[None] == (0.0, 0.0)
    assert min(shares["axial"]) > 0.002
    assert shares["von-mises"][0] > 0.004
    assert shares["von-mises"][1] == 0.0


def test_pictures_of_stress_need_fields_of_stress(tmp_path: Path) -> None:
    """A run without them says how to have them; no other stress is known."""
    case = model_of(None, model={"type": "reduced"}).case
    assert gapbeam.run(case, {"time.end": 1.0e-3}, tmp_path / "run").exit_status == 0
    with gapbeam.open_results(tmp_path / "run").fields() as fields:
        assert dict(fields.frame(0).stress) == {}
    assert len(FIELDS) == 3
    with pytest.raises(ResultsError, match=r"(?s)without stress.*output\.stress=true"):
        render(tmp_path / "run", film=False, stress="axial")
    with pytest.raises(OptionError, match=r"stress 'shear': expected one of axial, von-mises"):
        render(tmp_path / "run", film=False, stress="shear")  # type: ignore[arg-type]
