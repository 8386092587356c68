"""Summary of a march: figures, assumptions, remarks."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import Any

import numpy as np
from mpi4py import MPI

from gapbeam.solver.diagnostics.assumptions.assumption import Finding, in_one_line
from gapbeam.solver.diagnostics.march_diagnostics import impact_figures
from gapbeam.solver.diagnostics.statistics.run_statistics import in_words
from gapbeam.solver.models.model import Model
from gapbeam.solver.run.assumptions.recorded_content import recorded_content
from gapbeam.solver.run.run_consumers import RunConsumers
from gapbeam.solver.run.statistic_doubts import doubts_of
from gapbeam.solver.run.verdict import (
    assumptions,
    contact_words,
    figures,
    friction_words,
    remarks,
    resolution_remarks,
)
from gapbeam.solver.run.wear_figures import wear_figures, wear_words

LOG = logging.getLogger("gapbeam")


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
    LOG.info("%s", in_one_line(findings))
    LOG.info("%s", contact_words(model, accounts.peaks))
    if model.law.friction is not None:
        LOG.info("%s", friction_words(accounts))
    for remark in noted:
        LOG.warning("%s", remark)
    return findings
