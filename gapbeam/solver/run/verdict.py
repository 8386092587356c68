"""Figures and summary of a finished or ended march, its assumptions and wear, and doubts whether they can be trusted.

Statistics are in doubt where steps missed impacts, or the scheme biases them.

The summary gives work rate, volume rate and depth rate of every face, with intervals where known,

    W' = W / T,    V' = k W',    d' = V' / A

W is the work of sliding over the time T, k the coefficient of wear, A the worn area. Under random loads W' and its 95 %
interval are those of the statistics, behind the burn-in; the coefficient and the area count as exact. Other runs have
the mean from t = 0 to the end, and no interval. The same holds for the parts of W by the mode of motion.
The map of work rates per area over the points of a face has an interval for its largest value, see
`gapbeam.solver.diagnostics.statistics.batch_interval`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from math import inf
from typing import Any

import numpy as np

from gapbeam.meshes.rank_zero import on_rank_zero
from gapbeam.solver.case.case import Case
from gapbeam.solver.diagnostics.assumption import (
    WARNING,
    Assumption,
    Finding,
    FrequencyContent,
    in_one_line,
    let_pass,
    limited,
)
from gapbeam.solver.diagnostics.contact_episodes import DURATION
from gapbeam.solver.diagnostics.energy_gates import describe_energy, describe_gates
from gapbeam.solver.diagnostics.history_rows import Recorder
from gapbeam.solver.diagnostics.march_diagnostics import Accounts, Tally, impact_figures
from gapbeam.solver.diagnostics.point_contact import Peaks
from gapbeam.solver.diagnostics.statistics.batch_interval import largest_of_map, missed_share
from gapbeam.solver.diagnostics.statistics.run_statistics import PointStatistics, RunStatistics, in_words
from gapbeam.solver.diagnostics.statistics.statistic_figures import LEAST, PARTS_OF_WORK, WORK_RATE, Doubts, energy_bias
from gapbeam.solver.integrators.time_scheme import bias_at
from gapbeam.solver.march.stepwise_march import RESOLVING_SHARE
from gapbeam.solver.messages.errors import RangeNotCovered
from gapbeam.solver.messages.wording import LOG
from gapbeam.solver.models.bending_stiffness import bending_remarks
from gapbeam.solver.models.model import Model
from gapbeam.solver.models.reduction.span_basis import basis_remarks
from gapbeam.solver.models.time_step import frequency_of_interest
from gapbeam.solver.run.assumptions.frequency_findings import of_frequencies, recorded_content
from gapbeam.solver.run.assumptions.motion_findings import RESTRAINED, of_contact, of_pose
from gapbeam.solver.run.outcome import BOUNDS, all_rates, times_rate, wear_words, work_rate
from gapbeam.solver.run.output.history_file import recorded_figures
from gapbeam.solver.run.output.wear_file import angles, face_wear
from gapbeam.solver.run.run_consumers import RunConsumers
from gapbeam.solver.run.stop_rule import has_statistics
from gapbeam.solver.schema.record_table import SLIP_MODES
from gapbeam.solver.system.operators import Array
from gapbeam.solver.system.semi_discrete import ContactOperator


def doubts_of(case: Case, accounts: Accounts) -> Doubts:
    """Return the doubts on the statistics of a march of a case."""
    contact, step = accounts.system.contact, accounts.tally.shortest if case.time.adaptive else accounts.tally.dt
    ended = dict(zip(contact.face_names, accounts.impacts.ended, strict=True))
    rubbed = {} if (work := accounts.sliding.by_face) is None else dict(zip(ended, work, strict=True))
    noise, struck = has_statistics(case), contact.slip_modes.impact_time
    return Doubts(
        {face: missed_share(one, step) for face, one in ended.items()},
        energy_bias(accounts.ledger) if noise else 0.0,
        {face: float(np.median(one.rows[:, DURATION])) / step for face, one in ended.items() if one.count},
        case.time.scheme.measured_bias if noise else (),
        struck / step if struck > 0.0 else inf,
        frozenset(face for face, done in rubbed.items() if done <= accounts.ledger.round_off),
    )


def noise_remarks(case: Case, model: Model) -> Iterator[str]:
    """Yield a warning of energy that the scheme, in its step, adds to or takes from a motion under noise."""
    if not has_statistics(case):
        return
    shortest = model.step / 2**case.time.max_halvings if case.time.adaptive else model.step
    steps = model.contact_duration / shortest
    row = bias_at(case.time.scheme.measured_bias, steps)
    if row is not None and abs(row.mean_square) > LEAST:
        side = "low" if row.mean_square < 0.0 else "high"
        yield (
            f"[time.scheme] {case.time.scheme.type} under random loads: with {steps:.2g} steps in a contact of "
            f"{model.contact_duration:.2g} s, the shortest one, the mean square of a rattling mass is "
            f"{abs(row.mean_square):.0%} {side} and its mean contact force {row.mean_force:+.0%} off; longer contacts "
            "and more damping make that less, which the run measures; the scheme discrete-gradient changes none"
        )


NOTABLE_LOSS = 0.2  # of the loss that ends a run
TAKEN = "energy kept by the scheme", "energy that the scheme took over that exchanged", "1"
TAKEN_MEANING = "the scheme itself damps the motion; try a smaller time.step"
UNDER_NOISE = "energy under noise kept by the scheme", "energy that the scheme took or created, relative", "1"
UNDER_NOISE_MEANING = (
    "mean squares of the motion are off by about as much, contact forces by more, and a longer run does not mend that; "
    "try a smaller time.step"
)


def figures(recorder: Recorder, accounts: Accounts) -> dict[str, Any]:
    """Return the figures of energy, gates, contact and restraint for the summary."""
    contact, peaks, friction = accounts.system.contact, accounts.peaks, accounts.law.friction
    deepest, clearance = float(np.max(peaks.deepest)), abs(recorder.case.layout.clearance)
    found = {
        "energy": describe_energy(accounts.ledger, accounts.gates),
        "gates": describe_gates(accounts.gates),
        "penetration": {
            "largest": deepest,
            "relative_to_clearance": deepest / clearance if clearance > 0.0 else None,
        },
        "peak_contact_force": dict(zip(contact.face_names, (float(x) for x in peaks.force), strict=True)),
        "restraint": {
            "largest_energy": recorder.largest_restraint_energy,
            "share_of_energy": recorder.restraint_share,
        },
    }
    if friction is not None:
        largest = dict(zip(contact.face_names, (float(x) for x in peaks.friction), strict=True))
        by_face = {key: _by_face(contact, value) for key, value in vars(friction).items() if value is not None}
        found["friction"] = by_face | {"peak_force": largest}
    return found


def friction_words(accounts: Accounts) -> str:
    """Return the effect of friction in one line."""
    faces, ledger = accounts.system.contact.face_names, accounts.ledger
    forces = ", ".join(f"{name} {force:.4g} N" for name, force in zip(faces, accounts.peaks.friction, strict=True))
    share = f", {ledger.friction_loss / ledger.exchanged:.2%} of the energy exchanged" if ledger.exchanged > 0.0 else ""
    return f"largest friction force: {forces}; friction took {ledger.friction_loss:.3g} J{share}"


def contact_words(clearance: float, faces: Sequence[str], peaks: Peaks) -> str:
    """Return the peaks of contact in one line, the penetration beside a clearance, m."""
    forces = ", ".join(f"{name} {force:.4g} N" for name, force in zip(faces, peaks.force, strict=True))
    deepest = max(float(np.max(peaks.deepest)), 0.0)
    size = "interference" if clearance < 0.0 else "clearance"
    share = f", {deepest / abs(clearance):.2%} of the {size}" if clearance != 0.0 else ""
    return f"largest contact force of a step: {forces}; largest penetration {deepest:.3g} m{share}"


def assumptions(recorder: Recorder, accounts: Accounts, content: FrequencyContent | None) -> list[Finding]:
    """Return the findings on every assumption. Collective."""
    case, ledger, gates = recorder.case, accounts.ledger, accounts.gates
    found = [] if recorder.watch is None else of_pose(recorder.watch, case)
    found += of_contact(case, accounts.peaks, accounts.episodes)
    share, held = recorder.restraint_share, f"{recorder.largest_restraint_energy:.3g} J"
    found.append(Finding(RESTRAINED, share, estimate=share, detail=held))
    found += of_frequencies(case, recorder.model, content, ledger, accounts.episodes.count)
    if has_statistics(case):
        off = energy_bias(ledger)
        noisy = Assumption(*UNDER_NOISE, LEAST, None, UNDER_NOISE_MEANING + _conserving(case))
        side = "too little" if off < 0.0 else "too much"
        found.append(Finding(noisy, abs(off), detail=f"{side} by {abs(off):.1%}" if off else "nothing"))
    taken = Assumption(*TAKEN, NOTABLE_LOSS * gates.limits.total_loss, None, TAKEN_MEANING + _conserving(case))
    found.append(Finding(taken, gates.loss(ledger), detail=f"{ledger.algorithmic:.3g} J"))
    return limited(found, case.gates)


def remarks(accounts: Accounts, findings: Sequence[Finding]) -> list[str]:
    """Return the remarks on the figures, one sentence each."""
    found = [finding.remark for finding in findings if finding.verdict == WARNING]
    ledger, gates = accounts.ledger, accounts.gates
    found += gates.remarks(ledger, "time.step")
    changing = accounts.episodes.count > 0 and not ledger.at_rest  # else the scheme is linear, and creates nothing
    if changing and ledger.round_off > gates.limits.impact_growth * ledger.exchanged:
        share = "more than all" if ledger.round_off > ledger.exchanged else f"{ledger.round_off / ledger.exchanged:.1%}"
        found.append(
            f"round-off hides {ledger.round_off:.2g} J from the energy balance, "
            f"{share} of the energy exchanged: impacts could create less than that unseen; "
            "compare with a run of half the time.step"
        )
    return found


def remarks_on_model(case: Case, model: Model) -> list[str]:
    """Return the remarks on a basis, or on steps by iterations, before their use, one sentence each."""
    found = [*basis_remarks(model.body.basis, frequency_of_interest(case)[0]), *noise_remarks(case, model)]
    found += bending_remarks(case, model.body.bending)
    if model.solver is not None and model.solver.iterative:
        found.append(
            f"{model.dofs} DOFs are marched by conjugate gradients ({model.solver.reason}), several solves of "
            'dozens of products in every step: type = "reduced" in [model] needs them only once, for its basis'
        )
    return found


def resolution_remarks(case: Case, model: Model, tally: Tally) -> list[str]:
    """Return the contacts that adaptive steps could not resolve, one sentence or none."""
    if tally.unresolved == 0:
        return []
    return [
        f"{tally.unresolved} steps of {tally.shortest:.2g} s do not resolve how faces open and close, which takes "
        f"{RESOLVING_SHARE * model.contact_duration:.2g} s: peak forces and accelerations follow the step; try more "
        f"time.max_halvings, a smaller time.step or a softer {case.layout.stiffness_keys}"
    ]


def judge_curve(curve: Mapping[str, Any] | None) -> None:
    """Pass a response curve that covers the range asked for, or none.

    Args:
        curve: `summary["periodic"]["curve"]`.

    Raises:
        RangeNotCovered: The curve covers only a part of the range.
    """
    if curve is None or not curve["missing"]:
        return
    from gapbeam.solver.periodic.continuation import LARGEST_NUMBER

    unit = curve["unit"]
    gaps = "; ".join(f"{gap['low']:.6g} to {gap['high']:.6g} {unit} ({gap['reason']})" for gap in curve["missing"])
    advice = (
        "impacts that begin to graze, or chatter, leave no smooth branch: try gapbeam sweep, which marches, over "
        f"{curve['key']}, analysis.periods = 2, more damping of the contact, or a softer one"
    )
    if any(LARGEST_NUMBER in gap["reason"] for gap in curve["missing"]):
        advice = "try more analysis.continuation.max_points"
    raise RangeNotCovered(
        f"the response curve does not cover all of the range of {curve['key']}: none was followed from {gaps}; {advice}"
    )


def judge_run(case: Case, accounts: Accounts, findings: Sequence[Finding]) -> None:
    """Pass a run of a case that reached its end, or raise.

    Raises:
        EnergyCreated: More energy was created over the run than the gate of an impact allows.
        EnergyLost: The scheme took more of the energy than the gates allow.
        AssumptionBroken: A limit beyond which the figures mean nothing is passed.
    """
    scheme, gates = case.time.scheme.type, accounts.gates
    gates.judge(scheme, accounts.ledger)
    gates.judge_loss(scheme, accounts.ledger, _conserving(case))
    let_pass(findings)


def _conserving(case: Case) -> str:
    """Return the advice to take the scheme that conserves energy, where another one is used and a potential exists."""
    if case.time.scheme.conserves_energy or case.contact.formulation.without_potential:
        return ""
    return ", or the scheme discrete-gradient, which takes none"


def _by_face(contact: ContactOperator, values: float | Array) -> float | dict[str, float]:
    """Return a figure that all contact points share, or that of each face by its name."""
    if isinstance(values, float | int):
        return float(values)
    return {name: float(values[contact.faces == face][0]) for face, name in enumerate(contact.face_names)}


def wear_figures(
    case: Case,
    accounts: Accounts,
    statistics: Mapping[str, Any] | None,
    gathered: RunStatistics | None,
    doubts: Doubts,
) -> dict[str, Any] | None:
    """Return the figures of wear for the summary; None for a case without [wear].

    Args:
        case: The case.
        accounts: Accounts at the end of the run.
        statistics: Statistics in the summary; None: the run has none.
        gathered: Gathered records that the statistics come from; None: there are none.
        doubts: Doubts on the statistics.
    """
    wear, work, parts = case.wear, accounts.sliding.by_face, accounts.sliding.parts_by_face
    if wear is None or work is None or parts is None:
        return None
    intervals = {} if statistics is None else {one["name"]: one for one in statistics["figures"]}
    faces = {}
    contact = accounts.system.contact
    maps = _largest(contact, gathered)
    for (face, of_case), done, of_face in zip(face_wear(case).items(), work, parts, strict=True):
        slides = float(face not in doubts.still)
        figure, done, of_face = intervals.get(f"face.{face}.{WORK_RATE}"), slides * done, slides * of_face
        by_mode: dict[str, Any] = {"work_by_mode": dict(zip(SLIP_MODES, of_face.tolist(), strict=True))}
        by_mode["work_rate_by_mode"] = {
            mode: work_rate(float(part), accounts.time, intervals.get(f"face.{face}.{name}"))
            for mode, name, part in zip(SLIP_MODES, PARTS_OF_WORK, of_face, strict=True)
        }
        faces[face] = (
            {"work": float(done), "coefficient": of_case.coefficient, "area": of_case.area}
            | by_mode
            | _of_map(maps.get(face) if slides else None, of_case.coefficient)
            | all_rates(work_rate(float(done), accounts.time, figure), of_case.coefficient, of_case.area)
        )
    limits = contact.slip_modes._asdict()
    few = doubts.too_few_steps
    doubt = None if few is None else f"its parts are not resolved: wear.impact_time {few}"
    return {"area": wear.area, "seconds": accounts.time, **limits, "parts_doubt": doubt, "faces": faces}


def _largest(contact: ContactOperator, gathered: RunStatistics | None) -> dict[str, dict[str, Any]]:
    """Return the place of the largest work rate per area of each face, W/m^2, with its interval."""
    series = gathered.point_series() if isinstance(gathered, PointStatistics) else np.zeros((0, 0))
    if not len(series):
        return {}
    found = {}
    for number, name in enumerate(contact.face_names):
        mine = np.flatnonzero(contact.faces == number)
        one = largest_of_map(series[:, mine] / contact.surfaces[mine])
        if one.interval.value > 0.0:
            place = mine[one.point]
            found[name] = {
                "x": float(contact.positions[place, 0]),
                "angle": float(angles(contact)[place]),
                "points": one.points,
                "work_rate_per_area": {key: getattr(one.interval, key) for key in BOUNDS},
                "at_places_of_other_batches": one.elsewhere,
            }
    return found


def _of_map(largest: Mapping[str, Any] | None, coefficient: float | None) -> dict[str, Any]:
    """Return the entry of a face's map for the summary; empty where there is no interval."""
    if largest is None:
        return {}
    depth = None if coefficient is None else times_rate(largest["work_rate_per_area"], coefficient)
    return {"largest": dict(largest) | {"depth_rate": depth}}


def describe_march(summary: dict[str, Any], consumers: RunConsumers) -> list[Finding]:
    """Add the figures, findings and remarks of a march to the summary, and log them. Collective."""
    case, model, accounts = consumers.case, consumers.model, consumers.accounts
    folder, comm = consumers.folder, consumers.comm
    summary |= figures(consumers.recorder, accounts)
    if consumers.plastic_set is not None:
        faces, names = model.system.contact.faces, model.system.contact.face_names
        sets = [float(np.max(consumers.plastic_set[faces == face], initial=0.0)) for face in range(len(names))]
        summary["plastic_set"] = dict(zip(names, sets, strict=True))
    summary["contact_episodes"] = accounts.episodes.figures()
    summary["impacts"] = impact_figures(accounts.impacts, case.layout, accounts.tally.steps * model.step)
    summary["convergence"] = accounts.tally.convergence()
    summary["wall_time"] |= accounts.tally.seconds()
    summary["checkpoints"] = consumers.costs()
    end = min(case.time.end, accounts.tally.steps * model.step)
    if generated := [found for load in case.load if (found := load.generated(end, case.load)) is not None]:
        summary["random_loads"] = generated
    statistics, rule = consumers.recorder.statistics, consumers.rule
    if own := case.figure:
        labels = consumers.recorder.labels
        summary["figures"] = on_rank_zero(comm, lambda: recorded_figures(own, folder, labels))
    doubts = doubts_of(case, accounts)
    if statistics is not None:
        summary["statistics"] = statistics.describe(doubts)
        if rule is not None:
            summary["statistics"]["until"] = rule.judge(statistics, accounts.time, consumers.met, doubts)
        LOG.info("%s", in_words(summary["statistics"]))
    worn = wear_figures(case, accounts, summary.get("statistics"), statistics, doubts)
    if worn is not None:
        summary["wear"] = worn
        LOG.info("%s", wear_words(worn))
    findings = assumptions(consumers.recorder, accounts, recorded_content(model, folder, comm))
    summary["assumptions"] = [finding.as_data() for finding in findings]
    noted = [*remarks(accounts, findings), *resolution_remarks(case, model, accounts.tally)]
    summary["warnings"] += noted
    LOG.debug("%s", in_one_line(findings))
    LOG.debug("%s", contact_words(case.layout.clearance, model.system.contact.face_names, accounts.peaks))
    if model.law.friction is not None:
        LOG.info("%s", friction_words(accounts))
    for remark in noted:
        LOG.warning("%s", remark)
    return findings
