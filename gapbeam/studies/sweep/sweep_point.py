"""One chain of a sweep, in a process of its own: set up, start, march, classify, and to the disk.

Random and chaotic responses have statistics with 95 % intervals besides their peaks.

A random response counts as settled where the rms of every probe is judged "good". One whose record is too short, or
whose figures rise or fall, is "not settled": it cannot tell whether responses coexist.
"""

from __future__ import annotations

import io
import json
import math
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import Any

import numpy as np
import xarray as xr

from gapbeam.postprocess.results.columns_of_run import as_history
from gapbeam.postprocess.signals.periodicity import NO_CYCLE, NOT_SETTLED
from gapbeam.postprocess.signals.signal import SignalError
from gapbeam.postprocess.signals.steady_figures import WORD, Steady, figures_of_record, steady
from gapbeam.postprocess.study_figures.sweep_branches import RANDOM
from gapbeam.solver.case.analysis_table import Transient
from gapbeam.solver.case.case import Case
from gapbeam.solver.case.computed_defaults import smoothing_window
from gapbeam.solver.case.figure_table import figure_values
from gapbeam.solver.case.reading.case_reader import read_case
from gapbeam.solver.diagnostics.assumption import WARNING, Finding
from gapbeam.solver.diagnostics.statistics.run_statistics import RunStatistics
from gapbeam.solver.diagnostics.statistics.statistic_figures import Doubts
from gapbeam.solver.errors import CaseError, OutOfMemory, RunError
from gapbeam.solver.loads.load_choice import forcing_frequencies
from gapbeam.solver.models.model import Model
from gapbeam.solver.record_table import SMOOTHING_WINDOW
from gapbeam.solver.run.output.results_folder import finite, write_beside
from gapbeam.solver.run.stop_rule import gathered_statistics, has_statistics, statistics_of
from gapbeam.solver.system.semi_discrete import VALUE, State, imaged
from gapbeam.studies.study_folder import study_written
from gapbeam.studies.sweep.sweep_plan import Chain, Task, point_file
from gapbeam.studies.sweep.window_data import as_data
from gapbeam.studies.trials.response import VERDICTS, TrialResponse, respond
from gapbeam.studies.trials.starts import KeptBody, Start, carried, kicked, seated

GOOD, BIASED = "good", "biased"
RMS = ("rms", "lateral_rms")


def statistics_of_response(model: Model, interval: float) -> RunStatistics | None:
    """Return the statistics to gather of a response; None where it is no transient.

    A response to a periodic force may turn out chaotic: its statistics are gathered, too. Its force holds it up, so
    that the damping of the beam is no time that its motion remembers.

    Args:
        model: The model.
        interval: Time between records, s.
    """
    if not isinstance(model.case.analysis, Transient):
        return None
    every = max(1, round(interval / model.step))
    return statistics_of(model, every) or gathered_statistics(model, every)


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
        notes: Gets what is to be said about it.
        doubts: On the figures of its statistics.

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
        data: With `figures`.
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


SAME = 1e-6  # of the range of the gaps: the same basis gives the same gaps
ROUND_OFF = 1e-11  # of the largest gap
FEWEST_RECORDS = 8  # of a response that did not pass, for figures of it
_End = tuple[State, Case]
BODY = KeptBody()  # of this process


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
        text = json.dumps(finite(record), indent=1, allow_nan=False) + "\n"
        with study_written(point_file(chain.folder, task)):
            write_beside(point_file(chain.folder, task), text)
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
    """Return the record of a response, and its case and end for the next one."""
    sweep, clock = chain.sweep, time.perf_counter()
    record = _blank(chain, task)
    try:
        case = read_case(sweep.case, sweep.overrides(task.values))
        model = BODY.model(case)
        begin = _start(model, task, before, sweep.seed)
    except (CaseError, RunError) as error:
        verdict = "refused" if isinstance(error, CaseError) else VERDICTS.get(type(error), "failed")
        return record | {"verdict": verdict, "exit_status": error.exit_status, "message": str(error)}, None
    record["start"], record["notes"] = begin.word, list(begin.notes)
    set_up = time.perf_counter() - clock
    steps, frequency = span(model)
    rings = before is not None or task.start > 0
    interval = case.output.history_interval or model.step
    statistics = statistics_of_response(model, interval)
    response = respond(model, begin.state, steps, interval, watched=True, rings=rings, statistics=statistics)
    record |= {name: getattr(response, name) for name in ("verdict", "exit_status", "message", "reached", "steps")}
    record |= {name: getattr(response, name) for name in ("created", "residual", "penetration", "peak_force")}
    record |= _watched(response.findings, record["notes"])
    record |= _classified(model, response, frequency, begin, sweep.transient, record["notes"], 0.5 * sweep.tolerance)
    record |= _own(model, response, record)
    record["seconds"] = {"set_up": set_up, "march": response.seconds}
    end = response.end if response.verdict == "passed" else None
    if end is None or not sweep.carry:
        return record, None
    _keep(chain, task, end)
    return record, (end, model.case)


def span(model: Model) -> tuple[int, float | None]:
    """Return the steps of a response, a whole number of forcing periods up to time.end, and the forcing frequency."""
    frequencies = forcing_frequencies(model.case.load)
    if len(frequencies) != 1:
        return round(model.case.time.end / model.step), None
    periods = math.floor(model.case.time.end * frequencies[0] + 1e-9)
    return max(1, round(max(periods, 1) / (frequencies[0] * model.step))), frequencies[0]


def _start(model: Model, task: Task, before: _End | None, seed: int) -> Start:
    if before is not None:
        return carried(model, *before)
    return seated(model) if task.start == 0 else kicked(model, task.start, seed)


def _watched(findings: Sequence[Finding], notes: list[str]) -> dict[str, Any]:
    """Return the distances of a response from the limits of the assumptions; those that it passed become notes."""
    notes += [f"{one.assumption.name}: {one.assumption.meaning}" for one in findings if one.verdict == WARNING]
    return {"assumptions": [one.as_data() for one in findings]}


def _own(model: Model, response: TrialResponse, record: dict[str, Any]) -> dict[str, Any]:
    """Return the figures of a response with those of one's own, and of one that did not pass those of its records."""
    found, history = dict(record.get("figures") or {}), response.history
    if response.verdict != "passed" and len(history.get("time", ())) >= FEWEST_RECORDS:
        with suppress(SignalError):
            found = as_data(figures_of_record(as_history(history, response.labels))[0])
    if not model.case.figure or not len(history.get("time", ())):
        return {"figures": found} if found else {}
    for name, one in figure_values(model.case.figure, history, response.labels).items():
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
    model: Model,
    response: TrialResponse,
    frequency: float | None,
    begin: Start,
    transient: float | None,
    notes: list[str],
    limit: float,
) -> dict[str, Any]:
    """Return the period and the figures of a response, as far as its records allow."""
    if response.verdict != "passed":
        return {}
    after = None if transient is None else begin.state.time + transient
    window, _ = smoothing_window(model.case)
    history = as_history(response.history, response.labels).assign_attrs({SMOOTHING_WINDOW: window})
    try:
        if has_statistics(model.case):
            return random_response(history, response.statistics, after, notes, response.doubts) | {
                "transient": transient or 0.0
            }
        if frequency is None:
            return _without_period(history, after, notes) | {"transient": transient or 0.0}
        found = steady(history, frequency, after, limit)
    except SignalError as fault:
        notes.append(f"no figures: {fault}")
        return {}
    notes += found.notes
    if found.cycle.period != 1 and stays_linear(model, history, found.start):
        notes.append(
            "the contact did not change and is linear, so that there is one response, of period 1: what else moves "
            "has not faded yet; try a larger time.end"
        )
        return described(found) | {"response": NOT_SETTLED, "transient": found.start - begin.state.time}
    data = described(found) | {"transient": found.start - begin.state.time}
    if found.word != NO_CYCLE or response.statistics is None:
        return data
    return with_intervals(data, response.statistics.describe(response.doubts))


def stays_linear(model: Model, history: xr.Dataset, after: float) -> bool:
    """Return whether the beam was a linear system from some time on: no point opened or closed, on linear springs.

    A linear system with damping has one steady response, with the period of its forcing.

    Args:
        model: The model.
        history: Its records.
        after: s.
    """
    law = model.law
    if law.friction is not None or not law.linear:
        return False
    closed = history["active_points"].sel(time=slice(after, None)).values
    return bool(np.all(closed == closed[:1]))


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
    notes += ["the forcing has no single frequency: no cycle, figures are peaks over the whole record", *words]
    return {"response": WORD, "windows": 1, "figures": as_data(quantities)}


def _keep(chain: Chain, task: Task, end: State) -> None:
    """Put the end of a response on disk, for a sweep that resumes after an interruption."""
    path, data = point_file(chain.folder, task, "npz"), io.BytesIO()
    np.savez(data, time=end.time, u=end.u[0], v=end.v[0], depth=end.depth, pressure=end.pressure)
    part = path.with_name(path.name + ".part")
    with study_written(path):
        part.write_bytes(data.getvalue())
        part.replace(path)


def _kept(chain: Chain, task: Task) -> _End | None:
    """Return end and case of a response that is on disk; None where this process has another basis than that one."""
    case = read_case(chain.sweep.case, chain.sweep.overrides(task.values))
    system = BODY.model(case).system
    with np.load(point_file(chain.folder, task, "npz")) as data:
        u, v = imaged(system.operators, data["u"]), imaged(system.operators, data["v"])
        state = State(float(data["time"]), u, v, data["depth"], data["pressure"])
    depth = system.contact.depth(system.contact.interface.trace(u[VALUE], system.operators), state.time)
    same = np.allclose(
        depth,
        state.depth,
        rtol=0.0,
        atol=SAME * float(np.ptp(state.depth)) + ROUND_OFF * float(np.max(np.abs(state.depth))),
    )
    return (state, case) if same else None
