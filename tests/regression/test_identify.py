"""The command gapbeam identify: known values found again, combinations, faults, going on, processes, exit status."""

from __future__ import annotations

import json
import math
import subprocess
import tomllib
from math import pi
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from PIL import Image

import gapbeam
from gapbeam.postprocess.report.blocks import TableBlock
from gapbeam.postprocess.report.charts import Chart
from gapbeam.postprocess.results.columns_of_run import as_history
from gapbeam.postprocess.signals.steady_figures import steady
from gapbeam.solver.case.case import Case, case_to_toml
from gapbeam.solver.case.reading.case_reader import read_case
from gapbeam.solver.case.reading.overrides import unit_of_key
from gapbeam.solver.messages.errors import CaseError
from gapbeam.solver.schema.record_table import SMOOTHING_WINDOW
from gapbeam.studies.engine.study_engine import Engine
from gapbeam.studies.engine.workers import Workers
from gapbeam.studies.identification.evaluations import Evaluations
from gapbeam.studies.identification.identification_file import read_identification
from gapbeam.studies.identification.identification_tables import FrequencyFigure
from gapbeam.studies.identification.misfit import difference_places
from gapbeam.studies.identification.run_figures import natural_frequency
from gapbeam.studies.trials.response import respond
from gapbeam.studies.trials.starts import KeptBody, seated, span
from tests.shared.command import PROJECT, alone, called_in_turn
from tests.shared.reports import report_on

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
FREE = 4.730041**2 / (2.0 * math.pi * 0.51**2) * math.sqrt(2.1e11 * 0.012**2 / (12.0 * 7919.0))  # Hz, Euler-Bernoulli


def measured(frequencies: tuple[float, ...] = FREQUENCIES, quick: str = QUICK) -> str:
    """Return measurements that the true values make, by way of the figures of a sweep; the last one is held out."""
    settings = tomllib.loads(quick)["set"]
    load = settings.pop("load")["shaker"]
    settings |= {f"load.shaker.{key}": value for key, value in load.items()}
    body, lines = KeptBody(), []
    for frequency in frequencies:
        model = body.model(read_case(CASE, {**settings, **TRUTH, "load.shaker.frequency": frequency}))
        response = respond(model, seated(model).state, span(model)[0], model.step)
        history = as_history(response.history, response.labels).assign_attrs({SMOOTHING_WINDOW: 5 / 2000.0})
        found = steady(history, frequency).quantities
        figures = {
            "motion": found["test peak-to-peak displacement"],
            "smooth": found["test peak-to-peak smoothed acceleration"],
        }
        for name, figure in figures.items():
            held_out = '\nuse = "predict"' if frequency == 60.0 and name == "motion" else ""
            lines.append(
                f'[[measurement]]\nset = {{"load.shaker.frequency" = {frequency}}}\nfigure = "{name}"\n'
                f"value = {figure.mean!r}{held_out}\n"
            )
    return "\n".join(lines)


def written(folder: Path, *parts: str, search: str = "", name: str = "beam.toml", quick: str = QUICK) -> Path:
    """Write the file of an identification."""
    path = folder / name
    text = "\n".join([f'case = "{CASE}"', quick, *parts, "[search]", search])
    path.write_text(text, encoding="utf-8")
    return path


LOCAL = "starts = 1\n"
TWICE = "budget = 20\nseed = 5\nprofile = false\ncoexisting = 0\ntolerance = 1e-6"
SETTLED = QUICK.replace('"time.end" = 0.6', '"time.end" = 1.5')
HEAVY = ("--set", "time.max_iterations=1", "--set", "time.max_halvings=0", "--set", "load.shaker.amplitude=500")


class Done(NamedTuple):
    """A call of the command and its folder."""

    call: subprocess.CompletedProcess[str]
    folder: Path

    @property
    def found(self) -> dict[str, Any]:
        """What it found."""
        data: dict[str, Any] = json.loads((self.folder / "identification.json").read_text(encoding="utf-8"))
        return data


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Files of identifications by name, and in "folder" where they are."""
    folder, values = tmp_path_factory.mktemp("identify"), measured()
    frequency = '[[figure]]\nname = "free"\ntype = "frequency"\nheld = "free"\nmode = 1\n'
    frequency += f'[[measurement]]\nfigure = "free"\nvalue = {FREE}\nrelative_sigma = 0.01\n'
    elastic = "".join(
        f'[[unknown]]\nkey = "material.{key}"\nlower = {0.5 * value}\nupper = {2.0 * value}\n'
        for key, value in (("young_modulus", 2.4e11), ("density", 7500.0))
    )
    first = values.split("\n\n")[0]
    parts = {
        "known": ((STIFFNESS, AMPLITUDE, DAMPING, values), LOCAL + "budget = 60"),
        "together": ((AMPLITUDE, DAMPING, first), LOCAL + "budget = 25\ncoexisting = 0"),
        "free": ((elastic, frequency), LOCAL + "budget = 20"),
        "heavy": ((STIFFNESS, first), LOCAL + "budget = 3\ncoexisting = 0"),
        "twice": ((STIFFNESS, AMPLITUDE, values), TWICE),
        "other": ((STIFFNESS, AMPLITUDE, values.replace("value = ", "value = 1", 1)), TWICE),
    }
    made = {
        name: written(folder, *tables, search=search, name=f"{name}.toml") for name, (tables, search) in parts.items()
    }
    return made | {"folder": folder}


@pytest.fixture(scope="module")
def done(files: dict[str, Path]) -> dict[str, Done]:
    """The calls of the command that do not depend on each other, in one process."""
    options: dict[str, tuple[str, ...]] = {"known": ("--leave-one-out",), "heavy": HEAVY}
    names = ("known", "together", "free", "heavy", "twice")
    folders = {name: files["folder"] / f"out-{name}" for name in names}
    words: list[list[str | Path]] = [
        ["identify", files[name], "--output", folders[name], "--workers", "1", *options.get(name, ())] for name in names
    ]
    calls = called_in_turn(*words)
    return {name: Done(call, folders[name]) for name, call in zip(names, calls, strict=True)}


@pytest.mark.slow(minutes=0.3)
@alone
def test_known_values_are_found_again(done: dict[str, Done]) -> None:
    """Stiffness, force and damping lie within their intervals, the held-out figure is predicted, files and pictures."""
    call, folder = done["known"]
    assert call.returncode == 0, call.stdout + call.stderr
    found = done["known"].found
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
    best = tomllib.loads((folder / "identified.toml").read_text(encoding="utf-8"))["set"]
    case = read_case(folder / "identified-case.toml")
    assert case == read_case(folder / "case.toml", best)
    assert case.damping.ratios == tuple(best["damping.ratios"])
    for name in ("identified-figures.png", "identified-misfit.png"):
        with Image.open(folder / name) as picture:
            assert len(picture.convert("RGB").getcolors(1 << 24) or []) > 50
    assert "held out" in call.stdout


@pytest.mark.slow(minutes=0.4)
@alone
@pytest.mark.parametrize(("search", "runs"), [(LOCAL, 189), ("", 2817)])
def test_settled_responses_take_a_fifth_of_the_runs(tmp_path: Path, search: str, runs: int) -> None:
    """Known values of three unknowns are found from 33 runs, where differences took 189 (153 to the same last step).

    Without a start, they are found from 78, where differential evolution took 2817.
    """
    file = written(
        tmp_path, STIFFNESS, AMPLITUDE, DAMPING, measured(quick=SETTLED), quick=SETTLED,
        search=search + "profile = false\ncoexisting = 0",
    )  # fmt: skip
    (call,) = called_in_turn(["identify", file, "--output", tmp_path / "out", "--workers", "1"])
    assert call.returncode == 0, call.stdout + call.stderr
    assert len((tmp_path / "out" / "evaluations.jsonl").read_text().splitlines()) <= runs / 5
    found = Done(call, tmp_path / "out").found
    for unknown in found["unknowns"]:
        true = TRUTH[unknown["key"]]
        assert unknown["value"] == pytest.approx(true[0] if isinstance(true, list) else true, rel=1e-3)
    assert found["rms"]["predict"] < 1e-5


@pytest.mark.slow(minutes=0.3)
@alone
def test_slopes_are_differences_of_periodic_responses(tmp_path: Path) -> None:
    """Derivatives without a run against peak to peak of responses that shooting finds anew on both sides."""
    one = '[[measurement]]\nset = {"load.shaker.frequency" = 40.0}\nfigure = "motion"\nvalue = 1.0\n'
    file = written(
        tmp_path, STIFFNESS, AMPLITUDE, DAMPING, one, quick=SETTLED, search="difference = 1e-3", name="one.toml"
    )
    problem = read_identification(file)
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "case.toml").write_text(case_to_toml(problem.base))
    values = problem.values(problem.start)
    places = difference_places(problem.scaled(values), 1e-3)
    with Engine(Workers(1)) as engine:
        evaluations = Evaluations(problem, tmp_path / "out", engine)
        evaluations.of([values], [0])
        (slopes,) = evaluations.slopes(values, [0], places)
    for pair, slope in zip(places, slopes["motion"], strict=True):
        heights = []
        for row in pair:
            case = read_case(
                tmp_path / "out" / "case.toml",
                {**problem.settings(problem.values(row)), "load.shaker.frequency": 40.0,
                 "analysis": {"type": "periodic", "tolerance": 1e-12}},
            )  # fmt: skip
            outcome = gapbeam.run(case, output=tmp_path / "run", overwrite=True)
            heights.append(outcome.summary["periodic"]["probes"]["test"]["peak_to_peak"])
        assert slope == pytest.approx((heights[1] - heights[0]) / 2e-3, rel=1e-4)


@pytest.mark.slow(minutes=0.4)
@alone
def test_one_figure_reports_force_and_damping_only_together(done: dict[str, Done]) -> None:
    """One measurement for two unknowns: said loudly, fitted exactly, and neither is claimed to be known."""
    call, _ = done["together"]
    assert call.returncode == 0, call.stdout + call.stderr
    found = done["together"].found
    assert [unknown["sentence"] for unknown in found["unknowns"]] == [
        "identifiable only in combination with damping.ratios",
        "identifiable only in combination with load.shaker.amplitude",
    ]
    assert "WARNING: 1 measurement for 2 unknowns" in call.stdout
    assert "RuntimeWarning" not in call.stderr
    assert "not determined by the measurements" in call.stdout
    assert found["rms"]["fit"] < 1e-3


@pytest.mark.slow(minutes=0.1)
@alone
def test_free_frequencies_reports_stiffness_over_mass_and_no_more(done: dict[str, Done]) -> None:
    """Bending of a free beam: E / rho as Euler and Bernoulli have it; E and rho are reported as not identifiable."""
    call, _ = done["free"]
    assert call.returncode == 0, call.stdout + call.stderr
    found = done["free"].found
    assert {unknown["word"] for unknown in found["unknowns"]} == {"only in combination"}
    young, density = (unknown["value"] for unknown in found["unknowns"])
    # shear and rotation, which Euler and Bernoulli leave out, make the frequency of this beam 0.2 % lower
    assert young / density == pytest.approx(2.1e11 / 7919.0 * 1.004, rel=1e-3)
    assert found["sensitivity"][0] == pytest.approx([0.5, -0.5], abs=1e-3)
    untold = found["combinations"][1]["of"]
    assert untold in ("material.young_modulus^1 material.density^1", "material.density^1 material.young_modulus^1")


@pytest.mark.slow(minutes=0.3)
@alone
def test_going_on_and_processes_make_no_difference(done: dict[str, Done], files: dict[str, Path]) -> None:
    """One process, two processes, and a log that was cut off in the middle of a line: the same files to the bit."""
    first, one = done["twice"]
    cut, two = files["folder"] / "cut", files["folder"] / "two"
    assert first.returncode == 5, first.stdout + first.stderr
    assert "misses its tolerance" in first.stdout
    lines = (one / "evaluations.jsonl").read_text(encoding="utf-8").splitlines(keepends=True)
    cut.mkdir()
    (cut / "evaluations.jsonl").write_text("".join(lines[: len(lines) // 2]) + lines[-1][:40], encoding="utf-8")
    (cut / "plan.json").write_bytes((one / "plan.json").read_bytes())
    beside, again, refused, changed = called_in_turn(
        ["identify", files["twice"], "--output", two, "--workers", "2"],
        ["identify", files["twice"], "--output", cut, "--workers", "1"],
        ["identify", files["other"], "--output", two],
        ["identify", files["twice"], "--output", two, "--set", "probe.test.point=0.36"],
    )
    assert beside.returncode == again.returncode == 5, beside.stderr + again.stderr
    assert f"{len(lines) // 2} experiments are on disk already" in again.stderr
    assert f"{len(lines) - len(lines) // 2} experiments were run" in again.stderr
    for name in ("identification.json", "identified.toml"):
        whole = (one / name).read_bytes()
        assert (two / name).read_bytes() == whole
        assert (cut / name).read_bytes() == whole
    rows = [sorted((folder / "evaluations.csv").read_text().splitlines()) for folder in (one, two, cut)]
    assert rows[0] == rows[1] == rows[2]
    assert refused.returncode == changed.returncode == 2
    assert "[[measurement]] number 1" in refused.stderr
    assert "probe.test.point: 0.37 there, 0.36 now" in changed.stderr


@pytest.mark.slow(minutes=0.1)
@alone
def test_what_fails_is_reported_and_never_taken(done: dict[str, Done]) -> None:
    """A contact solve that may not iterate: the status is 4, the verdict is reported, nothing is written as found."""
    call, folder = done["heavy"]
    assert call.returncode == 4, call.stdout + call.stderr
    assert "not converged" in call.stdout
    assert "nothing was identified" in call.stdout
    assert not (folder / "identified.toml").exists()


@pytest.mark.slow(minutes=0.1)
@alone
def test_a_report_shows_what_was_found(done: dict[str, Done]) -> None:
    """`gapbeam report` knows the folder; its blocks hold every measurement, unknown and evaluation."""
    blocks = report_on([done["known"].folder], "gapbeam report").sections[0].blocks
    comparisons = [block for block in blocks if isinstance(block, TableBlock) and "deviation" in block.columns]
    assert [len(block.rows) for block in comparisons] == [3, 3]
    off = [str(row[3]).removesuffix(" %").replace("−", "-") for block in comparisons for row in block.rows]
    assert all(abs(float(one)) < 1.0 for one in off)
    unknowns = next(block for block in blocks if isinstance(block, TableBlock) and "unknowns" in block.caption)
    assert [row[0] for row in unknowns.rows] == ["contact.stiffness", "load.shaker.amplitude", "damping.ratios"]
    misfit = next(block for block in blocks if isinstance(block, Chart) and len(block.choices) == 3)
    assert all(len(curve.x) > 20 for curve in misfit.curves if curve.mode == "markers")


def test_all_faults_are_reported_at_once_with_their_places(tmp_path: Path) -> None:
    """Tables by themselves, then contradictions, then what the case says to every experiment."""
    wrong = '[[unknown]]\nkey = "contact.stiffness"\nlower = "2e6"\nuper = 1e7\n'
    with pytest.raises(CaseError) as caught:
        read_identification(written(tmp_path, wrong, search="startz = 3\nbudget = 0"))
    message = str(caught.value)
    assert "remove the quotes: lower = 2e+06" in message
    assert "did you mean `upper`" in message
    assert "did you mean `starts`" in message
    assert "[search] budget" in message
    assert "no such table" in message
    unknown = '[[unknown]]\nkey = "load.shaker.amplitude"\nlower = -1.0\nupper = 2.0\nstart = 3.0\n'
    measurement = (
        '[[measurement]]\nfigure = "motoin"\nvalue = 1.0\nset = {"load.shaker.amplitude" = 2.0}\nsigma = 0.1\n'
        '[[measurement]]\nfigure = "motion"\nvalue = -1.0\n'
    )
    with pytest.raises(CaseError) as caught:
        read_identification(written(tmp_path, unknown, unknown, measurement))
    message = str(caught.value)
    assert "more than 0 on a logarithmic scale" in message
    assert "a value from -1 to 2" in message
    assert "which is [[unknown]] number 1 too" in message
    assert 'did you mean "motion"?' in message
    assert "has no sign" in message
    assert "for every measurement that is fitted, or for none" in message
    assert "a key that is known in the experiment" in message


def test_faults_of_experiments_name_the_line_of_the_identification(tmp_path: Path) -> None:
    """Keys that the case does not have, values it refuses, probes it lacks, a step that would change."""
    unknown = '[[unknown]]\nkey = "contact.stifness"\nlower = 1.0\nupper = 2.0\n'
    length = '[[unknown]]\nkey = "support.length"\nlower = 0.04\nupper = 1.0\n'
    measurement = '[[measurement]]\nfigure = "motion"\nvalue = 1.0\nset = {"material.densty" = 7800.0}\n'
    elsewhere = '[[figure]]\nname = "end"\ntype = "motion"\nprobe = "tipp"\n'
    path = written(tmp_path, unknown, length, elsewhere, measurement)
    with pytest.raises(CaseError) as caught:
        read_identification(path, ['time.step="auto"'])
    message = str(caught.value)
    assert "[[unknown]] number 1 (contact.stifness" in message
    assert "did you mean `stiffness`?" in message
    assert "[[measurement]] number 1 set material.densty" in message
    assert "[[unknown]] number 2 (support.length) upper" in message
    assert 'did you mean "tip"?' in message
    assert 'time.step = "auto"' in message


@pytest.mark.parametrize(
    ("figure", "marched"), [('type = "frequency"', False), ('type = "motion"\nprobe = "tip"', True)]
)
def test_a_step_is_asked_for_where_something_is_marched(figure: str, marched: bool, tmp_path: Path) -> None:
    """Natural frequencies have no step, so that "auto" cannot make their misfit jump."""
    path = tmp_path / "fit.toml"
    path.write_text(
        f'case = "{CASE}"\n[[unknown]]\nkey = "material.young_modulus"\nlower = 1e11\nupper = 3e11\n'
        f'[[figure]]\nname = "one"\n{figure}\n[[measurement]]\nfigure = "one"\nvalue = 40.0\n',
        encoding="utf-8",
    )
    if not marched:
        assert read_identification(path, ['time.step="auto"'])
        return
    with pytest.raises(CaseError, match="gapbeam check gives for the case"):
        read_identification(path, ['time.step="auto"'])


def test_units_are_those_of_the_case_models() -> None:
    """Also behind remarks in brackets, in named tables, and for springs at points."""
    case = read_case(CASE).model_dump(mode="json")
    assert unit_of_key("contact.stiffness", case) == "Pa/m"
    at_points = read_case(CASE, {"contact.points": [0.0, 0.05]}).model_dump(mode="json")
    assert unit_of_key("contact.stiffness", at_points) == "N/m"
    assert unit_of_key("load.shaker.point", case) == "m"
    assert unit_of_key("material.density", case) == "kg/m^3"
    assert unit_of_key("no.such.key", case) == ""
    boom = read_case(PROJECT / "cases" / "boom.toml").model_dump(mode="json")
    assert unit_of_key("support.front.clearance", boom) == "m"


HOLDS = {
    "free": ([], (4.730041, 7.853205)),
    "clamped": ([("clamped", 0.0)], (1.875104, 4.694091)),
    "pinned": ([("pinned", 0.0)], (3.926602, 7.068583)),
    "pinned twice": ([("pinned", 0.0), ("pinned", 1.0)], (pi, 2.0 * pi)),
    "clamped and pinned": ([("clamped", 0.0), ("pinned", 1.0)], (3.926602, 7.068583)),
}
"""Joints at parts of the length, and beta L of the first two bending modes of Euler and Bernoulli."""


@pytest.mark.parametrize("joints", HOLDS)
@pytest.mark.parametrize("model", ["beam", "reduced"])
def test_natural_frequencies_leave_out_rigid_motions_alone(joints: str, model: str) -> None:
    """A clamped beam has no rigid motion that its first modes could be taken for, a pinned one has one."""
    random = np.random.default_rng(len(joints))
    length = float(random.uniform(0.8, 2.0))
    thickness, modulus = 0.008 * length, float(random.uniform(0.5e11, 2.5e11))
    held, roots = HOLDS[joints]
    stop = {"name": "stop", "from": 0.45 * length, "to": 0.55 * length, "clearance": 1e-3}
    tables: dict[str, Any] = {
        "beam": {"length": length, "thickness": thickness, "width": 0.02},
        "material": {"young_modulus": modulus, "poisson_ratio": 0.3, "density": 7800.0},
        "support": [stop], "load": [{"type": "gravity"}], "probe": [{"name": "tip", "point": length}],
        "time": {"end": 0.1, "step": 1e-4}, "model": {"type": model},
        "joint": [{"name": f"j{i}", "type": kind, "point": part * length} for i, (kind, part) in enumerate(held)],
    }  # fmt: skip
    case = Case.model_validate(tables)
    built = KeptBody().model(case)
    for mode, root in enumerate(roots, 1):
        figure = FrequencyFigure(name="f", type="frequency", held="free", mode=mode)
        exact = (root / length) ** 2 * thickness * np.sqrt(modulus / 12.0 / 7800.0) / (2.0 * pi)
        assert natural_frequency(figure, built).mean == pytest.approx(exact, rel=0.01)
