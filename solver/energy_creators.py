"""Combinations of scheme and contact that are known to create energy: refused unless the case accepts them by name."""

from __future__ import annotations

from solver.case_file.faults import Fault
from solver.case_tables.contact import Penalty
from solver.case_tables.time import CentralDifference
from solver.contact_scales import compared_depth, slope_factor
from solver.defaults import STIFFEST_OTHERS, stiffness_unit
from solver.errors import UserError
from solver.integrators.created_energy import creates_energy
from solver.model import Model

ROUNDED = 1.0e-3  # of a stiffness: what is lost by writing it with a few digits


def energy_creator(model: Model) -> Fault | None:
    """Return the fault of a scheme on a contact on which it is known to create energy, or None.

    The contact is too stiff where the slope of its law is above 1 E/h, for laws with an exponent at a depth of 1 % of
    the clearance (1e-6 m where that is 0), and where the formulation is exact: unilateral, augmented-lagrangian and
    nitsche.
    """
    case, scheme, formulation = model.case, model.case.time.scheme, model.case.contact.formulation
    on_masses = isinstance(scheme, CentralDifference) and case.contact.mass == "consistent"
    if not (creates_energy(scheme) or on_masses):
        return None
    modulus, factor = case.material.young_modulus, slope_factor(case)
    body = modulus / model.facet_length
    share, most = model.law_stiffness * factor / body, STIFFEST_OTHERS * body / factor
    points = case.contact.points
    key = 1.0 if points is None else 0.5 * model.system.contact.area / len(points)
    words = f"E = {modulus:.3g} Pa, h = {model.facet_length:.3g} m"
    at_depth = f" at a depth of {compared_depth(case):.2g} m" if factor != 1.0 else ""
    unit = stiffness_unit(case)
    if isinstance(formulation, Penalty):
        if share <= (1.0 + ROUNDED) * STIFFEST_OTHERS:
            return None
        contact = f"a contact of {model.law_stiffness:.4g} {unit}, {share:.3g} E/h{at_depth} ({words})"
        softer = f"contact.stiffness = {key * most:.3g}"
    else:
        contact = f"the formulation {formulation.type}, which is exact and as stiff as {share:.3g} E/h ({words})"
        softer = f'contact.formulation = "penalty" with contact.stiffness = {most:.3g}'
    return Fault(
        ("time", "scheme"),
        f"{scheme.type} on {contact}: known to create energy at impacts",
        f"for this scheme a penalty of at most {most:.4g} {unit}, {STIFFEST_OTHERS:g} E/h{at_depth}",
        f'time.scheme = "discrete-gradient" (implicit-midpoint where there is no potential), or {softer}; '
        "gates.accept_energy_growth = true runs it as it is",
        (("contact", "stiffness"),),
        "time.scheme with contact",
    )


def refuse_energy_creators(model: Model) -> None:
    """Refuse a combination that is known to create energy, unless the case accepts growth of energy.

    Raises:
        UserError: Found, expected and what to try.
    """
    fault = energy_creator(model)
    if fault is not None and not model.case.gates.accept_energy_growth:
        raise UserError(f"the case has a fault; nothing was run.\n\n{fault}")


def accepted_energy_creators(model: Model) -> list[str]:
    """Return the warning of a combination that is known to create energy and was accepted, or nothing."""
    fault = energy_creator(model)
    if fault is None:
        return []
    return [f"{fault.found}; accepted by name, by gates.accept_energy_growth = true: the gates report, and end nothing"]
