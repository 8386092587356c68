"""Runs of scenes into results folders, against closed forms and against what readers of folders ask for."""

from __future__ import annotations

import json
import os
import resource
import signal
import time
from math import pi, sqrt
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gapbeam as gb
from gapbeam.solver.messages.errors import Interrupted
from gapbeam.solver.run.interruption import left_to_rank_zero
from gapbeam.solver.scene.marcher import Marcher

GRAVITY, HEIGHT, STIFFNESS = 9.81, 0.1, 1e6


def ball(**law: float) -> gb.Scene:
    """Return a ball of 1 kg that falls from 0.1 m to a stiff floor; it moves toward +."""
    body = gb.mass(1.0, name="ball")
    floor = gb.Contact(
        body["at"], gb.HalfPlane(0.0), gb.KelvinVoigt(stiffness=STIFFNESS, **law), offset=-HEIGHT, name="floor"
    )
    return gb.Scene(body, contacts=[floor], loads=[gb.weight(body, GRAVITY, name="weight")])


def test_a_bouncing_mass_has_the_impacts_of_its_closed_form(tmp_path: Path) -> None:
    """Times, speeds, impulses and durations of free fall and half a sine; the largest force by energy."""
    outcome = gb.run(ball(), step=1e-5, end=0.5, every=10, output=tmp_path / "a")
    assert outcome.exit_status == 0, outcome.message
    results = gb.open_results(outcome)
    fall, speed, w = sqrt(2 * HEIGHT / GRAVITY), sqrt(2 * GRAVITY * HEIGHT), sqrt(STIFFNESS)
    rest = GRAVITY / w**2
    contact = 2.0 * (pi - np.arctan2(speed / w, rest)) / w  # of x'' = g - w^2 x from (0, speed) back to 0
    table = np.loadtxt(tmp_path / "a" / "impacts.csv", delimiter=",", skiprows=1, usecols=range(1, 5))
    for number, row in enumerate(table):
        assert row[0] == pytest.approx(fall + number * (contact + 2.0 * fall), abs=2e-6)
        assert row[1] == pytest.approx(speed, rel=2e-4)  # the mean over the step in which it touches
        assert row[2] == pytest.approx(2.0 * speed + GRAVITY * contact, rel=1e-5)
        assert row[3] == pytest.approx(contact, rel=1e-4)
    assert len(table) == results.summary["impacts"]["floor"]["count"] == 2
    peak = STIFFNESS * (rest + sqrt(rest**2 + (speed / w) ** 2))
    assert outcome.summary["peak_contact_force"]["floor"] == pytest.approx(peak, rel=1e-4)
    history = results.history
    assert history.sizes["time"] == 5001
    u = history["displacement"].sel(probe="at", component="y").values
    early = history["time"].values < fall
    assert np.abs(u - 0.5 * GRAVITY * history["time"].values ** 2)[early].max() < 1e-9
    assert np.abs(history["penetration"].sel(face="floor").values - (u - HEIGHT)).max() < 1e-12
    assert float(history["impulse"][-1, 0]) == pytest.approx(table[:, 2].sum(), rel=1e-9)
    residual = np.abs(history["energy_residual"].values).max()
    assert residual < 1e-9 * GRAVITY * HEIGHT


def test_folders_of_scenes_are_read_as_those_of_cases(tmp_path: Path) -> None:
    """Report, figures, export and comparison; the report says that there is nothing to draw."""
    oscillator = gb.mass(1.0, stiffness=1.0, damping=0.02, name="block")
    stop = gb.Contact(oscillator["at"], gb.HalfPlane(0.5), gb.KelvinVoigt(stiffness=100.0), name="stop")
    scene = gb.Scene(oscillator, contacts=[stop], loads=[gb.Force(oscillator["at"], lambda t: 0.5 * np.cos(0.7 * t))])
    for name, step in (("a", 0.02), ("b", 0.01)):
        outcome = gb.run(scene, step=step, end=100.0, period=2 * pi / 0.7, output=tmp_path / name)
        assert outcome.exit_status == 0
    (page,) = gb.report(tmp_path / "a", pdf=False)
    words = page.read_text(encoding="utf-8")
    assert "no geometry" in words
    with pytest.raises(gb.RenderError, match=r"no shapes.*gapbeam plot"):
        gb.render(tmp_path / "a")
    assert "KelvinVoigt" in words
    assert gb.export(tmp_path / "a", tmp_path / "a.csv").is_file()
    assert gb.compare(tmp_path / "a", tmp_path / "b", output=tmp_path / "c").agree


def test_a_scheme_that_takes_energy_does_not_pass(tmp_path: Path) -> None:
    """Implicit Euler with coarse steps loses energy: status 3, the words of cases, and a remark on its balance."""
    body = gb.mass(1.0, stiffness=100.0)
    scene = gb.Scene(body)
    outcome = gb.run(
        scene, step=0.01, end=1.0, start=scene.state({body: 0.1}), scheme=gb.euler(), output=tmp_path / "a"
    )
    assert outcome.exit_status == 3
    assert "took" in outcome.message
    assert outcome.summary["status"] == "failed"
    assert any("promises no energy balance" in one for one in outcome.summary["warnings"])
    lost = 0.5 * 100.0 * 0.1**2 * (1.0 - 1.01**-100)  # theta = 1: each step divides energy by 1 + (w h)^2
    assert outcome.summary["energy"]["algorithmic_dissipation"] == pytest.approx(lost, rel=1e-9)


def test_a_motion_that_is_not_finite_keeps_the_records_before(tmp_path: Path) -> None:
    """A motion whose energy overflows ends with status 4, and its records end before."""
    body = gb.mass(1.0, name="a")
    push = gb.Force(body["at"], lambda t: np.where(np.asarray(t) < 0.05, 1.0, 1e308))
    outcome = gb.run(gb.Scene(body, loads=[push]), step=1e-3, end=1e3, output=tmp_path / "a")
    assert outcome.exit_status == 4
    assert outcome.summary["reason"] == "not finite"
    history = gb.open_results(outcome).history
    assert np.isfinite(history["displacement"].values).all()
    assert float(history["time"][-1]) == pytest.approx(0.05)


def test_observers_see_every_record_and_set_loads(tmp_path: Path) -> None:
    """A controller in an observer moves as the same controller between the steps of a march."""
    seen = []

    def made() -> tuple[gb.Scene, gb.Force]:
        body = gb.mass(1.0, stiffness=100.0, name="a")
        brake = gb.Force(body["at"], 0.0, name="brake")
        push = gb.Force(body["at"], lambda t: np.sin(9.0 * t), name="push")
        return gb.Scene(body, loads=[brake, push]), brake

    scene, brake = made()

    def control(step: Any) -> None:
        seen.append(step.t)
        brake.value = -3.0 * step["at"].velocity

    outcome = gb.run(scene, step=1e-3, end=0.5, observers=[control], output=tmp_path / "a")
    scene, brake = made()
    for step in gb.march(scene, step=1e-3, end=0.5):
        brake.value = -3.0 * step["at"].velocity
    assert len(seen) == 500
    last = gb.open_results(outcome).history["displacement"].values[-1, 0, 0]
    assert last == step["at"].displacement


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"step": 1e-3}, "needs `end=`"),
        ({"step": 1e-3, "end": 1.0, "stop": 2.0}, "found `stop=`"),
        ({"step": 1e-3, "end": 1.0, "every": 0}, "every = 0"),
        ({"step": 1e-3, "end": 1.0, "of": "probe.tip.rms"}, "found `of=`"),
        ({"step": 1e-3, "end": 1.0, "period": -1.0}, "period -1.0"),
        ({"step": 1e-3, "end": 1.0, "gates": {"total": 1.0}}, "gates: total"),
        ({"step": 1e-3, "end": 1.0, "observers": [3]}, "the observer 3"),
        ({"step": 1e-3, "end": -1.0}, "end -1.0"),
    ],
)
def test_arguments_that_do_not_fit_are_refused_by_name(tmp_path: Path, arguments: dict[str, Any], words: str) -> None:
    """Before anything is written."""
    with pytest.raises(gb.UserError, match=words):
        gb.run(ball(), output=tmp_path / "a", **arguments)
    assert not (tmp_path / "a").exists()


def test_step_and_end_are_no_arguments_of_cases() -> None:
    """A case has them as keys."""
    with pytest.raises(gb.UserError, match="found `step=`"):
        gb.run("cases/stability.toml", step=1e-4)


def test_studies_of_cases_refuse_scenes(tmp_path: Path) -> None:
    """They name what does the same for scenes, before anything is written."""
    with pytest.raises(gb.UserError, match="ensemble"):
        gb.sweep(ball(), {"floor.stiffness": [1e5, 1e6]}, output=tmp_path / "a")
    with pytest.raises(gb.UserError, match="found a scene"):
        gb.check(ball())  # type: ignore[arg-type]
    assert not (tmp_path / "a").exists()


def test_results_are_not_replaced_by_accident(tmp_path: Path) -> None:
    """As those of cases."""
    gb.run(ball(), step=1e-3, end=0.01, output=tmp_path / "a")
    with pytest.raises(gb.UserError, match="already holds results"):
        gb.run(ball(), step=1e-3, end=0.01, output=tmp_path / "a")
    assert gb.run(ball(), step=1e-3, end=0.01, output=tmp_path / "a", overwrite=True).exit_status == 0


def rattling() -> gb.Scene:
    """Return two masses, with friction, a wall that moves, a law with damping, and a load: all that has memory."""
    a, b = gb.mass(1.0, motions=2, stiffness=100.0, name="a"), gb.mass(0.5, motions=2, stiffness=50.0, name="b")
    law = gb.KelvinVoigt(stiffness=1e5, damping=5.0)
    hole = gb.Contact(
        a["at"], gb.Disc(0.02), law, friction=0.2, sliding=1e-3, name="hole", wall=lambda t: (0.003 * np.sin(9 * t), 0)
    )
    bump = gb.Contact((a["at"], b["at"]), gb.HalfPlane(0.01, normal=(0.6, 0.8)), law, name="bump")
    push = gb.Force(a["at"], lambda t: 5.0 * np.sin(12.0 * t), name="push")
    return gb.Scene(a, b, contacts=[hole, bump], loads=[push])


@pytest.mark.parametrize("left", ["interrupted", "killed"])
def test_a_run_that_was_stopped_continues_to_the_same_bits(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, left: str
) -> None:
    """Records, impacts and figures of a run that was stopped twice are those of one that was not."""
    asked: dict[str, Any] = {"step": 2e-4, "end": 4.0, "every": 3, "errors": False}
    whole = gb.run(rattling(), output=tmp_path / "whole", **asked)
    assert whole.exit_status == 0
    assert whole.summary["gates"]["impacts"] > 10
    advance, blocks = Marcher.advance, []

    def stopping(self: Marcher, steps: int, record: bool = False, energies: bool = False) -> Any:
        blocks.append(steps)
        if len(blocks) in (4, 7) and left == "killed":
            raise MemoryError("killed")
        if len(blocks) in (4, 7):
            os.kill(os.getpid(), signal.SIGTERM)
        return advance(self, steps, record, energies)

    monkeypatch.setattr(Marcher, "advance", stopping)
    for number in range(2):
        if left == "killed":
            with pytest.raises(MemoryError):
                gb.run(rattling(), output=tmp_path / "part", resume=number > 0, checkpoint=0.0, **asked)
        else:
            stopped = gb.run(rattling(), output=tmp_path / "part", resume=number > 0, **asked)
            assert stopped.exit_status == 143
    again = gb.run(rattling(), output=tmp_path / "part", resume=True, **asked)
    assert again.exit_status == 0
    assert len(again.summary["resumed"]) >= 1
    assert not (tmp_path / "part" / "checkpoint").exists()
    one, other = (gb.open_results(folder).history for folder in (whole, again))
    assert one.identical(other)
    for file in ("impacts.csv",):
        assert (tmp_path / "whole" / file).read_bytes() == (tmp_path / "part" / file).read_bytes()
    for key in ("energy", "gates", "peak_contact_force", "contact_episodes", "impacts", "convergence"):
        assert again.summary[key] == whole.summary[key]
    done = gb.run(rattling(), output=tmp_path / "part", resume=True, **asked)
    assert done.message.startswith("was done before")
    os.truncate(tmp_path / "part" / "history.h5", 4000)
    with pytest.raises(gb.UserError, match=r"history\.h5 cannot be read"):
        gb.run(rattling(), output=tmp_path / "part", resume=True, **asked)


def test_a_run_stops_at_its_wall_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Before the march, or between two blocks: status 124, then resumed to the same bits."""
    asked: dict[str, Any] = {"step": 2e-4, "end": 4.0, "every": 3, "errors": False}
    whole = gb.run(rattling(), output=tmp_path / "whole", **asked)
    hour, advance = 3600.0, Marcher.advance
    late = []
    with pytest.raises(Interrupted, match="the wall-time limit was reached before the march"):
        gb.run(rattling(), output=tmp_path / "part", wall_time=1e-6, **asked)

    def expiring(self: Marcher, steps: int, record: bool = False, energies: bool = False) -> Any:
        monkeypatch.setattr(time, "perf_counter", lambda: clock() + hour)
        return advance(self, steps, record, energies)

    clock = time.perf_counter
    for _ in range(2):
        with monkeypatch.context() as within:
            within.setattr(Marcher, "advance", expiring)
            late.append(gb.run(rattling(), output=tmp_path / "part", resume=True, wall_time=hour, **asked))
        monkeypatch.setattr(time, "perf_counter", clock)
    assert [one.exit_status for one in late] == [124, 124]
    assert all("wall-time limit" in one.message for one in late)
    again = gb.run(rattling(), output=tmp_path / "part", resume=True, **asked)
    assert again.exit_status == 0
    one, other = (gb.open_results(folder).history for folder in (whole, again))
    assert one.identical(other)


@pytest.mark.parametrize(("rank", "heard"), [(0, True), (1, False), (3, False)])
def test_ranks_that_wait_leave_signals_to_rank_zero(rank: int, heard: bool) -> None:
    """They were killed by signals that rank 0 acts on, and took it with them."""
    came = []
    for number in (signal.SIGTERM, signal.SIGUSR1, signal.SIGINT):
        before = signal.signal(number, lambda number, _: came.append(number))
        try:
            with left_to_rank_zero(rank):
                os.kill(os.getpid(), number)
            assert (number in came) == heard
            os.kill(os.getpid(), number)
            assert number in came
        finally:
            signal.signal(number, before)


def test_another_scene_is_not_continued(tmp_path: Path) -> None:
    """A changed clearance, a changed load, an observer: refused, and nothing in the folder changes."""
    asked: dict[str, Any] = {"step": 2e-4, "end": 0.1, "output": tmp_path / "a", "errors": False}
    gb.run(rattling(), **asked)
    before = (tmp_path / "a" / "history.h5").read_bytes()
    with pytest.raises(gb.UserError, match="another scene"):
        gb.run(rattling().with_({"hole.friction": 0.1}), resume=True, **asked)
    with pytest.raises(gb.UserError, match="another scene"):
        gb.run(rattling().with_({"push.value": 1.0}), resume=True, **asked)
    with pytest.raises(gb.UserError, match="observers"):
        gb.run(rattling(), resume=True, observers=[print], **asked)
    assert (tmp_path / "a" / "history.h5").read_bytes() == before


def test_a_full_disk_ends_with_status_6(tmp_path: Path) -> None:
    """A limit of file sizes stands for a full disk: the folder stays readable, and the run continues with more room."""
    asked: dict[str, Any] = {"step": 2e-4, "end": 2.0, "output": tmp_path / "a", "errors": False}
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    gb.run(rattling(), step=2e-4, end=0.01, output=tmp_path / "b", errors=False)  # machine code is kept on the disk
    try:
        resource.setrlimit(resource.RLIMIT_FSIZE, (300_000, before[1]))
        outcome = gb.run(rattling(), **asked)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert outcome.exit_status == 6
    assert "history.h5" in outcome.message
    assert gb.run(rattling(), resume=True, **asked).exit_status == 0


def test_smoothing_follows_the_first_period_where_nothing_forces(tmp_path: Path) -> None:
    """A twentieth of 2 pi / w of the softest motion that is not rigid; of the run where that is shorter."""
    free, held = gb.mass(1.0, name="free"), gb.mass(1.0, stiffness=1e4, name="held")
    stop = gb.Contact((free["at"], held["at"]), gb.HalfPlane(1.0), gb.KelvinVoigt(stiffness=1e6), name="stop")
    for end, expected in ((1.0, 2.0 * pi / 100.0), (0.05, 0.05)):
        outcome = gb.run(gb.Scene(free, held, contacts=[stop]), step=1e-3, end=end, output=tmp_path / f"{end}")
        assert outcome.summary["smoothing"]["window"] == pytest.approx(0.05 * expected, rel=1e-9)


@pytest.mark.parametrize("kind", [np.float64, np.float32, np.asarray])
def test_arguments_of_numpy_are_numbers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kind: Any) -> None:
    """Step, end and period from arrays leave the same summary as those of Python."""
    monkeypatch.setenv("GAPBEAM_ERRORS", "companions")
    block = gb.mass(1.0, stiffness=1.0, damping=0.5, name="block")
    scene = gb.Scene(block, loads=[gb.Force(block["at"], lambda t: np.cos(2.0 * pi * t), name="push")])
    given = {"step": 1.0 / 64.0, "end": 64.0, "period": 1.0}
    found = []
    for number in (float, kind):
        run = gb.run(scene, **{key: number(value) for key, value in given.items()}, output=tmp_path / number.__name__)
        found.append(json.loads((run.folder / "summary.json").read_text())["closing"])
    assert found[0] == found[1]
    assert found[0]["rows"]


@pytest.mark.parametrize("place", ["at", "ball.at"])
def test_a_figure_takes_the_name_of_a_point_with_its_structure(tmp_path: Path, place: str) -> None:
    """As files and `check` write it: it was refused where the point alone bears its name."""
    deep = gb.figure("deep", "displacement", place)
    outcome = gb.run(ball(), step=1e-5, end=0.2, output=tmp_path / "a", figures=[deep])
    assert outcome.summary["figures"]["deep"]["value"] == pytest.approx(HEIGHT, rel=0.05)
    table = {
        "structure": [{"name": "ball", "model": {"type": "mass", "mass": 1.0, "stiffness": 1.0}}],
        "pair": [{"name": "floor", "between": ["ball.at"], "region": {"type": "half-plane", "clearance": HEIGHT},
                  "law": {"type": "kelvin-voigt", "stiffness": STIFFNESS}}],
        "load": [{"type": "step_force", "point": "ball.at", "amplitude": GRAVITY}],
        "figure": [{"name": "deep", "quantity": "displacement", "place": place}],
        "time": {"end": 0.2},
    }  # fmt: skip
    found = gb.run(table, output=tmp_path / "b").summary["figures"]["deep"]
    assert found["value"] == pytest.approx(HEIGHT, rel=0.05)
