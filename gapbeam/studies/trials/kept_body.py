"""The body of the last case, kept for the next one that differs only in what is cheap to change."""

from __future__ import annotations

import time

from mpi4py import MPI

from gapbeam.solver.case.case import Case
from gapbeam.solver.models.body import Body
from gapbeam.solver.models.body_key import body_key
from gapbeam.solver.models.model import Model, build_body, model_of


class KeptBody:
    """Sets up models one after the other, each body once.

    The body is that of `body_key(case)`, so that a model has the same bits whatever case came before it.

    Attributes:
        seconds: What the body that is kept has cost, s.
    """

    def __init__(self, body: Body | None = None) -> None:
        """Start with the body of a model that is there already, or with none."""
        self._kept: tuple[Case, Body] | None = None if body is None else (body_key(body.case), body)
        self.seconds = 0.0

    def model(self, case: Case) -> Model:
        """Return the model of a case on this process alone; errors as in `gapbeam.solver.models.model.build_model`."""
        key = body_key(case)
        if self._kept is None or self._kept[0] != key:
            self._kept = None  # frees the memory of the old body before the new one takes its own
            clock = time.perf_counter()
            self._kept = key, build_body(key, MPI.COMM_SELF)
            self.seconds = time.perf_counter() - clock
        return model_of(case, self._kept[1])
