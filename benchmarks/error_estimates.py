"""Do the error estimates of runs cover? Drawn cases against converged marches.

For each case the true error of a key figure is its difference from the reduced model with 1/8 of the step, 1/4 of the
cell size, 40 modes and 19 shapes along each face. A contact stiffness that is given is that of the reference, too; one
that is computed stands for rigid contact, and the reference has eight times as much. Every model is drawn.

    environment/run python3 -m benchmarks.error_estimates --cases 40
"""

from __future__ import annotations

import argparse
import json
import random
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import gapbeam
from benchmarks.drawn_cases import drawn_case
from benchmarks.true_errors import true_errors
from gapbeam.postprocess.results.results import open_results
from gapbeam.solver.case.case import Case
from gapbeam.studies.error_estimate.companion_marches import EstimateError, companion_motions
from gapbeam.studies.error_estimate.companions import FINEST, FINEST_MODES, FINEST_SHAPES, Companion
from gapbeam.studies.error_estimate.motion_record import MotionRecord
from gapbeam.studies.trials.refined_mesh import mesh_keys

NEGLIGIBLE = 1.0e-6  # of the scale: figures whose error and estimate are both below it say nothing


MODELS = ("reduced", "full", "beam", "rigid")
STIFFER = 8.0  # times the computed contact stiffness


@dataclass(frozen=True)
class Checked:
    """A figure with its estimate and its true error.

    Attributes:
        seed: Of the case.
        name: Of the figure.
        span: Part of the run.
        model: Type of the model.
        stiffness: Of the contact: "given" or "auto".
        estimate: Of its error.
        error: The true one.
        scale: The figure itself.
    """

    seed: int
    name: str
    span: str
    model: str
    stiffness: str
    estimate: float
    error: float
    scale: float


def checked_case(seed: int, folder: Path, models: Sequence[str] = MODELS) -> tuple[list[Checked], dict[str, Any]]:
    """Run a drawn case, and compare the estimates of its errors with a converged march."""
    clock = time.perf_counter()
    tables = drawn_case(seed)
    chance = random.Random(f"class {seed}")
    model, automatic = chance.choice(models), chance.random() < 0.5
    case = gapbeam.read_case(tables, {"model": model})
    stiffness = {one.key: one.value for one in gapbeam.model(case).model.defaults}["contact.stiffness"]
    if not automatic:
        case = gapbeam.read_case(case, {"contact.stiffness": stiffness})
    outcome = gapbeam.run(case, output=folder, overwrite=True)
    errors = outcome.summary.get("errors", {})
    about = {
        "seed": seed,
        "model": model,
        "stiffness": "auto" if automatic else "given",
        "status": outcome.exit_status,
        "errors": errors.get("status"),
        "run_seconds": outcome.summary["wall_time"].get("march"),
        "estimate_seconds": errors.get("seconds"),
        "horizon": errors.get("horizon"),
        "repeats": errors.get("settled_part_repeats"),
        "message": outcome.message,
    }
    found: list[Checked] = []
    if about["errors"] == "estimated":
        exact = _reference(case, stiffness * (STIFFER if automatic else 1.0), open_results(folder).history, errors)
        found = [
            Checked(
                seed, row["name"], row["span"], model, str(about["stiffness"]), row["error"], error, abs(row["value"])
            )
            for row, error in true_errors(outcome.summary, exact)
        ]
    about["seconds"] = time.perf_counter() - clock
    return found, about


def _reference(case: Case, stiffness: float, history: Any, errors: dict[str, Any]) -> MotionRecord:
    """Return the converged motion on the times of a run.

    Raises:
        EstimateError: There is none.
    """
    step = case.time.step
    assert step != "auto"
    changes = {
        "model": {"type": "reduced", "modes": FINEST_MODES, "shapes": FINEST_SHAPES},
        "time.step": step / 8.0,
        "output.history_interval": case.output.history_interval or step,
        "gates.accept_energy_growth": True,
        "contact.stiffness": stiffness,
        **mesh_keys(case, 0.25),
    }
    interval = MotionRecord.of_history(history).interval
    (finest,) = companion_motions(case, [Companion(FINEST, changes)], errors["up_to"], interval)
    if finest.motion is None:
        raise EstimateError(finest.failure)
    return finest.motion


def report(found: list[Checked]) -> Iterator[str]:
    """Yield the table: coverage by group of figures and by span."""
    worth = [one for one in found if max(one.error, one.estimate) > NEGLIGIBLE * one.scale]
    groups = {"all": worth}
    for one in worth:
        groups.setdefault(one.span, []).append(one)
        groups.setdefault(f"{one.model}, {one.stiffness}", []).append(one)
        words = one.name.split(maxsplit=1)[1]
        groups.setdefault("harmonics" if words.startswith("harmonic") else words, []).append(one)
    yield f"| {'figures':34} | number | below 5 E | below 2 E | below E | median E / error | median error |"
    yield "|---|---|---|---|---|---|---|"
    for name, rows in groups.items():
        shares = (np.mean([one.error <= factor * one.estimate for one in rows]) for factor in (5.0, 2.0, 1.0))
        within = " | ".join(f"{share:.1%}" for share in shares)
        ratio = np.median([one.estimate / one.error if one.error else np.inf for one in rows])
        share = np.median([one.error / max(one.scale, 1e-300) for one in rows])
        yield f"| {name:34} | {len(rows)} | {within} | {ratio:.3g} | {share:.2%} |"


def main() -> None:
    """Draw cases, check them, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, default=40)
    parser.add_argument("--first", type=int, default=1, help="seed of the first case")
    parser.add_argument("--models", nargs="+", choices=MODELS, default=MODELS, help="to draw from")
    parser.add_argument("--rows", type=Path, help="file to append all figures to, one JSON line each")
    options = parser.parse_args()
    found: list[Checked] = []
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(options.first, options.first + options.cases):
            try:
                rows, about = checked_case(seed, Path(folder) / str(seed), options.models)
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
