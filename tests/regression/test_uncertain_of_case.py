"""The command `gapbeam uncertain`: its members against the march of the scene, and faults of its file at their keys."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest

import gapbeam as gb
from gapbeam.interface.case_atlas import repeating_scene
from gapbeam.studies.uncertain.uncertain_file import read_uncertain, settings_of_study
from tests.shared.case_texts import assert_refused
from tests.shared.command import PROJECT, alone, called_anew

STUDY = PROJECT / "cases" / "studies" / "uncertain-stop.toml"


@alone
@pytest.mark.slow(minutes=0.5)
def test_members_are_those_of_the_scene(tmp_path: Path) -> None:
    """A member of the table has the peak of a single march of the scene of the case with its values."""
    done = called_anew("uncertain", STUDY, "--output", tmp_path / "found")
    assert done.returncode == 0, done.stderr
    assert "64 members; 1 response;" in done.stdout
    row = list(csv.DictReader((tmp_path / "found" / "members.csv").open()))[17]
    settings = settings_of_study(STUDY, read_uncertain(STUDY).set, [])
    one = repeating_scene(STUDY.parent / "../cantilever-stop.toml", settings)
    scene = one.scene.with_({path: float(row[path]) for path in ("stop*.clearance", "shaker.scale")})
    steps = int(np.ceil(one.period / one.step * (1.0 - 1e-9)))
    start = gb.seat(scene)
    found = gb.history(scene, step=one.period / steps, end=60 * one.period, start=start)
    assert float(row["peak/tip"]) == pytest.approx(np.abs(found.displacement["tip"][-4 * steps :]).max(), rel=1e-3)


HEAD = f'case = "{PROJECT / "cases" / "cantilever-stop.toml"}"\n'
GOOD = '[[variable]]\npath = "stop*.clearance"\ndistribution = "norm"\nparameters = {loc = 8e-4, scale = 1e-4}\n'


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (HEAD, "no [[variable]]"),
        (GOOD, "case"),
        (HEAD + GOOD.replace("norm", "nrom"), 'did you mean "norm"?'),
        (HEAD + GOOD.replace("scale", "sigma"), "loc, scale of norm"),
        (HEAD + GOOD.replace("norm", "beta"), "no a, b"),
        (HEAD + GOOD.replace("1e-4", "-1e-4"), "parameters that norm has a meaning for"),
        (HEAD + GOOD.replace("stop*.clearance", "clearance"), "name.value"),
        (HEAD + GOOD.replace("stop*.clearance", "a"), "text in quotes, 3 to 100 characters"),
        (HEAD + GOOD + GOOD, "every path once"),
        (HEAD + "members = 2\n" + GOOD, "members"),
        (HEAD + 'sampling = "grid"\n' + GOOD, "sobol"),
        (HEAD + "colour = 3\n" + GOOD, "colour"),
        (HEAD + GOOD + "[rare]\n", "[rare] without a limit"),
        (HEAD + GOOD + '[[limit]]\nfigure = "peak/tip"\nvalue = 1.0\n' * 2, "one limit for each figure"),
        (
            HEAD + GOOD + '[[correlation]]\npaths = ["stop*.clearance", "x.y"]\nrank = 0.5\n',
            "paths of two [[variable]]",
        ),
        (HEAD + GOOD + '[[correlation]]\npaths = ["x.y", "x.y"]\nrank = 1.5\n', "rank"),
    ],
)
def test_faults_are_at_their_keys(tmp_path: Path, text: str, says: str) -> None:
    """Each fault names what was found and what was expected."""
    assert_refused(read_uncertain, tmp_path / "study.toml", text, says)
