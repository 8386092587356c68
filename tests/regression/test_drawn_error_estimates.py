"""Cases that hypothesis draws for error estimates, and how the promises about them are counted."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

import gapbeam
from benchmarks.drawn_cases.attempts import Attempt, Figure, attempted, coverage, missed
from benchmarks.drawn_cases.scenes import CLASSES, drawn_scene
from benchmarks.true_errors import true_errors
from gapbeam.postprocess.results.results import records_in
from gapbeam.studies.error_estimate.motion_record import MotionRecord

FAST = (7,)
SLOW = (0, 1, 2, 3, 5, 6)
FEWEST_BELOW = 0.8  # of the figures of one case, which are few, lie below E


def numbers() -> Iterator[object]:
    """Yield the numbers of quick cases, those that take longer as slow ones."""
    yield from FAST
    for number in SLOW:
        yield pytest.param(number, marks=pytest.mark.slow(minutes=0.5))


@pytest.mark.parametrize("number", numbers())
def test_a_drawn_case_lies_within_its_errors(number: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """No figure is farther than 5 E from a second way, few farther than E, and what that solves is not refused."""
    monkeypatch.setenv("GAPBEAM_ERRORS", "companions")
    found = attempted(number, tmp_path)
    assert not found.falsely_refused, found.message
    ratios = [one.error / one.estimate for one in found.figures]
    assert max(ratios, default=0.0) <= 5.0
    assert sum(ratio <= 1.0 for ratio in ratios) >= FEWEST_BELOW * len(ratios)


def test_a_beam_that_chatters_lies_within_its_errors(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Blows of a few steps: the ranges of two motions agree by chance, and their difference does not."""
    monkeypatch.setenv("GAPBEAM_ERRORS", "companions")
    found = attempted(14, tmp_path, chatters=True)
    assert (found.status, found.second_status) == (0, 0)
    ratios = [one.error / one.estimate for one in found.figures]
    assert len(ratios) == 8
    assert max(ratios) <= 1.0


def leaf(push: float) -> dict[str, Any]:
    """Return a leaf that a force at its tip rattles in a narrow slot, in blows of one or two of 40 steps a period."""
    frequency = 37.2
    step = 1.0 / (40.0 * frequency)
    return {
        "beam": {"length": 0.18, "thickness": 0.0044, "width": 0.0054},
        "material": {"young_modulus": 3.0e9, "poisson_ratio": 0.35, "density": 1200.0},
        "damping": {"frequencies": [35.0, 210.0], "ratios": [0.01, 0.01]},
        "joint": [{"type": "clamped", "name": "root", "point": 0.0}],
        "support": [{"name": "slot", "from": 0.125, "to": 0.129, "clearance": 2.8e-4}],
        "model": {"type": "beam"},
        "contact": {"stiffness": 2.7e12, "law": {"type": "hunt-crossley", "restitution": 0.95}},
        "load": [
            {"type": "gravity"},
            {"type": "harmonic_force", "name": "push", "point": 0.18, "amplitude": push, "frequency": frequency,
             "ramp": 1.0 / frequency},
        ],
        "probe": [{"name": "tip", "point": 0.18}],
        "time": {"end": 6.0 / frequency, "step": step},
        "output": {"history_interval": step},
    }  # fmt: skip


@pytest.mark.slow(minutes=0.5)
def test_motions_that_chatter_lie_within_their_errors(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Up to the horizon, against a sixteenth of the step: ranges of coarse motions agreed by chance, 7.8 E off."""
    monkeypatch.setenv("GAPBEAM_ERRORS", "companions")
    ratios = []
    for push in (0.04, 0.06, 0.075, 0.09, 0.095):
        case = gapbeam.read_case(leaf(push))
        run = gapbeam.run(case, output=tmp_path / f"{push}")
        errors = run.summary["errors"]
        finer = {"time.step": leaf(push)["time"]["step"] / 16.0, "time.end": errors["up_to"], "output.errors": "none"}
        second = gapbeam.run(gapbeam.read_case(case, finer), output=tmp_path / f"{push} finer")
        assert (run.exit_status, second.exit_status) == (0, 0)
        exact = MotionRecord.of_records(*records_in(tmp_path / f"{push} finer"))
        rows = [one for one in true_errors(run.summary, exact) if one[0]["span"] == "up to the horizon"]
        ratios += [error / row["error"] for row, error in rows if row["name"].startswith("tip")]
    assert len(ratios) == 10
    assert max(ratios) <= 1.0


def attempt(number: int, *ratios: float, status: int = 0, second: int = 0) -> Attempt:
    """Return a run whose errors have these ratios to their estimates."""
    figures = tuple(Figure("settled", f"figure {place}", 1.0, 0.1, 0.1 * one) for place, one in enumerate(ratios))
    chosen = {"law": "kelvin-voigt", "scheme": "discrete-gradient"}
    return Attempt(number, "beam", "auto", chosen, status, "no seat", None, 1.0, 2.0, second, None, figures)


def test_a_number_draws_a_case_of_its_class() -> None:
    """Twenty in a row go through all classes; each is accepted, and the same again. Rigid bodies have no joints."""
    for number, expected in enumerate(CLASSES):
        scene = drawn_scene(number)
        assert (scene.kind, scene.automatic, scene.motion) == expected
        case = gapbeam.read_case(scene.tables)
        assert (case.contact.stiffness == "auto") == scene.automatic
        assert not (scene.kind == "rigid" and case.joint)
    assert drawn_scene(7).tables == drawn_scene(7).tables


@pytest.mark.parametrize(
    ("ratios", "lost"),
    [
        ([0.5] * 100, 0),
        ([0.5] * 95 + [1.5] * 5, 0),
        ([0.5] * 94 + [1.5] * 6, 1),
        ([0.5] * 98 + [3.0] * 2, 1),
        ([0.5] * 999 + [6.0], 1),
        ([0.5] * 90 + [6.0] * 10, 3),
        ([6.0] * 99, 0),
    ],
    ids=["kept", "just kept", "E", "2 E", "5 E", "all", "too few"],
)
def test_promises_are_counted(ratios: list[float], lost: int) -> None:
    """95 % below E, 99 % below 2 E, all below 5 E, of every class with a hundred figures: here of four alike."""
    found = list(missed([attempt(0, *ratios)]))
    assert len(found) == 4 * lost
    assert len(coverage([attempt(0, *ratios)]).rows) == 4


def test_a_refusal_is_false_where_the_second_way_ends_well() -> None:
    """Another status than 0 is none where the second way ends so, too, or where the run is wrong and says so."""
    refused = attempt(3, status=4)
    assert any("case 3 (beam) is refused" in line for line in missed([refused]))
    assert not any(missed([replace(refused, second_status=4)]))
    assert not any(missed([replace(refused, status=0, second_status=4)]))
    assert not any(missed([replace(refused, status=3, off=0.3)]))
    assert any(missed([replace(refused, status=3, off=0.001)]))


@pytest.mark.parametrize("scheme", ["generalized-alpha", "implicit-midpoint"])
def test_an_energy_gate_of_a_scheme_that_changes_energy_is_true(scheme: str) -> None:
    """Its status 3 is a measured energy; other statuses of it, and status 3 of a scheme that conserves, are judged."""
    refused = replace(attempt(3, status=3), choices={"scheme": scheme}, off=0.001)
    assert not any(missed([refused]))
    assert any(missed([replace(refused, status=4)]))
    assert any(missed([replace(refused, choices={"scheme": "discrete-gradient"})]))
