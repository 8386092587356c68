"""Check and run a case with a cubic stop that a folder of two files adds to gapbeam; print what came of it as JSON.

Arguments: the folder of the files, a case file with that law, a folder for results.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

from tests.shared.overlay import Overlay

Overlay(Path(sys.argv[1])).lay()

if __name__ == "__main__":
    import numpy as np

    import gapbeam
    from tests.programs.captured_call import captured

    case, results = sys.argv[2], Path(sys.argv[3])

    def said(*arguments: str) -> tuple[object, str]:
        """Return the status of a command, and what it said."""
        status, out, err = captured(list(arguments))
        return status, out + err

    def bounce(name: str, *overrides: str) -> dict[str, object]:
        """Return how a bounce ended, by which loop, its largest force, and time and place of its last record."""
        outcome = gapbeam.run(case, overrides, results / name)
        history = gapbeam.open_results(results / name).history
        place = np.asarray(history["displacement"])[:, 0, 1]
        return {
            "status": outcome.exit_status,
            "loop": outcome.summary["loop"],
            "force": float(np.asarray(history["contact_force"]).max()),
            "time": float(history["time"][-1]),
            "place": float(place[-1]),
            "energy": float(np.asarray(history["kinetic_energy"])[-1]),
        }

    words: dict[str, object] = {
        "check": said("check", case),
        "fine": bounce("fine"),
        "coarse": bounce("coarse", "time.step=2e-3"),
        "stages": bounce("stages", "time.scheme=generalized-alpha"),
        "linear": bounce("linear", "contact.law=kelvin-voigt"),
        "stiff": bounce("stiff", "contact.law.scale=1e-3"),
        "damped": bounce("damped", "contact.damping=2e3"),
        "exact": said("check", case, "--set", "contact.formulation=unilateral"),
        "sweep": said(
            "sweep", case, "contact.law.scale=2e-3,5e-3", "--workers", "1", "--output", str(results / "sweep")
        ),
    }
    print(json.dumps(words))
