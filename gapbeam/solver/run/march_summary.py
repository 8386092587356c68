"""Summary of a march: figures, assumptions, remarks, wear.

Wear in a run: work rate, volume rate and depth rate of every face, with intervals where known.

    W' = W / T,    V' = k W',    d' = V' / A

W is the work of sliding over the time T, k the coefficient of wear, A the worn area. Under random loads W' and its 95 %
interval are those of the statistics, behind the burn-in; the coefficient and the area count as exact. Other runs have
the mean from t = 0 to the end, and no interval. The same holds for the parts of W by the mode of motion.
The map of work rates per area over the points of a face has an interval for its largest value, see
`gapbeam.solver.diagnostics.statistics.batch_interval`.
"""

from __future__ import annotations

import logging
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from mpi4py import MPI

from gapbeam.solver.case.face_wear import face_wear
from gapbeam.solver.diagnostics.assumptions.assumption import Finding, in_one_line
from gapbeam.solver.diagnostics.march_diagnostics import Accounts, impact_figures
from gapbeam.solver.diagnostics.statistics.batch_interval import largest_of_map
from gapbeam.solver.diagnostics.statistics.run_statistics import PointStatistics, RunStatistics, in_words
from gapbeam.solver.diagnostics.statistics.statistic_figures import PARTS_OF_WORK, WORK_RATE
from gapbeam.solver.models.model import Model
from gapbeam.solver.record_table import SLIP_MODES
from gapbeam.solver.run.assumptions.frequency_findings import recorded_content
from gapbeam.solver.run.output.wear_file import angles
from gapbeam.solver.run.run_consumers import RunConsumers
from gapbeam.solver.run.verdict import (
    assumptions,
    contact_words,
    doubts_of,
    figures,
    friction_words,
    remarks,
    resolution_remarks,
)
from gapbeam.solver.run.wear_rates import BOUNDS, all_rates, times_rate, wear_words, work_rate

LOG = logging.getLogger("gapbeam")


def wear_figures(
    model: Model,
    accounts: Accounts,
    statistics: Mapping[str, Any] | None,
    gathered: RunStatistics | None = None,
    too_few_steps: str | None = None,
) -> dict[str, Any] | None:
    """Return the figures of wear for the summary; None for a case without [wear].

    Args:
        model: Of the run.
        accounts: At its end.
        statistics: Of the summary; None: the run has none.
        gathered: What they were made of.
        too_few_steps: Of `Doubts`: how many steps an impact has and needs; None: it has enough.
    """
    wear, work, parts = model.case.wear, accounts.sliding.by_face, accounts.sliding.parts_by_face
    if wear is None or work is None or parts is None:
        return None
    intervals = {} if statistics is None else {one["name"]: one for one in statistics["figures"]}
    faces = {}
    maps = _largest(model, gathered)
    for (face, of_case), done, of_face in zip(face_wear(model.case).items(), work, parts, strict=True):
        figure = intervals.get(f"face.{face}.{WORK_RATE}")
        by_mode: dict[str, Any] = {"work_by_mode": dict(zip(SLIP_MODES, of_face.tolist(), strict=True))}
        by_mode["work_rate_by_mode"] = {
            mode: work_rate(float(part), accounts.time, intervals.get(f"face.{face}.{name}"))
            for mode, name, part in zip(SLIP_MODES, PARTS_OF_WORK, of_face, strict=True)
        }
        faces[face] = (
            {"work": float(done), "coefficient": of_case.coefficient, "area": of_case.area}
            | by_mode
            | _of_map(maps.get(face), of_case.coefficient)
            | all_rates(work_rate(float(done), accounts.time, figure), of_case.coefficient, of_case.area)
        )
    limits = model.system.contact.slip_modes._asdict()
    doubt = None if too_few_steps is None else f"its parts are not resolved: wear.impact_time {too_few_steps}"
    return {"area": wear.area, "seconds": accounts.time, **limits, "parts_doubt": doubt, "faces": faces}


def _largest(model: Model, gathered: RunStatistics | None) -> dict[str, dict[str, Any]]:
    """Return the place of the largest work rate per area of each face, W/m^2, with its interval."""
    series = gathered.point_series() if isinstance(gathered, PointStatistics) else np.zeros((0, 0))
    if not len(series):
        return {}
    contact = model.system.contact
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


def describe_march(
    model: Model, folder: Path, comm: MPI.Comm, summary: dict[str, Any], consumers: RunConsumers
) -> list[Finding]:
    """Add the figures, findings and remarks of a march to the summary, and log them. Collective."""
    accounts = consumers.accounts
    summary |= figures(model, consumers.recorder, accounts)
    if consumers.plastic_set is not None:
        faces, names = model.system.contact.faces, model.system.contact.face_names
        sets = [float(np.max(consumers.plastic_set[faces == face], initial=0.0)) for face in range(len(names))]
        summary["plastic_set"] = dict(zip(names, sets, strict=True))
    summary["contact_episodes"] = accounts.episodes.figures()
    summary["impacts"] = impact_figures(accounts.impacts, model.case.layout, accounts.tally.steps * model.step)
    summary["convergence"] = accounts.tally.convergence()
    summary["wall_time"] |= accounts.tally.seconds()
    summary["checkpoints"] = consumers.costs()
    end = min(model.case.time.end, accounts.tally.steps * model.step)
    if generated := [found for load in model.case.load if (found := load.generated(end, model.case.load)) is not None]:
        summary["random_loads"] = generated
    statistics, rule = consumers.recorder.statistics, consumers.rule
    doubts = doubts_of(model, accounts)
    if statistics is not None:
        summary["statistics"] = statistics.describe(doubts)
        if rule is not None:
            summary["statistics"]["until"] = rule.judge(statistics, accounts.time, consumers.met, doubts)
        LOG.info("%s", in_words(summary["statistics"]))
    worn = wear_figures(model, accounts, summary.get("statistics"), statistics, doubts.too_few_steps)
    if worn is not None:
        summary["wear"] = worn
        LOG.info("%s", wear_words(worn))
    findings = assumptions(model, consumers.recorder, accounts, recorded_content(folder, comm))
    summary["assumptions"] = [finding.as_data() for finding in findings]
    noted = [*remarks(model, accounts, findings), *resolution_remarks(model, accounts.tally)]
    summary["warnings"] += noted
    LOG.debug("%s", in_one_line(findings))
    LOG.debug("%s", contact_words(model, accounts.peaks))
    if model.law.friction is not None:
        LOG.info("%s", friction_words(accounts))
    for remark in noted:
        LOG.warning("%s", remark)
    return findings
