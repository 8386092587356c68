"""Section 3 of the paper: its case is the ready one, its runs do what mechanics says, its tables say what runs say."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import gapbeam.studies.paper.adams_runs as runs
import gapbeam.studies.paper.section_three as module
from gapbeam.postprocess.report.blocks import ComparisonBlock, TableBlock, Verdict
from gapbeam.solver.case.reading.case_reader import read_case
from gapbeam.studies.paper.adams_plan import clearances, depths, main_run, main_runs, measured, variants
from gapbeam.studies.paper.adams_runs import Asked, G, RunFigures, adams_case, geometric_mean, run_one
from gapbeam.studies.paper.adams_tables import factors, sensitivities, settled_responses
from gapbeam.studies.paper.section_three import section_of, section_three
from gapbeam.studies.trials.response import TrialResponse

CASES = Path(__file__).parents[2] / "cases"
MADE_UP = {"settled": 0.125, "smoothed": 0.5, "elastic": 1.5, "suspended": 3.0}


def test_the_case_is_the_one_that_the_commands_name() -> None:
    ready = read_case(CASES / "li2013-adams.toml")
    made = adams_case(Asked(0.107, depths()[0]))
    assert made.model_copy(update={"title": ready.title}) == ready
    other = [
        "support.clearance=0.243e-3",
        "contact.law.full_depth=1e-5",
        "model={type='beam', elements=51}",
        "damping={frequencies=[40,300], ratios=[0.01,0.01]}",
        "load.shaker.mass=0.1",
        "load.shaker.stiffness=1e4",
        "load.shaker.damping=5",
        "time.end=2",
    ]
    made = adams_case(main_run(0.243, depths()[1], elastic=True, suspended=True))
    assert made.model_copy(update={"title": ready.title}) == read_case(CASES / "li2013-adams.toml", other)


def test_figures_are_those_of_the_paper_in_its_units() -> None:
    assert clearances() == [0.107, 0.143, 0.184, 0.243]
    assert [measured(clearance) for clearance in clearances()] == [0.481, 0.542, 0.599, 0.751]
    law = adams_case(Asked(0.107, depths()[0])).contact
    depth = 0.02  # mm
    assert law.stiffness * (1e-3 * depth) ** 2.2 == pytest.approx(1.0e5 * depth**2.2)  # type: ignore[operator]


def test_a_settled_rigid_beam_on_its_seat_follows_from_statics() -> None:
    """At 2 N it rocks on the slopes and the dampers of its contact, the same in any clearance."""
    words = [run_one(Asked(clearance, depths()[1], force=2.0)) for clearance in (0.107, 0.243)]
    assert all(one.verdict == "passed" and one.kind == "period 1" for one in words)
    assert words[0].settled == pytest.approx(words[1].settled, rel=1e-3)
    # the amplitude of the rigid beam on two springs, n F / d each, with dampers at 20 Hz
    weight = 7919.0 * 0.51 * 0.012 * 0.02 * G
    near, far = 0.005 / 6.0, 0.05 - 0.005 / 6.0
    gland = weight * (0.255 - far) / (far - near)
    forces = np.array([gland, gland + weight])
    slopes = 2.2 * forces ** (1.2 / 2.2) * (1.0e5 * 1.0e3**2.2) ** (1.0 / 2.2)
    arms = np.array([near, far]) - 0.255
    mass, inertia = weight / G, weight / G * (0.51**2 + 0.012**2) / 12.0
    stiffness = np.array([[slopes.sum(), slopes @ arms], [slopes @ arms, slopes @ arms**2]])
    omega = 40.0 * np.pi
    dampers = 1.0e4 * np.array([[2.0, arms.sum()], [arms.sum(), arms @ arms]])  # full at these depths
    dynamic = stiffness - omega**2 * np.diag([mass, inertia]) + 1j * omega * dampers
    place = np.linalg.solve(dynamic, 2.0 * np.array([1.0, 0.15 - 0.255])) @ np.array([1.0, 0.37 - 0.255])
    assert words[0].settled == pytest.approx(2.0 * omega**2 * abs(place) / G, rel=0.02)
    # the fall is of gravity, not of the force: larger from higher
    assert words[1].start > 1.3 * words[0].start > 10.0 * words[0].settled


def made_up(asked: Asked) -> RunFigures:
    """A response whose peaks are products of factors."""
    base = 10.0 * asked.clearance * (2.0 if asked.depth == depths()[0] else 1.0)
    base *= (MADE_UP["elastic"] if asked.elastic else 1.0) * (MADE_UP["suspended"] if asked.suspended else 1.0)
    settled, smoothed = MADE_UP["settled"], MADE_UP["smoothed"]
    kind = "no cycle" if asked.suspended else "period 2"
    curve = np.linspace(0.0, 0.3, 5)
    return RunFigures(
        asked, "passed", kind, base, base * smoothed, base * settled, base * settled * smoothed, 0.01, 0.0, curve, curve
    )


RUNS = {one: made_up(one) for one in [*main_runs(), *(one for each in variants().values() for one in each)]}


def test_factors_are_those_of_the_runs() -> None:
    table = factors(RUNS)
    assert [row[2] for row in table.rows[1:5]] == pytest.approx(list(MADE_UP.values()))
    assert [row[5] for row in table.rows[1:5]] == pytest.approx(list(MADE_UP.values()))
    assert [row[3] for row in table.rows[1:5]] == [f"{factor:.3g} to {factor:.3g}" for factor in MADE_UP.values()]
    assert table.rows[0][1] == pytest.approx(geometric_mean([10.0 * clearance for clearance in clearances()]))
    assert table.rows[0][4] == pytest.approx(2.0 * table.rows[0][1])  # type: ignore[operator]
    assert table.rows[5][1] == pytest.approx(0.5849, rel=1e-3)


def test_tables_reports_kinds_growth_and_scatter() -> None:
    settled = {(row[0], row[1]): row for row in settled_responses(RUNS).rows}
    assert settled["elastic, suspended exciter", "0.01"][2] == f"{1.07 * 4.5 / 16:.3g} ± 0.01 (no cycle)"
    assert settled["rigid, bare force", "0.001"][5] == f"{2.43 * 2 / 16:.3g} (period 2)"
    changed = {row[0]: row for row in sensitivities(RUNS).rows}
    assert changed["force 20 N"][2] == pytest.approx(0.243 / 0.107)
    assert changed["102 beam elements"][1:5] == [None] * 4
    assert changed["102 beam elements"][7] is not None


def test_the_section_holds_it_all_and_reports_of_failed_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fake(asked: list[Asked]) -> dict[Asked, RunFigures]:
        assert set(asked) == set(RUNS)
        return RUNS

    monkeypatch.setattr(module, "run_all", fake)
    section = section_three(tmp_path / "new")
    kept = json.loads((tmp_path / "new" / module.FILE).read_text(encoding="utf-8"))
    assert len(kept) == len(RUNS)
    ratios = next(block for block in section.blocks if isinstance(block, ComparisonBlock))
    assert ratios.rows[0].reference == 10.0
    expected = geometric_mean([10.0 * clearance / measured(clearance) for clearance in clearances()])
    assert ratios.rows[0].here == pytest.approx(expected)
    assert len([block for block in section.blocks if isinstance(block, TableBlock)]) == 3
    verdicts = [block for block in section.blocks if isinstance(block, Verdict)]
    assert [block.level for block in verdicts] == ["note"]
    assert "The factor of ten is the start" in verdicts[0].text
    spoiled = main_run(clearances()[1], depths()[1])
    broken = {**RUNS, spoiled: RunFigures(spoiled, "energy created: too much")}
    verdicts = [block for block in section_of(broken).blocks if isinstance(block, Verdict)]
    assert [block.level for block in verdicts] == ["error", "note"]
    assert "energy created" in verdicts[0].text
    assert "The factor of ten is the start" not in verdicts[1].text


def test_a_run_that_fails_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(runs, "respond", lambda *_: TrialResponse("energy created", "9 J from nowhere"))
    words = run_one(Asked(0.107, depths()[0]))
    assert words.verdict == "energy created: 9 J from nowhere"
    assert np.isnan(words.start)
    assert np.isnan(words.settled_smoothed)
