"""One drawn case: its run as a user starts it, then another way, each in a process of its own with a time limit."""

from __future__ import annotations

import json
import random
import time
from pathlib import Path
from typing import Any

import gapbeam
from benchmarks.drawn_schema.cases import drawn
from benchmarks.drawn_schema.comparison import compared, curve_of
from benchmarks.drawn_schema.earlier import before, earlier_folder
from benchmarks.drawn_schema.references import NoReferenceError
from benchmarks.drawn_schema.ways import IN_MEMORY, Way, ways_of
from benchmarks.fuzz.command_work import command
from benchmarks.fuzz.sandbox import Limits, Outcome, attempt
from gapbeam.solver.case.case import Case
from gapbeam.solver.case.case_writer import case_to_toml
from gapbeam.solver.case.placed_support import own_law
from gapbeam.solver.errors import RunError, UserError
from gapbeam.solver.faults import CaseError

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
        "friction": "friction" if contact.rubs is not None else "none",
        "points": "points" if contact.points is not None else "faces",
        "steps": "adaptive" if case.time.adaptive else "computed" if case.time.step == "auto" else "given",
        "analysis": case.analysis.type + _curve(case),
        "start": "another run" if earlier_folder(case) else str(getattr(case.analysis, "start", "")),
        "loads": "+".join(sorted({load.type for load in case.load})),
    }


def _curve(case: Case) -> str:
    return "" if curve_of(case) is None else ", curve"
