"""The equations of motion that a basis leaves out where joints hold the body: they give the forces of the joints.

A basis V without the motions that joints hold, B V = 0, knows nothing of the forces lambda that hold them. These follow
from the equation along shapes Z with B Z = 1, of the same body before it is held:

    lambda = Z^T (M a + C v + K u - f - H^T (w p)),    u = V q

Z are the static shapes of K + sigma M under unit forces along B. Every Z gives the same lambda, for the residual of the
held body lies in the span of B^T.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gapbeam.solver.assembly.attached_motions import attached_rows
from gapbeam.solver.models.body import Body
from gapbeam.solver.models.holding_shapes import HoldingShapes
from gapbeam.solver.models.reduction.modal_basis import Basis
from gapbeam.solver.system.semi_discrete import ContactOperator

INDEPENDENT = 1.0e-10  # of a motion of unit length: two holds may hold the same motion, and share its force


@dataclass(frozen=True)
class FloatingBody:
    """A body before joints hold it.

    Attributes:
        body: The body.
        basis: V of the floating body, with V^T M V = 1 and V^T K V = diag(s).
        shift: sigma > 0, 1/s^2.
    """

    body: Body
    basis: Basis
    shift: float

    def holding_shapes(self, contact: ContactOperator, held: Basis) -> HoldingShapes | None:
        """Return what the equations along Z take of the held body; None where no joint holds anything.

        Args:
            contact: The contact points that the held body keeps, on the DOFs of the body.
            held: The basis of the held body.

        Collective.
        """
        body, operators = self.body, self.body.operators
        rows = [row for one, row in attached_rows(body.case, body.patterns) if one.held]
        if not rows:
            return None
        motions = np.stack([self.basis.project(operators, row) for row in rows])
        soft = motions / (self.basis.squares + self.shift)
        flexibility = soft @ motions.T
        lengths = np.sqrt(np.diagonal(flexibility))
        lengths = np.where(lengths > 0.0, lengths, 1.0)
        stiffness = np.linalg.pinv(flexibility / np.outer(lengths, lengths), rcond=INDEPENDENT, hermitian=True)
        shapes = self.basis.columns @ (soft.T @ (stiffness / np.outer(lengths, lengths)))
        images = operators.apply_mass(shapes), operators.apply_stiffness(shapes)
        mass, elastic = (held.project(operators, image).T for image in images)
        traced = np.zeros((contact.interface.size, len(rows)))
        traced[contact.interface.slots] = shapes[contact.interface.owned]
        everywhere = operators.sum(traced)
        return HoldingShapes(
            mass=np.ascontiguousarray(mass),
            stiffness=np.ascontiguousarray(elastic),
            patterns=operators.sum(np.array([shapes.T @ pattern for pattern in body.patterns]).T.copy()),
            pressure=np.ascontiguousarray((contact.resultants.T @ everywhere).T),
            friction=np.ascontiguousarray((contact.friction_resultants.T @ everywhere).T),
        )
