"""One run of a case that leaves no files: its figures and its verdict."""

from __future__ import annotations

import time
from dataclasses import asdict, dataclass
from typing import Any

from mpi4py import MPI

from gapbeam.solver.case.case import Case
from gapbeam.solver.errors import RunError
from gapbeam.solver.march.simulation import Simulation
from gapbeam.studies.trials.response import TrialResponse, respond


@dataclass
class Trial:
    """Result of a run.

    Attributes:
        verdict: "passed", "energy created", "not converged", "not finite", "refused", "failed" or "lost".
        message: The error, where there was one.
        reached: Time up to which it went, s.
        created: Energy created relative to the energy exchanged; round-off counts as none.
        residual: Residual of the energy balance relative to the energy exchanged.
        lost: Energy that the scheme dissipated relative to the energy exchanged.
        penetration: Largest penetration, m.
        relative_penetration: The same relative to the clearance, or None.
        peak_force: Largest contact force on a face, N.
        iterations: Mean number of contact iterations of a step.
        most_iterations: The most in a step.
        seconds: Wall time, s.
    """

    verdict: str = "passed"
    message: str = ""
    reached: float = 0.0
    created: float = 0.0
    residual: float = 0.0
    lost: float = 0.0
    penetration: float = 0.0
    relative_penetration: float | None = None
    peak_force: float = 0.0
    iterations: float = 0.0
    most_iterations: int = 0
    seconds: float = 0.0

    def as_dict(self) -> dict[str, Any]:
        """Return the figures by name."""
        return asdict(self)


def try_case(case: Case) -> Trial:
    """Run a case on this process alone and judge it; a run that fails is a result, not an error."""
    started = time.perf_counter()
    response = TrialResponse()
    try:
        simulation = Simulation.of_case(case, MPI.COMM_SELF)
        response = respond(simulation.model, simulation.start(simulation.seat()), simulation.steps)
    except RunError as error:
        response.failed(error)
    clearance = abs(case.layout.clearance)
    marched = clearance > 0.0 and response.steps > 0
    return Trial(
        response.verdict,
        response.message,
        response.reached,
        response.created,
        response.residual,
        response.lost,
        response.penetration,
        response.penetration / clearance if marched else None,
        response.peak_force,
        response.iterations,
        response.most_iterations,
        time.perf_counter() - started,
    )
