"""The work of sliding: the integral of N |v_t| over time at every contact point.

    W = sum over steps of N |s|

N is the normal force of a point in the balance of a step, s the way that the point moves along its face in the step.
Over the time T it is the work rate W / T. Friction with the coefficient mu takes mu W from the motion of a point that
slides; W itself is measured without friction as well.

Source: Archard, Journal of Applied Physics 24 (1953) 981, for wear in proportion to W; Pettigrew, Taylor, Fisher,
Yetisir and Smith, Nuclear Engineering and Design 185 (1998) 249, for the work rate.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from gapbeam.solver.diagnostics.contact_peaks import by_face
from gapbeam.solver.system.operators import Array, Operators
from gapbeam.solver.system.semi_discrete import VALUE, ContactOperator, Step


@dataclass
class SlidingWork:
    """Sums over the accepted steps of a march.

    Attributes:
        contact: To distinguish the faces; its `measures_sliding` says whether anything is measured.
        work: W at each point, (m,), J; (0,) where nothing is measured.
    """

    contact: ContactOperator
    work: Array = field(init=False)

    def __post_init__(self) -> None:
        self.work = np.zeros(self.contact.size if self.contact.measures_sliding else 0)

    @property
    def by_face(self) -> Array | None:
        """W of each face, (faces,), J; None: not measured."""
        return by_face(self.contact, self.work) if self.contact.measures_sliding else None

    def see(self, step: Step, operators: Operators) -> None:
        """Take in an accepted step. Collective where sliding is measured."""
        contact = self.contact
        if not contact.measures_sliding:
            return
        moved = contact.slip(contact.interface.trace(step.new.u[VALUE] - step.old.u[VALUE], operators))
        force = np.maximum(contact.weights * step.stage.pressure, 0.0)
        self.work += force * np.linalg.norm(moved, axis=1)
