"""The command `gapbeam atlas`: tables, pictures and report of a case, its figures against the march of the case."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest

import gapbeam
from gapbeam.interface.case_atlas import scenes_of
from gapbeam.interface.case_scene import scene_of_model
from gapbeam.studies.atlas.run_atlas import PeriodicScene, run_atlas
from gapbeam.studies.trials.axes import read_axis
from tests.shared.command import PROJECT, alone, called_anew, settings
from tests.shared.reports import report_on

CASE = PROJECT / "cases" / "cantilever-stop.toml"
QUICK = ("damping.ratios=[0.05,0.05]", "time.step=2e-4")


def oscillator(texts: tuple[str, ...]) -> PeriodicScene:
    """A mass against a stop, pushed by the force that a text says; W = 2.6 has responses of order 1, 2 and 6."""
    size = float(dict(text.split("=") for text in texts)["push"])
    body = gapbeam.mass(1.0, stiffness=1.0, damping=0.08, name="body")
    stop = gapbeam.Contact(body["at"], gapbeam.HalfPlane(0.5), gapbeam.KelvinVoigt(stiffness=30.0), name="stop")
    push = gapbeam.Force(body["at"], lambda t: size * np.cos(2.6 * t), name="push")
    period = 2 * np.pi / 2.6
    scene, knock = gapbeam.Scene(body, contacts=[stop], loads=[push]), gapbeam.figure("knock", "contact_force", "stop")
    late = gapbeam.figure("late", "contact_force", "stop", start=1.0)
    return PeriodicScene(scene, period, period / 199.5, 2.2 * period, (knock, late))


def test_files_say_what_was_found(tmp_path: Path) -> None:
    """Two forces: one without contact, with its closed form; tables, picture and report agree with the atlas."""
    result = run_atlas(oscillator, [read_axis("push=0.5,1.7367")], tmp_path / "found", starts=40, reach=3.0)
    assert result.exit_status == 0
    few, many = result.atlas.points
    (linear,) = few.responses if len(few.responses) == 1 else [one for one in few.responses if not one.impacts["stop"]]
    assert linear.peak["at"] == pytest.approx(0.5 / np.hypot(1 - 2.6**2, 0.08 * 2.6), rel=2e-3)
    assert linear.state.t == pytest.approx(3 * few.period)
    assert len({one.order for one in many.responses}) >= 2
    records = json.loads((tmp_path / "found" / "atlas.json").read_text())
    assert [one["values"] for one in records] == [{"push": 0.5}, {"push": 1.7367}]
    orders = [one.order for each in result.atlas.points for one in each.responses]
    assert [r["order"] for one in records for r in one["responses"]] == orders
    rows = list(csv.DictReader((tmp_path / "found" / "atlas.csv").open()))
    assert [row["response"] for row in rows] == [f"order {order}" for order in orders]
    assert sum(float(row["share"]) for row in rows) == pytest.approx(2.0)
    assert [float(row["knock"]) for row in rows] == pytest.approx([float(row["force (N)"]) for row in rows])
    assert "late" not in rows[0]
    assert (tmp_path / "found" / "atlas-responses.png").stat().st_size > 1000
    report = report_on([tmp_path / "found"], "gapbeam report")
    assert [section.title for section in report.sections] == ["Summary", "Picture"]
    assert f"{len(orders)} stable periodic responses at 2 points" in result.headline()


@pytest.mark.slow(minutes=0.1)
def test_starts_that_do_not_settle_are_reported(tmp_path: Path) -> None:
    """Three periods are too few: nothing is claimed, and the status says so."""
    result = run_atlas(oscillator, [read_axis("push=1.7367")], tmp_path / "x", starts=8, settle=1, rounds=1, orders=1)
    assert result.exit_status == 5
    assert result.atlas.points[0].unsettled > 0.0
    assert "did not settle" in result.headline()


@pytest.mark.slow(minutes=0.2)
def test_responses_are_followed_over_a_key(tmp_path: Path) -> None:
    """The motion without contact ends where it grazes, F = g |1 - W^2 + 2 i z W|, though no start comes to it there."""
    free = 0.5 * np.hypot(1.0 - 2.6**2, 0.08 * 2.6)
    kept = {"starts": 6, "settle": 30, "rounds": 1, "orders": 2}
    result = run_atlas(oscillator, [read_axis("push=1.2,2.2,3.2")], tmp_path / "found", follow=True, **kept)
    rows = list(csv.DictReader((tmp_path / "found" / "branches.csv").open()))
    assert len(rows) == len(result.branches)
    one = next(one for one in result.branches if one.order == 1 and one.ends[0] == "end of range")
    assert one.values.tolist() == [1.2, 2.2]
    assert one.limits[1] - 1.0 / 32.0 <= free <= one.limits[1] + 1.0 / 64.0
    assert len(result.tables()) == 2
    with pytest.raises(gapbeam.UserError, match="over one key"):
        run_atlas(oscillator, [], tmp_path / "x", follow=True)


@pytest.mark.slow(minutes=0.3)
def test_a_killed_atlas_resumes_after_its_last_point(tmp_path: Path) -> None:
    """Killed at the third of three points: two are kept, and tables are those of one run."""
    axes = [read_axis("push=0.5,2.6,2.7")]
    asked, dead = list[str](), True

    def scene_at(texts: tuple[str, ...]) -> PeriodicScene:
        asked.append(texts[0])
        if dead and len(asked) == 3:
            raise KeyboardInterrupt
        return oscillator(texts)

    def found(folder: str) -> str:
        kept = {"starts": 6, "settle": 30, "rounds": 1, "orders": 3, "inputs": {"case": "a"}}
        run_atlas(scene_at, axes, tmp_path / folder, **kept)
        return (tmp_path / folder / "atlas.json").read_text()

    with pytest.raises(KeyboardInterrupt):
        found("killed")
    dead, asked = False, []
    again = found("killed")
    assert asked == ["push=0.5", "push=2.7"]  # the first for its starts and the picture
    assert not (tmp_path / "killed" / "points.jsonl").exists()
    assert again == found("whole")


@pytest.mark.parametrize(
    ("file", "overrides", "says"),
    [
        ("random-vibration.toml", (), "random and recorded ones never do"),
        ("cantilever-stop.toml", ('load=[{type="gravity"}]',), "expected a harmonic load"),
        (
            "cantilever-stop.toml",
            (
                'load=[{type="base_motion",name="a",amplitude=1.0,frequency=20.0},'
                '{type="base_motion",name="b",amplitude=1.0,frequency=31.0}]',
            ),
            "found frequencies of 20, 31 Hz",
        ),
        ("cantilever-stop.toml", ("model.type=full",), "a full model has its mesh"),
    ],
)
def test_cases_that_have_no_atlas_are_refused(file: str, overrides: tuple[str, ...], says: str) -> None:
    """By name, before anything is marched."""
    with pytest.raises(gapbeam.UserError, match=says):
        scenes_of(CASE.with_name(file), overrides)(())


def test_keys_are_numbers(tmp_path: Path) -> None:
    """A picture and a table over words would have no order."""
    with pytest.raises(gapbeam.UserError, match="expected numbers"):
        run_atlas(oscillator, [read_axis("model.type=beam,rigid")], tmp_path / "x")
    with pytest.raises(gapbeam.UserError, match="at most 2"):
        run_atlas(oscillator, [read_axis(f"{key}=1,2") for key in "abc"], tmp_path / "x")


@alone
@pytest.mark.slow(minutes=0.3)
def test_the_command_finds_the_response_of_a_run(tmp_path: Path) -> None:
    """One response of a cantilever over a stop: its peak agrees with the march of the case, another program."""
    done = called_anew(
        "atlas", CASE, *settings(*QUICK), "--starts", "8", "--settle", "20", "--rounds", "2", "--orders", "4",
        "--output", tmp_path / "found",
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "1 stable periodic response at 1 point," in done.stdout
    (record,) = json.loads((tmp_path / "found" / "atlas.json").read_text())
    (one,) = record["responses"]
    assert one["starts"] == 8
    simulation = gapbeam.model(CASE, list(QUICK))
    scene = scene_of_model(simulation.case, simulation.model)
    row = scene.structures[0].points["tip"].rows[0]
    steps = round(1.4 / simulation.model.step)
    tips = [row @ step.new.u[0] for step in simulation.march(simulation.start(simulation.seat()), steps=steps)]
    last = tips[-round(2 * record["period"] / simulation.model.step) :]
    assert one["peak"]["tip"] == pytest.approx(np.abs(last).max(), rel=5e-3)
