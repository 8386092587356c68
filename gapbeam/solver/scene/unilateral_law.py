"""Exact contact: impulses that stop an approach, with Newton's law of impact, by the scheme of Moreau and Jean.

Where the place predicted at the end of a step lies beyond a face, x0 + h u0 >= 0, the approach speed u obeys

    0 <= T  orthogonal to  u1 + e u0 <= 0    for u0 >= 0,    elsewhere T = 0,

which is x1 - x0 <= h (1 - e) u0 / 2 by the midpoint rule. A face that opens at the start of the step, u0 < 0, but would
close in it, obeys x1 - x0 <= 0: then no impulse makes energy. No stiffness is left in the result: Newton's method on
the augmented Lagrangian holds the face by the force of its last pass and a spring on what is missing, which ends at 0
(Alart and Curnier 1991, Comput. Methods Appl. Mech. Eng. 92, 353). Of order 1: bodies end up to half a step of the
approach before or beyond a face; predictions at half a step, which are usual, would let them end a whole step beyond.
The energy that an impact takes is the work of T, and belongs to the law in the ledger.

Source: Jean (1999), Comput. Methods Appl. Mech. Eng. 177, 235; Acary and Brogliato (2008), ch. 10.
"""

# mypy: disable-error-code="no-untyped-def"
from __future__ import annotations

from typing import Any

from gapbeam.solver.scene.argument_checks import checked
from gapbeam.solver.scene.force_law import SPEEDS, ForceLaw, LawKind, inlined

SHARE = 1e-5
"""Stiffness that decides whether a face holds, as soft as the bodies in a step, over the one that holds it."""


@inlined
def _impact(x0, step, h, force, stiffness, speed, restitution):
    missing = step - 0.5 * h * (1.0 - restitution) * max(speed, 0.0)
    if x0 + h * speed >= 0.0 and force + SHARE * stiffness * missing > 0.0:
        return force + stiffness * missing, stiffness
    return 0.0, 0.0


@inlined
def _settle(x0, x1, h, speed):
    return 2.0 * (x1 - x0) / h - speed


@inlined
def _none(x, *values):  # noqa: ARG001
    return 0.0


_UNILATERAL = LawKind(
    "Unilateral", ("restitution", *SPEEDS), _none, _none, None, defaults=dict.fromkeys(SPEEDS, 0.0),
    nonnegative=("restitution",), settle=_settle, memory=SPEEDS, fractions=("restitution",), per_area=(),
    impact=_impact,
)  # fmt: skip


@checked
def Unilateral(restitution: Any) -> ForceLaw:  # noqa: N802
    """Return exact contact: impulses let nothing approach beyond a face; no friction.

    Args:
        restitution: Speed of points after an impact over that before, 0 to 1. In elastic structures 0 takes the energy
            of the motion of the points themselves, which falls with the size of the mesh, and 1 takes none.

    Raises:
        UserError: The restitution is out of that range.
    """
    return _UNILATERAL(restitution=restitution)
