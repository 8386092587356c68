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
    from gapbeam.solver.contact.laws.made_up_spring import CubicStop  # type: ignore[import-not-found]

    import gapbeam
    from gapbeam.solver.contact.laws.contact_law import make_law
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

    def missed(scale: float) -> float:
        """Return by how much forms of the law miss closed forms, at drawn depths, also close to each other."""
        drawn = np.random.default_rng(1)
        old, new = scale * drawn.uniform(-2.0, 4.0, (2, 2000))
        new[::2] = old[::2] * (1.0 + 1.0e-3 * drawn.uniform(-1.0, 1.0, 1000))
        law = make_law(CubicStop(type="cubic-stop", scale=scale), drawn.uniform(1.0e6, 2.0e6, 2000), 1.0e-8)
        stiffness, (before, after) = law.spring.stiffness, np.maximum([old, new], 0.0)
        stored = [stiffness * (0.5 * d**2 + 0.25 * d**4 / scale**2) for d in (before, after)]
        pressure = stiffness * (after + after**3 / scale**2)
        mean, ahead = law.discrete_gradient(old, new, 1.0), 1.0e-5 * scale
        rise = (law.discrete_gradient(old, new + ahead, 1.0).pressure - mean.pressure) / ahead
        away = np.abs(new) > ahead  # the kink at touch has two slopes
        missed = [
            (law.static(new).pressure - pressure) / scale,
            (law.endpoint(new, np.zeros(2000), 1.0).elastic - pressure) / scale,
            (law.implicit(old, new, 1.0).pressure - pressure) / scale,
            (law.softened(0.25).static(new).pressure - 0.25 * pressure) / scale,
            (law.potential(new) - stored[1]) / scale**2,
            (mean.pressure * (new - old) - stored[1] + stored[0]) / scale**2,
            1.0e-6 * (rise - mean.slope)[away],
        ]
        return max(float(np.max(np.abs(one))) for one in missed) / 1.0e8

    words: dict[str, object] = {
        "missed": {scale: missed(scale) for scale in (1.0e-9, 1.0e-3, 1.0)},
        "check": said("check", case),
        "fine": bounce("fine"),
        "coarse": bounce("coarse", "time.step=2e-3"),
        "linear": bounce("linear", "contact.law=kelvin-voigt"),
        "stiff": bounce("stiff", "contact.law.scale=1e-3"),
        "damped": bounce("damped", "contact.damping=2e3"),
        "exact": said("check", case, "--set", "contact.formulation=unilateral"),
        "sweep": said(
            "sweep", case, "contact.law.scale=2e-3,5e-3", "--workers", "1", "--output", str(results / "sweep")
        ),
    }
    print(json.dumps(words))
