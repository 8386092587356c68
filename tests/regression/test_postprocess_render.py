"""Pictures and films: made, not blank, and honest about the gap. Skipped only where no OpenGL works."""

from __future__ import annotations

import subprocess
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from gapbeam.postprocess.render import RenderError, render
from gapbeam.postprocess.results.columns_of_run import supports_of
from gapbeam.postprocess.results.results import open_results
from gapbeam.postprocess.results_errors import OptionError, ResultsError
from gapbeam.postprocess.scene import film
from gapbeam.postprocess.scene import film as offscreen
from gapbeam.postprocess.scene.motion_range import Window, motion_of, scale_of_support, scale_of_whole
from gapbeam.postprocess.scene.plane_view import Shot, Studio, views_of
from gapbeam.postprocess.scene.support_surface import support_of
from gapbeam.postprocess.scene.surface_color import SurfaceColor
from tests.unit.test_postprocess_synthetic import plane_beam, solid_beam, write_fields, write_results

CLEARANCE = 1.07e-4
SIZE = (800, 450)


@pytest.fixture(scope="module", autouse=True)
def _drawing_is_possible() -> None:
    try:
        offscreen.prepare_offscreen()
    except RenderError as fault:
        pytest.skip(str(fault))


def rocking(points: np.ndarray, dimension: int, count: int = 4) -> list[tuple[float, np.ndarray, np.ndarray]]:
    """The beam rocks in its clearance about the edge of the base; pressure where it touches."""
    bending, frames = dimension - 1, []
    for k in range(count):
        angle = -CLEARANCE / 0.05 * np.sin(2 * np.pi * k / 8)
        displacement = np.zeros_like(points)
        displacement[:, bending] = angle * (points[:, 0] - 0.05)
        displacement[:, 0] = -angle * points[:, bending]
        at_edge = (np.abs(points[:, 0] - 0.05) < 0.006) & (points[:, bending] < -0.0059)
        frames.append((0.00625 * k, displacement, np.where(at_edge, 1e6 * (k + 1), 0.0)))
    return frames


def results(folder: Path, dimension: int, count: int = 4) -> Path:
    time = np.linspace(0.0, 0.1, 201)
    force = 50.0 + 40.0 * np.sin(2 * np.pi * 20 * time)
    write_results(folder, time, {"contact_force": force, "displacement": 1e-3 * force}, dimension=dimension)
    points, cells = plane_beam() if dimension == 2 else solid_beam()
    topology = "Quadrilateral" if dimension == 2 else "Hexahedron"
    write_fields(folder, points, cells, topology, rocking(points, dimension, count))
    return folder


@pytest.mark.slow(minutes=0.1)
@pytest.mark.parametrize("dimension", [2, 3])
def test_pictures_and_film(tmp_path: Path, dimension: int) -> None:
    calls: list[tuple[int, int]] = []
    paths = render(results(tmp_path, dimension), size=SIZE, progress=lambda *now: calls.append(now))
    assert [path.name for path in paths[:2]] == ["largest_contact_force.png", "largest_displacement.png"]
    for path in paths[:2]:
        with Image.open(path) as picture:
            assert picture.size == SIZE
            assert np.asarray(picture.convert("L"), dtype=float).std() > 10.0
    assert paths[2].stem == "film"
    assert paths[2].stat().st_size > 1000
    assert calls == [(1, 4), (2, 4), (3, 4), (4, 4)]


def test_without_ffmpeg_the_film_is_a_gif(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(film, "_ffmpeg", lambda: None)
    path = render(results(tmp_path, 2), size=SIZE, frames=3)[-1]
    assert path.suffix == ".gif"
    with Image.open(path) as picture:
        assert picture.n_frames == 3


@pytest.mark.slow(minutes=0.1)
def test_triangles_and_tetrahedra_are_drawn(tmp_path: Path) -> None:
    points, cells = plane_beam()
    triangles = np.concatenate([cells[:, [0, 1, 2]], cells[:, [0, 2, 3]]])
    write_fields(results(tmp_path / "2", 2), points, triangles, "Triangle", rocking(points, 2))
    assert len(render(tmp_path / "2", size=SIZE, film=False)) == 2
    points, cells = solid_beam()
    corners = [[0, 1, 3, 4], [1, 2, 3, 6], [1, 3, 4, 6], [1, 4, 5, 6], [3, 4, 6, 7]]
    tetrahedra = np.concatenate([cells[:, four] for four in corners])
    write_fields(results(tmp_path / "3", 3), points, tetrahedra, "Tetrahedron", rocking(points, 3))
    assert len(render(tmp_path / "3", size=SIZE, film=False)) == 2


def round_tube(around: int = 12, along: int = 51) -> tuple[np.ndarray, np.ndarray]:
    """A tube of hexahedra, 510 mm long, its radii 4 and 6 mm."""
    angles = 2.0 * np.pi * np.arange(around) / around
    ring = [(r * np.cos(a), r * np.sin(a)) for r in (0.004, 0.006) for a in angles]
    points = np.array([(x, y, z) for x in np.linspace(0.0, 0.51, along + 1) for y, z in ring])
    cells = []
    for i in range(along):
        for j in range(around):
            k = (j + 1) % around
            near = [i * len(ring) + n for n in (j, k, k + around, j + around)]
            cells.append([*near, *(n + len(ring) for n in near)])
    return points, np.array(cells)


def test_a_round_tube_is_drawn(tmp_path: Path) -> None:
    """Its edges are only those of its ends, and its contact faces are the outer halves in the support."""
    from gapbeam.postprocess.scene.camera_view import body_of

    points, cells = round_tube()
    write_fields(results(tmp_path, 3), points, cells, "Hexahedron", rocking(points, 3))
    assert len(render(tmp_path, size=SIZE, film=False)) == 2
    run = open_results(tmp_path)
    with run.fields() as fields:
        body = body_of(fields, support_of(fields.points, 3, supports_of(run.summary, run.case)))
    outer = np.hypot(points[:, 1], points[:, 2]) > 0.0059
    held = outer & (points[:, 0] < 0.0501)
    assert set(body.touching["base"]) == set(np.flatnonzero(held & (points[:, 2] < 1e-9)))
    assert set(body.touching["gland"]) == set(np.flatnonzero(held & (points[:, 2] > -1e-9)))
    assert np.ptp(body.edges.rest[:, 0][body.edges.rest[:, 0] > 0.1]) < 1e-9


def test_a_peak_between_fields_is_named(tmp_path: Path) -> None:
    """A shock between two fields is in no picture; its size and time stand beside the picture."""
    folder = results(tmp_path, 2)
    time = np.linspace(0.0, 0.1, 201)
    force = np.where(np.abs(time - 0.0095) < 1e-4, 900.0, 10.0)
    write_results(folder, time, {"contact_force": force, "displacement": 1e-5 * force}, dimension=2)
    run = open_results(folder)
    with run.fields() as fields:
        studio = Studio(run, fields, "auto", SIZE, 0.0)
        _, remark = studio.moments()["largest_contact_force"]
        studio.close()
    assert "20 N on base and gland together; between fields 1800 N at 9.5 ms" in remark


@pytest.mark.parametrize("share", [0.0, 0.5, 1.0])
def test_the_gap_is_drawn_at_the_factor_of_the_displacement(tmp_path: Path, share: float) -> None:
    """A beam lifted by a share of the clearance leaves the rest of it, times the factor, to the gland."""
    scale, pixel = 50.0, 1.0e-4
    write_results(tmp_path, np.linspace(0.0, 0.1, 3), clearance=CLEARANCE)
    points, cells = plane_beam()
    lifted = np.zeros_like(points)
    lifted[:, 1] = share * CLEARANCE
    write_fields(tmp_path, points, cells, "Quadrilateral", [(0.0, lifted, 0 * points[:, 0])])
    run = open_results(tmp_path)
    with run.fields() as fields:
        support = support_of(fields.points, 2, supports_of(run.summary, run.case))
        gland = support.box(support.blocks[1], scale)
        assert gland[2] == pytest.approx(0.006 + scale * CLEARANCE)
        shot = Shot(Window((0.0, 0.04), (-0.02, 0.02)), (400, 400), scale, (0.0, -1.0, 0.0))
        [view], _ = views_of(fields, support, [shot], SurfaceColor.of_pressure(1.0))
        picture = view.picture(fields.frame(0))
        view.close()
    column = (picture[:, 200] > 250).all(axis=-1)
    rows = np.arange(400)
    between = column & (rows > 200 - 0.02 / pixel) & (rows < 200) & (rows > 80)
    assert between.sum() == pytest.approx((1.0 - share) * scale * CLEARANCE / pixel, abs=4)


def test_a_beam_that_slides_stays_in_its_picture(tmp_path: Path) -> None:
    """The mean motion along the beam is drawn as it is, 10 mm of 510 mm, while all else is enlarged; it is written."""
    folder = results(tmp_path, 2)
    points, cells = plane_beam()
    frames = rocking(points, 2)
    slid = [(time, displacement + np.array([0.01, 0.0, 0.0]), pressure) for time, displacement, pressure in frames]
    found = []
    for series in (frames, slid):
        write_fields(folder, points, cells, "Quadrilateral", series)
        run = open_results(folder)
        with run.fields() as fields:
            studio = Studio(run, fields, "auto", SIZE, 0.0)
            found.append((studio.draw(2)[..., :3], studio._sheet._caption.whole))
            studio.close()
    assert "along the beam" not in found[0][1]
    assert found[1][1] == found[0][1] + "; along the beam × 1"
    color = np.array([0xC9, 0xD3, 0xDC])
    still, moved = ((np.abs(picture[50:200] - color.astype(int)) < 3).all(axis=-1).any(axis=0) for picture, _ in found)
    columns = [np.flatnonzero(one)[[0, -1]] for one in (still, moved)]
    length = columns[0][1] - columns[0][0]
    assert columns[1] - columns[0] == pytest.approx(length * 0.01 / 0.51, abs=2)


def test_marks_stand_where_the_camera_sees_their_places(tmp_path: Path) -> None:
    """Fractions of the picture are those of the camera of VTK, in perspective."""
    from gapbeam.postprocess.scene.camera_view import View, body_of

    run = open_results(results(tmp_path, 3))
    with run.fields() as fields:
        support = support_of(fields.points, 3, supports_of(run.summary, run.case))
        window = Window((-0.01, 0.53), (-0.05, 0.08))
        color = SurfaceColor.of_pressure(1.0)
        view = View(body_of(fields, support), support, window, (768, 158), 50.0, color, (0.1, -1.0, 0.28))
        view.picture(fields.frame(0))
    places = np.array([support.inside(x, height) for x in (0.0, 0.2, 0.51) for height in (-0.03, 0.006)])
    expected = []
    for place in places:
        view._plotter.renderer.SetWorldPoint(*place, 1.0)
        view._plotter.renderer.WorldToView()
        expected.append(0.5 + 0.5 * np.array(view._plotter.renderer.GetViewPoint()[:2]))
    np.testing.assert_allclose(view.fractions(places), expected, atol=1e-9)
    view.close()
    assert np.ptp(expected, axis=0).min() > 0.1


def test_automatic_factors_are_round_and_show_the_motion(tmp_path: Path) -> None:
    run = open_results(results(tmp_path, 2, count=8))
    with run.fields() as fields:
        support = support_of(fields.points, 2, supports_of(run.summary, run.case))
        motion = motion_of(fields, support.shown_near)
    assert support.shown_near == pytest.approx((0.0, 0.065))
    assert motion.highest == pytest.approx(0.46 * CLEARANCE / 0.05)
    assert motion.lowest == pytest.approx(-motion.highest)
    assert scale_of_support(motion, support) == 50.0  # 0.45 * 12 mm / 0.107 mm = 50.5
    whole = scale_of_whole(motion, support, (1536, 315))
    assert whole * (motion.highest - motion.lowest) <= 0.51 * 315 / 1536
    assert whole in {30.0, 40.0}


def test_a_beam_at_rest_is_drawn(tmp_path: Path) -> None:
    folder = write_results(tmp_path, np.zeros(1), probes=(), frequency=None, clearance=-6e-6)
    points, cells = plane_beam()
    write_fields(folder, points, cells, "Quadrilateral", [(0.0, 0 * points, 0 * points[:, 0])])
    assert len(render(folder, size=SIZE)) == 2


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"scale": -1.0}, "scale"),
        ({"frames": 0}, "frames"),
        ({"size": (10, 10)}, "size"),
        ({"frames_per_second": 0.0}, "second"),
    ],
)
def test_options_out_of_range_are_refused(tmp_path: Path, options: dict[str, object], message: str) -> None:
    with pytest.raises(OptionError, match=message):
        render(tmp_path, **options)  # type: ignore[arg-type]


def test_results_without_fields_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ResultsError, match=r"fields\.h5"):
        render(write_results(tmp_path, np.linspace(0, 1, 5)))


def test_where_nothing_can_be_drawn_the_message_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object, **__: object) -> subprocess.CompletedProcess[str]:
        return subprocess.CompletedProcess([], 1, "", "vtk: no EGL\n")

    monkeypatch.setattr(offscreen.subprocess, "run", refuse)
    with pytest.raises(RenderError, match=r"vtkEGLRenderWindow: vtk: no EGL; .*install libegl1"):
        offscreen.prepare_offscreen.__wrapped__()
