"""Eligibility of a plan for the compiled loop."""

from __future__ import annotations

import numpy as np

from gapbeam.solver.integrators.time_scheme import kernel_of
from gapbeam.solver.march.python.march import March
from gapbeam.solver.system.dense_operators import DenseOperators
from gapbeam.solver.system.semi_discrete import ContactOperator


def why_not_compiled(plan: March) -> str | None:
    """Return the reason against the compiled loop for a plan, in words; None where it can march.

    It marches dense systems, whose gaps and forces are the same shapes, by schemes that have a kernel, with springs and
    dampers, in steps of one size.
    """
    system, law = plan.system, plan.law
    if not isinstance(system.operators, DenseOperators):
        return "the model is not dense: finite elements on a mesh are marched step by step"
    if system.operators.massless.any():
        return "some degrees of freedom have no mass"
    if not system.contact.symmetric:
        return "Nitsche's method: gaps and forces are not the same shapes"
    if kernel_of(plan.scheme) is None:
        return f"no kernel marches the scheme {plan.scheme.type}"
    if law.why_not_compiled is not None:
        return law.why_not_compiled
    if law.friction is not None or system.contact.rubbed is not None:
        return "contact with friction"
    if law.augmented is not None:
        return "augmented Lagrangian: multipliers in every step"
    if not law.stores_energy:
        return "impulses instead of a contact stiffness"
    if system.contact.turning is not None and law.touch_product is not None:
        return "damping that follows from touch speeds, at holes that are met as circles"
    if system.contact.turning is not None and _others_move(system.contact):
        return "supports that move beside holes that are met as circles"
    if plan.resolution is not None:
        return "adaptive steps"
    return None


def _others_move(contact: ContactOperator) -> bool:
    """Return whether walls move at points that are no stations in round holes."""
    if contact.turning is None or not contact.walls.motions:
        return False
    return bool(np.any(np.delete(contact.walls.growths, contact.turning.points, axis=1)))
