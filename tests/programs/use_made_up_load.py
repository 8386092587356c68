"""Check, run, sweep and report a case with a load that a folder of two files adds to gapbeam; print it as JSON.

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
    from gapbeam.solver.case.json_schema import schema
    from gapbeam.solver.case.reading.case_reader import read_case
    from gapbeam.solver.march.compiled.compiled_march import CompiledLoop
    from gapbeam.solver.march.simulation import march_of_model
    from gapbeam.solver.march.stepwise_march import march
    from gapbeam.solver.models.body import body_key
    from gapbeam.solver.models.model import build_model
    from gapbeam.solver.seat.static_seat import find_seat
    from tests.programs.captured_call import captured
    from tests.shared.passages import followed

    case, results = sys.argv[2], Path(sys.argv[3])
    FULL, REDUCED = "model=full", "model=reduced"

    def said(*arguments: str) -> tuple[object, str]:
        """Return the status of a command, and what it said."""
        status, out, err = captured(list(arguments))
        return status, " ".join((out + err).split())

    def checked(*overrides: str) -> tuple[object, str]:
        """Return what `gapbeam check` said of the case with some overrides."""
        return said("check", case, *(word for override in overrides for word in ("--set", override)))

    def run_of(name: str, file: str, *overrides: str) -> dict[str, object]:
        """Return how a run ended, its loop, and the motion of its probe."""
        outcome = gapbeam.run(file, overrides, results / name)
        tip = np.asarray(gapbeam.open_results(results / name).history["displacement"])[:, 0, -1]
        return {"status": outcome.exit_status, "loop": outcome.summary["loop"], "tip": tip.tolist()}

    def apart(override: str) -> float:
        """Return how far the compiled march and the march in Python are apart, over the motion."""
        model = build_model(read_case(case, [override]), MPI.COMM_SELF)
        plan = replace(march_of_model(model, model.case.time.scheme), steps=60)
        seat = find_seat(model.system, model.law, model.seat_springs).state
        for step in march(plan, seat):
            end = step.refreshed or step.new
        compiled = followed(CompiledLoop(plan), seat, 60).end
        return float(np.max(np.abs(compiled.u[0] - end.u[0])) / np.max(np.abs(end.u[0] - seat.u[0])))

    same_body = ("load.pulse.amplitude=7.0", "load.pulse.duration=1e-3", "load.pulse.start=2e-3")
    recorded = sys.argv[4]
    reported = {
        "schema": "HalfSineForce" in schema()["$defs"],
        "cheap": body_key(read_case(case, same_body)) == body_key(read_case(case)),
        "place": body_key(read_case(case, ["load.pulse.point=0.2"])) == body_key(read_case(case)),
        "apart": [apart("title=a beam"), apart(REDUCED)],
        "beam": run_of("beam", case),
        "recorded": run_of("recorded", recorded),
        "full": run_of("full", case, FULL),
        "full recorded": run_of("full-recorded", recorded, FULL),
        "check": checked("time.step=auto"),
        "coarse": checked("time.step=1e-3"),
        "late": checked("load.pulse.start=1.0"),
        "misspelled": checked("load.pulse.durration=1.0"),
        "outside": checked("load.pulse.point=0.6"),
        "periodic": checked("analysis.type=periodic"),
        "gate": said("run", case, "--set", "time.scheme=newmark", "--set", "gates.total_growth=1e-6",
                     "--set", "gates.impact_growth=1e-6", "--output", str(results / "gate")),
        "sweep": said("sweep", case, "load.pulse.amplitude=30,60", "--workers", "1",
                      "--output", str(results / "sweep")),
        "report": said("report", str(results / "beam"), "--no-pdf"),
    }  # fmt: skip
    print(json.dumps(reported))
