"""The Python interface: every function on a tiny case, its errors in the words of Python, and what it loads."""

from __future__ import annotations

import json
from dataclasses import replace
from html import unescape
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gapbeam
from gapbeam.process.terminal_text import with_options
from gapbeam.solver.messages import errors
from gapbeam.studies.error_estimate.closing_table import ClosingRow
from tests.shared.command import PROJECT, alone, called, on_ranks, programmed

DEMO = PROJECT / "cases" / "demo.toml"
TINY: dict[str, Any] = {
    "model": {"type": "beam", "elements": 12},
    "time.end": 0.02,
    "time.step": 1e-4,
    "output.history_interval": 1e-4,
    "load.shaker.ramp": 0.0,
    "load.shaker.frequency": 500.0,
}
FEW = {"time.end": 0.002, "time.step": 1e-4, "output.history_interval": 1e-4, "model": {"type": "rigid"}}


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """Return the outcome of a tiny run."""
    return gapbeam.run(DEMO, TINY, output=tmp_path_factory.mktemp("run") / "out")


def test_a_case_reads_the_same_from_path_text_dict_and_itself() -> None:
    """Paths, texts, dicts with numbers of NumPy, and cases give equal cases; overrides act on each."""
    read = gapbeam.read_case(DEMO)
    tables = read.model_dump(mode="json")
    tables["support"]["clearance"] = np.float64(read.support.clearance)
    tables["damping"] = {key: tuple(v) if isinstance(v, list) else v for key, v in tables["damping"].items()}
    for source in (str(DEMO), DEMO.read_text(encoding="utf-8"), tables, read):
        assert gapbeam.read_case(source) == read
        changed = gapbeam.read_case(source, {"support.clearance": 2e-4})
        assert changed.support.clearance == 2e-4
        assert changed.beam == read.beam


def test_a_case_that_was_read_shows_its_file_and_has_the_scene_of_its_file() -> None:
    """The frequencies of the scene are those of the model; the text in a notebook reads as the same case."""
    case = gapbeam.read_case(DEMO, TINY)
    found = case.scene()
    assert repr(found) == repr(gapbeam.scene(DEMO, TINY))
    assert np.array_equal(found.structures[0].K, gapbeam.scene(case).structures[0].K)
    shown = unescape(case._repr_html_())
    assert gapbeam.read_case(shown.removeprefix("<pre>").removesuffix("</pre>")) == case
    assert case != gapbeam.read_case(DEMO)


@pytest.mark.parametrize("model", ["beam", "reduced", "rigid"])
def test_the_scene_of_a_case_rests_as_statics_has_it(model: str) -> None:
    """The base carries the weight and the gland's force; the weak restraint along the beam is a spring, no escape."""
    case = gapbeam.read_case(DEMO, {"model.type": model})
    scene = case.scene()
    pressed = dict.fromkeys(("base", "gland"), 0.0)
    for contact, force in zip(scene.contacts, gapbeam.seat(scene).F[:, 0], strict=True):
        pressed[contact.name.split()[0]] += abs(force)
    weight = case.material.density * case.beam.length * case.beam.width * case.beam.thickness * 9.81
    assert pressed["base"] - pressed["gland"] == pytest.approx(weight, rel=1e-6)
    lever = case.beam.length / 2 - case.support.length
    assert pressed["gland"] * case.support.length > weight * lever  # its resultant lies within the support


def test_faults_of_a_dict_name_its_keys() -> None:
    """All faults at once, in the words of Python, and none of the command line."""
    with pytest.raises(gapbeam.CaseError) as caught:
        gapbeam.read_case({"title": "x", "beam": {"lenght": 1.0}}, {"suport.clearance": 1e-4})
    message = str(caught.value)
    assert "`lenght`" in message
    assert "`overrides=` suport.clearance" in message
    assert "--" not in message
    assert "--set suport.clearance" in with_options(message)


def test_model_seats_and_marches_as_a_run_does(done: Any) -> None:
    """Step by step from the seat: the probe moves as in the run, to round-off of its compiled loop."""
    simulation = gapbeam.model(DEMO, TINY)
    seat = simulation.seat()
    tip = simulation.model.probes["tip"]
    found = [
        tip.evaluate(step.new.u[0], simulation.model.system.operators)
        for step in simulation.march(seat, steps=50)
        if step.completes
    ]
    history = gapbeam.open_results(done).history["displacement"].sel(probe="tip").values[1:51]
    assert len(found) == 50
    assert np.max(np.abs(np.array(found) - history)) < 1e-9 * np.max(np.abs(history))
    first = next(islice(simulation.march(), 1))
    assert first.old.time == 0.0
    for shown in (simulation, seat, seat.state, first, done):
        assert "\n" not in repr(shown)
        assert len(repr(shown)) < 300


@pytest.mark.slow(minutes=0.3)
@alone
def test_results_are_drawn_compared_and_reported(done: Any, tmp_path: Path) -> None:
    """Outcomes and folders serve alike; what comes back are files that are there."""
    figures = gapbeam.plot(done, output=tmp_path / "figures")
    assert figures
    assert all(path.is_file() for path in figures)
    comparison = gapbeam.compare(done, done.folder, output=tmp_path / "same", after=0.0)
    assert comparison.agree
    assert comparison.headline() in repr(comparison)
    assert "<pre" in comparison._repr_html_()
    assert done.history.identical(gapbeam.open_results(done).history)
    assert done.figures == []
    figures = [{"value": 1}]
    closing = {"part": "", "rows": [dict.fromkeys(ClosingRow._fields, "tip <a>")], "others": 0}
    judged = replace(done, summary={"closing": closing, "errors": {"figures": figures}})
    assert judged.figures == figures
    assert "tip &lt;a&gt;" in judged._repr_html_()
    (page,) = gapbeam.report([done], output=tmp_path / "page.html", pdf=False)
    assert "<html" in page.read_text(encoding="utf-8")
    with pytest.raises(gapbeam.OptionError, match="`overwrite=True`"):
        gapbeam.report(done, output=page, pdf=False)


@pytest.mark.slow(minutes=0.3)
@alone
def test_studies_of_a_dict(tmp_path: Path) -> None:
    """A sweep of a case without a file: two points, a table in a notebook, and arguments out of range refused."""
    case = gapbeam.read_case(DEMO, FEW).model_dump(mode="json")
    swept = gapbeam.sweep(case, {"support.clearance": [0.0, 1e-4]}, output=tmp_path / "sweep", workers=1)
    assert [record["values"]["support.clearance"] for record in swept.records] == ["0.0", "0.0001"]
    assert f"{2 - len(swept.failed)} of 2 responses passed" in repr(swept)
    assert "clearance (m)" in swept._repr_html_()
    with pytest.raises(gapbeam.UserError, match="`overwrite=True`") as caught:
        gapbeam.sweep(case, {"support.clearance": [0.0, 1e-4]}, seed=1, output=tmp_path / "sweep")
    assert "`seed=`: 0 there, 1 now" in str(caught.value)
    with pytest.raises(gapbeam.UserError, match=r"`starts=`: found 0"):
        gapbeam.sweep(case, {"support.clearance": [0.0]}, starts=0, output=tmp_path / "none")
    tried = gapbeam.stability(
        case, [1e9], [1e-4], "discrete-gradient", output=tmp_path / "stability", workers=1
    )  # fmt: skip
    assert [record["verdict"] for record in tried.records] == ["passed"]
    assert "1 of 1 trials passed" in repr(tried)


@pytest.mark.slow(minutes=0.1)
def test_modes_and_check_describe_a_case(tmp_path: Path) -> None:
    """Frequencies ascend; a description prints its tables; measured frequencies that descend are refused."""
    coarse = {"model": {"type": "beam", "elements": 12}}
    found = gapbeam.modes(DEMO, coarse, count=2, output=tmp_path / "modes")
    assert len(found.frequencies) == 2
    assert 0.0 < found.frequencies[0] < found.frequencies[1]
    assert "Bending modes" in found._repr_html_()
    with pytest.raises(gapbeam.UserError, match="ascend"):
        gapbeam.modes(DEMO, coarse, measured={1: 50.0, 2: 40.0})
    described = gapbeam.check(DEMO, FEW)
    assert described.cost.steps == 20
    assert "wall time" in described._repr_html_()


def test_errors_speak_python_and_the_command_line_its_options(done: Any) -> None:
    """The same refusal: `overwrite=True` in Python, --overwrite on the command line."""
    with pytest.raises(gapbeam.UserError) as caught:
        gapbeam.run(DEMO, TINY, output=done.folder)
    assert "`overwrite=True`" in str(caught.value)
    assert "--" not in str(caught.value)
    refused = called("run", DEMO, "--output", done.folder)
    assert refused.returncode == 2
    assert "--overwrite" in refused.stderr
    assert "`" not in refused.stderr.replace("`clearance`", "")
    assert with_options("`zipped=True` and `overrides=` x, not `tolerance`") == "--zip and --set x, not `tolerance`"


@alone
def test_import_is_light_and_every_name_is_there() -> None:
    """In a fresh interpreter: nothing heavy is loaded by the import or by --help, and each exported name is found."""
    said = programmed("tests.programs.light_import")
    assert said.returncode == 0, said.stderr
    heavy, heavy_help, missing, version = json.loads(said.stdout)
    assert (heavy, heavy_help, missing) == ([], [], [])
    assert version[0].isdigit()
    with pytest.raises(AttributeError, match="no attribute 'swep'"):
        gapbeam.swep  # noqa: B018


@pytest.mark.slow(minutes=0.3)
@alone
def test_model_and_run_on_two_ranks(tmp_path: Path) -> None:
    """Both are collective."""
    said = on_ranks(2, DEMO, tmp_path / "out", program="tests.programs.modeled_and_run_on_ranks")
    assert said.returncode == 0, said.stderr
    assert said.stdout.split() == ["3", "2", "0"]


def test_every_error_of_a_run_can_be_caught_by_name() -> None:
    """What can end a run is a name of the package: an error that was added to the solver was missing here."""
    kinds = {
        name for name, kind in vars(errors).items() if isinstance(kind, type) and issubclass(kind, errors.RunError)
    }
    assert kinds <= set(dir(gapbeam))
    for name in kinds:
        assert getattr(gapbeam, name) is getattr(errors, name)
