"""Pictures of planes: where things are in them, smooth lines, colors, and no need for OpenGL."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from meshio import CellBlock
from PIL import Image

from gapbeam.postprocess.render import RenderError, render
from gapbeam.postprocess.results.columns_of_run import RunFace, RunSupport
from gapbeam.postprocess.results.field_reader import Frame
from gapbeam.postprocess.scene import plane_view as view_choice
from gapbeam.postprocess.scene.motion_range import Window
from gapbeam.postprocess.scene.plane_view import PlaneView
from gapbeam.postprocess.scene.set_up import plane_body
from gapbeam.postprocess.scene.support_surface import SupportBoxes, support_of
from gapbeam.postprocess.scene.surface_color import BEAM, SurfaceColor
from tests.shared.command import alone, programmed
from tests.unit.test_postprocess_synthetic import plane_beam, solid_beam, write_fields, write_results

SIZE = (400, 200)
WINDOW = Window((-0.02, 0.02), (-0.01, 0.01))  # 0.1 mm a pixel
COLOR = tuple(int(BEAM[k : k + 2], 16) for k in (1, 3, 5))
SUPPORTS = (RunSupport("s", 0.0, 0.004, 1e-4, (RunFace("base", True, 0.0), RunFace("gland", False, 1e-4))),)


@dataclass(frozen=True)
class Plate:
    """A mesh alone."""

    points: np.ndarray
    cells: list[CellBlock]

    @property
    def support(self) -> SupportBoxes:
        """Beam and support."""
        return support_of(self.points, 2, SUPPORTS)


def plate(along: int = 8, through: int = 4, left_out: tuple[int, ...] = (), turned: bool = False) -> Plate:
    """A plate of 16 by 8 mm in cells of 2 mm; every other one may have its corners the other way round."""
    points, cells = plane_beam(along, through)
    points = points * np.array([0.016 / 0.51, 0.008 / 0.012, 1.0]) - [0.008, 0.0, 0.0]
    if turned:
        cells[::2] = cells[::2, ::-1]
    return Plate(points, [CellBlock("quad", np.delete(cells, left_out, axis=0))])


def at_rest(body: Plate, pressure: float = 0.0, turn: float = 0.0) -> Frame:
    """A frame of a body that is turned a little about the origin."""
    moved = turn * np.column_stack([-body.points[:, 1], body.points[:, 0], body.points[:, 2]])
    values = np.full(len(body.points), pressure)
    return Frame(0.0, moved, 0.0 * moved, values, {"axial_stress": 1e9 * body.points[:, 0]})


def drawn(body: Plate, frame: Frame, color: SurfaceColor | None = None) -> np.ndarray:
    """Draw a frame and return the picture, (height, width, 3)."""
    color = color or SurfaceColor.of_pressure(1.0)
    view = PlaneView(plane_body(body, body.support), body.support, WINDOW, SIZE, 1.0, color)
    return view.picture(frame)[..., :3].astype(int)


def test_fractions_are_those_of_the_picture() -> None:
    """The corners of the plate: the first and last row and column that have its color, between its edges of a pixel."""
    body = plate()
    view = PlaneView(plane_body(body, body.support), body.support, WINDOW, SIZE, 1.0, SurfaceColor.of_pressure(1.0))
    low, high = SIZE * view.fractions(np.array([[-0.008, -0.004, 0.0], [0.008, 0.004, 0.0]]))
    assert (low, high) == (pytest.approx([120.0, 60.0]), pytest.approx([280.0, 140.0]))
    rows, columns = np.nonzero((view.picture(at_rest(body))[..., :3] == COLOR).all(axis=-1))
    assert (columns.min(), columns.max()) == (121, 278)
    assert (SIZE[1] - 1 - rows.max(), SIZE[1] - 1 - rows.min()) == (61, 138)


@pytest.mark.parametrize("turned", [False, True])
def test_a_hole_is_seen_through(turned: bool) -> None:
    """The outline is a polygon around the plate and one around the hole, whichever way the corners of cells go."""
    body = plate(left_out=(11, 12, 19, 20), turned=turned)
    found = plane_body(body, body.support)
    assert sorted(len(loop) for loop in found.loops) == [8, 24]
    picture = drawn(body, at_rest(body))
    assert (picture[100, 200] == 255).all()
    assert (picture[100, 140] == COLOR).all()
    assert {face: len(points) for face, points in found.touching.items()} == {"base": 3, "gland": 3}


def test_lines_are_smooth() -> None:
    """Across an edge that rises by 1 in 30 the picture changes little by little from column to column."""
    body = plate()
    picture = drawn(body, at_rest(body, turn=1.0 / 30.0))
    dark = (255 - picture[30:100, 180:260, 0]).sum(axis=0)  # from above into the plate: how much of it is seen
    steps = np.diff(dark)
    assert dark[0] != dark[-1]
    assert np.abs(steps).max() < 0.12 * 255
    levels = picture[30:100, 180:260, 0]
    assert len(np.unique(levels)) > 20


def test_a_pressed_face_has_the_color_of_its_pressure() -> None:
    """All of the base is pressed by half of the largest pressure; where nothing presses there is no such color."""
    body = plate()
    color = SurfaceColor.of_pressure(2.0)
    half = np.round(255 * np.array(color.colors(0.5)[:3]))
    pressed, free = (np.abs(drawn(body, at_rest(body, value), color) - half).max(axis=-1) <= 2 for value in (1.0, 0.0))
    rows, columns = np.nonzero(pressed)
    assert columns.min() == pytest.approx(120, abs=1)
    assert columns.max() == pytest.approx(160, abs=1)
    assert set(rows) == {*range(57, 63), *range(137, 143)}  # 7 pixels about each edge, the first and last half covered
    assert not free.any()


def test_stress_is_colored_as_its_scale_says() -> None:
    """A stress that grows along the plate: in the middle of each cell column the color of its value, none outside."""
    body = plate()
    color = SurfaceColor.of_stress("axial_stress", {"axial_stress": 8e6})
    picture = drawn(body, at_rest(body), color)
    for x in (-0.007, -0.003, 0.001, 0.005):
        found = picture[90, round(200 + x * 1e4)]
        wanted = 255 * np.array(color.colors((1e9 * x + 8e6) / 16e6)[:3])
        assert np.abs(found - wanted).max() < 8
    assert (picture[30, 180:] == 255).all()


def test_planes_are_drawn_where_opengl_is_not(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A solid is refused and leaves no folder."""

    def refuse() -> str:
        raise RenderError("no OpenGL")

    monkeypatch.setattr(view_choice, "prepare_offscreen", refuse)
    for dimension, (points, cells), topology in (
        (2, plane_beam(), "Quadrilateral"),
        (3, solid_beam(), "Hexahedron"),
    ):
        folder = tmp_path / str(dimension)
        write_results(folder, np.linspace(0.0, 0.1, 11), dimension=dimension)
        write_fields(folder, points, cells, topology, [(0.0, 0.0 * points, 0.0 * points[:, 0])])
        if dimension == 2:
            path, _ = render(folder, size=(800, 450))
            assert np.asarray(Image.open(path)).std() > 10.0
        else:
            with pytest.raises(RenderError, match="no OpenGL"):
                render(folder)
            assert not (folder / "pictures").exists()


@alone
def test_pictures_of_planes_load_little(tmp_path: Path) -> None:
    """In a fresh interpreter: neither VTK nor what cases and computations need, a second of imports."""
    folder = write_results(tmp_path, np.linspace(0.0, 0.1, 11))
    points, cells = plane_beam()
    write_fields(folder, points, cells, "Quadrilateral", [(0.0, 0.0 * points, 0.0 * points[:, 0])])
    done = programmed("tests.programs.drawn_folder", folder)
    assert (done.returncode, done.stdout) == (0, "[]\n"), done.stderr
