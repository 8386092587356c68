"""Modes of beams as contact holds them, by the command and by its parts, against theory and SciPy."""

from __future__ import annotations

import json
from pathlib import Path

import meshio
import numpy as np
import pytest

import gapbeam
from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.seat.contact_modes import SEATED, HeldModes, held_modes
from gapbeam.studies.modes.theory_comparison import assurance, beams_of, compare_modes, remarks
from tests.shared.command import DEMO, PROJECT, alone, called, called_in_turn, on_ranks, settings
from tests.shared.models import GRAVITY, SOLID, beam_case, beam_model, bending_frequencies, spread, stiffness_of
from tests.verification.test_frequencies import SHEAR, timoshenko_free

EDGES = 3.0 * 604.8 / 0.05  # N m/rad: 3 E I / a, the span between the edges that the seat rests on, in statics


def frequencies_of(state: HeldModes, kind: str) -> np.ndarray:
    """Return the frequencies of one kind, Hz."""
    pairs = zip(state.frequencies, state.motions, strict=True)
    return np.array([frequency for frequency, motion in pairs if motion.kind == kind])


@pytest.mark.slow(minutes=0.1)
def test_the_seat_is_a_beam_on_its_two_edges() -> None:
    """Under gravity it rests at x = 0 and 50 mm: the overhang on k1 infinite, k2 = 3 E I / a has 44.08 Hz, 278.2 Hz.

    The slice, which gives way to shear and at its edges, is within 0.5, 0.7 and 1.1 %; springs fitted to it have that
    k2 within 10 %, and no k1, which is beyond the plateau.
    """
    model = beam_model()
    states = held_modes(model, 4)
    seated = states[0].bending()[0][:3]
    theory = beams_of(model.case)["overhang"].frequencies(np.arange(1, 4), np.inf, EDGES)
    assert theory[:2] == pytest.approx([44.078, 278.24], rel=1e-5)
    assert np.all(seated < theory)
    assert seated == pytest.approx(theory, rel=0.012)
    found = compare_modes(model.case, states, 4, {}, 0.01)
    best = found.best("seated")
    assert best is not None
    assert best.choice == "overhang"
    assert best.fit.misfit < 1e-3
    assert best.fit.torsion.low < EDGES < best.fit.torsion.high
    assert best.fit.torsion.value == pytest.approx(EDGES, rel=0.1)
    assert best.fit.draught.verdict == "at least"
    assert [one.matched for one in best.modes] == [1, 2, 3, 4]
    assert min(one.mac for one in best.modes) > 0.99


def test_two_soft_points_are_springs_at_their_middle() -> None:
    """Springs K at x = 0 and a: k1 = 2 K and k2 = K a^2 / 2 at l = L - a / 2, all inside the intervals identified.

    Neither the overhang nor the whole beam has springs with these frequencies.
    """
    stiffness, span = 2e6, 0.05
    model = beam_model({"contact": {"points": [0.0, span], "stiffness": stiffness}})
    found = compare_modes(model.case, held_modes(model, 3), 3, {}, 0.01)
    overhang, whole, fitted = (one.fit for one in found.fits)
    assert not overhang.reproduces
    assert not whole.reproduces
    assert fitted.length is not None
    expected = (2.0 * stiffness, 0.5 * stiffness * span**2, 0.51 - 0.5 * span)
    for estimate, value in zip((fitted.draught, fitted.torsion, fitted.length), expected, strict=True):
        assert estimate.verdict == "identified"
        assert estimate.low < value < estimate.high


def test_modes_are_those_of_scipy_and_of_the_clamped_beam() -> None:
    """An interference fit closes all points: SciPy's eigenvalues of K + springs; 45.8 Hz between 44.5 and 47.18."""
    model = beam_model({"support": {"clearance": -0.006e-3}})
    seated, _, closed = held_modes(model, 3)
    springs = spread(model.system.contact.springs(model.law.stiffness), model.system.operators.size)
    expected = bending_frequencies(model, 3, stiffness_of(model) + springs)
    assert seated.closed == seated.points
    assert seated.bending()[0][:3] == pytest.approx(expected, rel=1e-7)
    assert closed.bending()[0][:3] == pytest.approx(expected, rel=1e-7)
    assert 44.5 < expected[0] < 47.18


def test_modes_of_a_solid_are_reported_apart() -> None:
    """Free solid: lateral those of Timoshenko's beam on edge, axial n c / 2 l, torsional by Saint-Venant's constant."""
    mesh = SOLID | {"size": 0.02, "support_size": 0.02}
    free = held_modes(beam_model({"mesh": mesh, "restraint": {"axial": 1.0, "lateral": 1.0}}), 3)[1]
    assert frequencies_of(free, "bending")[2:5] == pytest.approx(timoshenko_free(0.51, 0.012, SHEAR[3], 3), rel=6e-3)
    assert frequencies_of(free, "lateral")[2:4] == pytest.approx(timoshenko_free(0.51, 0.02, SHEAR[3], 2), rel=6e-3)
    assert frequencies_of(free, "axial")[1] == pytest.approx(np.sqrt(2.1e11 / 7919.0) / (2.0 * 0.51), rel=1e-3)
    b, h = 0.02, 0.012
    odd = np.arange(1, 40, 2)
    constant = b * h**3 / 3.0 * (1.0 - 192.0 * h / (np.pi**5 * b) * np.sum(np.tanh(odd * np.pi * b / (2 * h)) / odd**5))
    speed = np.sqrt(2.1e11 / 2.6 / 7919.0 * constant / (b * h * (b * b + h * h) / 12.0))
    # one cell of degree 2 across holds most of the warping
    assert frequencies_of(free, "torsional")[1] == pytest.approx(speed / (2.0 * 0.51), rel=0.1)


@pytest.mark.parametrize("kind", ["reduced", "beam"])
def test_cheaper_models_have_the_same_modes(kind: str) -> None:
    full, cheap = held_modes(beam_model(), 4), held_modes(beam_model({"model": {"type": kind}}), 4)
    for one, other in zip(full, cheap, strict=True):
        count = 6 if one.name == "free" else 4
        assert other.bending()[0][:count] == pytest.approx(one.bending()[0][:count], rel=2.5e-3, abs=0.3)
        for x, y in zip(one.bending()[1][2:count], other.bending()[1][2:count], strict=True):
            assert assurance(x, y, one.masses) > 0.9999


@pytest.mark.parametrize("kind", ["full", "reduced", "beam"])
def test_an_exciter_moves_along(kind: str) -> None:
    """A mass m and a spring k at x0 in Rayleigh's quotient of the shape without them: to first order, both small."""
    place, mass, stiffness = 0.3, 2e-3, 400.0
    exciter = {"type": "exciter", "point": place, "amplitude": 0.0, "frequency": 20.0}
    exciter |= {"mass": mass, "stiffness": stiffness}
    bare, carrying = (
        held_modes(beam_model({"model": {"type": kind}}, loads), 3)[2] for loads in ((GRAVITY,), (GRAVITY, exciter))
    )
    for mode in range(3):
        shape = bare.bending()[1][mode]
        square = np.interp(place, bare.places, shape) ** 2 / (bare.masses @ shape**2)
        rate = (2.0 * np.pi * bare.bending()[0][mode]) ** 2
        expected = (rate + stiffness * square) / (1.0 + mass * square) / rate
        found = (carrying.bending()[0][mode] / bare.bending()[0][mode]) ** 2
        assert found - 1.0 == pytest.approx(expected - 1.0, rel=0.03)


def test_a_beam_that_nothing_presses_is_free() -> None:
    model = beam_model(loads=())
    states = held_modes(model, 3)
    assert states[0].closed == 0
    assert states[0].bending()[0][:5] == pytest.approx(states[1].bending()[0][:5], abs=1e-6)
    found = compare_modes(model.case, states, 3, {}, 0.01)
    assert found.fits == ()
    assert [one.matched for one in found.free] == [1, 2, 3]


def test_a_mesh_that_locks_is_reported() -> None:
    """Linear elements four times as long as high are 40 % too stiff in bending."""
    for degree in (1, 2):
        model = beam_model({"mesh": {"degree": degree}}, loads=())
        text = remarks(compare_modes(model.case, held_modes(model, 3), 3, {}, 0.01))
        assert any("locks" in line for line in text) == (degree == 1)


def test_what_has_no_modes_is_refused() -> None:
    skew = {"contact": {"formulation": {"type": "nitsche", "theta": -1.0}}}
    with pytest.raises(UserError, match="theta"):
        held_modes(beam_model(skew), 2)
    with pytest.raises(UserError, match="expected 1 to"):
        held_modes(beam_model(), 60)
    with pytest.raises(UserError, match=r"take more modes in \[model\]"):
        held_modes(beam_model({"model": {"type": "reduced", "modes": 4}}), 6)
    with pytest.raises(UserError, match="were asked for; the model with"):
        held_modes(beam_model({"model": {"type": "beam", "elements": 3}}), 9)


@pytest.mark.slow(minutes=0.3)
@alone
def test_the_command_reports_and_writes(tmp_path: Path) -> None:
    """Tables, a picture, and the same frequencies on two ranks."""
    done = called("modes", DEMO, "--measured", "43.2,268,-,1500", "--output", tmp_path / "one")
    assert done.returncode == 0, done.stderr
    assert "Bending modes" in done.stdout
    assert "measured" in done.stdout
    assert "axial" in done.stdout
    one = json.loads((tmp_path / "one" / "modes.json").read_text(encoding="utf-8"))
    assert (tmp_path / "one" / "modes.png").stat().st_size > 10_000
    with meshio.xdmf.TimeSeriesReader(tmp_path / "one" / SEATED / "fields.xdmf") as reader:
        reader.read_points_cells()
        series = [reader.read_data(number) for number in range(reader.num_steps)]
    assert [time for time, *_ in series] == pytest.approx([mode["frequency"] for mode in one["states"][0]["modes"]])
    largest = [np.abs(points["displacement"]).max() for _, points, _ in series]
    assert largest == pytest.approx([0.05 * 0.51] * len(series), rel=0.1)
    measured = [fit for fit in one["springs"] if fit["source"] == "measured"]
    assert [fit["length_is"] for fit in measured] == ["overhang", "whole", "fitted"]
    assert measured[0]["fitted"] == {"1": 43.2, "2": 268.0, "4": 1500.0}
    two = on_ranks(2, "modes", DEMO, "--output", tmp_path / "two")
    assert two.returncode == 0, two.stderr
    other = json.loads((tmp_path / "two" / "modes.json").read_text(encoding="utf-8"))
    for here, there in zip(one["states"], other["states"], strict=True):
        ours, theirs = ([mode["frequency"] for mode in state["modes"]] for state in (here, there))
        assert ours == pytest.approx(theirs, rel=1e-8, abs=1e-3)


@pytest.mark.slow(minutes=0.3)
@alone
def test_the_command_refuses_bad_input(tmp_path: Path) -> None:
    """Exit status 2 and what to try; 5 where no springs reproduce what was measured."""
    output = ("--output", tmp_path)
    wrong = {
        ("--measured", "43,abc,-3"): ["mode 2", "mode 3", "abc", "-3"],
        ("--measured", "43.2"): ["at least 2"],
        ("--measured", "50,40"): ["ascend"],
        ("--measured", "1,2,3,4,5"): ["--count 5"],
        ("--measured", "1,nan"): ["more than 0 Hz"],
        ("--count", "1"): ["--count", "2"],
        ("--count", "70"): ["expected 1 to"],
        ("--accuracy", "3"): ["between 0 and 1"],
        tuple(settings("beam.lenght=1")): ["did you mean"],
    }
    calls = [("modes", DEMO, *arguments, *output) for arguments in wrong]
    *done, last = called_in_turn(*calls, ("modes", DEMO, "--measured", "400,410,420", *output))
    for one, words in zip(done, wrong.values(), strict=True):
        assert one.returncode == 2, one.stderr
        assert all(word in one.stderr for word in words), one.stderr
    assert last.returncode == 5
    assert "no end springs reproduce the measured frequencies" in last.stdout


def test_sections_hold_the_mass_and_rigid_motions() -> None:
    """Their masses are the mass of the beam; the first free mode of a solid moves all of them alike."""
    model = beam_model({"mesh": SOLID}, (GRAVITY,))
    free = held_modes(model, 2)[1]
    case = beam_case()
    assert free.masses.sum() == pytest.approx(7919.0 * case.beam.length * case.beam.thickness * case.beam.width)
    first = free.motions[0]
    assert first.share == pytest.approx(1.0, abs=1e-6)
    assert np.ptp(first.bending) < 1e-3 * np.abs(first.bending).max()


def test_a_beam_with_joints_has_modes_without_theory(tmp_path: Path) -> None:
    """A cantilever with a head: the first frequency by (3 E I / L^3) / (M + 0.236 m), a picture, and no free beam.

    Source: Rayleigh's quotient with the static deflection, 33/140 of the mass of the beam; within 0.5 %.
    """
    found = gapbeam.modes(PROJECT / "cases" / "cantilever-stop.toml", {"model": {"type": "beam"}}, output=tmp_path)
    length, thickness, width = 0.4, 0.006, 0.02
    stiffness = 3.0 * 2.1e11 * width * thickness**3 / 12.0 / length**3
    mass = 0.10 + 33.0 / 140.0 * 7850.0 * width * thickness * length
    assert found.frequencies[0] == pytest.approx(np.sqrt(stiffness / mass) / (2.0 * np.pi), rel=5e-3)
    assert found.exit_status == 0
    assert found.comparison.free == found.comparison.clamped == found.comparison.fits == ()
    assert not any("theory" in line for line in found.remarks)
    assert (tmp_path / "modes.png").stat().st_size > 1000
    assert json.loads((tmp_path / "modes.json").read_text(encoding="utf-8"))["count"] == 4
