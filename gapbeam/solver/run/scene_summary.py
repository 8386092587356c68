"""Summary of a run of a scene: the scene, its figures, assumptions and remarks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import zip_longest
from math import log
from typing import Any

import numpy as np

from gapbeam.solver.diagnostics.assumption import WARNING, Assumption, Finding, limited
from gapbeam.solver.diagnostics.energy_gates import describe_energy, describe_gates
from gapbeam.solver.diagnostics.march_diagnostics import figures_of_lists
from gapbeam.solver.diagnostics.statistics.batch_interval import FEWEST, BlockEnds, burn_in, correlation_time
from gapbeam.solver.diagnostics.statistics.statistic_figures import WORK_RATE, AveragedSeries
from gapbeam.solver.run.assumptions.motion_findings import RESOLVED
from gapbeam.solver.run.outcome import all_rates, work_rate
from gapbeam.solver.run.scene_records import EPS, SceneAccounts, promises_balance
from gapbeam.solver.scene.contact_pair import Contact
from gapbeam.solver.scene.feedback import Feedback, Joint
from gapbeam.solver.scene.flow_force import Flow, fit_doubts
from gapbeam.solver.scene.linear_scheme import LinearScheme
from gapbeam.solver.scene.matrix_digits import MORE_DIGITS, MOST_OFF
from gapbeam.solver.scene.recorded_places import turning_places
from gapbeam.solver.scene.scene import Scene
from gapbeam.solver.scene.scene_load import BaseMotion

DIGITS = Assumption(
    "digits of matrices", "part of the first frequency that digits leave unknown", "1", MOST_OFF, 10.0 * MOST_OFF,
    MORE_DIGITS,
)  # fmt: skip
BOUNDED = Assumption(
    "bounded motion", "growth of the linear motion over the run, in the digits of a number", "1",
    log(10.0) / log(1.0 / EPS), 1.0,
    "forces that follow the motion drive it, and no contact limits it: its figures are those of the end of the run; "
    "look at `gapbeam check`, or start where contact is met",
)  # fmt: skip


def describe_scene(scene: Scene, step: float, end: float, scheme: LinearScheme) -> dict[str, Any]:
    """Return structures, contacts, loads and feedback of a scene, the step, and the numbers of the scheme."""
    contacts = [
        {
            "name": one.name,
            "between": [f"{point.structure.name or '?'}.{point.name or '?'}" for point in one.points],
            "region": one.region.kind.name,
            "law": one.law.kind.name,
            "impulsive": one.is_impulsive,
            "values": _plain(dict(zip(one.law.kind.given, one.law.values, strict=False))),
            "clearance": _plain(_clearance(one.region)),
            "friction": _plain(one.friction),
            "moves": one.is_moved,
        }
        for one in scene.contacts
    ]
    return {
        "structures": [
            {"name": one.name, "dofs": one.size, "points": list(one.points)} for one in scene.structures
        ],
        "contacts": contacts,
        "loads": [{"name": one.name, "type": getattr(one, "kind", type(one).__name__.lower())} for one in scene.loads],
        "feedbacks": [_feedback(one) for one in scene.feedbacks if not isinstance(one, Joint)],
        "step": step,
        "end": end,
        "scheme": scheme._asdict(),
        "keeps_energy": promises_balance(scheme),
        "geometry": False,
        "turning": turning_places(scene),
    }  # fmt: skip


def _feedback(one: Feedback) -> dict[str, Any]:
    found: dict[str, Any] = {"name": one.name, "states": len(one.A)}
    if isinstance(one, Flow):
        fit = one.law.fit
        found |= {"velocity": one.velocity, "density": one.density, "delay": one.delay, "delay_error": one.error,
                  "coefficients": None if fit is None else fit.as_data()}  # fmt: skip
    return found


def _clearance(region: Any) -> Any:
    names = region.kind.names
    return region.values[names.index("clearance")] if "clearance" in names else None


def _plain(value: Any) -> Any:
    """Return values as JSON holds them."""
    if isinstance(value, dict):
        return {key: _plain(one) for key, one in value.items()}
    return np.asarray(value).tolist() if value is not None else None


def figures_of(accounts: SceneAccounts, names: Sequence[str], seconds: float) -> dict[str, Any]:
    """Return the figures of energy, gates and contact for the summary.

    Args:
        accounts: Accounts of the march.
        names: Names of the contacts.
        seconds: Span of the march, s.
    """

    def by_contact(values: Any) -> dict[str, float]:
        forces = zip(names, values, accounts.impulsive, strict=True)
        return {name: float(value) for name, value, impulsive in forces if not impulsive}

    found = {
        "energy": describe_energy(accounts.ledger, accounts.gates),
        "gates": describe_gates(accounts.gates),
        "penetration": {"largest": float(accounts.depth.max(initial=0.0)), "relative_to_clearance": None},
        "peak_contact_force": by_contact(accounts.force),
        "contact_episodes": accounts.episodes,
        "impacts": {
            name: figures_of_lists([one], seconds) for name, one in zip(names, accounts.impacts, strict=True)
        },
    }  # fmt: skip
    if any(one.is_rough for one in accounts.scene.contacts):
        found["friction"] = {"peak_force": by_contact(accounts.friction)}
    return found


def wear_of(
    accounts: SceneAccounts, names: Sequence[str], seconds: float, step: float, wear: Mapping[str, float | None]
) -> dict[str, Any]:
    """Return the wear in the summary: the work of sliding at contacts of several motions, by Archard's law.

    Rates are those behind the burn-in, with 95 % intervals and verdicts, or the mean of a run of few steps.

    Args:
        accounts: Accounts of the march.
        names: Names of the contacts.
        seconds: Span of the march, s.
        step: s.
        wear: `coefficient`, 1/Pa, and `area`, m^2, where they are known.
    """
    coefficient, area = wear.get("coefficient"), wear.get("area")
    mine = [i for i, one in enumerate(accounts.scene.contacts) if one.region.motions > 1]
    rates, found = _work_rates(accounts.worn, step, mine), dict[str, Any]()
    for i, rate in zip_longest(mine, rates):
        work = float(accounts.sliding[i])
        found[names[i]] = {"work": work, "coefficient": coefficient, "area": area, "work_by_mode": {}}
        found[names[i]] |= all_rates(work_rate(work, seconds, rate), coefficient, area)
    return {"area": area, "seconds": seconds, "parts_doubt": None, "faces": found}


def _work_rates(worn: BlockEnds, step: float, contacts: Sequence[int]) -> list[dict[str, Any]]:
    """Return the work rates of contacts behind the burn-in, with intervals and verdicts; none of a short run."""
    rates, block = worn.changes[:, contacts] / step, worn.length * step
    if len(rates) < 2 * FEWEST or not contacts:
        return []
    late = rates[burn_in(list(rates.T)) :]
    slowest = max(correlation_time(one) for one in late.T)
    series = (AveragedSeries(WORK_RATE, "W", one, positive=True, rare=True) for one in late.T)
    figures = (one.judged(block, slowest) for one in series)
    return [vars(one.interval) | {"verdict": one.verdict} for one in figures]


def findings_of(accounts: SceneAccounts, growth: float) -> list[Finding]:
    """Return the findings on the assumptions of a scene.

    Args:
        accounts: Accounts of the march.
        growth: Logarithm of the growth of a linear motion over the march; 0: it is bounded.
    """
    seen = accounts.episodes
    detail = f"{seen['short_episodes']} of {seen['episodes']} contacts"
    found = [Finding(RESOLVED, seen["share_of_impulse_in_short_episodes"], detail=detail)] if seen["episodes"] else []
    doubts = [one.doubt for one in accounts.scene.structures if one.doubt is not None]
    found += [Finding(DIGITS, one.part, detail=one.words) for one in doubts]
    if growth > 0.0:
        found.append(Finding(BOUNDED, growth / log(1.0 / EPS), detail=f"times 10^{growth / log(10.0):.2g}"))
    return limited(found, accounts.gates.limits)


def remarks_of(accounts: SceneAccounts, findings: Sequence[Finding]) -> list[str]:
    """Return the remarks on the figures, one sentence each."""
    found = [one.remark for one in findings if one.verdict == WARNING]
    found += fit_doubts(accounts.scene.feedbacks)
    found += _still_neighbors(accounts.scene) + _idle_motions(accounts.scene)
    if not accounts.balanced:
        found.append(
            "the scheme promises no energy balance: energy that is missing counts as its dissipation, so that the "
            "balance proves nothing; compare with the default scheme"
        )
    return [*found, *accounts.gates.remarks(accounts.ledger, "step")]


def _still_neighbors(scene: Scene) -> list[str]:
    """Return a sentence for each structure without base motion that a contact or a joint ties to one that has it."""
    shaken = {scene.place_of(one.structure, "base motion"): one.name for one in scene.loads if type(one) is BaseMotion}
    tied: list[Contact | Feedback] = [*scene.contacts, *scene.feedbacks]
    ties = [{scene.place_of(point.structure, "a point") for point in one.points} for one in tied]
    still = {(max(tie & set(shaken)), other) for tie in ties if tie & set(shaken) for other in tie - set(shaken)}
    names = [one.name or "?" for one in scene.structures]
    return [
        f"base motion {shaken[moved]} shakes {names[moved]}, but not {names[other]}, which touches it or is joined to "
        f"it: the inertia of {names[other]} is left out; give all structures the base motion"
        for moved, other in sorted(still)
    ]


def _idle_motions(scene: Scene) -> list[str]:
    """Return a sentence for each base motion along which no structure of the scene moves."""
    moves = dict[str, bool]()
    for load in scene.loads:
        if isinstance(load, BaseMotion):
            name = load.name.removesuffix(f"-{load.structure.name}")
            moved = float(np.abs(load.pattern).max(initial=0.0)) > EPS * abs(load.structure.M).max()
            moves[name] = moves.get(name, False) or moved
    return [
        f"base motion {name or '?'} moves nothing: no structure has a motion along its direction; look at that, and at "
        "axis and across of the places"
        for name, moved in moves.items()
        if not moved
    ]
