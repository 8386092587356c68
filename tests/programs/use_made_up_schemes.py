"""Check, run and sweep a case with schemes that a folder of two files adds to gapbeam; print what came of it as JSON.

Arguments: the folder of the files, a case file, a folder for results.
"""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from pathlib import Path

from tests.shared.overlay import Overlay

Overlay(Path(sys.argv[1])).lay()  # also in the processes of a sweep, which import this file

if __name__ == "__main__":
    import numpy as np
    from mpi4py import MPI

    import gapbeam
    from gapbeam.solver.case.reading.case_reader import read_case
    from gapbeam.solver.integrators.scheme_choice import scheme_names
    from gapbeam.solver.march.compiled.compiled_march import CompiledLoop
    from gapbeam.solver.march.simulation import march_of_model
    from gapbeam.solver.march.stepwise_march import march
    from gapbeam.solver.models.model import build_model
    from gapbeam.solver.seat.static_seat import find_seat
    from tests.programs.captured_call import captured
    from tests.shared.passages import followed

    case, results = sys.argv[2], Path(sys.argv[3])

    def said(*arguments: str) -> tuple[object, str]:
        """Return the status of a command, and what it said."""
        status, out, err = captured(list(arguments))
        return status, out + err

    def run_of(name: str, *overrides: str) -> dict[str, object]:
        """Return how a run ended, which loop marched it, and the last displacement of its probe."""
        outcome = gapbeam.run(case, overrides, results / name)
        history = gapbeam.open_results(results / name).history
        last = np.asarray(history["displacement"])[-1].ravel().tolist()
        return {"status": outcome.exit_status, "loop": outcome.summary["loop"], "last": last}

    model = build_model(read_case(case, ["time.scheme=bossak"]), MPI.COMM_SELF)
    scheme = model.case.time.scheme
    plan = replace(march_of_model(model, scheme), steps=60)
    seat = find_seat(model.system, model.law, model.seat_springs, scheme.carries_acceleration).state
    for step in march(plan, seat):
        end = step.refreshed or step.new
    compiled = followed(CompiledLoop(plan), seat, 60).end
    words = {
        "names": scheme_names(),
        "apart": float(np.max(np.abs(compiled.u[0] - end.u[0])) / np.max(np.abs(end.u[0] - seat.u[0]))),
        "check": said("check", case, "--set", "time.scheme=bossak"),
        "out of range": said("check", case, "--set", "time.scheme.type=bossak", "--set", "time.scheme.alpha=2.0"),
        "stiff": said("run", case, "--set", "time.scheme=bossak", "--set", "contact.stiffness=1e15",
                      "--output", str(results / "stiff")),
        "bossak": run_of("bossak", "time.scheme=bossak"),
        "trapezoidal": run_of("trapezoidal", "time.scheme.type=bossak", "time.scheme.alpha=0.0"),
        "newmark": run_of("newmark", "time.scheme=newmark"),
        "cautious": run_of("cautious", "time.scheme=cautious-midpoint"),
        "discrete-gradient": run_of("discrete-gradient", "time.scheme=discrete-gradient"),
        "sweep": said("sweep", case, "time.scheme.alpha=0.2,0.3", "--set", "time.scheme.type=bossak", "--workers", "1",
                      "--output", str(results / "sweep")),
    }  # fmt: skip
    print(json.dumps(words))
