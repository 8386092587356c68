"""Runs with supports that give way: resumed, swept, on two ranks, periodic, drawn and reported."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import gapbeam
from gapbeam.postprocess.figures.motion_figures import shifts_at_probes
from gapbeam.postprocess.report.blocks import TableBlock
from gapbeam.postprocess.report.sections.contact_section import contact_section
from gapbeam.postprocess.results.columns_of_run import supports_of, wall_motions
from gapbeam.solver.case.beam_motions import axial_restraint
from gapbeam.solver.case.case import case_to_toml
from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.seat.contact_modes import held_modes
from gapbeam.studies.tradeoff.level_measurement import plan_levels
from tests.parallel.test_ranks_agree import CLOSE, disagreements
from tests.shared.command import alone, on_ranks
from tests.shared.interrupted import differing, run_in_parts
from tests.verification.test_own_contact import AREA, GRAVITY, stops, tables
from tests.verification.test_support_bodies import SOFT_CONTACT, on_two
from tests.verification.test_support_body_modes import SPRUNG_HOLES, holes

BODY = {"mass": 0.2, "stiffness": 2.0e4, "damping": 20.0}
SHAKER = {"type": "base_motion", "name": "shaker", "amplitude": 14.0, "frequency": 25.0}
WEIGHT = {"type": "gravity", "acceleration": GRAVITY}


def shaken(**more: Any) -> dict[str, Any]:
    """Return a bar of beam elements that is shaken off two sprung stops, and falls back."""
    return tables(
        on_two([BODY, BODY], stiffness=[SOFT_CONTACT] * 2, damping=[200.0 / AREA] * 2),
        **{
            "model": {"type": "beam", "elements": 10},
            "damping": {"frequencies": [50.0, 2000.0], "ratios": [0.03, 0.03]},
            "load": [WEIGHT, SHAKER],
            "time": {"end": 0.12, "step": 2.0e-4},
            "output": {"errors": "none", "fields_interval": 0.02},
            "gates": {"accept_energy_loss": True},
        }
        | more,
    )


def written(folder: Path, **more: Any) -> Path:
    """Write that case, and return its path."""
    path = folder / "shaken.toml"
    path.write_text(case_to_toml(gapbeam.read_case(shaken(**more))))
    return path


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of that case."""
    folder = tmp_path_factory.mktemp("bodies")
    done = gapbeam.run(written(folder), output=folder / "run")
    assert done.exit_status == 0, done.message
    return folder / "run"


def test_a_resumed_run_is_the_same(run: Path, tmp_path: Path) -> None:
    """Stopped and continued: no bit differs."""
    parts = run_in_parts(written(tmp_path), (), tmp_path / "parts", (2,))
    assert parts.exit_status == 0, parts.message
    assert 0.0 < parts.summary["resumed"][0] < parts.summary["convergence"]["steps"]
    assert differing(run, tmp_path / "parts") == []


def test_summary_and_history_name_the_bodies(run: Path) -> None:
    """What they are made of, where they are at the seat, and the closed balance of the run."""
    results = gapbeam.open_results(run)
    described = results.summary["model"]["supports"]
    assert [one["body"] for one in described] == [BODY | {"displacement": 0.0, "velocity": 0.0}] * 2
    at_rest = results.history["support_displacement"].sel(support_axis="y").values[0]
    seat = results.summary["seat"]["support_displacement"]
    assert [seat["left.y"], seat["right.y"]] == pytest.approx(list(at_rest), rel=1e-12)
    assert results.summary["energy"]["relative_residual"] == pytest.approx(0.0, abs=1e-10)
    assert float(results.history["contact_force"].min()) == 0.0


def test_pictures_and_reports_show_the_bodies(run: Path) -> None:
    """Faces are drawn where their body is; the report says how far it moves and what the frame feels."""
    results = gapbeam.open_results(run)
    time = float(results.history["time"][300])
    moved = wall_motions(results.history, time)
    place = float(results.history["support_displacement"].sel(support_body="left", support_axis="y")[300])
    (face, *_), *_ = (one.faces for one in supports_of(results.summary, results.case))
    assert moved["left.y"] == place != 0.0
    assert face.moved(moved).gap == pytest.approx(face.gap - place, abs=1e-15)
    (table,) = [
        block
        for block in contact_section(results.history, 25.0, "gapbeam plot").blocks
        if isinstance(block, TableBlock) and "give way" in block.caption
    ]
    assert [row[0] for row in table.rows] == ["left", "right"]
    forces = np.abs(results.history["support_force"].values).max(axis=(0, 2))
    assert [row[-1] for row in table.rows] == pytest.approx(list(forces))


def test_orbits_are_drawn_in_the_hole_that_moves(tmp_path: Path) -> None:
    """The shift of a hole is what its body moves, sideways and up."""
    load = [WEIGHT | {"direction": [0.0, 1.0, -1.0]}]
    probe = [{"name": "tip", "point": 0.025}]
    keys = SPRUNG_HOLES | {"load": load, "probe": probe, "time": {"end": 1.0e-3, "step": 1.0e-4}}
    case = tables(holes(), **(keys | {"output": {"errors": "none", "fields_interval": 1.0e-3}}))
    done = gapbeam.run(case, output=tmp_path / "run")
    assert done.exit_status == 0, done.message
    results = gapbeam.open_results(tmp_path / "run")
    shift = shifts_at_probes(results.case, supports_of(results.summary, results.case), results.history)["tip"]
    moved = results.history["support_displacement"].sel(support_body="left")
    np.testing.assert_array_equal(shift, np.stack([moved.sel(support_axis=axis) for axis in "yz"], axis=1))
    assert np.all(np.abs(shift[0]) > 1.0e-5)


def test_a_sweep_reaches_a_spring(tmp_path: Path) -> None:
    """Keys of a body are swept by the name of the support."""
    key = "support.left.body.stiffness"
    gapbeam.sweep(written(tmp_path), {key: [2.0e4, 8.0e4]}, output=tmp_path / "sweep", workers=1)
    with (tmp_path / "sweep" / "sweep.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [float(row[key]) for row in rows] == [2.0e4, 8.0e4]


def last_period(folder: Path) -> xr.DataArray:
    """Return the motion of the left body over the last 40 ms."""
    moved = gapbeam.open_results(folder).history["support_displacement"].sel(support_body="left", support_axis="y")
    return moved[-201:]


@pytest.mark.slow(minutes=0.1)
def test_periodic_responses(tmp_path: Path) -> None:
    """Shooting finds where a march ends, and that it is stable; harmonic balance comes near."""
    march = gapbeam.run(shaken(time={"end": 0.8, "step": 2.0e-4}), output=tmp_path / "march")
    assert march.exit_status == 0
    wanted = last_period(tmp_path / "march").values
    for method, limit in (("shooting", 2.0e-3), ("harmonic-balance", 2.0e-2)):
        analysis = {"type": "periodic", "method": method}
        done = gapbeam.run(shaken(analysis=analysis, time={"end": 0.4, "step": 2.0e-4}), output=tmp_path / method)
        assert done.exit_status == 0, done.message
        found = last_period(tmp_path / method).values
        assert np.max(np.abs(found - wanted)) < limit * np.ptp(wanted)
        assert done.summary["periodic"]["stable"] is (True if method == "shooting" else None)  # too few harmonics


@pytest.mark.slow(minutes=0.1)
@alone
@pytest.mark.versions
def test_two_ranks(tmp_path: Path) -> None:
    """The histories of a reduced model agree; along the beam, which the weak restraint alone holds, its forces do.

    Round-off in forces, a share e of them, moves the beam by e F / k there: as much as the spring k is soft.
    """
    case = written(tmp_path, model={"type": "reduced"}, time={"end": 0.02, "step": 2.0e-4})
    assert gapbeam.run(case, (), tmp_path / "1").exit_status == 0
    done = on_ranks(2, "run", case, "--output", tmp_path / "2")
    assert done.returncode == 0, done.stderr
    results = [gapbeam.open_results(tmp_path / name) for name in ("1", "2")]
    far = {name: apart for name, apart in disagreements(results).items() if not apart <= CLOSE}
    assert far.keys() <= {"displacement", "restraint_energy"}
    moved, other = (found.history["displacement"] for found in results)
    apart = np.abs(moved - other).max(("time", "probe"))
    assert float(apart.sel(component="y")) <= CLOSE * float(np.abs(moved).max())
    force = float(results[0].history["contact_force"].max())
    assert axial_restraint(gapbeam.read_case(case)).value * float(apart.sel(component="x")) <= CLOSE * force
    one, two = (found.history["support_displacement"].values for found in results)
    np.testing.assert_allclose(two, one, atol=1e-6 * np.abs(one).max())


def test_a_trade_off_has_no_mesh_to_compare_with() -> None:
    """Its full model knows supports that stand still: refused before anything is computed."""
    with pytest.raises(UserError, match=r"support.left.body: the trade-off compares with a full model"):
        plan_levels(gapbeam.read_case(shaken()))


def test_modes_name_the_bodies() -> None:
    """Free of contact, each body vibrates alone on its spring: sqrt(k / m) / 2 pi."""
    model = gapbeam.model(gapbeam.read_case(shaken())).model
    _, free, _ = held_modes(model, 1)
    alone_at = [f for f, one in zip(free.frequencies, free.motions, strict=True) if one.kind == "support"]
    assert alone_at == pytest.approx([np.sqrt(1.0e5) / (2.0 * np.pi)] * 2, rel=1e-12)


def test_flat_cases_have_no_bodies() -> None:
    """Supports that stand still add no unknown, no record and no key to results."""
    model = gapbeam.model(gapbeam.read_case(tables(stops()))).model
    assert model.system.operators.size == model.body.operators.size
    assert model.system.dashpots is None
