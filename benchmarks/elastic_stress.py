"""The stress of a displacement as a form of UFL."""

from __future__ import annotations

from typing import Any

import ufl

from gapbeam.solver.assembly.elasticity import lame
from gapbeam.solver.case.case import Material


def stress(u: Any, material: Material, plane_stress: bool) -> Any:
    """Return sigma(u) = lambda tr(eps) I + 2 mu eps (UFL), Pa; in plane."""
    first, second = lame(material, plane_stress)
    strain = ufl.sym(ufl.grad(u))
    return first * ufl.tr(strain) * ufl.Identity(len(u)) + 2.0 * second * strain
