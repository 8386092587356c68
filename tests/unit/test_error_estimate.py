"""The parts of an error estimate against answers in closed form."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import xarray as xr

import gapbeam
from gapbeam.solver.models.model import build_body
from gapbeam.solver.run.assumptions.frequency_findings import IN_BASIS, ON_MESH
from gapbeam.solver.run.verdict import UNDER_NOISE
from gapbeam.studies.error_estimate.companion_marches import CompanionMotion, companion_motions
from gapbeam.studies.error_estimate.companions import (
    COARSER,
    FINEST,
    HALF_STEP,
    SAME,
    STIFFER,
    CompanionPlan,
    companions_of,
)
from gapbeam.studies.error_estimate.figure_errors import figure_errors
from gapbeam.studies.error_estimate.force_peaks import doubtful_peaks, force_peaks
from gapbeam.studies.error_estimate.horizon import horizon_of, spans_of
from gapbeam.studies.error_estimate.key_figures import Span, key_figures
from gapbeam.studies.error_estimate.motion_record import MotionRecord, window_means
from gapbeam.studies.error_estimate.run_errors import (
    RunErrors,
    beyond_resolution,
    doubts,
    eaten,
    errors_of,
    last_line,
    without_errors,
)
from gapbeam.studies.trials import kept_body
from tests.shared.command import DEMO

FREQUENCY, INTERVAL = 20.0, 1.0e-4
OMEGA = 2.0 * np.pi * FREQUENCY


def sine(amplitude: float = 1.0e-3, end: float = 1.0, growth: float = 0.0, force: float = 10.0) -> MotionRecord:
    """Return u = A exp(g t) sin(w t), and a force f (1 + sin(w t)), by their closed forms."""
    times = np.arange(round(end / INTERVAL) + 1) * INTERVAL
    displacement = amplitude * np.exp(growth * times) * np.sin(OMEGA * times)
    velocity = amplitude * OMEGA * np.cos(OMEGA * times)
    impulse = force * (times + (1.0 - np.cos(OMEGA * times)) / OMEGA)
    pressed = force * (1.0 + np.sin(OMEGA * times))
    return MotionRecord(
        times, ("tip",), displacement[:, None], velocity[:, None], ("base",), pressed[:, None], impulse[:, None]
    )


def test_figures_of_a_sine_are_known() -> None:
    """Range 2 A, harmonic A and none beside, the mean of a force over 0.5 ms, its impulse over a period f T."""
    figures = key_figures(sine(), Span("settled part", 0.5, 0.25, 2, FREQUENCY))
    assert figures["tip displacement"].values == pytest.approx([2.0e-3, 2.0e-3], rel=1e-5)
    assert figures["tip harmonic 1"].mean == pytest.approx(1.0e-3, rel=1e-9)
    assert figures["tip harmonic 2"].mean == pytest.approx(0.0, abs=1e-12)
    gain = np.sinc(FREQUENCY * 2.5e-3)  # of a mean over 2.5 ms
    assert figures["tip smoothed acceleration"].mean == pytest.approx(2.0e-3 * OMEGA**2 * gain, rel=1e-3)
    assert figures["base peak force"].mean == pytest.approx(10.0 * (1.0 + np.sinc(FREQUENCY * 0.5e-3)), rel=1e-4)
    assert figures["base impulse"].mean == pytest.approx(10.0 * 0.25, rel=1e-9)


def test_means_over_windows_are_differences_of_the_integral() -> None:
    """Of t^2 / 2, whose mean from a to b is (a + b) / 2; a window longer than the record is the record."""
    times = np.linspace(0.0, 1.0, 11)
    integral = 0.5 * times[:, None] ** 2
    assert window_means(integral, 0.1, 0.2)[:, 0] == pytest.approx(0.5 * (times[2:] + times[:-2]))
    assert window_means(integral, 0.1, 7.0) == pytest.approx(0.5)
    assert len(window_means(integral, 0.1, 0.0)) == 10


def test_the_horizon_is_where_motions_have_parted_by_three_percent() -> None:
    """A exp(g t) sin(w t) leaves A sin(w t) by 3 % of 2 A at a peak with exp(g t) - 1 = 0.06."""
    parted = horizon_of(sine(), [sine(), sine(growth=0.1)])
    expected = np.log(1.06) / 0.1
    assert parted == pytest.approx(expected, abs=0.5 / FREQUENCY)
    assert horizon_of(sine(), [sine(growth=0.05)]) is None
    moved = replace(sine(), displacement=sine().displacement + 1.0)
    assert horizon_of(sine(), [moved]) is None, "another seat is no other motion"
    silent = replace(sine(), probes=(), displacement=np.zeros((10001, 0)))
    louder = replace(sine(force=20.0), probes=(), displacement=np.zeros((10001, 0)))
    assert horizon_of(silent, [louder]) is not None


def test_spans_are_whole_periods_and_respect_the_horizon() -> None:
    """The settled part is the second half; beyond the horizon figures are statistics."""
    case = gapbeam.read_case(DEMO, {"time.end": 4.8})
    start_up, settled = spans_of(case, 4.8, INTERVAL, None)
    assert (start_up.name, settled.name) == ("start-up", "settled part")
    assert settled.end == pytest.approx(4.8)
    assert settled.count >= 4
    assert settled.width * FREQUENCY == pytest.approx(round(settled.width * FREQUENCY))
    names = [span.name for span in spans_of(case, 4.8, INTERVAL, 1.0)]
    assert names == ["up to the horizon", "beyond the horizon"]
    start_up, settled, beyond = spans_of(case, 4.8, INTERVAL, 3.7)
    assert settled.end <= 3.7
    assert beyond.start == pytest.approx(settled.end)
    gravity = gapbeam.read_case(DEMO, {"time.end": 0.1})
    assert [span.name for span in spans_of(gravity, 0.1 - INTERVAL, INTERVAL, None)] == ["whole run"]
    assert [span.name for span in spans_of(gravity, 0.09, INTERVAL, None)] == ["first part"]
    for records, names in ((7, []), (9, ["up to the horizon"])):
        assert [span.name for span in spans_of(gravity, 0.1 - INTERVAL, INTERVAL, records * INTERVAL)] == names
        assert spans_of(case, 4.8, INTERVAL, records * INTERVAL)[0].name == (*names, "beyond the horizon")[0]


def test_errors_are_the_stated_combination() -> None:
    """max(2 |R - A2|, |R - Rc2|, 4/3 |R - R2|) + |f - R| + 2 |R - RK|, of ranges that differ by known amounts."""
    span = Span("settled part", 0.5, 0.25, 2, FREQUENCY)
    others = {SAME: 1.01, HALF_STEP: 1.04, COARSER: 1.03, FINEST: 1.025, STIFFER: 1.012}
    motions = {name: sine(1.0e-3 * factor) for name, factor in others.items()}
    range_of = {one.name: one for one in figure_errors(sine(), motions, span, in_plane=False)}
    found = range_of["tip displacement"]
    assert found.error == pytest.approx(2.0e-3 * (4.0 / 3.0 * 0.03 + 0.01 + 2.0 * 0.002), rel=1e-3)
    assert found.relative == pytest.approx(found.error / 2.0e-3, rel=1e-3)
    parting = Span("up to the horizon", 0.5, 0.25, 2, FREQUENCY)
    cut = {one.name: one for one in figure_errors(sine(), motions, parting, in_plane=False)}
    assert cut["tip displacement"].error == pytest.approx(2.0 * found.error)
    plane = {one.name: one for one in figure_errors(sine(), motions, span, in_plane=True)}
    assert plane["tip displacement"].error == pytest.approx(
        1.1 / 1.01 * 2.0e-3 * (4.0 / 3.0 * 0.03 + 2.0 * 0.002), rel=1e-3
    )


def test_beyond_the_horizon_few_windows_have_no_error() -> None:
    """Two windows say nothing about a mean; four do, and at least 2.83 standard errors."""
    motions = {HALF_STEP: sine(), COARSER: sine(), FINEST: sine()}
    growing = sine(growth=0.5)
    for count, known in ((2, False), (5, True)):
        span = Span("beyond the horizon", 0.5, 0.1, count, FREQUENCY)
        rows = {one.name: one for one in figure_errors(growing, motions, span, in_plane=False)}
        found = rows["tip displacement"]
        assert (found.error is not None) == known
        if found.error is not None:
            assert found.error >= 2.83 * found.standard_error > 0.0


def test_a_single_high_record_is_reported_beside_its_means() -> None:
    """An impulse of 1 N s in one interval: 10 000 N on record, 2000 N over 0.5 ms."""
    times = np.arange(1001) * INTERVAL
    force = np.zeros((1001, 1))
    force[500] = 1.0e4
    impulse = np.cumsum(force * INTERVAL, axis=0)
    still = np.zeros((1001, 0))
    run = MotionRecord(times, (), still, still, ("base",), force, impulse)
    case = gapbeam.read_case(DEMO, {"time.end": 0.1})
    peaks = force_peaks(run, case)["whole run"]["base"]
    assert peaks["one record"] == 1.0e4
    assert peaks["0.5 ms mean"] == pytest.approx(2000.0)
    assert peaks["0.25 ms mean"] == pytest.approx(1.0e4 / 2.0, rel=0.01)  # two intervals
    assert "5 times the largest 0.5 ms mean, 2000 N" in "".join(doubtful_peaks(force_peaks(run, case)))


@pytest.mark.parametrize(
    ("overrides", "names"),
    [
        ({}, [SAME, HALF_STEP, STIFFER, COARSER, FINEST]),
        ({"model.type": "reduced"}, [HALF_STEP, STIFFER, COARSER, FINEST]),
        ({"model.type": "beam"}, [HALF_STEP, STIFFER, COARSER, FINEST]),
        ({"model.type": "rigid"}, [HALF_STEP, STIFFER, COARSER, FINEST]),
    ],
    ids=["full", "reduced", "beam", "rigid"],
)
def test_each_model_has_its_companions(overrides: dict[str, object], names: list[str]) -> None:
    """A full model also has a reduced one of its own step and mesh; all of them are cases that can be read."""
    case = gapbeam.read_case(DEMO, overrides)
    plan = companions_of(case, 1.0e-4, 2.1e14, computed=True)
    assert [one.name for one in plan.companions] == names
    for one in plan.companions:
        read = gapbeam.read_case(case, dict(one.changes))
        assert read.contact.stiffness == (4.2e14 if one.name == STIFFER else 2.1e14)
        assert read.time.step == (0.5e-4 if one.name in (HALF_STEP, FINEST) else 1.0e-4)
    given = companions_of(case, 1.0e-4, 2.1e14, computed=False)
    assert STIFFER not in [one.name for one in given.companions]


@pytest.mark.parametrize("formulation", ["penalty", "nitsche", "unilateral", "augmented-lagrangian"])
def test_companions_of_each_formulation_are_cases(formulation: str) -> None:
    """A reduced model cannot take all formulations of a full one: what it takes instead has no faults either."""
    case = gapbeam.read_case(DEMO, {"contact.formulation": formulation, "time.scheme": "implicit-midpoint"})
    for one in companions_of(case, 1.0e-4, 2.1e14, computed=True).companions:
        gapbeam.read_case(case, dict(one.changes))


@pytest.mark.parametrize("solid", [False, True], ids=["plane", "solid"])
def test_companions_of_linear_cells_have_nodes_on_the_axis(solid: bool) -> None:
    """Half of two cells is one, without a node where the probes are: the errors of such runs were not estimated."""
    keys = {"mesh.degree": 1, "mesh.cells_through_thickness": 2, "mesh.size": 0.02}
    case = gapbeam.read_case(DEMO, keys | ({"mesh.dimension": 3, "mesh.cell": None} if solid else {}))
    for one in companions_of(case, 1.0e-4, 2.1e14, computed=True).companions:
        assert gapbeam.read_case(case, dict(one.changes)).mesh.cells_through_thickness in (None, 2, 4)


def test_no_companion_has_more_cells_than_a_case_may_have() -> None:
    """Twice 150 cells through the thickness are refused: no finer companion then, which is said."""
    case = gapbeam.read_case(DEMO, {"mesh.cells_through_thickness": 150})
    plan = companions_of(case, 1.0e-4, 2.1e14, computed=True)
    assert FINEST not in [one.name for one in plan.companions]
    assert any("more than 200 cells" in words for words in plan.left_out)
    for one in plan.companions:
        gapbeam.read_case(case, dict(one.changes))


def test_a_solid_in_its_plane_has_plane_companions() -> None:
    """And one that is loaded across it has solid ones, without a finer mesh, which is said."""
    solid = gapbeam.read_case(DEMO, {"mesh.dimension": 3, "mesh.cell": None, "probe.tip.point": [0.51, 0.0, 0.0]})
    plan = companions_of(solid, 1.0e-4, 2.1e14, computed=True)
    assert plan.in_plane
    for one in plan.companions:
        assert gapbeam.read_case(solid, dict(one.changes)).mesh.dimension == 2
    across = gapbeam.read_case(solid, {"load.shaker.direction": [0.0, 1.0, 1.0]})
    plan = companions_of(across, 1.0e-4, 2.1e14, computed=True)
    assert not plan.in_plane
    assert FINEST not in [one.name for one in plan.companions]
    assert any("finer mesh" in words for words in plan.left_out)
    for one in plan.companions:
        assert gapbeam.read_case(across, dict(one.changes)).mesh.dimension == 3


def test_no_solid_with_every_interface_dof_is_a_companion_of_beam_elements() -> None:
    """Friction needs such a basis, whose set-up took minutes where the run took a second (drawn case 3483)."""
    section = {"beam.width": 0.012, "beam.section": {"type": "tube", "wall": 0.002}}
    tube = {"model": "beam", "mesh.dimension": 3, "mesh.cell": None} | section
    rubbing = {"contact.friction.coefficient": 0.3, "contact.friction.slip_velocity": 1.0e-3}
    for keys, solid in (({}, True), (rubbing, False)):
        plan = companions_of(gapbeam.read_case(DEMO, tube | keys), 1.0e-4, 2.1e14, computed=True)
        assert (FINEST in [one.name for one in plan.companions]) == solid
        assert any("what the model leaves out" in words for words in plan.left_out) != solid


def test_companions_of_a_tube_that_meets_circles_keep_its_sections() -> None:
    """A basis of deforming sections is refused there, and the whole estimate was (drawn case 3478)."""
    circles = {f"support.{name}.region": {"type": "hole", "contact": "circle"} for name in ("left", "right")}
    case = gapbeam.read_case(DEMO.parent / "tube-holes.toml", {"model": {"type": "rigid"}} | circles)
    companions = {one.name: one for one in companions_of(case, 1.0e-5, 2.1e14, computed=True).companions}
    assert companions[FINEST].changes["model"]["sections"] == "rigid"
    gapbeam.read_case(case, dict(companions[FINEST].changes))


def test_accelerations_beyond_the_resolution_are_not_known() -> None:
    """Energy at five times the highest mode of a basis: a sentence, and no error of accelerations; all others stay."""
    within = {"assumptions": [{"name": IN_BASIS.name, "closest": 1.9, "limit": 1.0}]}
    beyond = {"assumptions": [*within["assumptions"], {"name": ON_MESH.name, "closest": 0.4, "limit": 0.125}]}
    assert beyond_resolution({}) == beyond_resolution(within) == []
    (words,) = beyond_resolution(beyond)
    assert "errors of accelerations are not known" in words
    assert f"{ON_MESH.name} 0.4, limit 0.125" in words
    assert IN_BASIS.name not in words
    run = sine()
    moved = {HALF_STEP: sine(1.01e-3), FINEST: sine(1.02e-3), COARSER: sine(1.03e-3)}
    figures = tuple(figure_errors(run, moved, Span("settled part", 0.5, 0.25, 2, FREQUENCY), in_plane=False))
    found = without_errors(RunErrors(figures, None, 1.0, CompanionPlan((), False, ()), {}), " smoothed acceleration")
    errors = {one.name: one.error for one in found.figures}
    assert errors["tip smoothed acceleration"] is None
    assert all(error is not None for name, error in errors.items() if name != "tip smoothed acceleration")


def test_errors_are_not_known_where_the_scheme_takes_the_energy_of_noise() -> None:
    """A scheme that takes nearly all of it does so with half of the step, too (drawn case 3355: 15 E off)."""
    few, most = ({"assumptions": [{"name": UNDER_NOISE[0], "closest": share, "limit": 0.02}]} for share in (0.1, 0.997))
    assert eaten({}) == eaten(few) == []
    (words,) = eaten(most)
    assert "100% of the energy" in words
    assert "discrete-gradient" in words
    run = sine()
    figures = tuple(figure_errors(run, {HALF_STEP: run}, Span("settled part", 0.5, 0.25, 2, FREQUENCY), in_plane=False))
    found = without_errors(RunErrors(figures, None, 1.0, CompanionPlan((), False, ()), {}), "")
    assert {one.error for one in found.figures} == {None}
    assert last_line(found) == "no figure could be estimated"


def test_companions_that_end_early_say_nothing_of_what_comes_later() -> None:
    """A force that grows to the end of a run, and companions that reached four fifths of it."""
    case = gapbeam.read_case(DEMO, {"time.end": 0.05})
    growing = sine(end=0.05)
    growing = replace(growing, impulse=0.5 * growing.times[:, None] ** 2)
    plan = CompanionPlan((), False, ())
    for end, later in ((0.05, ()), (0.04, ("base",))):
        motions = {name: growing.between(0.0, end) for name in (HALF_STEP, COARSER, FINEST)}
        found = errors_of(
            case, growing, {name: CompanionMotion(name, motions[name], 1, 1e-5, 1.0) for name in motions}, plan
        )
        assert found.later == later
        assert last_line(found).startswith("first part, up to t = 0.04 s: tip" if later else "whole run: tip")
        assert "+- less than 0.001 %" in last_line(found)
        words = doubts(found, growing.end)
        assert any("the largest force on base came later and has no error" in one for one in words) == bool(later)


def in_space(lateral: float, noise: float = 0.0) -> MotionRecord:
    """Return a probe that moves on an ellipse, 1 mm high, as the records of a run have it."""
    times = np.arange(2001) * INTERVAL
    waves = np.zeros((len(times), 1, 3))
    waves[:, 0, 2] = 1.0e-3 * np.sin(OMEGA * times)
    waves[:, 0, 1] = lateral * np.cos(OMEGA * times) + noise * np.sin(7.3 * OMEGA * times)
    force = np.ones((len(times), 1))
    history = xr.Dataset(
        {
            "displacement": (("time", "probe", "component"), waves),
            "acceleration_absolute": (("time", "probe", "component"), -(OMEGA**2) * waves),
            "contact_force": (("time", "face"), force),
            "impulse": (("time", "face"), np.cumsum(force, axis=0) * INTERVAL),
        },
        {"time": times, "probe": ["tip"], "face": ["hole"], "component": ["x", "y", "z"]},
    )
    return MotionRecord.of_history(history, in_space=True)


def test_motion_in_space_has_figures_in_both_directions() -> None:
    """The lateral range of an ellipse stands beside the vertical one, and both are judged by the larger one."""
    motion = in_space(2.0e-3)
    assert motion.probes == ("tip", "tip lateral")
    assert motion.spans == pytest.approx([4.0e-3, 4.0e-3], rel=1e-4)
    figures = key_figures(motion, Span("whole run", 0.0, 0.2, 1, FREQUENCY))
    assert figures["tip displacement"].mean == pytest.approx(2.0e-3, rel=1e-4)
    assert figures["tip lateral displacement"].mean == pytest.approx(4.0e-3, rel=1e-4)
    assert figures["tip lateral harmonic 1"].mean == pytest.approx(2.0e-3, rel=1e-9)
    assert figures["tip lateral displacement"].group == figures["tip displacement"].group != ""


def test_round_off_aside_does_not_end_what_can_be_predicted() -> None:
    """A beam that moves upward but for round-off is predictable; one that leaves its orbit by 5 % is not."""
    still = in_space(0.0)
    assert horizon_of(still, [in_space(0.0, 1.0e-12)]) is None
    assert horizon_of(still, [in_space(0.0, 1.0e-4)]) is not None


def test_companions_share_the_body_of_their_run(monkeypatch: pytest.MonkeyPatch) -> None:
    """A reduced run sets up no mesh again for half its step; the coarser mesh is another one."""
    changes = ["model.type=reduced", "time.end=0.01", "output.errors=none"]
    case = gapbeam.read_case(DEMO, changes)
    built = gapbeam.model(case).model
    found = []
    monkeypatch.setattr(kept_body, "build_body", lambda key, comm: found.append(key) or build_body(key, comm))
    plan = companions_of(case, 1.0e-4, 1.0e12, False)
    for body in (None, built.body):
        found.clear()
        motions = list(companion_motions(case, plan.companions[:2], 0.01, 1.0e-4, 1.0e-4, 60.0, body))
        assert [one.name for one in motions] == ["half step", "coarser mesh"]
        assert len(found) == (2 if body is None else 1)
