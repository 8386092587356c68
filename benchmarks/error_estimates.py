"""Do the error estimates of runs cover? Drawn cases against converged marches.

For each case the true error of a key figure is its difference from the reduced model with 1/8 of the step, 1/4 of the
cell size, 40 modes and 19 shapes along each face, at the same contact stiffness.

    environment/run python3 -m benchmarks.error_estimates --cases 40
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import gapbeam
from benchmarks.drawn_cases import drawn_case
from gapbeam.postprocess.results.results import open_results
from gapbeam.solver.case.case import Case
from gapbeam.studies.error_estimate.companion_marches import EstimateError, companion_motions
from gapbeam.studies.error_estimate.companions import FINEST, FINEST_MODES, FINEST_SHAPES, Companion
from gapbeam.studies.error_estimate.horizon import spans_of
from gapbeam.studies.error_estimate.key_figures import key_figures
from gapbeam.studies.error_estimate.motion_record import MotionRecord
from gapbeam.studies.trials.refined_mesh import mesh_keys

NEGLIGIBLE = 1.0e-6  # of the scale: figures whose error and estimate are both below it say nothing


@dataclass(frozen=True)
class Checked:
    """A figure with its estimate and its true error.

    Attributes:
        seed: Of the case.
        name: Of the figure.
        span: Part of the run.
        estimate: Of its error.
        error: The true one.
        scale: Of the figure.
    """

    seed: int
    name: str
    span: str
    estimate: float
    error: float
    scale: float


def checked_case(seed: int, folder: Path) -> tuple[list[Checked], dict[str, Any]]:
    """Run a drawn case, and compare the estimates of its errors with a converged march."""
    clock = time.perf_counter()
    tables = drawn_case(seed)
    case = gapbeam.read_case(tables)
    first = gapbeam.model(case)
    stiffness = {default.key: default.value for default in first.model.defaults}["contact.stiffness"]
    case = gapbeam.read_case(case, {"contact.stiffness": stiffness})
    outcome = gapbeam.run(case, output=folder, overwrite=True)
    about = {
        "seed": seed,
        "model": tables["model"],
        "status": outcome.exit_status,
        "errors": outcome.summary.get("errors", {}).get("status"),
        "run_seconds": outcome.summary["wall_time"].get("march"),
        "estimate_seconds": outcome.summary.get("errors", {}).get("seconds"),
        "message": outcome.message,
    }
    found: list[Checked] = []
    if about["errors"] == "estimated":
        found = list(_compared(seed, case, outcome.summary["errors"], open_results(folder).history))
    about["horizon"], about["seconds"] = outcome.summary.get("errors", {}).get("horizon"), time.perf_counter() - clock
    return found, about


def _compared(seed: int, case: Case, errors: dict[str, Any], history: Any) -> Iterator[Checked]:
    run = MotionRecord.of_history(history)
    step = case.time.step
    assert step != "auto"
    changes = {
        "model": {"type": "reduced", "modes": FINEST_MODES, "shapes": FINEST_SHAPES},
        "time.step": step / 8.0,
        "output.history_interval": case.output.history_interval or step,
        "gates.accept_energy_growth": True,
        **mesh_keys(case, 0.25),
    }
    truth = Companion(FINEST, changes)
    reached = errors["up_to"]
    (finest,) = companion_motions(case, [truth], reached, step, run.interval, 1e9)
    known = {(row["name"], row["span"]): row for row in errors["figures"]}
    for span in spans_of(case, reached, run.interval, errors["horizon"]):
        exact = key_figures(finest.motion, span)
        for name, figure in key_figures(run, span).items():
            row = known[name, span.name]
            if row["error"] is None:
                continue
            scale = row["error"] / row["relative_error"] if row["relative_error"] else abs(figure.mean)
            yield Checked(seed, name, span.name, row["error"], abs(figure.mean - exact[name].mean), scale)


def report(found: list[Checked]) -> Iterator[str]:
    """Yield the table: coverage by group of figures and by span."""
    worth = [one for one in found if max(one.error, one.estimate) > NEGLIGIBLE * one.scale]
    groups = {"all": worth}
    for one in worth:
        groups.setdefault(one.span, []).append(one)
        words = one.name.split(maxsplit=1)[1]
        groups.setdefault("harmonics" if words.startswith("harmonic") else words, []).append(one)
    yield f"| {'figures':24} | number | below 2 E | below E | median E / error | median error |"
    yield "|---|---|---|---|---|---|"
    for name, rows in groups.items():
        twice = np.mean([one.error <= 2.0 * one.estimate for one in rows])
        once = np.mean([one.error <= one.estimate for one in rows])
        ratio = np.median([one.estimate / one.error if one.error else np.inf for one in rows])
        share = np.median([one.error / one.scale for one in rows])
        yield f"| {name:24} | {len(rows)} | {twice:.1%} | {once:.1%} | {ratio:.3g} | {share:.2%} |"


def main() -> None:
    """Draw cases, check them, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, default=40)
    parser.add_argument("--first", type=int, default=1, help="seed of the first case")
    parser.add_argument("--rows", type=Path, help="file to append all figures to, one JSON line each")
    options = parser.parse_args()
    found: list[Checked] = []
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(options.first, options.first + options.cases):
            try:
                rows, about = checked_case(seed, Path(folder) / str(seed))
            except (EstimateError, gapbeam.UserError) as error:
                rows, about = [], {"seed": seed, "refused": str(error)}
            found += rows
            print(json.dumps(about), file=sys.stderr, flush=True)
            if options.rows is not None:
                with options.rows.open("a", encoding="utf-8") as file:
                    file.writelines(json.dumps(vars(row)) + "\n" for row in rows)
    print(*report(found), sep="\n")


if __name__ == "__main__":
    main()
