"""The command `gapbeam optimize`: against a grid of members, and faults of its file at their keys."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest

import gapbeam as gb
from gapbeam.interface.case_atlas import repeating_scene
from gapbeam.studies.atlas.run_atlas import rest_of
from gapbeam.studies.optimum.optimum_study import read_optimum_study
from gapbeam.studies.uncertain.uncertain_file import settings_of_study
from tests.shared.case_texts import assert_refused
from tests.shared.command import PROJECT, alone, called_anew

STUDY = PROJECT / "cases" / "studies" / "optimize-stop.toml"


@alone
@pytest.mark.slow(minutes=0.3)
def test_the_best_stop_is_that_of_a_grid_of_members(tmp_path: Path) -> None:
    """No member of a grid that keeps the limit moves less; marches with the values found have their figures."""
    done = called_anew("optimize", STUDY, "--output", tmp_path / "found")
    assert done.returncode == 0, done.stderr
    assert "tip.rms falls from" in done.stdout
    (record,) = json.loads((tmp_path / "found" / "optimum.json").read_text())
    best = {one["path"]: one["found"] for one in record["values"]}
    figures = {one["figure"]: one for one in record["figures"]}
    assert {name: one["unit"] for name, one in figures.items()} == {"tip.rms": "m", "stop*.peak_force": "N"}
    study = read_optimum_study(STUDY)
    one = repeating_scene(STUDY.parent / study.case, settings_of_study(STUDY, study.set, []))
    ((path, value),) = best.items()
    values = {path: np.append(np.linspace(study.free[0].lower, study.free[0].upper, 20), value)}
    start, T = rest_of(one), one.period
    many = gb.ensemble(
        one.scene, values, step=T / one.steps, end=start.t + 81 * T, settle=start.t + 80 * T, start=start, every=1
    )
    force = np.abs(sum(many.force[contact.name] for contact in one.scene.contacts)).max(axis=0)
    limit = study.limit[0]
    assert many.rms["tip"][-1] == pytest.approx(figures["tip.rms"]["found"], rel=1e-6)
    assert force[-1] == pytest.approx(figures[limit.figure]["found"], rel=1e-6)
    assert figures[limit.figure]["found"] <= limit.value * (1.0 + 1e-6)
    kept = many.rms["tip"][:-1][force[:-1] <= limit.value]
    assert 3 < len(kept) < 18
    assert figures["tip.rms"]["found"] <= kept.min()
    rows = list(csv.DictReader((tmp_path / "found" / "search.csv").open()))
    assert len(rows) == record["responses"]
    assert float(rows[0][path]) == study.free[0].start
    assert called_anew("report", tmp_path / "found").returncode == 0


HEAD = f'case = "{PROJECT / "cases" / "cantilever-stop.toml"}"\nleast = "tip.rms"\n'
GOOD = '[[free]]\npath = "stop*.clearance"\nlower = 4e-4\nupper = 1e-3\n'


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (HEAD, "no [[free]]"),
        (HEAD.replace("least", "most") + GOOD, "least"),
        (GOOD, "case"),
        (HEAD + GOOD + GOOD, "every path once"),
        (HEAD + GOOD.replace("1e-3", "1e-4"), "more than lower = 0.0004"),
        (HEAD + GOOD + "start = 2e-3\n", "a value from 0.0004 to 0.001"),
        (HEAD + "order = 0\n" + GOOD, "order"),
        (HEAD + GOOD + '[[limit]]\nfigure = "tip.peak"\nvalue = -1.0\n', "value"),
        (HEAD + GOOD + '[[limit]]\nfigure = "tip.peak"\nvalue = 1.0\n' * 2, "one limit for each figure"),
    ],
)
def test_faults_are_at_their_keys(tmp_path: Path, text: str, says: str) -> None:
    """Each fault names what was found and what was expected."""
    assert_refused(read_optimum_study, tmp_path / "study.toml", text, says)
