"""The life of supports that wear: the study on small cases, its files, its ends, and what it refuses."""

from __future__ import annotations

import csv
import json
from math import log
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gapbeam
from gapbeam.postprocess.report.blocks import TableBlock, Verdict
from gapbeam.postprocess.report.sections.curve_section import life_sections
from gapbeam.solver.case.case import case_to_toml
from gapbeam.solver.messages.errors import CaseError
from gapbeam.studies.life.case_rates import CaseRates
from gapbeam.studies.life.worn_case import YEAR, long_time, time_words, worn_case
from gapbeam.studies.life.worn_march import Blocks, wear_down
from tests.shared.command import alone, called

LIMIT = 5.0e-5  # m
GENTLE: dict[str, Any] = {
    "beam": {"length": 0.5, "thickness": 0.012, "width": 0.02},
    "material": {"young_modulus": 2.1e11, "poisson_ratio": 0.3, "density": 7900.0},
    "damping": {"frequencies": [40.0, 300.0], "ratios": [0.05, 0.05]},
    "support": {"length": 0.05, "clearance": 1.07e-4},
    "mesh": {"dimension": 2, "size": 0.05, "support_size": 0.02, "cells_through_thickness": 2},
    "model": {"type": "beam", "elements": 10},
    "contact": {"stiffness": 1.0e11, "damping": 3.0e6},
    "load": [
        {"type": "gravity"},
        {"type": "harmonic_force", "name": "shaker", "point": 0.5, "amplitude": 8.0, "frequency": 25.0},
    ],
    "probe": [{"name": "tip", "point": 0.5}],
    "time": {"end": 0.4, "step": 1.0e-4, "scheme": "discrete-gradient"},
    "output": {"errors": "none"},
    "wear": {"coefficient": 2.0e-14, "area": 1.0e-5, "depth_limit": LIMIT},
}
NOISE = {
    "type": "random",
    "name": "shaker",
    "quantity": "acceleration",
    "seed": 1,
    "ramp": 0.05,
    "spectrum": {"type": "white", "density": 3.0, "low": 10.0, "high": 300.0},
}
NOISY = GENTLE | {"load": [{"type": "gravity"}, NOISE]}


def test_a_life_is_found_written_and_gone_on_with(tmp_path: Path) -> None:
    """Few short runs: files agree, another call makes no run, more runs go on, and what differs is refused."""
    folder = tmp_path / "life"
    found = gapbeam.life(NOISY, runs=3, output=folder)
    assert (found.exit_status, found.worn.reason, found.worn.runs, found.kept) == (5, "runs", 3, 0)
    assert "is not reached" in found.headline()
    again = gapbeam.life(NOISY, runs=60, tolerance=0.02, output=folder)
    assert again.kept == 3
    assert again.exit_status == 0
    worn = again.worn
    assert worn.low is not None
    assert worn.high is not None
    assert worn.life is not None
    assert worn.low < worn.life < worn.high
    stored = json.loads((folder / "life.json").read_text())
    assert stored["reached"]
    assert stored["life"] == worn.life
    assert stored["face"] in ("base", "gland")
    last = stored["states"][-1]
    assert max(last["depths"]) == pytest.approx(LIMIT)
    assert last["clearances"]["support"] == pytest.approx(1.07e-4 + sum(last["depths"]))
    rows = list(csv.DictReader((folder / "life.csv").open()))
    assert [float(row["time"]) for row in rows] == [state["time"] for state in stored["states"]]
    assert [float(row["base_depth"]) for row in rows] == [state["depths"][0] for state in stored["states"]]
    assert "95 %" in again.headline()
    with pytest.raises(
        gapbeam.UserError, match=r"holds a study of other inputs: .*wear\.depth_limit: \S+ there, 0\.0001 now"
    ):
        gapbeam.life(NOISY, {"wear.depth_limit": 1e-4}, output=folder)
    summary, over_time, runs = life_sections(folder, "gapbeam report")
    assert isinstance(summary.blocks[0], Verdict)
    assert summary.blocks[0].text == again.headline()
    assert len(over_time.blocks) == 2
    assert isinstance(runs.blocks[0], TableBlock)
    assert len(runs.blocks[0].rows) == 2 * len(stored["states"])
    early = gapbeam.life(NOISY, at_most=0.3 * worn.life, output=tmp_path / "early")
    assert (early.exit_status, early.worn.reason) == (0, "time")
    assert early.worn.states[-1].time == pytest.approx(0.3 * worn.life)


@pytest.mark.slow
def test_blocks_of_half_the_length_change_a_life_by_less_than_its_error() -> None:
    """A beam that rattles with its shaker: without chance, the blocks alone make the error."""
    tables = GENTLE | {"time": GENTLE["time"] | {"end": 4.4}}
    rates = CaseRates(gapbeam.read_case(tables))
    found, halved = (wear_down(rates, 2, Blocks(LIMIT, factor=factor)) for factor in (1.0, 0.5))
    assert found.life is not None
    assert halved.life is not None
    assert found.chance < 1e-3
    assert halved.runs > found.runs
    assert 0.0 < abs(found.life - halved.life) < found.block_error < 0.02 * found.life
    assert set(found.states[-1].rates.verdicts) == {"good"}


@pytest.mark.slow
def test_a_load_that_is_0_17_percent_larger() -> None:
    """Work rates of four signals, 0.17 % larger or not: most within the interval of the other, all overlap."""
    louder = NOISE | {"spectrum": NOISE["spectrum"] | {"density": 3.0 * 1.0017**2}}
    base = NOISY | {"time": GENTLE["time"] | {"end": 20.0}, "output": {"errors": "none", "history_interval": 1.0e-3}}
    cases = [gapbeam.read_case(base | {"load": [{"type": "gravity"}, noise]}) for noise in (NOISE, louder)]
    first, second = (CaseRates(case) for case in cases)
    inside = 0
    for number in range(4):
        a, b = (rates(np.zeros(2), number) for rates in (first, second))
        widths = [log(one.high[0] / one.low[0]) for one in (a, b)]
        assert max(widths) < 0.8
        apart = abs(log(a.values[0] / b.values[0]))
        assert apart < sum(widths) / 2.0
        inside += apart < min(widths) / 2.0
    assert inside >= 2


def test_gaps_grow_by_the_depths_of_their_faces() -> None:
    """A slot by both of its faces, each on its side; a stop and a hole by one; other noise in every run."""
    placed = {"from": 0.0, "to": 0.05, "clearance": 1.0e-4}
    support = [
        placed | {"name": "slot", "offset": 1.0e-5},
        placed | {"name": "stop", "from": 0.2, "to": 0.23, "region": "stop"},
    ]
    case = gapbeam.read_case(NOISY | {"support": support})
    worn = worn_case(case, [1e-5, 3e-5, 2e-5], 2)
    gaps = [face.gap for face in case.layout.faces]
    assert [face.gap for face in worn.layout.faces] == pytest.approx([gaps[0] + 1e-5, gaps[1] + 3e-5, gaps[2] + 2e-5])
    assert worn.load[1].seed != case.load[1].seed  # type: ignore[union-attr]
    assert worn_case(case, [0.0, 0.0, 0.0]) == case


def test_each_support_has_its_own_limit(tmp_path: Path) -> None:
    """The limit of a support counts instead of that of [wear]: the first to come ends the life, by its name."""
    slot = {"from": 0.0, "to": 0.05, "clearance": 1.07e-4}
    far = {"name": "far", "from": 0.3, "to": 0.32, "clearance": 1.0e-4, "region": "stop", "depth_limit": 1.0e-3}
    wear = {"coefficient": 2.0e-14, "depth_limit": 1.0e-3}
    ends = []
    for limit, area in ((5.0e-5, 1.0e-5), (2.5e-5, 2.0e-5)):
        own = {"name": "slot", "depth_limit": limit, "area": area}
        tables = NOISY | {"support": [slot | own, far | {"area": 2.0e-5}], "wear": wear}
        found = gapbeam.life(tables, tolerance=0.5, output=tmp_path / f"{limit}")
        assert found.exit_status == 0, found.headline()
        name = found.faces[found.worn.first or 0]
        assert name.startswith("slot_")
        assert f"until {name} is worn by {1e3 * limit:g} mm" in found.headline()
        stored = json.loads((tmp_path / f"{limit}" / "life.json").read_text())
        assert (stored["limit"], stored["limits"]) == (limit, [limit, limit, 1.0e-3])
        ends.append(found.worn.states[0].rates.values)
    assert ends[0][:2] == pytest.approx(2.0 * ends[1][:2], rel=1e-12)
    assert ends[0][2] == pytest.approx(ends[1][2], rel=1e-12)


REFUSED: dict[str, tuple[dict[str, Any], str]] = {
    "no wear": ({"wear": None}, r"expected depth_limit, coefficient and area in .*; found no \[wear\]"),
    "no limit": ({"wear": {"coefficient": 1e-14, "area": 1e-5}}, "found no depth_limit"),
    "no limit of a support": (
        {
            "support": [
                {"name": "one", "from": 0.0, "to": 0.05, "clearance": 1e-4, "depth_limit": 1e-4},
                {"name": "two", "from": 0.3, "to": 0.32, "clearance": 1e-4, "region": "stop"},
            ],
            "wear": {"coefficient": 1e-14, "area": 1e-5},
        },
        "found no depth_limit for two",
    ),
    "nothing wears": ({"wear": {"coefficient": 0.0, "area": 1e-5, "depth_limit": 1e-4}}, "no coefficient but 0"),
    "too few records": ({"time": GENTLE["time"] | {"end": 0.002}}, "too few records"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_cases_without_a_life_are_refused(name: str, tmp_path: Path) -> None:
    """Each with what was found."""
    changes, message = REFUSED[name]
    tables = {key: value for key, value in (GENTLE | changes).items() if value is not None}
    with pytest.raises(gapbeam.UserError, match=message):
        gapbeam.life(tables, output=tmp_path / "life")


@pytest.mark.parametrize(
    ("wear", "message"),
    [
        ({"coefficient": 1e-14, "depth_limit": 1e-4}, "without the worn area"),
        ({"coefficient": 1e-14, "area": 1e-5, "depth_limit": -1e-4}, "depth_limit"),
        ({"coefficient": 1e-14, "area": 1e-5, "depth_limit": 0.0}, "depth_limit"),
    ],
)
def test_limits_that_make_no_sense_are_faults(wear: dict[str, float], message: str) -> None:
    """Of the case, with status 2."""
    with pytest.raises(CaseError, match=message):
        gapbeam.read_case(GENTLE | {"wear": wear})


@pytest.mark.parametrize(
    ("own", "wear", "message"),
    [
        ({"depth_limit": 1e-4}, None, r"depth_limit\n  found:    0.0001 m, without \[wear\]"),
        ({"area": 1e-5}, None, r"area\n  found:    1e-05 m\^2, without \[wear\]"),
        ({"area": 1e-5}, {}, r"area\n  found:    1e-05 m\^2, without a coefficient"),
        ({"depth_limit": 1e-4}, {"coefficient": 1e-14}, "depth_limit\n  found:    0.0001 m, without the worn area"),
        ({"area": -1e-5}, {"coefficient": 1e-14}, "area"),
    ],
)
def test_keys_of_a_support_that_make_no_sense_are_faults(
    own: dict[str, float], wear: dict[str, float] | None, message: str
) -> None:
    """Without [wear], without a coefficient or an area."""
    support = [{"name": "one", "from": 0.0, "to": 0.05, "clearance": 1e-4} | own]
    tables = {key: value for key, value in GENTLE.items() if key != "wear"} | {"support": support}
    with pytest.raises(CaseError, match=message):
        gapbeam.read_case(tables if wear is None else tables | {"wear": wear})


def test_what_does_not_slide_has_no_life(tmp_path: Path) -> None:
    """A stop that is never met: one run, status 5, and words that say so."""
    support = [
        {"name": "grip", "from": 0.0, "to": 0.05, "clearance": 1.0e-4, "wear": 0.0},
        {"name": "far", "from": 0.3, "to": 0.32, "clearance": 5.0e-3, "region": "stop"},
    ]
    found = gapbeam.life(NOISY | {"support": support}, output=tmp_path / "life")
    assert (found.exit_status, found.worn.reason, found.worn.runs) == (5, "nothing slides", 1)
    assert "nothing slides" in found.headline()


@alone
def test_the_command(tmp_path: Path) -> None:
    """Status 5 with its words where the limit is not reached, 0 at the time asked for; a wrong time is refused."""
    case = tmp_path / "case.toml"
    case.write_text(case_to_toml(gapbeam.read_case(NOISY)))
    output = tmp_path / "out"
    done = called("life", str(case), "--runs", "2", "--output", str(output))
    assert done.returncode == 5, done.stderr
    assert "is not reached" in done.stdout
    assert (output / "life.csv").exists()
    early = called("life", str(case), "--at-most", "1h", "--runs", "2", "--output", str(tmp_path / "early"))
    assert early.returncode == 0, early.stderr
    assert "after 1 h: " in early.stdout
    assert "no face reaches its limit" in early.stdout
    depths = json.loads((tmp_path / "early" / "life.json").read_text())["depths"]
    assert all(one["low"] <= one["depth"] <= one["high"] for one in depths.values())
    assert max(one["depth"] for one in depths.values()) > 0.0
    wrong = called("life", str(case), "--at-most", "soon", "--output", str(output))
    assert wrong.returncode == 2
    assert "40y" in wrong.stderr


def test_long_times_are_read_and_written() -> None:
    """Years, days, hours, seconds; nonsense is none."""
    assert long_time("40y") == 40.0 * YEAR
    assert (long_time("300d"), long_time("2000h"), long_time("90")) == (300.0 * 86400.0, 7.2e6, 90.0)
    assert [long_time(text) for text in ("soon", "-3d", "0", "")] == [None] * 4
    assert (time_words(2.0 * YEAR), time_words(7200.0), time_words(0.0)) == ("2 years", "2 h", "0 s")
