"""The parts of an error estimate against answers in closed form."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import gapbeam
from gapbeam.solver.case.case import case_to_toml
from gapbeam.solver.case.computed_defaults import smoothing_window
from gapbeam.solver.case.figure_table import Figure
from gapbeam.solver.case.reading.case_reader import read_case_text
from gapbeam.solver.messages.errors import in_one_line
from gapbeam.solver.models.model import build_body
from gapbeam.solver.run.assumptions.frequency_findings import IN_BASIS, ON_MESH
from gapbeam.solver.run.verdict import UNDER_NOISE
from gapbeam.solver.system.operators import Array
from gapbeam.studies.error_estimate import companion_marches
from gapbeam.studies.error_estimate.closing_table import ClosingTable, closing_lines, closing_table, words_beyond
from gapbeam.studies.error_estimate.companion_marches import CompanionMotion, companion_motions
from gapbeam.studies.error_estimate.companions import (
    COARSER,
    FINEST,
    FOURFOLD,
    HALF_STEP,
    MOST_STEPS,
    SAME,
    STIFFER,
    TWICE,
    CompanionPlan,
    companions_of,
)
from gapbeam.studies.error_estimate.figure_errors import (
    FACTORS,
    MODEL,
    RIGID_FACTOR,
    FigureError,
    _rests,
    figure_errors,
    figure_spans,
    lost_by_own,
    quantile_of_means,
)
from gapbeam.studies.error_estimate.force_peaks import (
    BEYOND_HORIZON,
    FEWEST_WINDOWS,
    Averages,
    Span,
    brief_share,
    contact_windows,
    doubtful_peaks,
    force_peaks,
    key_figures,
    lost_in_steps,
    spans_between,
    spans_of,
)
from gapbeam.studies.error_estimate.motion_horizon import horizon_of, repeats
from gapbeam.studies.error_estimate.motion_record import MotionRecord, impact_rates, window_means
from gapbeam.studies.error_estimate.run_errors import (
    RunErrors,
    beyond_resolution,
    doubts,
    eaten,
    errors_of,
    without_errors,
)
from gapbeam.studies.trials import starts as kept_body
from tests.shared.command import CASE_FOLDER, DEMO

FREQUENCY, INTERVAL = 20.0, 1.0e-4
OMEGA = 2.0 * np.pi * FREQUENCY
SMOOTHING = 2.5e-3  # s
SMOOTHED = Averages(SMOOTHING)


def sine(amplitude: float = 1.0e-3, end: float = 1.0, growth: float = 0.0, force: float = 10.0) -> MotionRecord:
    """Return u = A exp(g t) sin(w t), and a force f (1 + sin(w t)), by their closed forms."""
    times = np.arange(round(end / INTERVAL) + 1) * INTERVAL
    displacement = amplitude * np.exp(growth * times) * np.sin(OMEGA * times)
    velocity = amplitude * OMEGA * np.cos(OMEGA * times)
    impulse = force * (times + (1.0 - np.cos(OMEGA * times)) / OMEGA)
    pressed = force * (1.0 + np.sin(OMEGA * times))
    active = np.round(1.0 + np.sin(OMEGA * times))[:, None]  # contact points close and open
    return MotionRecord(
        times, ("tip",), displacement[:, None], velocity[:, None], ("base",), pressed[:, None], impulse[:, None],
        active=active,
    )  # fmt: skip


def test_figures_of_a_sine_are_known() -> None:
    """Range 2 A, harmonic A and none beside, the largest force and its mean, the impulse over a period f T."""
    span = Span("settled part", 0.5, 0.25, 2, FREQUENCY)
    figures = key_figures(sine(), span, SMOOTHED)
    assert figures["tip peak-to-peak displacement"].values == pytest.approx([2.0e-3, 2.0e-3], rel=1e-5)
    assert figures["tip harmonic 1"].mean == pytest.approx(1.0e-3, rel=1e-9)
    assert figures["tip harmonic 2"].mean == pytest.approx(0.0, abs=1e-12)
    gain = np.sinc(FREQUENCY * SMOOTHING)
    assert figures["tip peak-to-peak smoothed acceleration"].mean == pytest.approx(2.0e-3 * OMEGA**2 * gain, rel=1e-3)
    assert figures["base largest recorded force"].mean == pytest.approx(20.0, rel=1e-6)
    assert figures["base impulse"].mean == pytest.approx(10.0 * 0.25, rel=1e-9)
    averaged = key_figures(sine(), span, Averages(SMOOTHING, {"base": 0.5e-3}))
    assert "base largest recorded force" not in averaged
    assert averaged["base largest mean force"].mean == pytest.approx(
        10.0 * (1.0 + np.sinc(FREQUENCY * 0.5e-3)), rel=1e-4
    )


def test_means_over_windows_are_differences_of_the_integral() -> None:
    """Of t^2 / 2, whose mean from a to b is (a + b) / 2; a window longer than the record is the record."""
    times = np.linspace(0.0, 1.0, 11)
    integral = 0.5 * times[:, None] ** 2
    assert window_means(integral, 0.1, 0.2)[:, 0] == pytest.approx(0.5 * (times[2:] + times[:-2]))
    assert window_means(integral, 0.1, 7.0) == pytest.approx(0.5)
    assert len(window_means(integral, 0.1, 0.0)) == 10


def test_the_horizon_is_where_motions_have_parted_by_three_percent() -> None:
    """A exp(g t) sin(w t) leaves A sin(w t) by 3 % of 2 A at a peak with exp(g t) - 1 = 0.06."""
    parted = horizon_of(sine(), [(sine(), 1.0), (sine(growth=0.1), 1.0)], SMOOTHING)
    expected = np.log(1.06) / 0.1
    assert parted == pytest.approx(expected, abs=0.5 / FREQUENCY)
    assert horizon_of(sine(), [(sine(growth=0.05), 1.0)], SMOOTHING) is None
    assert horizon_of(sine(), [(sine(growth=0.1), 0.25)], SMOOTHING) is None, "a quarter of the difference counts"
    moved = replace(sine(), displacement=sine().displacement + 1.0)
    assert horizon_of(sine(), [(moved, 1.0)], SMOOTHING) is None, "another seat is no other motion"
    silent = replace(sine(), probes=(), displacement=np.zeros((10001, 0)))
    louder = replace(sine(force=20.0), probes=(), displacement=np.zeros((10001, 0)))
    assert horizon_of(silent, [(louder, 1.0)], SMOOTHING) is not None


@settings(max_examples=30, deadline=None)
@given(growth=st.floats(0.5, 5.0), points=st.integers(0, 50), rest=st.floats(1.0e-18, 1.0e-10))
def test_what_never_changes_its_contact_is_predictable_to_the_end(growth: float, points: int, rest: float) -> None:
    """A linear motion near resonance is off by its amplitude; a beam at rest has the residue of its seat only."""
    run = replace(sine(), active=np.full((10001, 1), points))
    assert horizon_of(run, [(sine(growth=growth), 1.0)], SMOOTHING) is None
    assert horizon_of(sine(), [(sine(growth=growth), 1.0)], SMOOTHING) is not None
    lying = replace(sine(rest), displacement=sine(rest).displacement - 1.0e-3)
    assert horizon_of(lying, [(sine(rest, growth=growth), 1.0)], SMOOTHING) is None


@settings(max_examples=15, deadline=None)
@given(cycle=st.integers(1, 4), phase=st.floats(0.0, 6.0))
def test_a_settled_cycle_is_judged_by_its_figures(cycle: int, phase: float) -> None:
    """A companion that is later on the same orbit leaves its path, and none of its figures."""
    span = Span("settled part", 0.5, 0.1, 5, FREQUENCY)

    def orbit(late: float) -> MotionRecord:
        wave = 1.0e-3 * np.sin(OMEGA * sine().times) + 4.0e-4 * np.sin(OMEGA * sine().times / cycle + late)
        return replace(sine(), displacement=wave[:, None])

    assert repeats(sine(), [span], SMOOTHING)
    assert repeats(orbit(phase), [span], SMOOTHING) == (cycle < 3), "three cycles in a row of 10 periods"
    drifting = replace(sine(), displacement=np.sin(OMEGA * sine().times ** 1.5)[:, None])
    assert not repeats(drifting, [span], SMOOTHING)
    case = gapbeam.read_case(DEMO, {"time.end": 1.0})
    plan = CompanionPlan((), False, ())
    late = {FINEST: CompanionMotion(FINEST, orbit(phase + 1.0))}
    found = errors_of(case, orbit(phase), late, plan)
    settled = [one for one in found.figures if one.name == "tip peak-to-peak displacement" and one.span != "start-up"]
    assert (settled[-1].span == "settled part") == found.repeats


def test_spans_are_whole_periods_and_respect_the_horizon() -> None:
    """The second half is settled where it repeats; beyond the horizon figures are statistics."""
    case = gapbeam.read_case(DEMO, {"time.end": 4.8})
    start_up, settled = spans_of(case, 4.8, INTERVAL, None)
    assert (start_up.name, settled.name) == ("start-up", "second half")
    assert spans_of(case, 4.8, INTERVAL, None, repeats=True)[1].name == "settled part"
    assert settled.end == pytest.approx(4.8)
    assert settled.count >= 4
    assert settled.width * FREQUENCY == pytest.approx(round(settled.width * FREQUENCY))
    names = [span.name for span in spans_of(case, 4.8, INTERVAL, 1.0)]
    assert names == ["up to the horizon", "beyond the horizon"]
    start_up, settled, beyond = spans_of(case, 4.8, INTERVAL, 3.7)
    assert settled.end <= 3.7
    assert [one.cut for one in (start_up, settled, beyond)] == [False, True, False]
    assert beyond.start == pytest.approx(settled.end)
    gravity = gapbeam.read_case(DEMO, {"time.end": 0.1})
    assert [span.name for span in spans_of(gravity, 0.1 - INTERVAL, INTERVAL, None)] == ["whole run"]
    assert [span.name for span in spans_of(gravity, 0.09, INTERVAL, None)] == ["first part"]
    assert [span.name for span in spans_of(case, 4.8, INTERVAL, 1.0, repeats=True)] == [
        "up to the horizon",
        "settled part",
    ]
    for records, names in ((7, []), (9, ["up to the horizon"])):
        assert [span.name for span in spans_of(gravity, 0.1 - INTERVAL, INTERVAL, records * INTERVAL)] == names
        assert spans_of(case, 4.8, INTERVAL, records * INTERVAL)[0].name == (*names, "beyond the horizon")[0]


@settings(max_examples=30, deadline=None)
@given(decay=st.floats(0.5, 40.0), size=st.floats(1.0e-3, 0.3))
def test_a_part_that_still_settles_has_the_rest_in_its_error(decay: float, size: float) -> None:
    """A (1 + s exp(-d t)) settles to a range of 2 A: E covers what windows miss, where a part is called settled."""
    times = sine().times
    fading = replace(sine(), displacement=sine().displacement * (1.0 + size * np.exp(-decay * times))[:, None])
    case = gapbeam.read_case(DEMO, {"time.end": 1.0})
    found = errors_of(case, fading, {FINEST: CompanionMotion(FINEST, fading)}, CompanionPlan((), False, ()))
    tip = next(one for one in found.figures if one.name == "tip peak-to-peak displacement" and one.span != "start-up")
    missed = abs(tip.value - 2.0e-3)
    assert (tip.span == "settled part") == found.repeats
    if found.repeats:
        assert missed <= 1.01 * (tip.error or 0.0) + 1e-9
    elif decay > 1.0:
        assert missed > 1.0e-4 * 2.0e-3, "what settled was not called so"


def test_errors_are_the_stated_combination() -> None:
    """max(2 |R - A|, |R - C|, |R - D| / 2, 4/3 |R - H|) + |f - R| + 3.4 |R - K|, of ranges that differ as known."""
    span = Span("settled part", 0.5, 0.25, 2, FREQUENCY)
    others = {TWICE: 1.01, HALF_STEP: 1.04, COARSER: 1.03, FINEST: 1.025, STIFFER: 1.012, FOURFOLD: 1.02}
    motions = {name: sine(1.0e-3 * factor) for name, factor in others.items()}

    def errors(span: Span, plane: bool) -> FigureError:
        rows = figure_errors(sine(), motions, TWICE, span, plane, SMOOTHED)
        return next(one for one in rows if one.name == "tip peak-to-peak displacement")

    found = errors(span, False)
    assert pytest.approx(3.414, rel=1e-3) == RIGID_FACTOR
    assert found.error == pytest.approx(2.0e-3 * (4.0 / 3.0 * 0.03 + 0.01 + RIGID_FACTOR * 0.002), rel=1e-3)
    assert found.relative == pytest.approx((found.error or 0.0) / 2.0e-3, rel=1e-3)
    assert found.parts[MODEL] == pytest.approx(2.0e-5, rel=1e-3)
    cut = errors(Span("second half", 0.5, 0.25, 2, FREQUENCY, cut=True), False)
    assert cut.error == pytest.approx(2.0 * (found.error or 0.0))
    plane = errors(span, True)
    assert plane.error == pytest.approx(1.1 / 1.01 * 2.0e-3 * (4.0 / 3.0 * 0.03 + RIGID_FACTOR * 0.002), rel=1e-3)


def test_largest_forces_and_accelerations_have_larger_errors_than_means_of_the_same_differences() -> None:
    """They follow the phases of ringing, which differ by chance: 1.75 and 1.5 times the stated combination."""
    span = Span("settled part", 0.5, 0.25, 2, FREQUENCY)
    motions = {TWICE: sine(force=10.1), FINEST: sine(1.02e-3, force=10.4)}
    found = {one.name: one for one in figure_errors(sine(), motions, TWICE, span, False, SMOOTHED)}
    impulse, largest = (found[f"base {name}"].relative or 0.0 for name in ("impulse", "largest recorded force"))
    assert impulse == pytest.approx(2.0 * 0.03 + 0.01, rel=1e-3)
    assert largest == pytest.approx(1.75 * impulse, rel=1e-3)
    range_, rate = (found[f"tip peak-to-peak {name}"].relative for name in ("displacement", "smoothed acceleration"))
    assert rate == pytest.approx(1.5 * (range_ or 0.0), rel=1e-3)


@pytest.mark.parametrize(("across", "known"), [(1e-2, True), (1e-4, False)])
def test_small_motions_across_have_no_errors_beyond_the_horizon(across: float, known: bool) -> None:
    """Symmetric motions that are unstable grow out of the asymmetry of the mesh to the size of the others."""

    def moving(factor: float) -> MotionRecord:
        one = sine(1.0e-3 * factor)
        moved, gained = (np.hstack([x, across * x]) for x in (one.displacement, one.velocity_gained))
        return replace(one, probes=("tip", "tip lateral"), displacement=moved, velocity_gained=gained, in_space=True)

    for name, usual in ((BEYOND_HORIZON, known), ("start-up", True)):
        span = Span(name, 0.0, 0.25, 4, FREQUENCY)
        rows = figure_errors(moving(1.0), {FINEST: moving(1.1)}, None, span, False, SMOOTHED)
        found = next(one for one in rows if one.name == "tip lateral peak-to-peak displacement")
        assert (found.error is not None) == usual


@settings(max_examples=25, deadline=None)
@given(coarse=st.floats(1.0e-4, 0.05), fine=st.floats(1.0e-4, 0.05))
def test_slow_meshes_have_the_errors_of_all_finer_ones(coarse: float, fine: float) -> None:
    """A difference that falls by q from mesh to mesh adds up to 1 / (1 - q), 2 to 10 times; of solids alone."""
    span = Span("settled part", 0.5, 0.25, 2, FREQUENCY)
    motions = {COARSER: sine(1.0e-3 * (1.0 - coarse)), FINEST: sine(1.0e-3 * (1.0 + fine))}

    def error(meshed: bool) -> float:
        rows = figure_errors(sine(), motions, None, span, False, SMOOTHED, meshed=meshed)
        return next(one.error or 0.0 for one in rows if one.name == "tip peak-to-peak displacement")

    left = 1.0 / (1.0 - min(max(fine / coarse, 0.5), 0.9))
    assert error(True) == pytest.approx(2.0e-3 * max(left * fine, coarse), rel=1e-3)
    assert error(False) == pytest.approx(2.0e-3 * max(2.0 * fine, coarse), rel=1e-3)


@settings(max_examples=25, deadline=None)
@given(phase=st.floats(0.01, 3.0), order=st.integers(1, 3), size=st.floats(1.0e-3, 1.0))
def test_harmonics_that_differ_by_phase_alone_have_errors(phase: float, order: int, size: float) -> None:
    """Amplitudes agree, motions do not: a sin(w t) and a sin(w t + p) are 2 a sin(p / 2) apart. No chance helps."""
    span = Span("settled part", 0.5, 0.25, 2, FREQUENCY)

    def wave(late: float) -> MotionRecord:
        added = 1.0e-3 * size * np.sin(order * OMEGA * sine().times + late)
        return replace(sine(), displacement=sine().displacement + added[:, None])

    name = f"tip harmonic {order}"
    found = {one.name: one for one in figure_errors(wave(0.0), {FINEST: wave(phase)}, None, span, False, SMOOTHED)}
    assert found[name].error == pytest.approx(2.0 * 2.0e-3 * size * np.sin(0.5 * phase), rel=1e-3, abs=1e-9)


def test_the_closing_table_says_of_which_part_it_is_and_what_it_leaves_out() -> None:
    """A table without rows has the latter alone."""
    row = {"figure": "tip", "value": "1 mm", "interval": "+- 1 %", "verdict": "good"}
    said = closing_lines({"part": "settled", "rows": [row], "others": 2})
    assert said == [
        "figure, settled  value  interval  verdict",
        "tip              1 mm   +- 1 %    good",
        "2 more in summary.json",
    ]
    assert closing_lines({"part": "", "rows": [], "others": 2}) == said[2:]


@pytest.mark.parametrize("width", [30, 60, 80, 100, 200])
def test_values_of_the_closing_table_are_whole_however_narrow_the_terminal(width: int) -> None:
    """A name goes on in further lines; the width of a mean and its unit are not cut off."""
    blow = FigureError("plate3_walls largest mean force", "N", "whole run", 20.3, 1.0, {}, 0.0, window=6.14e-5)
    named = closing_table((blow,), 1.0, True).rows[0].figure
    assert named == "plate3_walls largest mean force over 61.4 us"
    row = {
        "figure": named,
        "value": "20.3 1/s",
        "interval": "6.87 1/s to 60 1/s",
        "verdict": "too short",
    }
    heads, said, *more = closing_lines({"part": "up to the horizon", "rows": [row], "others": 0}, width)
    assert heads.split() == ["figure,", "up", "to", "the", "horizon", "value", "interval", "verdict"]
    assert re.split(r"\s{2,}", said.strip())[1:] == [row["value"], row["interval"], row["verdict"]]
    assert "".join([re.split(r"\s{2,}", said)[0], *more]).replace(" ", "") == row["figure"].replace(" ", "")


@given(value=st.floats(-1.0e9, 1.0e9, allow_subnormal=False), error=st.floats(0.0, 1.0e9, allow_subnormal=False))
def test_no_error_is_more_than_all_of_its_figure(value: float, error: float) -> None:
    """Beyond 100 % the error stands in the unit of the figure, and no per cent do."""
    one = FigureError("tip peak-to-peak displacement", "W", "whole run", value, error, {}, 0.0)
    (row,) = closing_table((one,), 1.0, True).rows
    if one.relative is None:
        assert error > abs(value) or value == 0.0
        assert row.interval == f"+- {error:.2g} W"
        assert row.verdict == "do not use"
    else:
        assert one.relative == error / abs(value) <= 1.0
        assert row.interval.endswith(" %")
        rough = "rough" if error <= 0.5 * abs(value) else "do not use"
        assert row.verdict == ("good" if error <= 0.1 * abs(value) else rough)


@given(
    st.sampled_from([(-12.0, -9.1), (-8.9, -5.1), (-4.9, 0.0)]).flatmap(lambda ends: st.floats(*ends)),
    st.sampled_from([(-3.0, -0.1), (0.1, 3.0)]).flatmap(lambda ends: st.floats(*ends)),
    st.integers(-20, 20),
)
def test_a_motion_without_a_right_digit_is_none(size: float, error: float, power: int) -> None:
    """What moves less than 1e-5 of the rest, by an error that is larger, rests; what has a digit is a figure."""
    farthest = 2.0**power
    moved = 10.0**size * farthest
    assert _rests(moved, 10.0**error * moved, farthest) == (size <= -9.0 or (size <= -5.0 and error > 0.0))
    assert not _rests(2.0e-9 * farthest, None, farthest)


@pytest.mark.parametrize(("moved", "rests"), [(0.0, True), (1e-15, True), (1e-12, True), (1e-8, False), (1e-3, False)])
def test_what_rests_has_no_relative_error(moved: float, rests: bool) -> None:
    """A range below 1e-9 of the largest displacement is round-off, however far that of a comparison is from it."""
    sag, span = 4.0e-3, Span("whole run", 0.0, 1.0, 1)
    ours, theirs = (replace(one, displacement=one.displacement - sag) for one in (sine(moved), sine(1.5 * moved)))
    found = figure_errors(ours, {FINEST: theirs}, None, span, False, SMOOTHED)
    rows = {row.figure: row.value for row in closing_table(found, 1.0, True).rows}
    assert (rows["tip peak-to-peak displacement"] == "0 but for round-off") == rests
    if rests:
        assert next(one for one in found if one.name == "tip peak-to-peak displacement").relative is None
        along = replace(ours, displacement=ours.displacement + sag, farthest=sag)  # it moves along its axis alone
        found = figure_errors(along, {FINEST: theirs}, None, span, False, SMOOTHED)
        assert next(one for one in found if one.name == "tip peak-to-peak displacement").rests


@settings(max_examples=30, deadline=None)
@given(
    slender=st.floats(0.3, 3.0),
    sizes=st.tuples(*[st.floats(0.05, 1.0)] * 3),
    kind=st.sampled_from(["beam", "rigid", "reduced"]),
    dimension=st.sampled_from([2, 3]),
    exponent=st.integers(-6, 2),
)
def test_companions_of_short_beams_are_cases(
    slender: float, sizes: tuple[float, float, float], kind: str, dimension: int, exponent: int
) -> None:
    """Cells of coarser meshes are at most as long as beam and support, at every size: no companion has a fault."""
    length = 10.0**exponent
    size, near, edge = sizes
    mesh = {"dimension": dimension, "size": size * length, "support_size": 0.3 * near * length}
    tables = {
        "beam": {"length": length, "thickness": length / slender, "width": length},
        "material": {"young_modulus": 2.1e11, "poisson_ratio": 0.3, "density": 7850.0},
        "support": [{"name": "s", "from": 0.1 * length, "to": 0.4 * length, "clearance": 0.01 * length}],
        "mesh": mesh | {"edge_size": 0.3 * edge * near * length},
        "model": {"type": kind},
        "load": [{"type": "gravity"}],
        "time": {"end": 0.1, "step": 1.0e-3},
    }
    case = gapbeam.read_case(tables)
    for one in companions_of(case, 1.0e-3, 1.0e12, computed=True).companions:
        read_case_text(case_to_toml(case), one.changes, one.name)


def test_companions_of_circles_beside_planes_are_cases() -> None:
    """Rigid sections meet circles and, along lines, planes: a solid with these is the finest comparison."""
    supports = [
        {"name": "h", "from": 0.0, "to": 0.02, "clearance": 1e-4, "region": {"type": "hole", "contact": "circle"}},
        {"name": "s", "from": 0.4, "to": 0.42, "clearance": 1e-4},
    ]
    round_ = {"support": supports, "model": "beam", "mesh.dimension": 3, "mesh.cell": None, "beam.section": "round"}
    case = gapbeam.read_case(DEMO, round_ | {"beam.width": 0.012})
    plan = companions_of(case, 1.0e-4, 1.0e12, computed=True)
    for one in plan.companions:
        read_case_text(case_to_toml(case), one.changes, one.name)
    assert FINEST in [one.name for one in plan.companions]
    assert not any("circles" in words for words in plan.left_out)


def test_a_refused_case_in_one_line_names_its_fault() -> None:
    """Messages about other runs name the fault; those of other errors are their first lines."""
    with pytest.raises(gapbeam.CaseError) as refused:
        gapbeam.read_case(DEMO, overrides={"mesh.size": 3.0})
    assert in_one_line(str(refused.value)).endswith(
        "mesh.size: found: 3 m, expected: at most the length of the beam, 0.51 m"
    )
    assert in_one_line("no seat\ntry another") == "no seat"
    assert in_one_line("") == ""


def noisy(seed: int, count: int = 2001, bias: float = 1.0) -> MotionRecord:
    """Return a motion whose range differs by chance from window to window."""
    chance = np.random.default_rng(seed)
    run = sine(end=(count - 1) * INTERVAL)
    amplitude = np.repeat(1.0 + 0.1 * chance.standard_normal(-(-count // 250)), 250)[:count]
    return replace(run, displacement=bias * amplitude[:, None] * run.displacement)


def test_beyond_the_horizon_errors_are_those_of_means() -> None:
    """Two windows say nothing; more have the 95 % interval of a difference of two means, and a bias beyond it."""
    few = Span("beyond the horizon", 0.0, 0.05, 2, FREQUENCY)
    many = Span("beyond the horizon", 0.0, 0.05, 20, FREQUENCY)
    found = figure_errors(noisy(0), {FINEST: noisy(1)}, None, few, False, SMOOTHED)
    assert {one.error for one in found} == {None}
    covered, wide = 0, []
    for seed in range(40):
        motions = {name: noisy(10 * seed + number, 10001) for number, name in enumerate((FINEST, COARSER, TWICE), 2)}
        rows = figure_errors(noisy(10 * seed, 10001), motions, TWICE, many, False, SMOOTHED)
        mine = next(one for one in rows if one.name == "tip peak-to-peak displacement")
        truth = key_figures(noisy(10 * seed + 1, 10001), many, SMOOTHED)["tip peak-to-peak displacement"].mean
        assert mine.error is not None
        covered += abs(truth - mine.value) <= mine.error
        wide.append(mine.error / mine.standard_error)
    assert covered >= 0.9 * 40
    assert np.median(wide) < 4.5, "2.8 standard errors, and what several companions add by chance"
    biased = figure_errors(noisy(0, 10001), {FINEST: noisy(1, 10001, bias=2.0)}, None, many, False, SMOOTHED)
    mine = next(one for one in biased if one.name == "tip peak-to-peak displacement")
    assert mine.error is not None
    assert mine.error > 2.0e-3


@pytest.mark.parametrize("count", [4, 12])
@pytest.mark.parametrize("companions", [2, 4])
@pytest.mark.parametrize("common", [0.0, 0.3, 0.7, 1.5])
def test_means_differ_by_chance_in_95_percent(companions: int, count: int, common: float) -> None:
    """Windows that are normal, and in common to those of a motion an offset: a further motion lies within E.

    Where there is no offset E is at most 1.3 times the 95 % interval of the difference of two means, 2.77 / sqrt(n).
    """
    chance = np.random.default_rng(5)
    covered, wide = [], []
    for _ in range(1000):
        draws = chance.standard_normal((companions + 2, count))
        draws += common * chance.standard_normal((companions + 2, 1))
        means, within = draws[:-1].mean(axis=1), draws[:-1].var(axis=1, ddof=1).mean() / count
        far = np.sqrt(2.0) * quantile_of_means(within, float(means.var(ddof=1)), companions + 1, count)
        covered.append(abs(draws[-1].mean() - means[0]) <= far)
        wide.append(far)
    assert np.mean(covered) >= 0.92
    assert common or np.median(wide) <= 1.3 * 2.77 / np.sqrt(count)


@settings(max_examples=25, deadline=None)
@given(steps=st.integers(2, 40), gap=st.integers(5, 60))
def test_contacts_of_few_steps_have_the_error_of_the_scheme(steps: int, gap: int) -> None:
    """A half period of d steps is as much too long as the midpoint rule makes it: of faces, beyond the horizon of all.

    By the step matrix of the rule on x'' = -x: its eigenvalues turn by pi / d in a step of 2 tan(pi / (2 d)).
    """
    times = sine().times
    pressed = np.where(np.arange(len(times)) % (steps + gap) < steps, 10.0, 0.0)
    impulse = np.cumsum(pressed) * INTERVAL
    run = replace(sine(), force=pressed[:, None], impulse=impulse[:, None])
    for finer in (1, 4):
        lost = lost_in_steps(run, INTERVAL / finer)
        step = (1.0 + lost["base"]) * np.pi / (steps * finer)  # a step, with a half period of pi
        K = np.array([[0.0, 1.0], [-1.0, 0.0]])
        turned = np.linalg.eigvals(np.linalg.solve(np.eye(2) - 0.5 * step * K, np.eye(2) + 0.5 * step * K))
        assert np.abs(np.angle(turned)) == pytest.approx(np.pi / (steps * finer))
        assert lost[""] == lost["base"]
    lost = lost_in_steps(run, INTERVAL)
    for name, whole in (("settled part", False), ("beyond the horizon", True)):
        span = Span(name, 0.5, 0.1, 5, FREQUENCY)
        rows = figure_errors(run, {TWICE: run}, TWICE, span, False, SMOOTHED, lost=lost)
        found = {one.name: one for one in rows}
        moved, pushed = found["tip peak-to-peak displacement"], found["base impulse"]
        assert (pushed.error or 0.0) >= 0.999 * lost["base"] * pushed.value
        assert ((moved.error or 0.0) > 0.9 * lost["base"] * moved.value) == whole


@settings(max_examples=30, deadline=None)
@given(blow=st.integers(2, 5), early=st.floats(0.1, 0.35), late=st.floats(0.55, 0.9), width=st.floats(0.0, 0.09))
def test_a_figure_of_ones_own_knows_the_contacts_of_its_part(
    blow: int, early: float, late: float, width: float
) -> None:
    """Blows of few steps, then a contact that holds: a holding force has no share of the blows, on any window."""
    times = sine().times
    blows = (times < 0.5) & (np.arange(len(times)) % 40 < blow)
    force = np.where(times < 0.5, 100.0 * blows, 1.0)[:, None]
    run = replace(sine(), force=force, impulse=np.cumsum(force, axis=0) * INTERVAL)
    for start, short in ((early, True), (late, False)):
        for statistic in ("mean", "value"):
            when = {"time": start} if statistic == "value" else {"start": start, "end": start + 0.005 + width}
            own = Figure(name="hold", quantity="contact_force", place="base", statistic=statistic, **when)
            moving = replace(run, figures=(own,), own=force)
            (span,) = figure_spans(moving, moving.end, None, None)
            share = lost_by_own(moving, span, INTERVAL)["base"]
            if short and statistic == "mean":
                assert share >= 0.03
            if not short:
                assert share <= 0.003


@settings(max_examples=40, deadline=None)
@given(steps=st.integers(2, 30), phase=st.floats(0.01, 3.0), factor=st.sampled_from((1.0, 1.0e-6, 1.0e3)))
def test_ranges_of_motions_that_chatter_agree_by_chance(steps: int, phase: float, factor: float) -> None:
    """Two sines of one amplitude and another phase have one range; a fraction of that of their difference is E.

    sin(w t) - sin(w t - p) has the amplitude 2 sin(p / 2). Where contacts last ten steps or more, only ranges count; a
    smaller fraction counts where half of the step is the only companion.
    """
    times = sine().times
    pressed = np.where(np.arange(len(times)) % (steps + 40) < steps, 10.0, 0.0)[:, None]
    ours = replace(
        sine(), displacement=factor * sine().displacement, velocity_gained=factor * sine().velocity_gained,
        force=pressed, impulse=np.cumsum(pressed, axis=0) * INTERVAL,
    )  # fmt: skip
    amplitude = factor * 1.0e-3
    theirs = replace(
        ours,
        displacement=amplitude * np.sin(OMEGA * times - phase)[:, None],
        velocity_gained=amplitude * OMEGA * np.cos(OMEGA * times - phase)[:, None],
    )
    span = Span("whole run", 0.0, 1.0, 1)
    lost = lost_in_steps(ours, INTERVAL)
    for other, reference in ((TWICE, TWICE), (HALF_STEP, None)):
        rows = figure_errors(ours, {other: theirs}, reference, span, False, SMOOTHED, lost=lost)
        found = {one.name: one for one in rows}
        for name in ("tip peak-to-peak displacement", "tip peak-to-peak smoothed acceleration"):
            share = (found[name].error or 0.0) / found[name].value
            if steps < 10:
                assert share >= 0.3 * 2.0 * np.sin(0.5 * phase)
            elif other == TWICE:
                assert share <= 1.0e-3
            else:
                assert share == pytest.approx(0.1 * FACTORS[HALF_STEP] * 2.0 * np.sin(0.5 * phase), rel=0.1)


def pulses(shape: Array, scale: float = 1.0, base: float = 0.0) -> MotionRecord:
    """Return a face that is met by a force of a shape, (n,), N, in the middle of a run, with times scaled."""
    force = np.full((1001, 1), base)
    force[500 : 500 + len(shape), 0] += shape
    interval = scale * INTERVAL
    impulse = np.cumsum(force * interval, axis=0)
    times, still = np.arange(1001) * interval, np.zeros((1001, 0))
    return MotionRecord(times, (), still, still, ("base",), force, impulse)


def test_impacts_range_over_a_run_and_its_companions() -> None:
    """Faces that close every so many records, over a part that begins late; records without closings have no range."""
    run = pulses(np.ones(1))
    count = np.arange(1001.0)[:, None]
    every = [replace(run, closings=np.floor(count / records)) for records in (50, 20, 25)]
    parts = [one.between(200 * INTERVAL, 1000 * INTERVAL) for one in every]
    low, high = impact_rates(parts[0], parts[1:])["base"]
    assert (low, high) == pytest.approx((1.0 / (50 * INTERVAL), 1.0 / (20 * INTERVAL)))
    assert impact_rates(parts[0], [run]) == {}


@given(
    records=st.integers(1, 300), height=st.floats(1.0e-6, 1.0e9), base=st.sampled_from([0.0, 0.05]),
    power=st.integers(-14, 10),
)  # fmt: skip
def test_the_peak_force_is_the_largest_on_record_where_its_contact_is_resolved(
    records: int, height: float, base: float, power: int
) -> None:
    """Half a sine of more than ten records has its peak, a shorter one its impulse over its duration, at any scale."""
    scale = 2.0**power
    shape = height * np.sin(np.pi * (np.arange(records) + 0.5) / records)
    run = pulses(shape, scale, base * height)
    (width,) = contact_windows(run).values()
    whole = Span("whole run", 0.0, float(run.times[-1]), 1)
    figures = key_figures(run, whole, Averages(run.interval, {"base": width}))
    if records > 14:
        assert width is None
    if base == 0.0:
        assert (width is None) == (records > 10)
    if width is None:
        assert figures["base largest recorded force"].mean == run.force.max()
        assert list(doubtful_peaks(force_peaks(run, [whole]), run.interval)) == []
    elif base == 0.0:
        mean = shape.sum() / records
        assert figures["base largest mean force"].mean == pytest.approx(mean, rel=1e-9)
        assert width == pytest.approx(records * run.interval)


def test_a_blow_within_a_long_contact_is_not_resolved() -> None:
    """Two records of 10 000 N on a face that is pressed by 10 N all the time."""
    run = pulses(np.array([1.0e4, 8.0e3]), base=10.0)
    assert contact_windows(run)["base"] == pytest.approx(4.0 * INTERVAL)
    assert contact_windows(replace(run, force=np.full((1001, 1), 10.0)))["base"] is None, "a steady force is"
    peaks = force_peaks(run, [Span("whole run", 0.0, 0.1, 1)])["whole run"]["base"]
    assert peaks["largest recorded force"] == pytest.approx(1.0e4 + 10.0)
    assert peaks["largest mean force"] == pytest.approx(1.8e4 / 4.0 + 10.0)
    (words,) = doubtful_peaks({"whole run": {"base": peaks}}, INTERVAL)
    assert "a contact of 4 records is not resolved" in words
    worse = peaks | {"largest recorded force": 2.0e4}
    (words,) = doubtful_peaks({"whole run": {"base": peaks, "gland": worse}}, INTERVAL)
    assert "on gland (and so on base), 2e+04 N" in words, "one warning for all faces"


@pytest.mark.parametrize("shift", [0.0, 0.2, 0.45])
@pytest.mark.parametrize("statistic", ["time-of-maximum", "time-of-minimum"])
def test_a_time_has_the_error_of_the_interval_of_its_records(statistic: str, shift: float) -> None:
    """A sine that begins between two records: its extreme lies within E of the time found, though companions agree."""
    late = shift * INTERVAL
    times = np.arange(10_001) * INTERVAL
    motion = replace(sine(), figures=(), own=1e-3 * np.sin(OMEGA * (times - late))[:, None])
    own = Figure(name="when", quantity="displacement", place="tip", statistic=statistic, end=0.05)
    motion = replace(motion, figures=(own,))
    [span] = figure_spans(motion, 1.0, None, None)
    [found] = figure_errors(motion, {HALF_STEP: motion}, None, span, False, SMOOTHED)
    exact = late + (0.25 if statistic == "time-of-maximum" else 0.75) / FREQUENCY
    assert found.error is not None
    assert abs(found.value - exact) <= found.error <= INTERVAL


@pytest.mark.parametrize("limit", [0.5e-3, 2e-3])
@pytest.mark.parametrize("known", [True, False])
def test_a_probability_has_its_interval_as_its_error(limit: float, known: bool) -> None:
    """Clopper and Pearson's, of all of 20 windows or of none, also where the motion itself cannot be predicted."""
    own = Figure(name="over", quantity="displacement", place="tip", statistic="probability", limit=limit, duration=0.05)
    motion = sine()
    motion = replace(motion, figures=(own,), own=motion.displacement[:, :1])
    [span] = figure_spans(motion, 1.0, None if known else 0.1, None)
    [found] = figure_errors(motion, {HALF_STEP: motion}, None, span, False, SMOOTHED)
    assert found.value == (limit < 1e-3)
    assert found.error == pytest.approx(1.0 - 0.025 ** (1.0 / 20.0))


@pytest.mark.parametrize("place", ["stop", "stop_below"])
@pytest.mark.parametrize("statistic", ["maximum", "peak-to-peak"])
def test_the_force_on_a_whole_support_has_the_error_of_its_face(place: str, statistic: str) -> None:
    """Blows of few records: what the step may falsify belongs to the error, whether a face or its support is asked."""
    motion = sine()
    blows = 10.0 * np.maximum(np.sin(np.pi * np.arange(10_001) / 6.0), 0.0)
    own = Figure(name="hit", quantity="contact_force", place=place, statistic=statistic)
    motion = replace(motion, faces=("stop_below",), force=blows[:, None], figures=(own,), own=blows[:, None])
    [span] = figure_spans(motion, 1.0, None, None)
    lost = lost_by_own(motion, span, INTERVAL)
    [found] = figure_errors(motion, {HALF_STEP: motion}, None, span, False, SMOOTHED, lost=lost)
    assert found.error == pytest.approx(10.0 * lost["stop_below largest recorded force"])
    assert found.error > 0.1


@pytest.mark.parametrize("gap", [1, 2, 5])
def test_a_blow_right_after_the_horizon_belongs_to_its_error(gap: int) -> None:
    """Two records after the end of the part, the largest force is doubtful; five records after it, it is not."""
    run = pulses(np.full(20, 100.0), base=10.0)
    averages = Averages(INTERVAL, contact_windows(run.between(0.0, 490 * INTERVAL)))
    part = Span("up to the horizon", 0.0, (500 - gap) * INTERVAL, 1, cut=True)
    errors = {one.name: one.error for one in figure_errors(run, {TWICE: run}, TWICE, part, False, averages)}
    assert errors["base largest recorded force"] == pytest.approx(100.0 if gap <= 2 else 0.0)
    whole = replace(part, name="whole run", cut=False)
    errors = {one.name: one.error for one in figure_errors(run, {TWICE: run}, TWICE, whole, False, averages)}
    assert errors["base largest recorded force"] == 0.0


@given(
    points=st.integers(1, 400), others=st.integers(0, 400), records=st.integers(1, 200), at=st.integers(5, 150),
)  # fmt: skip
def test_a_face_that_slaps_while_it_is_closed_is_not_resolved(points: int, others: int, records: int, at: int) -> None:
    """Of a contact of 300 records, others stay; where most touch for less than five records, the peak is a mean."""
    force = np.zeros(1001)
    force[400:700] = 50.0 + 40.0 * np.sin(np.linspace(0.0, np.pi, 300))
    active = np.where(force > 0.0, others, 0.0)
    active[400 + at : min(400 + at + records, 700)] += points
    share = brief_share(force, active)
    assert share == (pytest.approx(points / (points + others)) if records < 5 else 0.0)
    run = replace(pulses(np.zeros(1)), force=force[:, None], impulse=np.cumsum(force)[:, None] * INTERVAL)
    assert contact_windows(run)["base"] is None, "a record without numbers of points"
    run = replace(run, active=active[:, None])
    assert (contact_windows(run)["base"] is None) == (share <= 0.75)
    figures = key_figures(run, Span("whole run", 0.0, 1000 * INTERVAL, 1), Averages(INTERVAL, contact_windows(run)))
    if share > 0.75:
        assert figures["base largest mean force"].mean == pytest.approx(force[545:555].mean(), rel=1e-4)


@given(records=st.integers(1, 30), height=st.floats(0.0, 0.9), at=st.integers(20, 900))
def test_blows_that_are_not_resolved_hide_others(records: int, height: float, at: int) -> None:
    """Beside a contact of 200 records, one of at most ten that carries a tenth of its force makes it a mean."""
    force = np.zeros(1201)
    force[950:1150] = np.sin(np.pi * (np.arange(200) + 0.5) / 200.0)
    force[at : at + records] = height
    run = replace(pulses(np.zeros(1)), force=force[:, None], impulse=np.cumsum(force)[:, None] * INTERVAL)
    hides = records <= 10 and height > 0.1 * force.max()
    assert contact_windows(run)["base"] == (pytest.approx(10.0 * INTERVAL) if hides else None)


def test_a_patch_that_grows_and_shrinks_is_resolved() -> None:
    """Half a sine of 12 records on a round face, whose points grow with the root of the force, keeps its peak."""
    run = pulses(np.sin(np.pi * (np.arange(12) + 0.5) / 12.0))
    assert contact_windows(replace(run, active=np.ceil(40.0 * np.sqrt(run.force))))["base"] is None


@pytest.mark.parametrize("power", [-14, -3, 0, 10])
def test_windows_scale_with_the_scene(power: int) -> None:
    """A run of 20 us has means within it; the paper, at 20 Hz, has 2.5 ms; a user has what the case says."""
    scale = 2.0**power
    spans = {"time.end": 0.2 * scale, "time.step": 1.0e-4 * scale, "output.fields_interval": None}
    spans |= {"output.history_interval": None, "load.shaker.ramp": 0.0}
    forced = gapbeam.read_case(DEMO, spans | {"load.shaker.frequency": FREQUENCY / scale})
    assert smoothing_window(forced)[0] == pytest.approx(2.5e-3 * scale, rel=1e-12)
    falling = gapbeam.read_case(
        DEMO, spans | {"load": [{"type": "gravity"}], "time.end": 2.0e-5 * scale, "time.step": 1e-7 * scale}
    )
    assert smoothing_window(falling)[0] <= 0.05 * 2.0e-5 * scale
    named = gapbeam.read_case(DEMO, {"output.smoothing_window": 2.5e-3 * scale})
    assert smoothing_window(named) == (2.5e-3 * scale, "output.smoothing_window")


@pytest.mark.parametrize("model", ["full", "reduced", "beam", "rigid"])
def test_each_model_has_its_companions(model: str) -> None:
    """All of them are cases that can be read, and march at most twice the steps of the run unless asked for more.

    Twice the step would not resolve the elastic motions beside a rigid body: 0.013 N were stated for 0.06 N.
    """
    case = gapbeam.read_case(DEMO, {"model.type": model})
    plan = companions_of(case, 1.0e-4, 2.1e14, computed=True)
    assert [one.name for one in plan.companions] == [TWICE, STIFFER, FINEST, *([] if model == "rigid" else [COARSER])]
    assert [one.steps for one in plan.companions if one.name == FINEST] == [1.0 if model == "rigid" else 0.5]
    assert sum(one.steps for one in plan.companions) <= MOST_STEPS
    for one in plan.companions:
        read = gapbeam.read_case(case, dict(one.changes))
        assert read.contact.stiffness == (4.2e14 if one.name == STIFFER else 2.1e14)
        assert read.time.step == 1.0e-4 / one.steps
        assert read.output.history_interval == pytest.approx(2.0e-4)
    given_one = companions_of(case, 1.0e-4, 2.1e14, computed=False)
    assert STIFFER not in [one.name for one in given_one.companions]
    thorough = companions_of(case, 1.0e-4, 2.1e14, computed=True, thorough=True)
    names = [HALF_STEP, STIFFER, FINEST, COARSER]
    assert [one.name for one in thorough.companions] == ([SAME, *names] if model == "full" else names)
    for one in thorough.companions:
        assert gapbeam.read_case(case, dict(one.changes)).time.step == (
            0.5e-4 if one.name in (HALF_STEP, FINEST) else 1.0e-4
        )


def test_harmonics_share_the_error_of_the_first() -> None:
    """E of 0.4 of H = 1 mm makes E^2 / (2 H) = 0.08 mm of harmonics that no companion has; E of 0.02 next to none."""
    span = Span("second half", 0.5, 0.25, 2, FREQUENCY)
    for apart, expected in ((0.2, 8.0e-5), (0.01, 2.0e-7)):  # the finest companion counts twice
        found = figure_errors(sine(), {FINEST: sine((1.0 + apart) * 1.0e-3)}, None, span, False, SMOOTHED)
        errors = {one.name: one.error for one in found}
        assert errors["tip harmonic 1"] == pytest.approx(2.0e-3 * apart, rel=1e-6)
        assert errors["tip harmonic 2"] == errors["tip harmonic 3"] == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize(
    ("keys", "expected"),
    [
        ({"time.scheme": "implicit-midpoint"}, "discrete-gradient"),
        ({"time.scheme": {"type": "generalized-alpha", "rho_inf": 0.5}, "model": "rigid"}, "discrete-gradient"),
        ({"time.scheme": "hht-alpha", "contact.formulation": "nitsche", "model": "full"}, "discrete-gradient"),
        ({"time.scheme": "moreau-jean", "contact.formulation": "unilateral", "model": "full"}, "moreau-jean"),
    ],
)
def test_companions_conserve_energy(keys: dict[str, object], expected: str) -> None:
    """What a scheme creates or takes shows in the difference from them; asked for more, they show the order of it."""
    case = gapbeam.read_case(DEMO, keys)
    found = companions_of(case, 1.0e-4, 2.1e14, computed=True).companions
    assert {gapbeam.read_case(case, dict(one.changes)).time.scheme.type for one in found} == {expected}
    thorough = companions_of(case, 1.0e-4, 2.1e14, computed=True, thorough=True).companions
    assert {gapbeam.read_case(case, dict(one.changes)).time.scheme for one in thorough} == {case.time.scheme}


@pytest.mark.parametrize("every", [1, 2, 3, 4])
@pytest.mark.parametrize("solid", [False, True], ids=["plane", "solid"])
def test_companions_have_records_of_the_run(every: int, solid: bool) -> None:
    """Twice the step, of solids four times, falls on every second or fourth record where it must."""
    keys = {"output.history_interval": every * 1.0e-4} | ({"mesh.dimension": 3, "mesh.cell": None} if solid else {})
    case = gapbeam.read_case(DEMO, keys)
    plan = companions_of(case, 1.0e-4, 2.1e14, computed=True)
    assert sum(one.steps for one in plan.companions) <= MOST_STEPS
    for one in plan.companions:
        interval = gapbeam.read_case(case, dict(one.changes)).output.history_interval
        assert interval == pytest.approx(plan.records * every * 1.0e-4)
        steps = interval / (1.0e-4 / one.steps)
        assert steps == pytest.approx(round(steps))


def test_a_companion_of_many_supports_has_few_shapes_on_each() -> None:
    """Sixty faces with 19 shapes are a basis of 1180 DOFs, whose set-up took minutes beside a march of 2 s."""
    for faces in (1, 2, 10, 60):
        stops = [
            {
                "name": f"s{number}",
                "from": 0.008 * number,
                "to": 0.008 * number + 0.005,
                "region": "stop",
                "clearance": 0,
            }
            for number in range(faces)
        ]
        case = gapbeam.read_case(DEMO, {"support": stops, "model": "beam", "mesh.support_size": 0.004})
        basis = {one.name: one for one in companions_of(case, 1e-4, 1e12, True).companions}[FINEST].changes["model"]
        assert basis["shapes"] * faces <= 200


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


@pytest.mark.parametrize("section", [{"type": "box", "wall": 0.001}, {"type": "i", "web": 0.002, "flange": 0.002}])
@pytest.mark.parametrize("model", ["beam", "rigid"])
def test_a_solid_beside_beam_elements_touches_at_few_points(section: dict[str, object], model: str) -> None:
    """Four to a cell, not sixteen: the solid of a slat took minutes where its march took a second."""
    own = {"model": model, "mesh.dimension": 3, "mesh.cell": None, "beam.section": section}
    for asked, expected in ((None, 3), (4, 3), (2, 2)):
        case = gapbeam.read_case(DEMO, own | ({"contact.quadrature_degree": asked} if asked else {}))
        changes = {one.name: one.changes for one in companions_of(case, 1.0e-4, 2.1e14, computed=True).companions}
        finest = gapbeam.read_case(case, dict(changes[FINEST]))
        assert (finest.mesh.dimension, finest.contact.quadrature_degree) == (3, expected)
        assert "contact.quadrature_degree" not in changes[TWICE]


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
    case = gapbeam.read_case(CASE_FOLDER / "tube-holes.toml", {"model": {"type": "rigid"}} | circles)
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
    figures = tuple(figure_errors(run, moved, None, Span("settled part", 0.5, 0.25, 2, FREQUENCY), False, SMOOTHED))
    found = without_errors(RunErrors(figures, None, 1.0, CompanionPlan((), False, ()), {}), " smoothed acceleration")
    errors = {one.name: one.error for one in found.figures}
    assert errors["tip peak-to-peak smoothed acceleration"] is None
    assert all(error is not None for name, error in errors.items() if name != "tip peak-to-peak smoothed acceleration")


def test_errors_are_not_known_where_the_scheme_takes_the_energy_of_noise() -> None:
    """A scheme that takes nearly all of it does so with half of the step, too (drawn case 3355: 15 E off)."""
    few, most = ({"assumptions": [{"name": UNDER_NOISE[0], "closest": share, "limit": 0.02}]} for share in (0.1, 0.997))
    assert eaten({}) == eaten(few) == []
    (words,) = eaten(most)
    assert "100% of the energy" in words
    assert "discrete-gradient" in words
    run = sine()
    figures = tuple(
        figure_errors(run, {HALF_STEP: run}, None, Span("settled part", 0.5, 0.25, 2, FREQUENCY), False, SMOOTHED)
    )
    found = without_errors(RunErrors(figures, None, 1.0, CompanionPlan((), False, ()), {}), "")
    assert {one.error for one in found.figures} == {None}
    assert closing_table(found.figures, 1.0, True) == ClosingTable("", (), 0)


def test_companions_that_end_early_say_nothing_of_what_comes_later() -> None:
    """A force that grows to the end of a run, and companions that reached four fifths of it."""
    case = gapbeam.read_case(DEMO, {"time.end": 0.05})
    growing = sine(end=0.05)
    growing = replace(growing, force=growing.times[:, None], impulse=0.5 * growing.times[:, None] ** 2)
    plan = CompanionPlan((), False, ())
    for end, later in ((0.05, ()), (0.04, ("base",))):
        motions = {name: growing.between(0.0, end) for name in (HALF_STEP, COARSER, FINEST)}
        found = errors_of(case, growing, {name: CompanionMotion(name, motions[name]) for name in motions}, plan)
        assert found.later == later
        closing = closing_table(found.figures, found.reached, found.whole)
        assert closing.part == ("first part, up to t = 0.04 s" if later else "whole run")
        assert closing.rows[0].figure.startswith("tip")
        assert "+- less than 0.001 %" in {row.interval for row in closing.rows}
        words = doubts(found, growing.end)
        assert any("the largest force on base came later and has no error" in one for one in words) == bool(later)


@pytest.mark.parametrize("number", range(40))
def test_an_end_that_is_advised_has_windows_beyond_the_horizon(number: int) -> None:
    """Four of them, whatever frequency, smooth start and horizon; without one forcing frequency no end has them."""
    chance = np.random.default_rng(number)
    frequency, rise, horizon = 10.0 ** chance.uniform(-3.0, 6.0), *(10.0 ** chance.uniform(-2.0, 2.0, 2)).tolist()
    rise, horizon = rise / frequency * chance.integers(2), horizon / frequency
    words = words_beyond((), False, frequency, rise, horizon)
    assert words.startswith("no figure has an error")
    end = float(words.split(" = ")[1].split()[0])
    spans = spans_between(end, end, frequency, rise, 1e-3 / frequency, horizon)
    assert spans[-1].name == BEYOND_HORIZON
    assert spans[-1].count >= FEWEST_WINDOWS
    assert "time.end" not in words_beyond((), False, None, rise, horizon)
    assert words_beyond((), True, None, rise, horizon) == "only its statistics have errors"


def test_what_comes_behind_the_horizon_of_a_short_run_is_said() -> None:
    """A motion that parts from a companion, with a force that grows: the largest one has no error."""
    case = gapbeam.read_case(DEMO, {"time.end": 0.1})
    run = sine(end=0.1)
    run = replace(run, force=run.times[:, None], impulse=0.5 * run.times[:, None] ** 2)
    parted = replace(run, displacement=run.displacement * (1.0 + 5.0 * np.maximum(run.times - 0.03, 0.0))[:, None])
    motions = {name: CompanionMotion(name, one) for name, one in ((HALF_STEP, run), (COARSER, parted), (FINEST, run))}
    found = errors_of(case, run, motions, CompanionPlan((), False, ()))
    assert found.horizon is not None
    assert 0.03 < found.horizon < 0.1
    said = "; ".join(doubts(found, run.end))
    assert found.later == ("base",)
    assert "the largest force on base came later" in said
    assert "only its statistics" not in said
    closing = closing_table(found.figures, found.reached, found.whole, horizon=found.horizon)
    assert closing.part == f"up to the horizon, t = {found.horizon:.3g} s"


def in_space(lateral: float, noise: float = 0.0) -> MotionRecord:
    """Return a probe that moves on an ellipse, 1 mm high, as the records of a run have it."""
    times = np.arange(2001) * INTERVAL
    waves = np.zeros((len(times), 1, 3))
    waves[:, 0, 2] = 1.0e-3 * np.sin(OMEGA * times)
    waves[:, 0, 1] = lateral * np.cos(OMEGA * times) + noise * np.sin(7.3 * OMEGA * times)
    force = np.ones((len(times), 1))
    records = {
        "time": times,
        "displacement": waves,
        "acceleration_absolute": -(OMEGA**2) * waves,
        "contact_force": force,
        "active_points": np.arange(len(times))[:, None],
        "impulse": np.cumsum(force, axis=0) * INTERVAL,
    }
    return MotionRecord.of_records(records, {"probe": ["tip"], "face": ["hole"]}, in_space=True)


def test_motion_in_space_has_figures_in_both_directions() -> None:
    """The lateral range of an ellipse stands beside the vertical one, and both are judged by the larger one."""
    motion = in_space(2.0e-3)
    assert motion.probes == ("tip", "tip lateral")
    assert motion.spans == pytest.approx([4.0e-3, 4.0e-3], rel=1e-4)
    figures = key_figures(motion, Span("whole run", 0.0, 0.2, 1, FREQUENCY), SMOOTHED)
    assert figures["tip peak-to-peak displacement"].mean == pytest.approx(2.0e-3, rel=1e-4)
    assert figures["tip lateral peak-to-peak displacement"].mean == pytest.approx(4.0e-3, rel=1e-4)
    assert figures["tip lateral harmonic 1"].mean == pytest.approx(2.0e-3, rel=1e-9)


def test_round_off_aside_does_not_end_what_can_be_predicted() -> None:
    """A beam that moves upward but for round-off is predictable; one that leaves its orbit by 5 % is not."""
    still = in_space(0.0)
    assert horizon_of(still, [(in_space(0.0, 1.0e-12), 1.0)], SMOOTHING) is None
    assert horizon_of(still, [(in_space(0.0, 1.0e-4), 1.0)], SMOOTHING) is not None
    for noise, known in ((1.0e-12, False), (1.0e-5, True)):  # across the motion: of the mesh, or a motion of its own
        found = figure_errors(
            in_space(0.0, noise), {FINEST: in_space(0.0, 2.0 * noise)}, None, Span("whole run", 0.0, 1.0, 1), False,
            SMOOTHED,
        )  # fmt: skip
        assert {one.error is not None for one in found if one.name.startswith("tip lateral")} == {known}
        assert all(one.error is not None for one in found if not one.name.startswith("tip lateral"))


def test_the_closing_table_has_what_matters_of_many_faces() -> None:
    """Sixty stops, most of them never touched, and twenty probes filled a screen; the others stand in the summary."""
    rows = [
        FigureError(f"c{n}_below largest recorded force", "N", "whole run", float(n), 0.0, {}, 0.0) for n in range(60)
    ]
    rows += [FigureError(f"p{n} peak-to-peak displacement", "m", "whole run", 1e-3, 1e-5, {}, 0.0) for n in range(20)]
    closing = closing_table(rows, 1.0, True)
    shown = [row.figure.partition(" ")[0] for row in closing.rows]
    assert sorted(shown) == ["c56_below", "c57_below", "c58_below", "c59_below", "p0", "p1", "p2", "p3"]
    assert closing.others == 55 + 16, "c0_below was never touched"
    rms = {"name": "probe.tip.rms", "unit": "m", "value": 1e-3, "low": 0.9e-3, "high": 1.1e-3, "relative": 0.1}
    noisy = closing_table(rows, 1.0, True, {"figures": [{**rms, "verdict": "too short"}, {**rms, "verdict": "good"}]})
    assert noisy.rows[:2] == (
        ("probe.tip.rms", "1 mm", "0.9 mm to 1.1 mm", "too short"),
        ("probe.tip.rms", "1 mm", "0.9 mm to 1.1 mm", "good"),
    )
    assert len(noisy.rows) == 8
    late = closing_table(rows, 1.0, True, {"burn_in": 0.25, "figures": [{**rms, "verdict": "good"}]})
    assert late.part == "whole run"
    assert late.rows[0].figure == "probe.tip.rms, from 0.25 s on", "statistics have a part of the run of their own"


@given(
    name=st.sampled_from(["largest recorded force", "largest mean force", "impulse"]),
    value=st.sampled_from([0.0, 2.0]),
    error=st.sampled_from([0.0, 0.1, None]),
)
def test_a_face_that_no_run_touches_has_no_error(name: str, value: float, error: float | None) -> None:
    """Companions that miss it, too, do not say by how much: "0 N +- 0 N" was printed. One that touches it does."""
    one = FigureError(f"far_below {name}", "N", "whole run", value, error, {"finest": 0.0}, 0.0)
    untouched = value == 0.0 == error
    assert one.as_data()["error"] == (None if untouched else error)
    rows = closing_table([one], 1.0, True).rows
    assert len(rows) == (error is not None)
    for row in rows:
        assert (row.interval == "not known") == (row.verdict == "no contact") == untouched


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
        motions = list(companion_motions(case, [plan.companions[0], plan.companions[2]], 0.01, 2.0e-4, body=body))
        assert [one.name for one in motions] == ["twice the step", "coarser mesh"]
        assert len(found) == (2 if body is None else 1)


def test_long_estimates_say_what_they_do(monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture) -> None:
    """Five minutes passed without a word while a solid was set up, with which a beam of elements is compared."""
    case = gapbeam.read_case(DEMO, ["model.type=beam", "time.end=0.01"])
    plan = companions_of(case, 1.0e-4, 1.0e12, False)
    for line, numbers in ((np.inf, [2]), (-1.0, [1, 2, 3])):
        monkeypatch.setattr(companion_marches, "LINE", line)
        caplog.clear()
        with caplog.at_level("INFO", "gapbeam"):
            names = [one.name for one in companion_motions(case, plan.companions, 0.01, 2.0e-4)]
        assert names == ["twice the step", "finest", "coarser mesh"]
        words = [f"errors: comparison run {n} of 3, {names[n - 1]}{' on a solid' * (n == 2)}" for n in numbers]
        assert [one.getMessage() for one in caplog.records] == words
