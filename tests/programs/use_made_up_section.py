"""Check and run a case with a cross-section that a folder of two files adds to gapbeam; print it as JSON.

Arguments: the folder of the files, a case file with that section, a folder for results.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

from tests.shared.overlay import Overlay

Overlay(Path(sys.argv[1])).lay()

if __name__ == "__main__":
    import numpy as np
    from mpi4py import MPI

    import gapbeam
    from gapbeam.meshes.tagged_mesh import mean_section
    from gapbeam.solver.assembly.case_mesh import mesh_of_case
    from gapbeam.solver.case.json_schema import schema
    from gapbeam.solver.case.reading.case_reader import read_case
    from gapbeam.solver.models.model import build_model
    from tests.programs.captured_call import captured

    case, results = sys.argv[2], Path(sys.argv[3])

    def checked(*overrides: str) -> tuple[object, str]:
        """Return the status of `gapbeam check` for the case with some overrides, and what it said."""
        status, out, err = captured(["check", case, *(word for one in overrides for word in ("--set", one))])
        return status, " ".join((out + err).split())

    def run_of(name: str, *overrides: str) -> dict[str, object]:
        """Return how a run ended, the loop that marched it, and the height of its probe at all times, m."""
        outcome = gapbeam.run(case, overrides, results / name)
        tip = np.asarray(gapbeam.open_results(results / name).history["displacement"])[:, 0, -1]
        return {"status": outcome.exit_status, "loop": outcome.summary["loop"], "tip": tip.tolist()}

    mesh = mean_section(mesh_of_case(read_case(case), MPI.COMM_SELF), 1.0)
    contact = build_model(read_case(case), MPI.COMM_SELF).system.contact
    reported = {
        "schema": sorted(name for name in schema()["$defs"] if name.endswith("Section")),
        "mesh": [mesh.area, mesh.second_moment],
        "touched": [float(contact.weights[contact.faces == face].sum()) for face in (0, 1)],
        "beam": run_of("beam"),
        "solid": run_of("solid", "model=reduced"),
        "check": checked(),
        "thick": checked("beam.section.bar=0.05"),
        "misspelled": checked("beam.section.bars=0.005"),
        "beside": checked("probe.tip.point=[0.6, 0.01, 0.01]"),
        "on an arm": checked("probe.tip.point=[0.6, 0.01, 0.001]"),
        "slice": checked("mesh.dimension=2"),
    }
    print(json.dumps(reported))
