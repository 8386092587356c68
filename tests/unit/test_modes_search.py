"""The search for vibration modes, as SLEPc sees it."""

from __future__ import annotations

from typing import Any

import pytest
from petsc4py import PETSc

from gapbeam.solver.messages.errors import RunError
from gapbeam.solver.models.reduction.vibration_modes import _Solve, _solved


class Solver:
    """Keeps the size of the space until it is given anew, as SLEPc does, and finds a mode for four dimensions."""

    def __init__(self) -> None:
        """Start without a space."""
        self.wanted, self.space = 0, PETSc.DECIDE

    def setDimensions(self, nev: int, ncv: int | None = None, **_: Any) -> None:  # noqa: N802 - SLEPc's names
        """Keep what is not given."""
        self.wanted, self.space = nev, self.space if ncv is None else ncv

    def setFromOptions(self) -> None:  # noqa: N802
        """Decide on a space."""
        self.space = 2 * self.wanted if self.space == PETSc.DECIDE else self.space

    def solve(self) -> None:
        """Refuse a space that is too small."""
        if self.space < self.wanted + 1:
            raise PETSc.Error(95)

    def getConverged(self) -> int:  # noqa: N802
        """Return the number of modes."""
        return self.space // 4

    def getDimensions(self) -> tuple[int, int, int]:  # noqa: N802
        """Return modes wanted, space, and nothing."""
        return self.wanted, self.space, 0


def test_more_modes_are_searched_for_in_a_space_of_their_own() -> None:
    """A space that was enlarged for 4 modes was kept for 30, of which SLEPc finds none in it: status 1."""
    solver: Any = Solver()
    factor: Any = None  # which this solver does not ask
    solve = _Solve(factor)
    assert _solved(solver, solve, 4, 1000) >= 4
    assert _solved(solver, solve, 30, 1000) >= 30
    with pytest.raises(RunError, match="modes of 40 DOFs converged"):
        _solved(solver, solve, 30, 40)
