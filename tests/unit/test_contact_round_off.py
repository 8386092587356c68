"""The contact solve ends where round-off of the Delassus operator leaves the law missed by more than its tolerance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from gapbeam.solver.contact.laws.contact_law import StagePressure
from gapbeam.solver.contact.solve.condensation import ForceResponse
from gapbeam.solver.contact.solve.contact_solve import solve_contact
from gapbeam.solver.messages.errors import NotConverged
from gapbeam.solver.system.operators import Array, Indices

COMPLIANCE, STIFFNESS, HELD = 1.0e-3, 2.0e9, 1.0e-3  # m/N, Pa/m, m


@dataclass(frozen=True)
class Blurred:
    """D = c at one point; the matrix that Newton's method solves with is off by a share of it."""

    blur: float
    symmetric: bool = True
    iterative: bool = False
    largest_compliance: float = COMPLIANCE

    def respond(self, forces: Array) -> ForceResponse:
        """Return D f."""
        return ForceResponse(COMPLIANCE * forces)

    def solve_linearized(
        self, scale: float, active: Indices, compliance: Array, target: Array, change: Array, *_rest: object
    ) -> tuple[Array, ForceResponse]:
        """Solve (c' + s D (1 + blur)) x = t."""
        change[active] = target / (compliance + scale * COMPLIANCE * (1.0 + self.blur))
        return change, self.respond(change)


def law(depth: Array) -> StagePressure:
    """Return a linear spring."""
    pressure = STIFFNESS * np.maximum(depth, 0.0)
    return StagePressure(pressure, np.where(depth > 0.0, STIFFNESS, 0.0), pressure)


@pytest.mark.parametrize(("blur", "solved"), [(0.0, True), (1e-13, True), (4e-12, True), (1e-6, False)])
def test_a_solution_that_stands_still_is_one(blur: float, solved: bool) -> None:
    """With w = 1, f = K d and d = d_h - c f give f = d_h / (1 / K + c), also with four times the expected round-off."""
    held = np.array([HELD])
    if not solved:
        with pytest.raises(NotConverged, match="did not converge"):
            solve_contact(Blurred(blur), 1.0, held, np.ones(1), law, np.zeros(1))  # type: ignore[arg-type]
        return
    found = solve_contact(Blurred(blur), 1.0, held, np.ones(1), law, np.zeros(1))  # type: ignore[arg-type]
    assert found.forces == pytest.approx(HELD / (1.0 / STIFFNESS + COMPLIANCE), rel=1e-10)
    assert found.iterations <= 12
