"""The command gapbeam identify: known values found again, combinations, faults, going on, processes, exit status."""

from __future__ import annotations

import json
import math
import tomllib
from pathlib import Path
from typing import Any

import pytest
from PIL import Image

from gapbeam.identification.reading import read_identification, unit_of_key
from gapbeam.sweeping.point import span
from postprocess.records_in_memory import as_history
from postprocess.steady import steady
from solver.case_file.faults import CaseError
from solver.case_file.reader import read_case
from solver.studies.kept_body import KeptBody
from solver.studies.respond import respond
from solver.studies.starts import seated
from tests.command import PROJECT, alone, called_in_turn

CASE = PROJECT / "cases" / "li2013-2d.toml"
QUICK = """
[set]
model = {type = "beam", elements = 8}
mesh = {dimension = 2, size = 0.06, support_size = 12.5e-3, edge_size = 12.5e-3, cells_through_thickness = 1}
"time.end" = 0.6
"time.step" = 5e-4
"output.history_interval" = 5e-4
"contact.points" = [0.0, 0.05]
"contact.stiffness" = 2e6
"damping.frequencies" = [20.0, 300.0]
"damping.ratios" = [0.1, 0.1]
load.shaker.amplitude = 5.0
load.shaker.ramp = 0.05

[[figure]]
name = "motion"
type = "motion"
quantity = "displacement"
probe = "test"

[[figure]]
name = "smooth"
type = "motion"
probe = "test"
average = {points = 5, rate = 2000.0}
"""
STIFFNESS = '[[unknown]]\nkey = "contact.stiffness"\nlower = 5e5\nupper = 1e7\n'
AMPLITUDE = '[[unknown]]\nkey = "load.shaker.amplitude"\nlower = 1.0\nupper = 20.0\n'
DAMPING = '[[unknown]]\nkey = "damping.ratios"\nlower = 0.02\nupper = 0.3\n'
TRUTH = {"contact.stiffness": 2.3e6, "load.shaker.amplitude": 4.1, "damping.ratios": [0.083, 0.083]}
FREQUENCIES = (30.0, 40.0, 60.0)


def measured(frequencies: tuple[float, ...] = FREQUENCIES) -> str:
    """Return measurements that the true values make, by way of the figures of a sweep; the last one is held out."""
    settings = tomllib.loads(QUICK)["set"]
    load = settings.pop("load")["shaker"]
    settings |= {f"load.shaker.{key}": value for key, value in load.items()}
    body, lines = KeptBody(), []
    for frequency in frequencies:
        model = body.model(read_case(CASE, {**settings, **TRUTH, "load.shaker.frequency": frequency}))
        response = respond(model, seated(model).state, span(model)[0], model.step)
        found = steady(as_history(response.history, response.labels), frequency).quantities
        figures = {"motion": found["test displacement"], "smooth": found["test smoothed acceleration"]}
        for name, figure in figures.items():
            held_out = '\nuse = "predict"' if frequency == 60.0 and name == "motion" else ""
            lines.append(
                f'[[measurement]]\nset = {{"load.shaker.frequency" = {frequency}}}\nfigure = "{name}"\n'
                f"value = {figure.mean!r}{held_out}\n"
            )
    return "\n".join(lines)


def written(folder: Path, *parts: str, search: str = "", name: str = "beam.toml") -> Path:
    """Write the file of an identification."""
    path = folder / name
    text = "\n".join([f'case = "{CASE}"', QUICK, *parts, "[search]", search])
    path.write_text(text, encoding="utf-8")
    return path


def outcome(folder: Path) -> dict[str, Any]:
    """Return what an identification found."""
    found: dict[str, Any] = json.loads((folder / "identification.json").read_text(encoding="utf-8"))
    return found


@pytest.fixture(scope="module")
def measurements() -> str:
    """The measurements of the true values."""
    return measured()


@alone
def test_known_values_are_found_again(tmp_path: Path, measurements: str) -> None:
    """Stiffness, force and damping lie within their intervals, the held-out figure is predicted, files and pictures."""
    file = written(
        tmp_path,
        STIFFNESS,
        AMPLITUDE,
        DAMPING,
        measurements,
        search='method = "least-squares"\nbudget = 80\nstarts = 3',
    )
    (done,) = called_in_turn(["identify", file, "--output", tmp_path / "out", "--processes", "1", "--leave-one-out"])
    assert done.returncode == 0, done.stdout + done.stderr
    found = outcome(tmp_path / "out")
    for unknown in found["unknowns"]:
        true = TRUTH[unknown["key"]]
        value = true[0] if isinstance(true, list) else true
        low, high = unknown["interval"]
        assert low <= value <= high, unknown
        assert high / low < 1.5, unknown
        assert unknown["profile"][0] <= unknown["value"] <= unknown["profile"][1]
        assert unknown["word"] == "identifiable"
    assert found["rms"]["fit"] < 1e-3
    assert found["rms"]["predict"] < 2e-3
    assert found["rms_left_out"] < 5e-3
    assert [unknown["unit"] for unknown in found["unknowns"]] == ["N/m", "N", "no unit"]
    assert [row["use"] for row in found["measurements"]].count("predict") == 1
    # in a support that stays closed, figures grow as the force does
    assert [row[1] for row in found["sensitivity"]] == pytest.approx([1.0] * 6, abs=0.02)
    best = tomllib.loads((tmp_path / "out" / "identified.toml").read_text(encoding="utf-8"))["set"]
    case = read_case(tmp_path / "out" / "identified-case.toml")
    assert case == read_case(tmp_path / "out" / "case.toml", best)
    assert case.damping.ratios == tuple(best["damping.ratios"])
    for name in ("identified-figures.png", "identified-misfit.png"):
        with Image.open(tmp_path / "out" / name) as picture:
            assert len(picture.convert("RGB").getcolors(1 << 24) or []) > 50
    assert "held out" in done.stdout


@alone
def test_one_figure_tells_force_and_damping_only_together(tmp_path: Path, measurements: str) -> None:
    """One measurement for two unknowns: said loudly, fitted exactly, and neither is claimed to be known."""
    one = measurements.split("\n\n")[0]
    file = written(tmp_path, AMPLITUDE, DAMPING, one, search='method = "least-squares"\nbudget = 40\ncoexisting = 0')
    (done,) = called_in_turn(["identify", file, "--output", tmp_path / "out", "--processes", "1"])
    assert done.returncode == 0, done.stdout + done.stderr
    found = outcome(tmp_path / "out")
    assert [unknown["told"] for unknown in found["unknowns"]] == [
        "identifiable only in combination with damping.ratios",
        "identifiable only in combination with load.shaker.amplitude",
    ]
    assert "WARNING: 1 measurements for 2 unknowns" in done.stdout
    assert "not told by the measurements" in done.stdout
    assert found["rms"]["fit"] < 1e-3


@alone
def test_going_on_and_processes_make_no_difference(tmp_path: Path, measurements: str) -> None:
    """One process, two processes, and a log that was cut off in the middle of a line: the same files to the bit."""
    search = "budget = 30\nseed = 5\nprofile = false\ncoexisting = 0\ntolerance = 1e-6"
    file = written(tmp_path, STIFFNESS, AMPLITUDE, measurements, search=search)
    cut = tmp_path / "cut"
    first, two = called_in_turn(
        ["identify", file, "--output", tmp_path / "one", "--processes", "1"],
        ["identify", file, "--output", tmp_path / "two", "--processes", "2"],
    )
    assert first.returncode == two.returncode == 5, first.stdout + first.stderr
    assert "misses its tolerance" in first.stdout
    text = (tmp_path / "one" / "evaluations.jsonl").read_text(encoding="utf-8")
    lines = text.splitlines(keepends=True)
    cut.mkdir()
    (cut / "evaluations.jsonl").write_text("".join(lines[: len(lines) // 2]) + lines[-1][:40], encoding="utf-8")
    (cut / "plan.json").write_bytes((tmp_path / "one" / "plan.json").read_bytes())
    changed = written(
        tmp_path, STIFFNESS, AMPLITUDE, measurements.replace("value = ", "value = 1", 1), name="other.toml"
    )
    again, refused, anew = called_in_turn(
        ["identify", file, "--output", cut, "--processes", "1"],
        ["identify", changed, "--output", tmp_path / "two"],
        ["identify", file, "--output", tmp_path / "two", "--set", "probe.test.point=0.36"],
    )
    assert again.returncode == 5
    assert f"{len(lines) // 2} experiments are on disk already" in again.stderr
    assert f"{len(lines) - len(lines) // 2} experiments were run" in again.stderr
    for name in ("identification.json", "identified.toml"):
        whole = (tmp_path / "one" / name).read_bytes()
        assert (tmp_path / "two" / name).read_bytes() == whole
        assert (cut / name).read_bytes() == whole
    assert sorted((cut / "evaluations.csv").read_text().splitlines()) == sorted(
        (tmp_path / "two" / "evaluations.csv").read_text().splitlines()
    )
    assert refused.returncode == anew.returncode == 2
    assert "[[measurement]] number 1" in refused.stderr
    assert "probe.test.point: 0.37 there, 0.36 now" in anew.stderr


@alone
def test_what_fails_is_told_and_never_taken(tmp_path: Path, measurements: str) -> None:
    """A contact solve that may not iterate ends with 4; where it may in some places only, those alone are taken."""
    settings = 'method = "least-squares"\nbudget = 3\ncoexisting = 0'
    file = written(tmp_path, STIFFNESS, measurements, search=settings)
    done, = called_in_turn(
        ["identify", file, "--output", tmp_path / "out", "--processes", "1", "--set", "time.max_iterations=1",
         "--set", "time.max_halvings=0", "--set", "load.shaker.amplitude=500"],
    )  # fmt: skip
    assert done.returncode == 4, done.stdout + done.stderr
    assert "not converged" in done.stdout
    assert "nothing was identified" in done.stdout
    assert not (tmp_path / "out" / "identified.toml").exists()


@alone
def test_free_frequencies_tell_stiffness_over_mass_and_no_more(tmp_path: Path) -> None:
    """Bending of a free beam: E / rho as Euler and Bernoulli have it, E and rho themselves are told to be unknown."""
    exact = 4.730041**2 / (2.0 * math.pi * 0.51**2) * math.sqrt(2.1e11 * 0.012**2 / (12.0 * 7919.0))
    unknowns = "".join(
        f'[[unknown]]\nkey = "material.{key}"\nlower = {0.5 * value}\nupper = {2.0 * value}\n'
        for key, value in (("young_modulus", 2.4e11), ("density", 7500.0))
    )
    figures = '[[figure]]\nname = "free"\ntype = "frequency"\nheld = "free"\nmode = 1\n'
    figures += '[[measurement]]\nfigure = "free"\nvalue = ' + f"{exact}\nrelative_sigma = 0.01\n"
    path = written(tmp_path, unknowns, figures, search='method = "least-squares"\nbudget = 30')
    (done,) = called_in_turn(["identify", path, "--output", tmp_path / "out", "--processes", "1"])
    assert done.returncode == 0, done.stdout + done.stderr
    found = outcome(tmp_path / "out")
    assert {unknown["word"] for unknown in found["unknowns"]} == {"only in combination"}
    young, density = (unknown["value"] for unknown in found["unknowns"])
    # shear and rotation, which Euler and Bernoulli leave out, make the frequency of this beam 0.3 % lower
    assert young / density == pytest.approx(2.1e11 / 7919.0 * 1.006, rel=3e-3)
    assert found["sensitivity"][0] == pytest.approx([0.5, -0.5], abs=1e-3)
    assert found["combinations"][1]["of"] in (
        "material.young_modulus^1 material.density^1", "material.density^1 material.young_modulus^1"
    )  # fmt: skip


def test_all_faults_are_told_at_once_with_their_places(tmp_path: Path) -> None:
    """Tables by themselves, then contradictions, then what the case says to every experiment."""
    wrong = '[[unknown]]\nkey = "contact.stiffness"\nlower = "2e6"\nuper = 1e7\n'
    with pytest.raises(CaseError) as caught:
        read_identification(written(tmp_path, wrong, search='metod = "global"\nbudget = 0'))
    told = str(caught.value)
    assert "remove the quotes: lower = 2e+06" in told
    assert "did you mean `upper`" in told
    assert "did you mean `method`" in told
    assert "[search] budget" in told
    assert "no such table" in told
    unknown = '[[unknown]]\nkey = "load.shaker.amplitude"\nlower = -1.0\nupper = 2.0\nstart = 3.0\n'
    measurement = (
        '[[measurement]]\nfigure = "motoin"\nvalue = 1.0\nset = {"load.shaker.amplitude" = 2.0}\nsigma = 0.1\n'
        '[[measurement]]\nfigure = "motion"\nvalue = -1.0\n'
    )
    with pytest.raises(CaseError) as caught:
        read_identification(written(tmp_path, unknown, unknown, measurement))
    told = str(caught.value)
    assert "more than 0 on a logarithmic scale" in told
    assert "a value from -1 to 2" in told
    assert "which is [[unknown]] number 1 too" in told
    assert 'did you mean "motion"?' in told
    assert "has no sign" in told
    assert "for every measurement that is fitted, or for none" in told
    assert "a key that is known in the experiment" in told


def test_faults_of_experiments_name_the_line_of_the_identification(tmp_path: Path) -> None:
    """Keys that the case does not have, values it refuses, probes it lacks, a step that would change."""
    unknown = '[[unknown]]\nkey = "contact.stifness"\nlower = 1.0\nupper = 2.0\n'
    clearance = '[[unknown]]\nkey = "support.clearance"\nlower = 1e-5\nupper = 1.0\n'
    measurement = '[[measurement]]\nfigure = "motion"\nvalue = 1.0\nset = {"material.densty" = 7800.0}\n'
    elsewhere = '[[figure]]\nname = "end"\ntype = "motion"\nprobe = "tipp"\n'
    path = written(tmp_path, unknown, clearance, elsewhere, measurement)
    with pytest.raises(CaseError) as caught:
        read_identification(path, ['time.step="auto"'])
    told = str(caught.value)
    assert "[[unknown]] number 1 (contact.stifness" in told
    assert "did you mean `stiffness`?" in told
    assert "[[measurement]] number 1 set material.densty" in told
    assert "[[unknown]] number 2 (support.clearance) upper" in told
    assert 'did you mean "tip"?' in told
    assert 'time.step = "auto"' in told


def test_units_are_those_of_the_case_models() -> None:
    """Also behind remarks in brackets, in named tables, and for springs at points."""
    case = read_case(CASE)
    assert unit_of_key("contact.stiffness", case) == "Pa/m"
    assert unit_of_key("contact.stiffness", read_case(CASE, {"contact.points": [0.0, 0.05]})) == "N/m"
    assert unit_of_key("load.shaker.point", case) == "m"
    assert unit_of_key("material.density", case) == "kg/m^3"
    assert unit_of_key("no.such.key", case) == ""
