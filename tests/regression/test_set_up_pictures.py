"""Pictures of cases before they run: gaps as large as the factor on the picture says, every load an arrow."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import gapbeam
from gapbeam.interface.case_picture import set_up_of
from gapbeam.postprocess.results.columns_of_run import RunFace, RunSupport
from gapbeam.postprocess.scene.film import rows_of
from gapbeam.solver.case.reading.case_reader import read_case
from tests.shared.command import PROJECT, alone, called_anew

pytestmark = alone

CASES = sorted((PROJECT / "cases").glob("*.toml"))
DEMO = PROJECT / "cases" / "demo.toml"


def drawn(path: Path, tmp_path: Path) -> np.ndarray:
    """Draw a case and return the picture, (height, width, 3)."""
    found = gapbeam.view(path, output=tmp_path / f"{path.stem}.png")
    return np.asarray(Image.open(found).convert("RGB")).astype(int)


def test_a_gap_is_as_large_as_the_factor_says(tmp_path: Path) -> None:
    """The demo: 0.107 mm between beam and gland, times 50 over a thickness of 12 mm, counted in pixels."""
    from gapbeam.postprocess.scene.setup_sheet import factor_of

    assert factor_of(set_up_of(read_case(DEMO)).supports, 0.012) == 50.0
    picture = drawn(DEMO, tmp_path)
    column = picture[200:420, 200].sum(axis=1)  # through the support of the whole beam, between two lines of the mesh
    dark = np.flatnonzero(column < 300)  # outlines: gland above, gland below, beam above, beam below, base below
    lines = [float(run.mean()) for run in np.split(dark, np.flatnonzero(np.diff(dark) > 3) + 1)]
    assert len(lines) == 5
    assert (lines[2] - lines[1]) / (lines[3] - lines[2]) == pytest.approx(50 * 0.107 / 12.0, rel=0.05)


@pytest.mark.parametrize(
    ("clearance", "offset", "factor"),
    [(0.107e-3, 0.0, 50.0), (0.0, 0.0, 1.0), (0.1, 0.0, 1.0), (1e-3, 2e-3, 1.5), (-6e-6, 0.0, 800.0)],
)
def test_the_factor_is_round_and_at_least_one(clearance: float, offset: float, factor: float) -> None:
    """0.45 of the thickness over the widest gap, rounded down; wide gaps are drawn as they are."""
    from gapbeam.postprocess.scene.setup_sheet import factor_of

    face = RunFace("a", True, clearance, offset=offset)
    assert factor_of((RunSupport("one", 0.0, 0.1, clearance, (face,)),), 0.012) == factor


def test_labels_cover_no_other() -> None:
    spans = [(0.0, 0.2), (0.1, 0.3), (0.25, 0.4), (0.15, 0.28), (0.5, 0.6)]
    assert rows_of(spans, 2, 0.01) == [0, 1, 0, None, 0]


def test_every_load_is_an_arrow() -> None:
    """A force where it acts and where it points; motions of walls at their supports; weight downward, one way."""
    arrows = {one.words.split()[0]: one for one in set_up_of(read_case(PROJECT / "cases/tube-holes.toml")).loads}
    assert arrows["shaker"].words == "shaker 30 N, 25 Hz"
    assert arrows["shaker"].point == (0.5, 0.0, 0.0)
    assert arrows["shaker"].direction == pytest.approx(np.array([0.0, 1.0, 0.3]) / np.hypot(1.0, 0.3))
    assert (arrows["gravity"].direction, arrows["gravity"].sways) == ((0.0, 0.0, -1.0), False)
    piers = {one.words.split()[0]: one for one in set_up_of(read_case(PROJECT / "cases/piers.toml")).loads}
    assert piers["wave_second"].support == "second"
    assert piers["wave_second"].words == "wave_second moves second, 5 Hz"
    assert piers["wear"].words == "wear opens third"
    assert piers["gravity"].direction == (0.0, -1.0, 0.0)


def test_a_section_has_its_area() -> None:
    """The tube: pi (R^2 - r^2), by counting points."""
    section = set_up_of(read_case(PROJECT / "cases/tube-holes.toml")).sections["left"]
    step = (section.across[1] - section.across[0]) * (section.up[1] - section.up[0])
    assert section.inside.sum() * step == pytest.approx(np.pi * (12.5e-3**2 - 9.5e-3**2), rel=0.02)


def test_unknown_sections_are_left_out() -> None:
    """The picture is that with sections, but for the panels across the beam."""
    from gapbeam.postprocess.scene.setup_sheet import picture_of

    set_up = set_up_of(read_case(DEMO))
    whole, scale = picture_of(set_up, (800, 450))
    bare, same = picture_of(replace(set_up, sections={}), (800, 450))
    assert scale == same
    changed = np.argwhere((whole != bare).any(axis=2))
    assert len(changed) > 1000
    assert changed[:, 0].min() > 0.65 * 450  # rows: below the whole beam
    assert changed[:, 1].min() > 0.21 * 800  # columns: right of the support from near


@pytest.mark.slow(minutes=1)
@pytest.mark.parametrize("path", CASES, ids=[path.stem for path in CASES])
def test_every_shipped_case_is_drawn(path: Path, tmp_path: Path) -> None:
    """Something stands in every part of the picture: title, beam, labels below, a support from near."""
    picture = drawn(path, tmp_path)
    assert picture.shape == (900, 1600, 3)
    for rows in (slice(15, 55), slice(170, 430), slice(430, 470), slice(575, 600), slice(620, 860)):
        assert picture[rows].std() > 1.0


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("cases/demo.toml", "--output", "a.pdf"), "--output a.pdf: expected a name that ends with .png"),
        (("cases/demo.toml", "--output", "cases/x.png/y.png", "--size", "100x100"), "expected at least 200 pixels"),
        (("cases/demo.toml", "--set", "support.clearance=big"), 'found: "big"'),
        (("cases/demmo.toml",), "demmo.toml"),
    ],
)
def test_bad_calls_are_explained(words: tuple[str, ...], said: str) -> None:
    done = called_anew("view", *words)
    assert done.returncode == 2
    assert said in " ".join(done.stderr.split())
    assert "Traceback" not in done.stderr


@pytest.mark.slow(minutes=0.2)
def test_the_command_says_where_the_picture_is(tmp_path: Path) -> None:
    done = called_anew("view", DEMO, "--output", tmp_path / "new" / "demo.png", "--size", "800x450")
    assert (done.returncode, done.stdout) == (0, f"{tmp_path / 'new' / 'demo.png'}\n"), done.stderr
    assert Image.open(tmp_path / "new" / "demo.png").size == (800, 450)
