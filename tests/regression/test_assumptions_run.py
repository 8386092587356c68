"""Runs that leave what their equations assume: status, reason, the table, and what the report shows of it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gapbeam
from gapbeam.solver.diagnostics.assumption import FrequencyContent
from gapbeam.solver.diagnostics.energy_ledger import Ledger
from gapbeam.solver.run.assumptions.frequency_findings import of_resonance
from tests.shared.command import DEMO, PROJECT, alone, called, on_ranks, settings

pytestmark = alone

CLAMPED = PROJECT / "cases" / "clamped.toml"
BEAM = ("model.type=beam",)
RESONANT = (
    *BEAM,
    "time.step=4e-4",
    "load.shaker.amplitude=0.2",
    "load.shaker.frequency=45.8",
    "damping.ratios=[0.002,0.002]",
    "output.history_interval=4e-4",
    "output.fields_interval=0.4",
    "time.end=2.0",
)
NAMES = [
    "small rotation",
    "small strain",
    "inside the support",
    "linear seat",
    "penetration beside the thickness",
    "penetration beside the clearance",
    "contacts resolved by the step",
    "weak restraint",
    "step beside the frequencies",
    "damping of the scheme",
    "resonance beside the scheme",
]


def run(folder: Path, case: Path, *overrides: str) -> dict[str, Any]:
    """Run a case and return its summary, with what was said and the exit status."""
    done = called("run", case, *settings(*overrides), "--output", folder)
    assert "Traceback" not in done.stderr
    summary: dict[str, Any] = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    assert summary["exit_status"] == done.returncode
    assert summary["message"] in done.stderr + done.stdout
    return summary


def finding(summary: dict[str, Any], name: str) -> dict[str, Any]:
    """Return one row of the table."""
    return next(one for one in summary["assumptions"] if one["name"] == name)


@pytest.mark.slow(minutes=0.1)
def test_a_small_motion_holds_and_is_shown(tmp_path: Path) -> None:
    """The demo stays inside of every limit: one table in summary and report, one line in the log."""
    summary = run(tmp_path, DEMO, *BEAM, "time.end=0.1", "material.yield_stress=3.55e8")
    names = [one["name"] for one in summary["assumptions"]]
    assert names[:5] == [*NAMES[:4], "no yield"]
    assert set(NAMES) < set(names)
    assert {one["verdict"] for one in summary["assumptions"]} == {"holds"}
    rotation = finding(summary, "small rotation")
    assert 0.0 < rotation["closest"] < 0.02
    assert rotation["error_estimate"] == pytest.approx(rotation["closest"] ** 2 / 2.0)
    assert rotation["place"][0] > 0.4
    assert 0.0 < rotation["time"] <= 0.1
    log = (tmp_path / "run.log").read_text(encoding="utf-8")
    page = next(path for path in gapbeam.report(tmp_path) if path.suffix == ".html").read_text(encoding="utf-8")
    closest = max(summary["assumptions"], key=lambda one: one["share_of_limit"])["name"]
    assert f"{len(names)} of {len(names)} assumptions hold; closest to its limit: {closest}: " in log
    for name in names:
        assert name in page


@pytest.mark.parametrize(
    ("overrides", "name"),
    [
        (("load.shaker.amplitude=1e6", "time.end=0.05"), "small rotation"),
        (("material.young_modulus=1e6", "time.end=0.05"), "linear seat"),
    ],
)
def test_absurd_displacements_end_with_status_4(tmp_path: Path, overrides: tuple[str, ...], name: str) -> None:
    """7 m of a beam of half a meter, and one of 1 MPa: status 4 with a reason of its own; records up to then stay."""
    summary = run(tmp_path, DEMO, *BEAM, *overrides)
    assert (summary["status"], summary["exit_status"], summary["reason"]) == ("failed", 4, "assumption broken")
    one = finding(summary, name)
    assert one["verdict"] == "failure"
    assert one["closest"] > one["failure_limit"]
    assert name in summary["message"]
    assert "rotation^2 / 2" in summary["message"]
    assert gapbeam.open_results(tmp_path).history.sizes["time"] >= 1


def test_a_rotation_beyond_small_ones_is_warned_of_with_its_error(tmp_path: Path) -> None:
    """0.1 to 0.5 rad: status 0, and a warning that gives the error estimate."""
    summary = run(tmp_path, DEMO, *BEAM, "load.shaker.amplitude=1.5e4", "time.end=0.06", "contact.stiffness=1e12")
    rotation = finding(summary, "small rotation")
    assert 0.1 < rotation["closest"] < 0.5
    assert rotation["verdict"] == "warning"
    warning = next(text for text in summary["warnings"] if text.startswith("small rotation: "))
    assert f"off by about {50.0 * rotation['closest'] ** 2:.2g} %" in warning


def test_a_beam_that_leaves_its_support(tmp_path: Path) -> None:
    """Pushed along x with a soft restraint: the run ends when half of the faces are outside, with status 4."""
    text = DEMO.read_text(encoding="utf-8")
    text = text.replace("amplitude = 20.0 ", "direction = [1.0, 0.0]\namplitude = 20.0 ")
    case = tmp_path / "pushed.toml"
    case.write_text(text, encoding="utf-8")
    pushed = ("model.type=rigid", "restraint.axial=1.0", "load.shaker.frequency=0.5", "time.end=0.3")
    summary = run(tmp_path / "out", case, *pushed)
    travel = finding(summary, "inside the support")
    assert (summary["exit_status"], summary["reason"]) == (4, "assumption broken")
    assert "travel along the support" in summary["message"]
    assert travel["detail"] == f"{0.05 * travel['closest']:.3g} m along a support of 0.05 m"
    assert "contact stays at the sections that lay in the support at the start" in summary["message"]
    assert "load shaker drives this motion" in summary["message"]
    assert 0.5 < travel["closest"] < 0.55
    displacement = gapbeam.open_results(tmp_path / "out").history["displacement"]
    moved = float(displacement.sel(probe="tip", component="x").sel(time=travel["time"]).values)
    assert travel["closest"] == pytest.approx(moved / 0.05, rel=1e-3)


@pytest.mark.parametrize("share", [0.3, 0.9])
@pytest.mark.parametrize("dimension", [2, 3])
def test_what_friction_holds_is_advised_to_load_after_the_start(share: float, dimension: int, tmp_path: Path) -> None:
    """Seats have no friction: a bar pulled by less than mu W leaves its guides; loaded as advised, it but creeps."""
    length, side, density, mu = 1.0, 0.02, 7850.0, 0.3
    pull = share * mu * density * 9.81 * side**2 * length
    guides = [{"name": name, "from": at, "to": at + 0.02, "clearance": 1e-4}
              for name, at in (("left", 0.1), ("right", 0.88))]  # fmt: skip
    tables: dict[str, Any] = {
        "beam": {"length": length, "thickness": side, "width": side},
        "material": {"young_modulus": 2.1e11, "poisson_ratio": 0.3, "density": density},
        "model": {"type": "beam"},
        "mesh": {"dimension": dimension},
        "support": guides,
        "contact": {"friction": {"coefficient": mu}},
        "probe": [{"name": "tip", "point": length}],
        "time": {"end": 0.02},
    }
    force = {"name": "pull", "point": length, "amplitude": pull, "direction": [1.0, 0.0, 0.0][:dimension]}
    loads = [{"type": "gravity"}, {"type": "constant_force", **force}]
    slid = gapbeam.run(tables | {"load": loads}, output=tmp_path / "slid")
    assert slid.exit_status == 4
    assert "load pull moves it in the seat, which is found without friction" in slid.message
    loads[1] = {"type": "step_force", "ramp": 0.005, **force}
    held = gapbeam.run(tables | {"load": loads}, output=tmp_path / "held")
    assert held.exit_status == 0, held.message
    creep = held.summary["friction"]["slip_velocity"] * share / np.sqrt(1.0 - share**2)
    assert np.abs(held.history["displacement"].sel(component="x")).max() < 3.0 * creep * 0.02 + 1e-7


@pytest.mark.parametrize("at", [0.05, 0.15])
@pytest.mark.parametrize("thickness", [0.02, 0.05])
def test_travel_by_rotation_is_not_blamed_on_sliding(tmp_path: Path, at: float, thickness: float) -> None:
    """An arm on a hinge turns on its bump stop: neither a joint nor a restraint keeps its surface where it is."""
    tables = {
        "beam": {"length": 1.0, "thickness": thickness, "width": 0.03},
        "material": {"young_modulus": 7.0e10, "poisson_ratio": 0.33, "density": 2700.0},
        "support": [{"name": "bump", "from": at, "to": at + 0.02, "clearance": 1e-3, "region": "stop"}],
        "joint": [{"name": "hinge", "type": "pinned", "point": 0.0}],
        "contact": {"stiffness": 1e9},
        "model": {"type": "rigid"},
        "analysis": {"type": "transient", "motion": {"spin": 10.0, "point": 0.0}},
        "load": [{"type": "gravity"}],
        "output": {"errors": "none"},
        "time": {"end": 0.03},
    }
    done = gapbeam.run(tables, output=tmp_path / "out")
    travel = finding(done.summary, "inside the support")
    assert travel["verdict"] == "warning"
    (words,) = [one for one in done.summary["warnings"] if one.startswith("inside the support: ")]
    assert "rotation moves its surface along the support" in words
    assert "[[joint]]" not in words
    assert "[restraint]" not in words


PLATE = {"from": 0.15, "to": 0.17, "clearance": 1e-3}
BARS = {"type": "polygon", "walls": [0.0, 180.0]}


@pytest.mark.parametrize("model", [{"type": "beam", "elements": 8}, {"type": "rigid"}])
@pytest.mark.parametrize("second", [None, BARS])
def test_a_tube_that_crosses_its_play_has_not_slid_out(
    tmp_path: Path, second: object, model: dict[str, object]
) -> None:
    """It rolls aside about a hinge in a hole with play of a sixth of its radius, at two thirds of the bars, if any.

    Motion across is compared with the radius where a hole is met along it: bars are met by a round section at the same
    points wherever it lies between them. The travel is along the tube.
    """
    supports = [{"name": "plate", "region": "hole", **PLATE}]
    if second is not None:
        supports.append({"name": "bars", "region": second, "from": 0.27, "to": 0.28, "clearance": 2.5e-3})
    tables = {
        "beam": {"length": 0.3, "thickness": 0.012, "width": 0.012, "section": "round"},
        "material": {"young_modulus": 2.1e11, "poisson_ratio": 0.3, "density": 7850.0},
        "support": supports,
        "joint": [{"name": "hinge", "type": "pinned", "point": 0.0}],
        "contact": {"stiffness": 1e11, "damping": 1e6},
        "model": model,
        "load": [{"type": "gravity", "direction": [0.0, 1.0, -0.2]}],
        "analysis": {"type": "transient", "start": "centered"},
        "output": {"errors": "none"},
        "time": {"end": 0.05},
    }
    done = gapbeam.run(tables, output=tmp_path / "out")
    radii = finding(done.summary, "radii in supports around the beam")
    assert radii["closest"] == pytest.approx(1e-3 / 0.006, rel=0.15)
    assert 0.15 <= radii["place"][0] <= 0.17
    assert finding(done.summary, "inside the support")["closest"] < 0.01
    assert not any(one.startswith("inside the support") for one in done.summary["warnings"])


@pytest.mark.parametrize(
    ("scheme", "status", "reason", "least"),
    [
        ('"discrete-gradient"', 0, None, 0.0),
        ('{type="newmark",beta=0.36,gamma=0.7}', 3, "energy lost", 0.8),
        ('{type="generalized-alpha",rho_inf=0.0}', 4, "assumption broken", 0.6),
    ],
)
def test_schemes_that_damp_a_resonance(
    tmp_path: Path, scheme: str, status: int, reason: str | None, least: float
) -> None:
    """A sharp resonance: the share of its amplitude that a scheme takes ends the run where it is most of it."""
    summary = run(tmp_path, CLAMPED, *RESONANT, f"time.scheme={scheme}")
    assert (summary["exit_status"], summary["reason"]) == (status, reason)
    taken = finding(summary, "resonance beside the scheme")
    assert taken["closest"] >= least
    if status:
        assert taken["verdict"] == "failure"
        assert finding(summary, "damping of the scheme")["verdict"] == "warning"
    if reason == "energy lost":
        assert "gates.total_loss" in summary["message"]
        assert summary["energy"]["algorithmic_dissipation"] > 0.1 * summary["energy"]["exchanged"]
        allowed = run(tmp_path / "allowed", CLAMPED, *RESONANT, f"time.scheme={scheme}", "gates.total_loss=1.0")
        assert allowed["reason"] == "assumption broken"


def test_a_rattling_beam_is_at_no_resonance_of_the_formula() -> None:
    """Contact limits the amplitude: the same scheme at the same frequency is warned of, and no longer ends the run."""
    words = (*RESONANT, "time.scheme={type='generalized-alpha',rho_inf=0.0}")
    model = gapbeam.model(gapbeam.read_case(CLAMPED, words)).model
    content = FrequencyContent(np.full(100, 45.8))
    ledger = Ledger(1.0, 1.0, 0.0, 2.0, np.zeros(2), structural=0.1, largest_kinetic=1.0, absolute_work=1.1)
    smooth, rattling = (of_resonance(model.case, model, content, ledger, contacts) for contacts in (0, 1000))
    assert smooth.closest == rattling.closest > 0.5
    assert (smooth.verdict, rattling.verdict) == ("failure", "warning")
    assert rattling.estimate is None
    assert "contact limits the amplitude" in rattling.words


def test_a_beam_model_beyond_its_frequencies(tmp_path: Path) -> None:
    """Forced at 30 kHz, whose bending waves are hardly five times as long as the beam is thick: a warning."""
    forced = ("load.shaker.frequency=30000.0", "load.shaker.ramp=0.0", "time.step=5e-7", "time.end=5e-5")
    output = ("output.history_interval=5e-7", "output.fields_interval=5e-5")
    summary = run(tmp_path, DEMO, *BEAM, *forced, *output)
    slender = finding(summary, "beam model beside the wavelengths")
    assert slender["verdict"] == "warning"
    # Timoshenko's waves are a little shorter than Bernoulli's
    wave = (2.1e11 * 0.012**2 / (12.0 * 7919.0)) ** 0.25 * (2.0 * 3.14159 / 30000.0) ** 0.5
    assert slender["closest"] > 0.012 / wave
    assert any("waves through the thickness" in text for text in summary["warnings"])


@pytest.mark.slow(minutes=0.3)
def test_ranks_find_the_same(tmp_path: Path) -> None:
    """Two ranks watch a full model and find what one finds."""
    overrides = settings("time.end=0.01", "mesh.size=0.06", "output.fields_interval=0.01", *("load.shaker.ramp=0.0",))
    alone_found = run(tmp_path / "one", DEMO, *overrides[1::2])["assumptions"]
    done = on_ranks(2, "run", DEMO, *overrides, "--output", tmp_path / "two")
    assert done.returncode == 0, done.stderr
    both = json.loads((tmp_path / "two" / "summary.json").read_text(encoding="utf-8"))["assumptions"]
    assert [one["name"] for one in both] == [one["name"] for one in alone_found]
    for one, other in zip(alone_found[:4], both[:4], strict=True):
        assert one["closest"] == pytest.approx(other["closest"], rel=1e-6, abs=1e-12)
        assert one["place"] == pytest.approx(other["place"], abs=1e-9) if one["place"] else other["place"] is None
