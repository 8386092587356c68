"""Combinations of scheme and contact that are known to create energy: refused unless the case accepts them by name."""

from __future__ import annotations

import numpy as np

from gapbeam.solver.case.case import Case, law_at
from gapbeam.solver.case.computed_defaults import contact_modulus, slowest_touch, stiffness_unit
from gapbeam.solver.case.model_choice import nominal_area, own_stiffness
from gapbeam.solver.integrators.stable_step import stable_step
from gapbeam.solver.messages.errors import Fault, UserError
from gapbeam.solver.models.model import Model
from gapbeam.solver.models.time_step import slope_factor
from gapbeam.solver.schema.table import type_name
from gapbeam.solver.supports.layout import stiffness_key
from gapbeam.solver.supports.support_tables import OneSupport

ROUNDED = 1.0e-3  # of a stiffness: what is lost by writing it with a few digits


def energy_creator(model: Model) -> Fault | None:
    """Return the fault of a scheme on a contact on which it is known to create energy, or None.

    The contact is too stiff where the slope of its law is above 1 E/h, for laws with an exponent at a depth of 1 % of
    the clearance (1e-4 of the thickness where that is 0), and where the formulation is exact: unilateral,
    augmented-lagrangian and nitsche. An explicit step does not bear a damper whose coefficient grows as the speed at
    touch goes to zero.
    """
    case, scheme = model.case, model.scheme
    formulation = case.contact.formulation
    massless = case.contact.mass == "redistributed"
    if not scheme.creates_energy_on(massless):
        return None
    if scheme.excess is not None:
        found, expected, advice = scheme.excess
        runs = "gates.accept_energy_growth = true runs it anyway"
        return Fault(("time", "scheme"), f"{found}: known to make energy at impacts", expected, f"{advice}; {runs}")
    if scheme.explicit and (fault := _damped_by_touch(case, model)) is not None:
        return fault
    stiffest = scheme.contact_range_on(massless).stiffest
    modulus, factor = contact_modulus(case), slope_factor(case)
    length = model.body.meshed.facet_length
    body = modulus / length
    share, most = model.support.stiffness_per_area * factor / body, stiffest * body / factor
    words = f"E = {modulus:.3g} Pa, h = {length:.3g} m"
    at_depth = f" at a depth of {model.compared_depth:.2g} m" if factor != 1.0 else ""
    unit = stiffness_unit(case)
    if formulation.follows_the_law:
        if share <= (1.0 + ROUNDED) * stiffest:
            return None
        contact = f"a contact of {model.support.stiffness_per_area:.4g} {unit}, {share:.3g} E/h{at_depth} ({words})"
        softer = _softest_of_stiffest(case, model, stiffest * body)
    else:
        # multipliers stand on a soft penalty
        stiff = f" and as stiff as {share:.3g} E/h" if formulation.left_by_multipliers is None else ""
        contact = f"the formulation {formulation.type}, which is exact{stiff} ({words})"
        softer = f'contact.formulation = "penalty" with contact.stiffness = {most:.3g}'
    return Fault(
        ("time", "scheme"),
        f"{scheme.type} on {contact}: known to create energy at impacts",
        f"for this scheme a penalty of at most {most:.4g} {unit}, {stiffest:g} E/h{at_depth}",
        f'time.scheme = "discrete-gradient" (implicit-midpoint where there is no potential), or {softer}; '
        "gates.accept_energy_growth = true runs it anyway",
        (("contact", "stiffness"),),
        "time.scheme with contact",
    )


def _softest_of_stiffest(case: Case, model: Model, slope: float) -> str:
    """Return the key of the stiffest contact with the value that has a slope, Pa/m, at `compared_depth`, in words."""
    points = case.contact.points
    usual = next((default.value for default in model.defaults if default.key == "contact.stiffness"), 0.0)

    def slope_at(support: OneSupport) -> float:
        own = own_stiffness(case, support)
        return (usual if own is None else own) * slope_factor(case, law_at(case.contact, support))

    support = max(case.layout.supports, key=slope_at)
    area = 1.0 if support.support_stiffness is None else nominal_area(case, support)
    if points is not None:
        area = model.system.contact.area / (len(model.support.faces) * len(points))
    return f"{stiffness_key(support)} = {area * slope / slope_factor(case, law_at(case.contact, support)):.3g}"


def _damped_by_touch(case: Case, model: Model) -> Fault | None:
    """Return the fault of explicit steps where mass meets contact that is damped by the speed at touch, or None.

    The stable step does not count such damping: it would be too short for all but the slowest touch.
    """
    laws = [law_at(case.contact, support) for support in case.layout.supports]
    damped = next((law for law in laws if law.by_touch_speed and law.dissipates), None)
    if damped is None:
        return None
    slow = model.law.touched_at(np.zeros(model.system.contact.size))
    bearable = stable_step(model.system, slow, model.compared_depth)
    if model.step <= bearable.step:
        return None
    return Fault(
        ("time", "scheme"),
        f"{case.time.scheme.type} on the law {type_name(type(damped))}, whose damping grows as the speed at touch "
        "falls: known to create energy where the beam rests or touches slowly",
        f"steps of at most {bearable.written} s, which bear contact that begins at {slowest_touch(case):.2g} m/s and "
        f"is {model.compared_depth:.2g} m deep; an implicit scheme, massless contact nodes, or a damper with a given "
        "coefficient",
        'time.scheme = "discrete-gradient", contact.mass = "redistributed", or contact.law = "kelvin-voigt"; '
        "gates.accept_energy_growth = true runs it anyway",
        (("contact", "law"),),
        "time.scheme with contact",
    )


def refuse_energy_creators(case: Case, model: Model) -> None:
    """Refuse a combination that is known to create energy, unless the case accepts growth of energy.

    Raises:
        UserError: The scheme may create energy; the message has what was found, expected and to be tried.
    """
    fault = energy_creator(model)
    if fault is not None and not case.gates.accept_energy_growth:
        raise UserError(f"the case has a fault; nothing was run.\n\n{fault}")


def accepted_energy_creators(model: Model) -> list[str]:
    """Return the warning of a combination that is known to create energy and was accepted, or nothing."""
    fault = energy_creator(model)
    if fault is None:
        return []
    return [f"{fault.found}; accepted by name, by gates.accept_energy_growth = true: the gates report, and end nothing"]
