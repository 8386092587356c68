"""One drawn case: its run as a user starts it, then another way, each in a process of its own with a time limit."""

from __future__ import annotations

import json
import random
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

import gapbeam
from benchmarks.drawn_schema.finishing import entries_of, finished
from benchmarks.drawn_schema.rules import drawn_scene
from benchmarks.drawn_schema.tables import Choice, Draw, all_choices
from benchmarks.drawn_schema.ways import (
    IN_MEMORY,
    NoReferenceError,
    Way,
    before,
    earlier_folder,
    long_march,
    motion_by,
    ways_of,
)
from benchmarks.fuzz.sandbox import Limits, Outcome, attempt, command
from benchmarks.table import Cell, Table
from benchmarks.true_errors import true_errors
from gapbeam.postprocess.results.results import Results, open_results, records_in
from gapbeam.solver.case.analysis_table import Continuation, Periodic
from gapbeam.solver.case.beam_motions import bends_in_two_planes
from gapbeam.solver.case.case import Case, case_to_toml, own_law
from gapbeam.solver.messages.errors import CaseError, Fault, RunError, UserError
from gapbeam.solver.schema.record_table import CURVE_FILE
from gapbeam.solver.schema.table import models_in
from gapbeam.studies.error_estimate.motion_record import MotionRecord

TRIES = 400  # of drawing tables again
SCENES = 40  # of drawing everything again
ARRAYS = ("segment", "load", "probe", "support", "joint", "mass", "fluid")
ALWAYS = ("mesh", "contact")  # drawn in every case: most choices are theirs, and the defaults of a mesh are fine ones
SCALES = ("beam", "support", "material")


class NoCaseError(RuntimeError):
    """No valid case with a choice was found."""


def drawn(seed: int, folder: Path) -> tuple[dict[str, Any], Choice]:
    """Return the tables of a case that the reader accepts, and the choice that it was drawn for.

    The choices of the schema take turns, from seed to seed; all else is left to chance.

    Args:
        seed: The same seed gives the same case.
        folder: Folder for the records of its loads.

    Raises:
        NoCaseError: No case with this choice was found: the rules leave hardly any.
    """
    choices = all_choices()
    focus = choices[seed % len(choices)]
    for scene in range(SCENES):
        found = _drawn(random.Random(f"{seed} {scene}"), seed, folder, focus)
        if found is not None:
            return found, focus
    raise NoCaseError(f"no valid case with {focus} in {SCENES} scenes of {TRIES} draws")


def _drawn(chance: random.Random, seed: int, folder: Path, focus: Choice) -> dict[str, Any] | None:
    draw = Draw(chance, drawn_scene(chance, folder, seed), focus)
    tables = {key: _table(draw, key) for key in Case.model_fields}
    for _ in range(TRIES):
        whole = finished(draw, tables)
        try:
            gapbeam.read_case(whole)
        except CaseError as error:
            again = _of_faults(error.faults)
        except UserError:
            again = ["load"]
        else:
            return whole
        key = chance.choice(again or list(tables))
        tables[key] = _table(draw, key)
    return None


def _table(draw: Draw, key: str) -> Any:
    if key in ARRAYS:
        return entries_of(draw, key)
    if key in ALWAYS:
        return draw.table(models_in(Case.model_fields[key].annotation)[0])
    return draw.value(Case, key, Case.model_fields[key])


def _of_faults(faults: Sequence[Fault]) -> list[str]:
    """Return the tables that take part in faults; those that only hold the scales are not drawn again."""
    keys = [str(key[0]) for fault in faults for key in (fault.key, *fault.related) if key]
    return [key for key in keys if key in Case.model_fields and key not in SCALES]


CHANGES = 10  # of contact: before, motions that are the same are the same
PRESSED = 1.0e-9  # N s: less is round-off
NEGLIGIBLE = 1.0e-6  # of the scale
FACTOR = 2.0  # times its stated error: beyond, a figure is a finding
SETTLED = 1.0e-4  # change over a period, relative
CLOSED = 1.0e-4  # of its range: what a period may miss its start by, times the multiplier of disturbances
PERIODIC = 0.01  # difference from a settled march, relative
NOT_ASKED = {"status": "not asked for", "reason": "no errors were asked for"}
ENDS = 1.0e-6  # of a period: how near to its end the last record is
ANOTHER = 0.2  # difference from which a march has settled on another response, which says nothing of the curve
CURVE_POINTS = 3  # that are compared
UNSTABLE = 0.995  # multipliers closer to 1 take longer than a long march to settle


def compared(way: Way, case: Case, folder: Any) -> dict[str, Any]:
    """Compare the run in a folder with another way, and return what was found, for a line of JSON."""
    results = open_results(folder)
    summary = results.summary
    computed = {one["key"]: one["value"] for one in summary["defaults"]}
    step = float(computed.get("time.step", case.time.step))
    if way.name == "long march":
        found = _periodic(way, case, results, step, computed)
        return found if curve_of(case) is None else _added(found, _comparison_curve(way, case, results, step, computed))
    run = MotionRecord.of_records(*records_in(results.folder), bends_in_two_planes(case))
    other = motion_by(way, case, run, step, computed)
    if way.exact is not None:
        return _exactly(run, other, way.exact, way.forces)
    return _within(summary, other)


def _exactly(run: MotionRecord, other: MotionRecord, limit: float, forces: float) -> dict[str, Any]:
    mine, theirs = _waves(run), _waves(other, forces)
    count = min(len(mine), len(theirs), _calm(run))
    sizes = np.abs(mine).max(axis=0)
    if not run.probes and max(float(sizes.max(initial=0.0)), float(np.abs(theirs).max(initial=0.0))) < PRESSED:
        return {"figures": 0, "above": 0, "worst": None, "what": "no probe, and no face presses but for round-off"}
    if run.in_space and run.probes:  # what does not move aside but for round-off is the same
        sizes = np.tile(sizes.reshape(2, -1).max(axis=0), 2)
    apart = np.abs(mine[:count] - theirs[:count]) / np.maximum(sizes, 1.0e-30)
    largest = float(apart.max(initial=0.0))
    return {"figures": 1, "above": int(largest > limit), "worst": largest / limit, "what": "motion"}


def _calm(motion: MotionRecord) -> int:
    """Return the number of records before contacts have changed so often that chaos multiplies round-off."""
    changes = np.flatnonzero(np.any(np.diff(motion.force > 0.0, axis=0), axis=1))
    return int(changes[CHANGES]) if len(changes) > CHANGES else len(motion.times)


def _waves(motion: MotionRecord, forces: float = 1.0) -> Any:
    """Return displacements, or impulses, divided by a factor of forces, where there is no probe."""
    return motion.displacement if motion.probes else motion.impulse / forces


def _within(summary: dict[str, Any], other: MotionRecord) -> dict[str, Any]:
    """Compare each figure that has an error; figures of which both difference and error are negligible are not."""
    errors = summary.get("errors", NOT_ASKED)
    if errors["status"] != "estimated":
        return {"figures": 0, "above": 0, "worst": None, "what": errors["reason"]}
    rows = []
    for row, difference in true_errors(summary, other):
        size = max(abs(row["value"]), 1.0e-300)
        if max(difference, row["error"]) > NEGLIGIBLE * size:
            rows.append((difference / max(row["error"], 1.0e-300), f"{row['name']}, {row['span']}", difference / size))
    worst = max(rows, default=(None, "", 0.0), key=lambda row: row[0] or 0.0)
    above = sum(ratio > FACTOR for ratio, _, _ in rows)
    return {"figures": len(rows), "above": above, "worst": worst[0], "what": worst[1], "relative": worst[2]}


def _periodic(way: Way, case: Case, results: Results, step: float, computed: dict[str, float]) -> dict[str, Any]:
    """Look whether the marched period closes, and compare a stable response with the end of a march that settles."""
    found = results.summary["periodic"]
    run = MotionRecord.of_records(*records_in(results.folder), bends_in_two_planes(case))
    if not run.probes:
        return {"figures": 0, "above": 0, "worst": None, "what": "no probe"}
    if abs(run.times[-1] - run.times[0] - found["period"]) > ENDS * found["period"]:
        return {"figures": 0, "above": 0, "worst": None, "what": "no record at the end of the period"}
    closes = np.abs(run.displacement[-1] - run.displacement[0]) / np.maximum(np.ptp(run.displacement, axis=0), 1e-30)
    multiplier = found["largest_multiplier"] or 1.0
    worst = float(closes.max()) / (CLOSED * max(1.0, multiplier))
    report = {"figures": 1, "above": int(worst > 1.0), "worst": worst, "what": "the marched period closes"}
    if not found["stable"] or multiplier > UNSTABLE:
        return report
    last, change = long_march(way, case, step, computed, multiplier)
    if change > SETTLED:
        return report
    mine, theirs = (np.ptp(motion.displacement, axis=0) for motion in (run, last))
    apart = float((np.abs(mine - theirs) / theirs).max())
    if apart <= PERIODIC:
        return report | {"figures": 2, "worst": max(worst, apart / PERIODIC)}
    return {"figures": 2, "above": 1, "worst": apart / PERIODIC, "what": "range beside a long march"}


def _comparison_curve(
    way: Way, case: Case, results: Results, step: float, computed: dict[str, float]
) -> dict[str, Any]:
    """Compare stable points of a curve, spread along it, with marches that settle there, unless on another response."""
    asked = curve_of(case)
    assert asked is not None
    rows = json.loads((results.folder / CURVE_FILE).read_text("utf-8"))["points"]
    stable = [row for row in rows if row["stable"] and row["largest_multiplier"] < UNSTABLE]
    chosen = [stable[number] for number in np.linspace(0, len(stable) - 1, CURVE_POINTS).astype(int)] if stable else []
    found: dict[str, Any] = {"figures": 0, "above": 0, "worst": None, "what": "no stable point of a curve"}
    for row in chosen:
        varied = keys_at(case, asked.key, row["value"])
        frequency = next((load.forcing_frequency for load in case.load if load.forcing_frequency is not None), 1.0)
        slower = frequency / row["value"] if asked.key.endswith(".frequency") else 1.0
        last, change = long_march(way, case, step * slower, computed, row["largest_multiplier"], varied)
        if change > SETTLED:
            continue
        ranges = {name: row.get(f"{name}.peak_to_peak") for name in last.probes}  # lateral motion is no column
        pairs = [
            pair for pair in zip(ranges.values(), np.ptp(last.displacement, axis=0), strict=True) if None not in pair
        ]
        apart = max((abs(mine / theirs - 1.0) for mine, theirs in pairs if theirs > 0.0), default=0.0)
        if not pairs or apart > ANOTHER:
            continue
        words = f"point of a curve, {asked.key} = {row['value']:.6g}"
        found = _added(found, {"figures": 1, "above": int(apart > PERIODIC), "worst": apart / PERIODIC, "what": words})
    return found


def _added(one: dict[str, Any], other: dict[str, Any]) -> dict[str, Any]:
    """Return two comparisons as one, with the words of the worse."""
    worse = max(one, other, key=lambda found: found["worst"] or 0.0)
    return worse | {key: one[key] + other[key] for key in ("figures", "above")}


def curve_of(case: Case) -> Continuation | None:
    """Return the continuation of a case that asks for a curve."""
    return case.analysis.continuation if isinstance(case.analysis, Periodic) else None


def keys_at(case: Case, key: str, value: float) -> dict[str, float]:
    """Return the keys of a case at a point of a curve; a frequency is that of all loads that have one."""
    if not key.endswith(".frequency"):
        return {key: value}
    return {f"load.{load.name}.frequency": value for load in case.load if "frequency" in load.curve_units}


PART_OF_A_CURVE = 5  # status of a curve that misses a part of its range; what it has is compared
DOCUMENTED = (124,)  # beside those that the sandbox knows: the wall-time limit

LIMITS = Limits(seconds=100.0, memory=4 * 2**30)
LONGEST = "25s"  # of a run, with which it ends by itself
EXACT = 0.4  # share of the cases, at least, that are computed by a way with the same answer
NO_WAY = Way("none", {}, exact=0.0)
LAST_WORDS = 1200  # characters of what a run said that are kept


def attempted(seed: int, folder: Path) -> dict[str, Any]:
    """Draw a case, run it, compute it by another way, and return a line of the report."""
    clock = time.perf_counter()
    folder.mkdir(parents=True)
    tables, focus = drawn(seed, folder)
    case = gapbeam.read_case(tables)
    state = earlier_folder(case)
    earlier = None if state is None else _earlier(case, state, folder).status
    way = _way(random.Random(f"way {seed}"), case, whole=earlier in (None, 0))
    line: dict[str, Any] = {"seed": seed, "focus": str(focus), "way": way.name, "choices": taken(case)}
    file, out = folder / "drawn.toml", folder / "out"
    file.write_text(case_to_toml(case), encoding="utf-8")
    if earlier is not None:
        line["earlier"] = earlier
    asked = ["--wall-time", LONGEST, *(["--error", "none"] if way.exact is not None else [])]
    outcome = attempt(command("run", file, "--output", out, *asked), folder / "said.txt", LIMITS)
    kind = "stopped" if _documented(outcome) else outcome.kind
    line |= {"kind": kind, "status": outcome.status, "run_seconds": round(outcome.seconds, 2)}
    partial = outcome.status == PART_OF_A_CURVE and curve_of(case) is not None
    if outcome.is_finding or (outcome.status != 0 and not partial):
        line |= {"said": outcome.printed[-LAST_WORDS:]}
    elif way is not NO_WAY:
        line |= _other_way(way, case, out, folder)
    line |= _reported(out)
    line["findings"] = list(findings(line, outcome))
    return line | {"seconds": round(time.perf_counter() - clock, 2)}


def _earlier(case: Case, state: str, folder: Path) -> Outcome:
    """Run the case whose last state the drawn one starts from, into the folder `state`."""
    file = folder / "earlier.toml"
    file.write_text(case_to_toml(before(case)), encoding="utf-8")
    asked = ("--output", state, "--wall-time", LONGEST, "--error", "none")
    return attempt(command("run", file, *asked), folder / "earlier.txt", LIMITS)


def _way(chance: random.Random, case: Case, whole: bool) -> Way:
    """Draw another way, more often one that has the same answer: no errors are estimated for that, which takes long.

    Args:
        chance: Random number generator.
        case: The case.
        whole: Whether the run that the case starts from reached its end; from elsewhere no other way starts.
    """
    ways = [way for way in ways_of(case) if whole or way.name != IN_MEMORY]
    exact = [way for way in ways if way.exact is not None]
    return chance.choice(exact if exact and chance.random() < EXACT else ways or [NO_WAY])


def _reported(out: Path) -> dict[str, Any]:
    """Return the end of a run's summary, where there is one."""
    path = out / "summary.json"
    if not path.is_file():
        return {}
    summary = json.loads(path.read_text(encoding="utf-8"))
    return {key: summary.get(key) for key in ("message", "reason", "warnings")} | {
        "errors": summary.get("errors", {}).get("status"),
        "estimate_seconds": summary.get("errors", {}).get("seconds"),
        "march_seconds": summary.get("wall_time", {}).get("march"),
    }


def _other_way(way: Way, case: Case, out: Path, folder: Path) -> dict[str, Any]:
    answer = folder / "other.json"

    def work() -> int:
        try:
            found = compared(way, case, out)
        except (NoReferenceError, RunError, UserError, CaseError) as none:
            found = {"figures": 0, "above": 0, "worst": None, "what": f"no reference: {none}"}
        answer.write_text(json.dumps(found), encoding="utf-8")
        return 0

    outcome = attempt(work, folder / "other.txt", LIMITS)
    if outcome.kind == "hang":  # it has no limit of its own, as runs have
        return {"other": "too slow", "figures": 0}
    if outcome.is_finding:
        return {"other": outcome.kind, "said": outcome.printed[-LAST_WORDS:]}
    found: dict[str, Any] = json.loads(answer.read_text(encoding="utf-8"))
    return found | {"other": "done", "other_seconds": round(outcome.seconds, 2)}


def findings(line: dict[str, Any], outcome: Outcome) -> list[str]:
    """Return the defects of an attempt, in words."""
    found = []
    if outcome.is_finding and not _documented(outcome):
        found.append(f"{outcome.kind}, status {outcome.status}")
    if line.get("other") in ("crash", "escape"):
        found.append(f"other way: {line['other']}")
    if line.get("above"):
        found.append(f"outside: {line['what']}, {line['worst']:.3g} times the limit")
    return found


def _documented(outcome: Outcome) -> bool:
    """Return whether a run ended in another documented way, such as at its wall-time limit."""
    return outcome.status in DOCUMENTED and "Traceback" not in outcome.printed


def taken(case: Case) -> dict[str, str]:
    """Return the choices that reports count by."""
    contact = case.contact
    return {
        "model": case.model.type,
        "model by": "auto" if case.model.reasons else "name",
        "dimension": str(case.mesh.dimension),
        "scheme": case.time.scheme.type,
        "formulation": contact.formulation.type,
        "law": contact.law.type,
        "own laws": "own" if any(own_law(one) for one in case.layout.supports) else "none",
        "wear": "none" if case.wear is None else "wear",
        "friction": "friction" if case.friction is not None else "none",
        "points": "points" if contact.points is not None else "faces",
        "steps": "adaptive" if case.time.adaptive else "computed" if case.time.step == "auto" else "given",
        "analysis": case.analysis.type + ("" if curve_of(case) is None else ", curve"),
        "start": "another run" if earlier_folder(case) else str(getattr(case.analysis, "start", "")),
        "loads": "+".join(sorted({load.type for load in case.load})),
    }


COLUMNS = ("choice", "drawn", "status 0", "compared", "refused (2)", "3, 4, 124", "findings")
NOT_TRUSTED = (3, 4, 124)  # energy created or lost, not converged or an assumption broken, out of time


def table_of(lines: Sequence[dict[str, Any]]) -> Table:
    """Return the table: for each value of each choice how many cases were drawn, and how they ended."""
    kinds: dict[str, list[dict[str, Any]]] = {"all": list(lines)}
    for line in lines:
        for key, value in (*line["choices"].items(), ("way", line["way"])):
            if key != "loads":
                kinds.setdefault(f"{key}: {value}", []).append(line)
        for load in line["choices"]["loads"].split("+"):
            kinds.setdefault(f"load: {load}", []).append(line)
    order = sorted(kinds, key=lambda name: (name != "all", name))
    figures = sum(line.get("figures") or 0 for line in lines)
    above = sum(line.get("above") or 0 for line in lines)
    findings = sum(bool(line["findings"]) for line in lines)
    return Table(
        "drawn",
        "Cases drawn from the whole schema",
        COLUMNS,
        tuple(_row(name, kinds[name]) for name in order),
        (f"{figures} figures or motions compared, {above} outside of what is allowed",),
        {"cases": len(lines), "findings": findings, "figures": figures, "above": above},
    )


def _row(name: str, lines: Sequence[dict[str, Any]]) -> tuple[Cell, ...]:
    passed, refused = (sum(line["status"] == status for line in lines) for status in (0, 2))
    stopped = sum(line["status"] in NOT_TRUSTED for line in lines)
    compared = sum(bool(line.get("figures")) for line in lines)
    findings = sum(bool(line["findings"]) for line in lines)
    return (name, len(lines), passed, compared, refused, stopped, findings)
