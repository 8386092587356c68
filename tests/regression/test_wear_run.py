"""Runs that measure wear: figures, the same motion, resumed, on two ranks, swept, reported, refused."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gapbeam
from gapbeam.postprocess.report.blocks import TableBlock
from gapbeam.postprocess.report.sections.contact_section import wear_section
from gapbeam.postprocess.results.columns_of_run import rows_by_face, wear_of
from gapbeam.postprocess.results_errors import ResultsError
from gapbeam.solver.case.case import Case, case_to_toml
from gapbeam.solver.march.compiled.compiled_march import why_not_compiled
from gapbeam.solver.messages.errors import CaseError, UserError
from gapbeam.solver.models.body import body_key
from gapbeam.solver.run.stop_rule import StopRule
from tests.parallel.test_ranks_agree import CLOSE, disagreements
from tests.regression.test_random_statistics_run import CASE, KEYS
from tests.shared.command import alone, on_ranks
from tests.shared.interrupted import differing, run_in_parts
from tests.verification.test_rubbing_beam import SLICE

WEAR = ("wear.coefficient=2e-14", "wear.area=1e-5")
RUBBING: dict[str, Any] = {
    "model": {"type": "beam", "elements": 51},
    "output": {"errors": "none"},
    "time": {"end": 0.02, "step": 1.0e-4},
    "wear": {"coefficient": 2.0e-14},
}


@pytest.fixture(scope="module")
def worn(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run under noise that measures wear."""
    folder = tmp_path_factory.mktemp("worn") / "run"
    outcome = gapbeam.run(CASE, (*KEYS, *WEAR), folder)
    assert outcome.exit_status == 0, outcome.message
    return folder


def test_rates_are_those_of_the_records(worn: Path) -> None:
    """Work per time behind the burn-in, within the interval; volume and depth by coefficient and area."""
    results = gapbeam.open_results(worn)
    found, statistics = results.summary["wear"], results.summary["statistics"]
    assert why_not_compiled(gapbeam.model(gapbeam.read_case(CASE, [*KEYS, *WEAR])).plan) is None
    history = results.history["sliding_work"]
    assert history.attrs["units"] == "J"
    time, work = history["time"].values, history.values
    assert np.all(np.diff(work, axis=0) >= 0.0)
    first = int(np.searchsorted(time, statistics["burn_in"] - 1e-9))
    for face, name in enumerate(("base", "gland")):
        of_face = found["faces"][name]
        assert of_face["work"] == pytest.approx(work[-1, face], rel=1e-12)
        rate = of_face["work_rate"]
        assert rate["value"] == pytest.approx((work[-1, face] - work[first, face]) / (time[-1] - time[first]), rel=0.02)
        assert 0.0 < rate["low"] < rate["value"] < rate["high"]
        figure = next(one for one in statistics["figures"] if one["name"] == f"face.{name}.work_rate")
        assert [figure[key] for key in rate] == list(rate.values())
        for key in ("value", "low", "high"):
            assert of_face["volume_rate"][key] == pytest.approx(2e-14 * rate[key], rel=1e-12)
            assert of_face["depth_rate"][key] == pytest.approx(2e-14 * rate[key] / 1e-5, rel=1e-12)


def test_parts_and_maps_have_intervals(worn: Path) -> None:
    """Parts add up to the work rate of the face, points too; the largest of a map is that of its points."""
    found, maps = gapbeam.open_results(worn).summary["wear"], wear_of(worn)
    rows = rows_by_face(worn, "wear")
    for name, of_face in found["faces"].items():
        parts, whole = of_face["work_rate_by_mode"], of_face["work_rate"]["value"]
        assert sum(one["value"] for one in parts.values()) == pytest.approx(whole, rel=1e-9)
        for mode in ("impact", "sliding"):
            assert 0.0 < parts[mode]["low"] < parts[mode]["value"] < parts[mode]["high"], mode
        settled, largest = rows[name][:, -3:], of_face["largest"]
        assert settled[:, 0].sum() == pytest.approx(whole, rel=0.1), "blocks of points are longer"
        assert np.all((settled[:, 1] <= settled[:, 0]) & (settled[:, 0] <= settled[:, 2]))
        density, rate = settled[:, 0] / maps[name].area, largest["work_rate_per_area"]
        assert rate["value"] == pytest.approx(density.max(), rel=1e-12)
        assert largest["x"] == maps[name].x[np.argmax(density)]
        assert rate["low"] <= rate["value"] <= rate["high"]
        assert largest["depth_rate"]["high"] == pytest.approx(2e-14 * rate["high"], rel=1e-12)
        assert largest["points"] == len(density)


def test_the_report_has_every_rate(worn: Path) -> None:
    """Three rates of two faces, with intervals; nothing in the report of a run without wear."""
    section = wear_section(gapbeam.open_results(worn).summary, wear_of(worn))
    assert section is not None
    table, parts, rates, largest, where = [block for block in section.blocks if isinstance(block, TableBlock)]
    assert [row[:2] for row in table.rows] == [
        (face, f"{rate} rate") for face in ("base", "gland") for rate in ("work", "volume", "depth")
    ]
    assert all(" to " in str(row[4]) for row in table.rows)
    assert [row[0] for row in parts.rows] == [row[0] for row in where.rows] == ["base", "gland"]
    assert all(sum(map(float, row[2:])) == pytest.approx(100.0) for row in parts.rows)
    assert {row[1] for row in rates.rows} == {"impact", "sliding"}, "nothing sticks without friction"
    assert all(" to " in str(row[3]) for row in rates.rows)
    assert [row[0] for row in largest.rows] == ["base", "gland"]
    assert all(" to " in str(row[4]) for row in largest.rows)
    assert wear_section({}, {}) is None


def test_the_points_add_up_to_the_faces(worn: Path) -> None:
    """Work rates of all points add up to the face's, depths over the area to its volume; a damaged file is refused."""
    results, maps = gapbeam.open_results(worn), wear_of(worn)
    for name, found in results.summary["wear"]["faces"].items():
        one = maps[name]
        assert one.rate.sum() * results.summary["wear"]["seconds"] == pytest.approx(found["work"], rel=1e-13)
        assert one.depth_rate is not None
        assert one.depth_rate @ one.area == pytest.approx(2e-14 * one.rate.sum(), rel=1e-13)
        assert set(one.angle) == {0.0 if name == "base" else 180.0}
        places, density = one.along(one.density)
        assert places[0] >= 0.0
        assert np.all(density >= 0.0)
        assert one.unevenness > 1.0
    (worn / "copy").mkdir()
    (worn / "copy" / "wear.csv").write_text((worn / "wear.csv").read_text()[:-60])
    with pytest.raises(ResultsError, match="expected work at contact points"):
        wear_of(worn / "copy")


@pytest.mark.slow(minutes=0.2)
def test_the_map_is_drawn(worn: Path) -> None:
    """`gapbeam plot` draws it."""
    assert worn / "figures" / "wear.png" in gapbeam.plot(worn)


def test_wear_changes_no_bit_of_the_motion(worn: Path, tmp_path: Path) -> None:
    """The same run without [wear] has the same records; sliding_work is not among them."""
    assert gapbeam.run(CASE, KEYS, tmp_path / "without").exit_status == 0
    with_wear, without = (gapbeam.open_results(path).history for path in (worn, tmp_path / "without"))
    assert set(with_wear.variables) - set(without.variables) == {
        "sliding_work",
        "work_by_mode",
        "worn_face",
        "slip_mode",
    }
    assert [name for name in without.variables if not with_wear[name].equals(without[name])] == []
    assert "wear" not in gapbeam.open_results(tmp_path / "without").summary


@pytest.mark.slow(minutes=0.1)
def test_a_resumed_run_has_the_same_intervals(worn: Path, tmp_path: Path) -> None:
    """Of faces, parts, points and the largest of a map: stopped and continued, no bit differs."""
    parts = run_in_parts(CASE, (*KEYS, *WEAR), tmp_path / "parts", stops=(4, 9))
    assert parts.exit_status == 0, parts.message
    whole = gapbeam.open_results(worn).summary
    assert parts.summary["wear"] == whole["wear"]
    assert parts.summary["statistics"] == whole["statistics"]
    assert (tmp_path / "parts" / "wear.csv").read_text() == (worn / "wear.csv").read_text()


@pytest.mark.slow(minutes=0.1)
@pytest.mark.parametrize("rubs", [False, True], ids=["compiled", "python"])
def test_a_resumed_run_has_the_same_work(rubs: bool, tmp_path: Path) -> None:
    """Stopped and continued: no bit differs. Without noise there are no intervals."""
    case = tmp_path / "case.toml"
    smooth = {} if rubs else {"contact": {"stiffness": 2.0e10}}
    case.write_text(case_to_toml(gapbeam.read_case(SLICE | RUBBING | smooth)))
    whole = gapbeam.run(case, (), tmp_path / "whole")
    assert whole.exit_status == 0, whole.message
    parts = run_in_parts(case, (), tmp_path / "parts", (60 if rubs else 2,))
    assert parts.exit_status == 0, parts.message
    assert parts.summary["resumed"]
    assert differing(tmp_path / "whole", tmp_path / "parts") == []
    assert parts.summary["wear"] == whole.summary["wear"]
    for of_face in whole.summary["wear"]["faces"].values():
        assert of_face["work_rate"] == {"value": of_face["work"] / 0.02, "low": None, "high": None}
        assert of_face["verdict"] == "no interval"
        assert of_face["depth_rate"] is None
    assert max(of_face["work"] for of_face in whole.summary["wear"]["faces"].values()) > 0.0


@pytest.mark.slow(minutes=0.3)
@alone
def test_two_ranks(tmp_path: Path) -> None:
    """A full model without friction: the work agrees on one rank and on two."""
    case = tmp_path / "case.toml"
    changes = RUBBING | {"model": {"type": "full"}, "contact": {"stiffness": 2.0e10}}
    case.write_text(case_to_toml(gapbeam.read_case(SLICE | changes | {"time": {"end": 2e-3, "step": 1e-4}})))
    assert gapbeam.run(case, (), tmp_path / "1").exit_status == 0
    done = on_ranks(2, "run", case, "--output", tmp_path / "2")
    assert done.returncode == 0, done.stderr
    results = [gapbeam.open_results(tmp_path / name) for name in ("1", "2")]
    assert float(results[0].history["sliding_work"].values[-1].max()) > 0.0
    assert {name: apart for name, apart in disagreements(results).items() if not apart <= CLOSE} == {}


def test_the_coefficient_shares_the_body() -> None:
    """Coefficient and area are cheap to change; measuring at all is not."""
    read = [gapbeam.read_case(CASE, [*KEYS, *keys]) for keys in (WEAR, ("wear.coefficient=1e-13",), ())]
    assert body_key(read[0]) == body_key(read[1]) != body_key(read[2])


def test_a_run_can_end_by_its_work_rate() -> None:
    """The figure is one to ask for with [wear], and refused with the reason without."""
    rule = StopRule("face.base.work_rate", 0.5, 0.3)
    rule.refuse_misfit(gapbeam.read_case(CASE, [*KEYS, *WEAR]))
    with pytest.raises(UserError, match=r"without \[wear\]"):
        rule.refuse_misfit(gapbeam.read_case(CASE, [*KEYS]))


PLACED = {"name": "front", "from": 0.0, "to": 0.05, "clearance": 1.0e-4}
FAULTS: dict[str, tuple[dict[str, Any], str]] = {
    "coefficient without wear": (
        {"support": [PLACED | {"wear": 1e-14}], "wear": None},
        r"support.*wear.*without \[wear\]",
    ),
    "area alone": ({"wear": {"area": 1e-5}}, "without a coefficient"),
    "formulation": (
        {"wear": {}, "contact": {"formulation": "nitsche"}, "model": {"type": "full"}},
        "the work of sliding, with the formulation nitsche",
    ),
    "a hole that moves": (
        {
            "wear": {},
            "beam": {"length": 0.51, "thickness": 0.02, "width": 0.02, "section": "round"},
            "mesh": {"dimension": 3, "size": 0.02, "support_size": 0.01},
            "support": [PLACED | {"region": "hole"}],
            "load": [{"type": "support_motion", "support": "front", "amplitude": 1e-4, "frequency": 20.0}],
        },
        "the work of sliding, with support_motion of the hole front",
    ),
    "negative": ({"wear": {"coefficient": -1e-14}}, "coefficient"),
    "unknown": ({"wear": {"depth": 1e-4}}, "depth"),
}


@pytest.mark.parametrize("name", FAULTS)
def test_contradictions_are_refused(name: str) -> None:
    """Each with what was found."""
    changes, message = FAULTS[name]
    tables = {key: value for key, value in (SLICE | RUBBING | {"contact": {}} | changes).items() if value is not None}
    with pytest.raises(CaseError, match=f"(?s){message}"):
        gapbeam.read_case(tables)


@pytest.mark.parametrize("size", [1.0e-5, 1.0, 50.0])
@pytest.mark.parametrize("noisy", [True, False])
def test_what_does_not_slide_has_no_wear_rate(tmp_path: Path, size: float, noisy: bool) -> None:
    """A rigid block pressed between plates moves straight up and down; a force beside its middle rocks and rubs it."""
    second = size**0.5  # accelerations are those of gravity, at any size
    shake = {"type": "base_motion", "amplitude": 4.0, "frequency": 40.0 / second}
    spectrum = {"type": "white", "density": 0.04 * second, "high": 99.0 / second}
    noise = {"type": "random", "quantity": "acceleration", "spectrum": spectrum}
    weight = 7850.0 * 0.2 * 0.02**2 * size**3 * 9.81
    force = {"type": "harmonic_force", "point": 0.15 * size, "amplitude": 0.1 * weight, "frequency": 20.0 / second}
    stiffness = 3.0e3 * weight / size
    plates = {"clearance": -4.0 * weight / stiffness, "support_stiffness": stiffness}
    tables: dict[str, Any] = {
        "beam": {"length": 0.2 * size, "thickness": 0.02 * size, "width": 0.02 * size},
        "material": {"young_modulus": 2.1e11, "poisson_ratio": 0.3, "density": 7850.0},
        "model": {"type": "rigid"},
        "support": [
            {"name": "left", "from": 0.0, "to": 0.02 * size, **plates},
            {"name": "right", "from": 0.18 * size, "to": 0.2 * size, **plates},
        ],
        "contact": {"law": {"type": "kelvin-voigt", "restitution": 0.5}},
        "wear": {"coefficient": 2.0e-14},
        "output": {"errors": "none"},
        "time": {"end": second, "step": 1.0e-3 * second},
    }
    found = {}
    for name, loads in {"straight": [], "rocked": [force]}.items():
        case = Case.model_validate({**tables, "load": [{"type": "gravity"}, noise if noisy else shake, *loads]})
        outcome = gapbeam.run(case, output=tmp_path / name)
        assert outcome.exit_status == 0, outcome.message
        found[name] = outcome.summary["wear"]["faces"]
    for one in found["straight"].values():
        assert one["work_rate"]["value"] == one["volume_rate"]["value"] == one["work"] == 0.0
        assert one["verdict"] == ("no event" if noisy else one["verdict"])
    for one in found["rocked"].values():
        assert one["work_rate"]["value"] > 1e-9 * weight * size / second
        assert one["verdict"] != "no event"
