"""Figures of one's own that ensembles gather as they march: against those of single runs, and in uncertain values."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import stats

import gapbeam as gb
from gapbeam.interface.case_atlas import repeating_scene
from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.scene.scene import Scene
from gapbeam.studies.uncertain.uncertain_file import read_uncertain, run_uncertain

PERIOD, STEPS = 0.03, 400
FIGURES = [
    gb.figure("top", "displacement", "p0"),
    gb.figure("bottom", "displacement", "p0", statistic="minimum", start=0.0123),
    gb.figure("when", "contact_force", "gap p1", statistic="time-of-maximum"),
    gb.figure("fall", "velocity", "p1", statistic="time-of-minimum", end=0.0456),
    gb.figure("swing", "velocity", "p0", statistic="peak-to-peak"),
    gb.figure("push", "contact_force", "gap p0", statistic="mean"),
    gb.figure("shake", "velocity", "p1", statistic="rms", start=0.01001, end=0.04999),
    gb.figure("middle", "displacement", "p1", statistic="mean", magnitude=True),
    gb.figure("then", "velocity", "p0", statistic="value", time=0.031415),
    gb.figure("late", "displacement", "p0", statistic="share", limit=0.5e-4, magnitude=True),
]


def tube() -> Scene:
    """Six modes in two slots, driven at the first point."""
    modes = np.arange(6) + 0.5
    shapes = {f"p{i}": np.sqrt(2.0) * np.sin(modes * np.pi * x) for i, x in enumerate((1.0, 0.4))}
    body = gb.from_modes(2 * np.pi * 20 * modes**1.5, 0.02, shapes, name="tube")
    law = gb.KelvinVoigt(stiffness=1e6, damping=20.0)
    gaps = [gb.Contact(body[name], gb.Slot(2e-4), law, name=f"gap {name}") for name in shapes]
    shake = gb.Force(
        body["p0"], lambda t, size: size * np.sin(2 * np.pi * t / PERIOD), name="shaker", size=20.0
    )  # fmt: skip
    return gb.Scene(body, contacts=gaps, loads=[shake])


def test_members_have_the_figures_of_their_runs(tmp_path: Path) -> None:
    """All statistics that need no history, of seven members in lanes and of two alone: those of runs, to 1e-9."""
    scene, values = tube(), {"shaker.size": np.linspace(5.0, 40.0, 7), "gap *.clearance": np.linspace(4e-4, 1e-4, 7)}
    clock = {"step": PERIOD / STEPS, "end": 2.0 * PERIOD}
    lanes = gb.ensemble(scene, values, figures=FIGURES, output=tmp_path / "kept", **clock)
    alone = gb.ensemble(scene, {path: x[:2] for path, x in values.items()}, figures=FIGURES, **clock)
    kept = gb.ensemble(scene, values, figures=FIGURES, output=tmp_path / "kept", **clock)
    assert list(lanes.figures) == [one.name for one in FIGURES]
    for i in range(7):
        member = scene.with_({path: float(x[i]) for path, x in values.items()})
        outcome = gb.run(member, output=tmp_path / f"{i}", errors=False, figures=FIGURES, **clock)
        for one in FIGURES:
            found = outcome.summary["figures"][one.name]["value"]
            scale = 1e-9 * max(abs(found), PERIOD if one.unit == "s" else 0.0)
            assert lanes.figures[one.name][i] == pytest.approx(found, rel=1e-9, abs=scale), (one.name, i)
            if i < 2:
                assert alone.figures[one.name][i] == pytest.approx(found, rel=1e-9, abs=scale), (one.name, i)
    assert len(set(np.round(lanes.figures["late"], 6))) > 3
    assert all(np.array_equal(kept.figures[name], value) for name, value in lanes.figures.items())


def test_figures_count_from_the_time_that_features_do(tmp_path: Path) -> None:
    """After `settle`, a figure is that of a run from then on."""
    scene, clock = tube(), {"step": PERIOD / STEPS, "end": 2.0 * PERIOD}
    given = gb.figure("shake", "displacement", "p0", statistic="rms")
    later = gb.figure("shake", "displacement", "p0", statistic="rms", start=PERIOD)
    found = gb.ensemble(scene, members=8, settle=PERIOD, figures=[given], **clock)
    outcome = gb.run(scene, output=tmp_path / "run", errors=False, figures=[later], **clock)
    assert found.figures["shake"] == pytest.approx(outcome.summary["figures"]["shake"]["value"], rel=1e-9)


@pytest.mark.parametrize(
    ("figure", "words"),
    [
        (gb.figure("a", "displacement", "p0", statistic="quantile", level=0.9), "needs a history"),
        (gb.figure("a", "velocity", "p0", statistic="probability", limit=1.0, duration=0.1), "needs a history"),
        (gb.figure("a", "penetration", "gap p0"), "expected displacement, velocity or contact_force"),
        (gb.figure("a", "displacement", "p7"), "expected one of p0, p1"),
        (gb.figure("a", "displacement", "p0", component="x"), "component"),
    ],
)
def test_figures_that_need_more_are_refused(figure: Any, words: str) -> None:
    """By name, before anything marches."""
    with pytest.raises(UserError, match=words):
        gb.ensemble(tube(), members=2, step=1e-4, end=0.01, figures=[figure])


def test_a_contact_that_pulls_or_rubs_is_refused() -> None:
    """Its normal force has a sign, which sizes of forces do not have."""
    ball = gb.mass(0.5, stiffness=2e3, name="ball")
    sticky = gb.Contact(ball["at"], gb.HalfPlane(1e-4), gb.Adhesive(stiffness=1e6, pull=0.5, reach=1e-5), name="pad")
    with pytest.raises(UserError, match="that pulls"):
        gb.ensemble(
            gb.Scene(ball, contacts=[sticky]), members=2, step=1e-4, end=0.01,
            figures=[gb.figure("a", "contact_force", "pad")],
        )  # fmt: skip


def oscillator() -> Scene:
    """A linear mass under a sine, 1 Hz."""
    body = gb.mass(1.0, stiffness=4.0, damping=2.0, name="body")
    shaker = gb.Force(body["at"], lambda t, size: size * np.sin(2 * np.pi * t), name="shaker", size=1.0)
    return gb.Scene(body, loads=[shaker])


def test_uncertain_values_have_figures_of_ones_own() -> None:
    """The largest velocity of a linear mass is w F / |k - m w^2 + i c w|: its distribution follows from that of F."""
    figures = [gb.figure("speed", "velocity", "at"), gb.figure("share", "velocity", "at", statistic="share", limit=0.0)]
    omega = 2.0 * np.pi
    factor = omega / abs(4.0 - omega**2 + 2.0j * omega)
    found = gb.uncertain(
        oscillator(), {"shaker.size": stats.uniform(1.0, 1.0)}, period=1.0, members=64, replicates=4, measure=2,
        settle=20, exponents=50, figures=figures, limits={"speed": 1.25 * factor},
    )  # fmt: skip
    assert found.figures["speed"] == pytest.approx(factor * found.values["shaker.size"], rel=1e-3)
    assert found.figures["share"] == pytest.approx(0.5, abs=2e-3)
    one = found.exceeded["speed"]
    assert one.low <= 0.75 <= one.high
    with pytest.raises(UserError, match="it has a time"):
        gb.uncertain(
            oscillator(), {"shaker.size": stats.uniform(1.0, 1.0)}, period=1.0,
            figures=[gb.figure("then", "velocity", "at", statistic="value", time=1.0)],
        )  # fmt: skip


STUDY = """
case = "rattle.toml"
members = 32
replicates = 4
settle = 12
orders = 2
measure = 2

[[variable]]
path = "stop.clearance"
distribution = "norm"
parameters = { loc = 0.02, scale = 0.001 }
"""
FILE = """
[[structure]]
name = "ball"
model = { type = "mass", mass = 1.0, stiffness = 4.0, damping = 2.0 }

[[pair]]
name = "stop"
between = ["ball.at"]
region = { type = "half-plane", clearance = 0.02 }
law = { type = "kelvin-voigt", stiffness = 50.0, damping = 0.5 }

[[load]]
type = "harmonic_force"
name = "shaker"
point = "ball.at"
amplitude = 1.0
frequency = 1.0

[[figure]]
name = "knock"
quantity = "contact_force"
place = "stop"

[[figure]]
name = "tail"
quantity = "displacement"
place = "at"
statistic = "quantile"
level = 0.9

[time]
step = 5e-3
end = 4.0
"""


@pytest.mark.slow(minutes=0.1)
def test_a_study_of_a_file_of_structures_has_its_figures(tmp_path: Path) -> None:
    """The largest force is the one of ensembles; a figure that needs a history is left out, and refused as a limit."""
    (tmp_path / "rattle.toml").write_text(FILE)
    (tmp_path / "study.toml").write_text(STUDY)
    read = read_uncertain(tmp_path / "study.toml")
    one = repeating_scene(tmp_path / "rattle.toml", ())
    found = run_uncertain(read, one, tmp_path / "found")
    assert found.figures["knock"] == pytest.approx(found.figures["peak_force/stop"], rel=1e-6)
    assert np.ptp(found.figures["knock"]) > 0.0
    assert "tail" not in found.figures
    assert "knock" in (tmp_path / "found" / "distributions.csv").read_text()
    (tmp_path / "study.toml").write_text(STUDY.replace("orders = 2", "orders = 1"))
    unsettled = run_uncertain(read_uncertain(tmp_path / "study.toml"), one, tmp_path / "unsettled")
    assert unsettled.figures == {}
    assert (tmp_path / "unsettled" / "uncertain.png").is_file()
    (tmp_path / "study.toml").write_text(STUDY + '[[limit]]\nfigure = "tail"\nvalue = 1.0\n')
    with pytest.raises(UserError, match="figure tail: statistic = 'quantile'"):
        run_uncertain(read_uncertain(tmp_path / "study.toml"), one, tmp_path / "other")
