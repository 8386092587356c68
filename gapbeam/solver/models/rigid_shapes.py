"""Rigid motions of the beam on the DOFs of its model: x = M^-1 (M x), of the images that the body keeps."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from gapbeam.solver.case.analysis_table import NAMES, RigidMotion
from gapbeam.solver.system.operators import Array

if TYPE_CHECKING:
    from gapbeam.solver.models.body import Body


def rigid_parts(body: Body, motion: RigidMotion) -> Iterator[Array]:
    """Yield the parts of a rigid motion along `NAMES` on the DOFs of the beam, (n,) each. Collective."""
    sizes = motion.section(0.0)
    wanted = [(sizes[name], row) for name, row in zip(NAMES, body.rigid, strict=True) if sizes[name] != 0.0]
    if not wanted:
        return
    factor = body.operators.factor(1.0, 0.0)
    for size, row in wanted:
        yield size * factor.solve(row)
