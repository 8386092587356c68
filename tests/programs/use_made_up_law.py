"""Check and run a case with a law that a folder of two files adds to gapbeam; print what came of it as JSON.

Arguments: the folder of the files, a case file with that law, a folder for results.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from unittest.mock import patch

from tests.shared.overlay import Overlay

Overlay(Path(sys.argv[1])).lay()

if __name__ == "__main__":
    import numpy as np

    import gapbeam
    from gapbeam.solver.contact.laws.contact_law import ContactLaw
    from gapbeam.solver.contact.laws.damper import Damper
    from gapbeam.solver.contact.laws.law_choice import LAWS
    from gapbeam.solver.contact.laws.springs import Spring
    from tests.programs.captured_call import captured

    case, results = sys.argv[2], Path(sys.argv[3])

    def said(*arguments: str) -> tuple[object, str]:
        """Return the status of a command, and what it said."""
        status, out, err = captured(list(arguments))
        return status, out + err

    def run_of(name: str, *overrides: str) -> dict[str, object]:
        """Return how a run ended, which loop marched it, what contact lost, and the displacement of its probe."""
        outcome = gapbeam.run(case, overrides, results / name)
        history = gapbeam.open_results(results / name).history
        tip = np.asarray(history["displacement"]).ravel().tolist()
        lost = float(np.asarray(history["contact_dissipation"])[-1])
        return {"status": outcome.exit_status, "loop": outcome.summary["loop"], "lost": lost, "tip": tip}

    # K d + b d d' is Hunt and Crossley's law of n = 1 with chi = b / K
    depth = np.linspace(-1.0e-6, 1.0e-6, 101, dtype=np.float64)
    rate = np.linspace(1.0, -1.0, 101, dtype=np.float64)
    stiffness, chi = 1.0e11, 2.0
    alike = [
        ContactLaw(Spring(stiffness), Damper(name, coefficient)).endpoint(depth, rate, 1.0e4)
        for name, coefficient in (("growing", chi * stiffness), ("hunt-crossley", chi))
    ]
    words: dict[str, object] = {
        "laws": list(LAWS),
        "alike": [
            float(np.max(np.abs(one - other)) / np.max(np.abs(other))) for one, other in zip(*alike, strict=True)
        ],
        "check": said("check", case),
        "schema": said("schema"),
        "damped twice": said("check", case, "--set", "contact.damping=1.0e4"),
        "exact": said("check", case, "--set", "contact.formulation=unilateral"),
        "compiled": run_of("compiled"),
        "elastic": run_of("elastic", "contact.law=kelvin-voigt"),
        "gated": run_of("gated", *(f"gates.{gate}=1e-6" for gate in ("impact_growth", "impact_loss", "total_growth"))),
    }
    with patch("gapbeam.solver.march.simulation.why_not_compiled", return_value="asked for by a test"):
        words["steps"] = run_of("steps")
    print(json.dumps(words))
