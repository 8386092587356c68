"""One chain of a sweep, in a process of its own: set up, start, march, classify, and to the disk.

Random and chaotic responses have statistics with 95 % intervals besides their peaks.

A random response counts as settled where the rms of every probe is judged "good". One whose record is too short, or
whose figures rise or fall, is "not settled": it cannot tell whether responses coexist.
"""

from __future__ import annotations

import io
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import Any

import numpy as np
import xarray as xr

from gapbeam.postprocess.display_units import shown
from gapbeam.postprocess.results.columns_of_run import as_history
from gapbeam.postprocess.signals.figure_names import NOT_SETTLED
from gapbeam.postprocess.signals.periodicity import NO_CYCLE
from gapbeam.postprocess.signals.signal import SignalError
from gapbeam.postprocess.signals.steady_figures import WORD, Steady, WindowFigure, figures_of_record, steady
from gapbeam.postprocess.study_figures.sweep_branches import RANDOM
from gapbeam.solver.case.figure_table import Figure, figure_values
from gapbeam.solver.diagnostics.assumption import WARNING, Finding
from gapbeam.solver.diagnostics.statistics.run_statistics import RunStatistics
from gapbeam.solver.diagnostics.statistics.statistic_figures import Doubts
from gapbeam.solver.messages.errors import CaseError, OutOfMemory, RunError
from gapbeam.solver.schema.record_table import SMOOTHING_WINDOW
from gapbeam.studies.study_folder import study_written, write_json
from gapbeam.studies.sweep.sweep_plan import Chain, Task, point_file
from gapbeam.studies.trials.response import VERDICTS, TrialResponse
from gapbeam.studies.trials.subject import Subject, read_subject


def as_data(quantities: Mapping[str, WindowFigure]) -> dict[str, Any]:
    """Return figures by name: unit, mean and scatter, SI; accelerations in g too."""
    return {
        name: {"unit": one.unit, "mean": one.mean, "scatter": one.scatter, "unsettled": one.unsettled}
        | ({"mean_in_g": one.mean * shown(one.unit)[1]} if one.unit == "m/s^2" else {})
        for name, one in quantities.items()
    }


GOOD, BIASED = "good", "biased"
RMS = ("rms", "lateral_rms")


def random_response(
    history: xr.Dataset,
    statistics: RunStatistics | None,
    after: float | None,
    notes: list[str],
    doubts: Doubts | None = None,
) -> dict[str, Any]:
    """Return word and figures of a random response.

    Args:
        history: Its records.
        statistics: Its statistics.
        after: Time from which peaks count, s; statistics find their own start.
        notes: Receives remarks.
        doubts: Doubts on the figures of its statistics.

    Raises:
        SignalError: No probe, nothing after that time, or values that are not finite.
    """
    quantities, words = figures_of_record(history, after)
    found = {} if statistics is None else statistics.describe(doubts)
    verdicts = {one["verdict"] for one in found.get("figures", ()) if one["name"].rpartition(".")[2] in RMS}
    settled = bool(verdicts) and verdicts <= {GOOD, BIASED}
    notes += ["the forcing is random: statistics with 95 % intervals; displacements, accelerations and peak forces are "
              "largest values, which grow with the record", *words]  # fmt: skip
    if not settled:
        doubt = "figures rise or fall" if NOT_SETTLED in verdicts else "the record is too short for an interval"
        notes.append(f"not settled: {doubt}; try a larger time.end")
    data: dict[str, Any] = {
        "response": RANDOM if settled else NOT_SETTLED,
        "windows": 1,
        "figures": as_data(quantities),
    }
    return with_intervals(data, found)


def with_intervals(data: dict[str, Any], found: Mapping[str, Any]) -> dict[str, Any]:
    """Return the record of a response with its statistics, as far as they are judged good, among its figures.

    Args:
        data: Data with `figures`.
        found: Described statistics of the response; empty: there are none.
    """
    if not found:
        return data
    known = {
        one["name"]: {"unit": one["unit"], "mean": one["value"], "low": one["low"], "high": one["high"]}
        | {"scatter": 0.5 * (one["high"] - one["low"]), "unsettled": 0.0}
        for one in found["figures"]
        if one["verdict"] == GOOD
    }
    return data | {"figures": data["figures"] | known, "statistics": found}


FEWEST_RECORDS = 8  # of a response that did not pass, for figures of it
_End = tuple[Any, Subject]
"""The end of a response, and what responded."""


def run_chain(chain: Chain) -> int:
    """Compute the responses of a chain that are not on disk yet, put them there, and return how many there were.

    Raises:
        NotWritten: The disk is full, or the like.
    """
    first = next((place for place, task in enumerate(chain.tasks) if not point_file(chain.folder, task).exists()), None)
    if first is None:
        return 0
    before: _End | None = None
    if chain.sweep.carry and first > 0 and point_file(chain.folder, chain.tasks[first - 1], "npz").exists():
        before = _kept(chain, chain.tasks[first - 1])
        first = 0 if before is None else first
    for task in chain.tasks[first:]:
        record, before = _response(chain, task, before)
        write_json(point_file(chain.folder, task), record)
    return len(chain.tasks) - first


def lost_chain(chain: Chain, words: str) -> dict[int, dict[str, Any]]:
    """Return records of the responses that a chain has not written, as its workers were lost.

    They are not put on disk: a sweep that is called again tries them again.
    """
    left = [task for task in chain.tasks if not point_file(chain.folder, task).exists()]
    return {
        task.number: _blank(chain, task)
        | {"verdict": "lost", "exit_status": OutOfMemory.exit_status, "message": f"its worker was lost: {words}"}
        for task in left
    }


def _blank(chain: Chain, task: Task) -> dict[str, Any]:
    """Return the record of a response of which nothing is known yet."""
    return {
        "values": dict(zip((axis.key for axis in chain.sweep.axes), task.values, strict=True)),
        "direction": task.direction,
        "start": "",
        "verdict": "passed",
        "exit_status": 0,
        "message": "",
        "notes": [],
    }


def _response(chain: Chain, task: Task, before: _End | None) -> tuple[dict[str, Any], _End | None]:
    """Return the record of a response, and its end for the next one."""
    sweep, clock = chain.sweep, time.perf_counter()
    record = _blank(chain, task)
    try:
        subject = read_subject(sweep.case, sweep.overrides(task.values))
        begin = subject.start(task.start, sweep.seed) if before is None else subject.carried(*before)
    except (CaseError, RunError) as error:
        verdict = VERDICTS.get(type(error), "failed")
        return record | {"verdict": verdict, "exit_status": error.exit_status, "message": str(error)}, None
    record["start"], record["notes"] = begin.word, list(begin.notes)
    record["units"] = {axis.key: subject.unit_of(axis.key) for axis in sweep.axes}
    set_up = time.perf_counter() - clock
    response = subject.respond(begin, rings=before is not None or task.start > 0)
    record |= {name: getattr(response, name) for name in ("verdict", "exit_status", "message", "reached", "steps")}
    record |= {name: getattr(response, name) for name in ("created", "residual", "penetration", "peak_force")}
    record |= _watched(response.findings, record["notes"])
    record |= _classified(subject, response, sweep.transient, record["notes"], 0.5 * sweep.tolerance)
    record |= _own(subject.figures, response, record)
    record["seconds"] = {"set_up": set_up, "march": response.seconds}
    end = response.end if response.verdict == "passed" else None
    if end is None or not sweep.carry:
        return record, None
    _keep(chain, task, subject.packed(end))
    return record, (end, subject)


def _watched(findings: Sequence[Finding], notes: list[str]) -> dict[str, Any]:
    """Return the distances of a response from the limits of the assumptions; those that it passed become notes."""
    notes += [f"{one.assumption.name}: {one.assumption.meaning}" for one in findings if one.verdict == WARNING]
    return {"assumptions": [one.as_data() for one in findings]}


def _own(figures: Sequence[Figure], response: TrialResponse, record: dict[str, Any]) -> dict[str, Any]:
    """Return the figures of a response with those of one's own, and of one that did not pass those of its records."""
    found, history = dict(record.get("figures") or {}), response.history
    if response.verdict != "passed" and len(history.get("time", ())) >= FEWEST_RECORDS:
        with suppress(SignalError):
            found = as_data(figures_of_record(as_history(history, response.labels))[0])
    if not figures or not len(history.get("time", ())):
        return {"figures": found} if found else {}
    for name, one in figure_values(figures, history, response.labels).items():
        if one["value"] is None:
            record["notes"].append(f"no {name}: {one['reason']}")
        elif name not in found:
            ends = {key: one[key] for key in ("low", "high") if key in one}
            scatter = 0.5 * (one["high"] - one["low"]) if ends else 0.0
            found[name] = {"unit": one["unit"], "mean": one["value"], "scatter": scatter, "unsettled": 0.0, "own": True}
            found[name] |= ends
    unnamed = response.verdict == "passed" and "response" not in record
    return {"figures": found} | ({"response": WORD, "windows": 1} if unnamed else {})


def _classified(
    subject: Subject,
    response: TrialResponse,
    transient: float | None,
    notes: list[str],
    limit: float,
) -> dict[str, Any]:
    """Return the period and the figures of a response, as far as its records allow."""
    if response.verdict != "passed":
        return {}
    first, frequency = float(response.history["time"][0]), subject.frequency
    after = None if transient is None else first + transient
    history = as_history(response.history, response.labels).assign_attrs({SMOOTHING_WINDOW: subject.window})
    try:
        if subject.is_random:
            return random_response(history, response.statistics, after, notes, response.doubts) | {
                "transient": transient or 0.0
            }
        if frequency is None:
            lasting = response.statistics if subject.moves_by_itself else None
            known = {} if lasting is None else lasting.describe(response.doubts)
            after = first + known["burn_in"] if after is None and known.get("burn_in") else after
            data = _without_period(history, after, notes) | {"transient": 0.0 if after is None else after - first}
            return with_intervals(data, known)
        found = steady(history, frequency, after, limit)
    except SignalError as fault:
        notes.append(f"no figures: {fault}")
        return {}
    notes += found.notes
    if found.cycle.period != 1 and subject.stays_linear(history, found.start):
        notes.append(
            "the contact did not change and is linear, so that there is one response, of period 1: what else moves "
            "has not faded yet; try a larger time.end"
        )
        return described(found) | {"response": NOT_SETTLED, "transient": found.start - first}
    data = described(found) | {"transient": found.start - first}
    if found.word != NO_CYCLE or response.statistics is None:
        return data
    return with_intervals(data, response.statistics.describe(response.doubts))


def described(found: Steady) -> dict[str, Any]:
    """Return a steady response as plain data; accelerations in g too."""
    return {
        "response": found.word,
        "period": found.cycle.period,
        "repeats_within": found.cycle.residual,
        "windows": found.windows,
        "periods_in_a_window": found.periods,
        "figures": as_data(found.quantities),
    }


def _without_period(history: xr.Dataset, after: float | None, notes: list[str]) -> dict[str, Any]:
    """Return the figures of a response that no forcing period divides: peaks over the record, one window."""
    quantities, words = figures_of_record(history, after)
    part = "the whole record" if after is None else f"the record after {after:.4g} s"
    notes += [f"the forcing has no single frequency: no cycle, figures are peaks over {part}", *words]
    return {"response": WORD, "windows": 1, "figures": as_data(quantities)}


def _keep(chain: Chain, task: Task, arrays: Mapping[str, Any]) -> None:
    """Put the end of a response on disk, for a sweep that resumes after an interruption."""
    path, data = point_file(chain.folder, task, "npz"), io.BytesIO()
    np.savez(data, **arrays)
    part = path.with_name(path.name + ".part")
    with study_written(path):
        part.write_bytes(data.getvalue())
        part.replace(path)


def _kept(chain: Chain, task: Task) -> _End | None:
    """Return the end of a response that is on disk; None where this process has another basis than that one."""
    subject = read_subject(chain.sweep.case, chain.sweep.overrides(task.values))
    with np.load(point_file(chain.folder, task, "npz")) as data:
        end = subject.unpacked(data)
    return None if end is None else (end, subject)
