"""Results of a tube in holes: figures, pictures and reports of a beam that moves in space."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import gapbeam
from gapbeam.postprocess.figures.motion_figures import rooms_at_probes
from gapbeam.postprocess.render import RenderError, render
from gapbeam.postprocess.results.columns_of_run import supports_of
from gapbeam.postprocess.scene import film as offscreen
from gapbeam.postprocess.scene.support_surface import support_of
from tests.shared.command import CASE_FOLDER

KEYS = (
    "model.type=rigid",
    "support.right.offset=5e-5",
    "mesh.cells_through_thickness=2",
    "mesh.cells_across_width=2",
    "mesh.support_size=0.01",
    "mesh.size=0.1",
    "contact.stiffness=1e11",
    "time.end=0.02",
    "output.fields_interval=0.01",
    "output.errors=none",
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Run a rigid tube in two holes."""
    path: Path = tmp_path_factory.mktemp("holes") / "run"
    gapbeam.run((CASE_FOLDER / "tube-holes.toml"), KEYS, path)
    return path


def test_a_hole_is_described(folder: Path) -> None:
    """The summary has one face for each hole, all around the tube, with its offset."""
    results = gapbeam.open_results(folder)
    left, right = supports_of(results.summary, results.case)
    assert [face.face for one in (left, right) for face in one.faces] == ["left_hole", "right_hole"]
    assert all(face.around and face.gap == 1.2e-4 for one in (left, right) for face in one.faces)
    assert (left.faces[0].offset, right.faces[0].offset) == (0.0, 5e-5)


def test_a_ring_is_drawn_where_the_tube_touches_it(folder: Path) -> None:
    """Its inner radius is the tube's plus the enlarged clearance, its middle the enlarged offset."""
    results = gapbeam.open_results(folder)
    points = np.array([[0.0, -0.0125, -0.0125], [1.0, 0.0125, 0.0125]])
    boxes = support_of(points, 3, supports_of(results.summary, results.case))
    left, right = (boxes.box(block, 10.0) for block in boxes.blocks)
    assert left == pytest.approx((0.1, 0.12, -0.0212, 0.0212, -0.0212, 0.0212))
    assert right[4:] == pytest.approx((0.0005 - 0.0212, 0.0005 + 0.0212))
    assert boxes.is_around("left_hole")


def test_the_circle_of_a_hole_stands_behind_its_probe(folder: Path) -> None:
    """A probe on the axis within a hole has its clearance; the others have none."""
    results = gapbeam.open_results(folder)
    supports = supports_of(results.summary, results.case)
    rooms = rooms_at_probes(results.case, supports)
    assert list(rooms) == ["left_orbit"]
    assert np.hypot(*rooms["left_orbit"].T) == pytest.approx(1.2e-4, rel=1e-3)
    moved = results.history["displacement"].sel(probe="left_orbit").values
    assert 1.0e-4 < np.hypot(moved[:, 1], moved[:, 2]).max() < 1.4e-4  # it reaches the wall


def test_resultants_push_the_tube_back(folder: Path) -> None:
    """At rest they carry the weight; later each lies within the sum of the forces, against the motion in its hole."""
    results = gapbeam.open_results(folder)
    resultant, force = results.history["contact_resultant"], results.history["contact_force"].values
    assert resultant.dims == ("time", "face", "across")
    assert resultant["across"].values.tolist() == ["y", "z"]
    weight = 7850.0 * np.pi / 4.0 * (0.025**2 - 0.019**2) * 9.80665
    assert resultant.values[0].sum(axis=0) == pytest.approx([0.0, weight], abs=2e-3 * weight)
    size = np.linalg.norm(resultant.values, axis=2)
    assert np.all(size <= force * (1.0 + 1e-12))
    assert size.max() > 0.95 * force.max()  # contact is narrow
    pressed = size[:, 0] > 0.05 * size[:, 0].max()
    aside = results.history["displacement"].sel(probe="left_orbit", component=["y", "z"]).values
    assert np.all(np.sum(aside * resultant.values[:, 0], axis=1)[pressed] < 0.0)


@pytest.mark.slow(minutes=0.3)
def test_orbits_and_pictures_are_drawn(folder: Path, tmp_path: Path) -> None:
    """The figure of the orbits, and pictures that are not blank."""
    names = [path.name for path in gapbeam.plot(folder, output=tmp_path / "figures")]
    assert "orbits.png" in names
    try:
        offscreen.prepare_offscreen()
    except RenderError as fault:
        pytest.skip(str(fault))
    paths = render(folder, output=tmp_path / "pictures", size=(800, 450), film=False)
    for path in paths:
        assert np.asarray(Image.open(path)).std() > 10.0
