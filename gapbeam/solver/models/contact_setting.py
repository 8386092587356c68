"""Contact law, stiffness, damping and friction at every contact point: from [contact], or from the support itself.

Supports that ask for circles are met at stations, and flat walls along the lines of sections that keep their shape.

The forces and moments with which the joints of a case hold its model.

A spring and damper, and the stiff spring that holds a motion of a full model, pull by -k b u - c b v, b the row of the
motion. Where the model has no unknown for a held motion, its force is the residual of the equation along that motion
(`models.reduction.holds`), with the acceleration that the equation of the other motions has at the same instant:

    a = M^-1 (f + H^T (w p) - C v - K u),    lambda = M_Z a + C_Z v + K_Z u - f_Z - H_Z^T (w p)

What is attached to the body, its damping and the loads on masses come from the same assembly for both.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import csr_matrix

from gapbeam.solver.assembly.assembled_system import assembled_system, hold_stiffness, model_motions
from gapbeam.solver.case.case import Case, law_at, own_law, whole_unit
from gapbeam.solver.case.computed_defaults import (
    Default,
    contact_damping,
    contact_stiffness,
    slowest_touch,
    squeezed_stiffness,
    touch_depth,
)
from gapbeam.solver.case.model_choice import line_radii, nominal_area, own_damping, own_stiffness
from gapbeam.solver.contact.formulations.circle_contact import CircleOperator, circle_contact
from gapbeam.solver.contact.formulations.contact_points import ResultantOperator, sliding_shares, whole_contact
from gapbeam.solver.contact.laws.contact_law import ContactLaw, make_law
from gapbeam.solver.contact.laws.damper import CoulombFriction
from gapbeam.solver.contact.laws.law_choice import KelvinVoigt
from gapbeam.solver.contact.laws.law_tables import ChosenLaw
from gapbeam.solver.contact.laws.line_law import line_law, slower_return
from gapbeam.solver.contact.laws.mixed_law import LawGroup, mixed_law
from gapbeam.solver.loads.places import patterned
from gapbeam.solver.loads.support_walls import hole_shifts
from gapbeam.solver.models.body import Body, HoldingShapes
from gapbeam.solver.models.time_step import compared_stiffness
from gapbeam.solver.supports.support_tables import OneSupport
from gapbeam.solver.system.dense_operators import DenseOperators
from gapbeam.solver.system.operators import Array, Indices, Reactions
from gapbeam.solver.system.semi_discrete import ContactOperator, SemiDiscreteSystem


def reactions_of(case: Case, body: Body, system: SemiDiscreteSystem) -> Reactions | None:
    """Return the reactions of all joints, motion by motion of the model, 0 for motions that are free; None: no joints.

    Args:
        case: The case.
        body: Its body.
        system: Its system.
    """
    if not case.joint:
        return None
    motions = model_motions(case)
    parts: dict[str, list[Array]] = {name: [] for name in ("displacement", "velocity", "loads", "pressure", "friction")}
    dimension = body.meshed.space.mesh.geometry.dim
    held = None if body.holding is None else _held(case, body, body.holding, system, dimension)
    nothing = Reactions(*(np.zeros(length) for length in _lengths(system)))
    rows, taken = iter(body.patterns[len(patterned(case.load)) :]), 0
    for joint in case.joint:
        found = {one.motion.name: one for one in joint.attached()}
        for name in motions:
            one = found.get(name)
            row = nothing
            if one is not None and one.held and held is not None:
                row, taken = held[taken], taken + 1
                next(rows)
            elif one is not None:
                spring, damper = one.attachment.stiffness, one.attachment.damping
                if one.held:
                    spring = hold_stiffness(case, one)
                    damper = system.stiffness_damping * spring
                pattern = next(rows)
                row = Reactions(-spring * pattern, -damper * pattern, nothing.loads, nothing.pressure, nothing.friction)
            for part, values in parts.items():
                values.append(getattr(row, part))
    found_rows = {part: np.array(values) for part, values in parts.items()}
    if not isinstance(system.operators, DenseOperators):
        sparse = {part: csr_matrix(found_rows[part]) for part in ("displacement", "velocity")}
        return Reactions(**(found_rows | sparse))
    return Reactions(**found_rows)


def _lengths(system: SemiDiscreteSystem) -> tuple[int, ...]:
    contact, size = system.contact, system.operators.size
    return size, size, len(system.loads), contact.size, contact.friction_resultants.shape[1]


def _held(
    case: Case, body: Body, holding: HoldingShapes, system: SemiDiscreteSystem, dimension: int
) -> list[Reactions]:
    """Return the rows of motions that joints hold, one after the other."""
    operators, beam, contact = system.operators, body.operators, system.contact
    assert isinstance(operators, DenseOperators)
    assert isinstance(beam, DenseOperators)
    size, count = operators.size, len(holding.mass)
    damping = case.damping.model_copy(update={"ratio": None})
    whole = assembled_system(
        case.model_copy(update={"damping": damping}),
        DenseOperators(_bordered(beam.mass, holding.mass), _bordered(beam.stiffness, holding.stiffness)),
        contact,
        [np.concatenate(pair) for pair in zip(body.patterns, holding.patterns.T, strict=True)],
        dimension,
        (system.mass_damping, system.stiffness_damping),
    )
    assert isinstance(whole.operators, DenseOperators)
    inertia = np.linalg.solve(whole.operators.mass[:size, :size], whole.operators.mass[:size, size:]).T

    def residual(rows: Array) -> Array:
        return np.asarray(rows[size:] - inertia @ rows[:size])

    stiffness = residual(whole.operators.stiffness[:, :size])
    damper = system.stiffness_damping * stiffness  # what is proportional to M, such as modal damping, leaves nothing
    if whole.dashpots is not None:
        damper = damper + residual(whole.dashpots.matrix[:, :size])
    loads = np.array([load.pattern for load in whole.loads]).reshape(len(whole.loads), size + count).T
    here = inertia[:, contact.interface.owned]
    pressed, rubbed = (
        np.asarray(matrix[contact.interface.slots].T @ here.T).T
        for matrix in (contact.resultants, contact.friction_resultants)
    )
    parts = (
        stiffness,
        damper,
        -residual(loads),
        pressed - holding.pressure,
        rubbed - holding.friction,
    )
    return [Reactions(*rows) for rows in zip(*parts, strict=True)]


def _bordered(matrix: Array, rows: Array) -> Array:
    """Return a symmetric matrix (n, n) with further rows and columns; where these meet, ones that nothing asks for."""
    return np.block([[matrix, rows.T], [rows, np.identity(len(rows))]])


@dataclass(frozen=True)
class ContactSetting:
    """Stiffness and damping of the contact law at the points, and their scales.

    Attributes:
        stiffness: K of the law: one number, or one of each point, (m,), as with Nitsche's gamma.
        defaults: Values that were computed, with their reasons.
        face_stiffness: K of all points of the stiffest face together, compared as the law of [contact], N/m^n.
        damping: c of the law kelvin-voigt: one number, or one of each point, (m,).
        areas: Divisors of K and c, (m,), m^2; 1 where they are per area.
        nominal: Divisor of a yield force of whole supports: one number, or one of each point, (m,), m^2.
    """

    stiffness: float | Array
    defaults: tuple[Default, ...]
    face_stiffness: float
    damping: float | Array = 0.0
    areas: float | Array = 1.0
    nominal: float | Array = 1.0


def contact_setting(case: Case, body: Body) -> ContactSetting:
    """Return the values of the law of a case on a body."""
    terms, face = case.contact.formulation.stress_terms, body.contact.support.face_area
    if terms is not None:
        assert body.gamma is not None
        reason = f"{terms.factor:g} times the largest eigenvalue of the trace problem of the contact cells"
        consequence = "half: at the edge of stability for theta = 1; double: stiffer contact, the same answer to O(h)"
        largest = float(body.gamma.max())
        gamma = Default("Nitsche's gamma", largest, "Pa/m", reason, consequence)
        return ContactSetting(body.gamma, (gamma,), face * largest)
    stiffness, damping, defaults = _law_of_faces(case, body, face)
    points, places = _at_points(stiffness, body), case.contact.points
    laws = [law_at(case.contact, one) for one in case.layout.by_face]
    stiffest = max(compared_stiffness(case, one, law) for one, law in zip(stiffness, laws, strict=True))
    if places is None:
        nominal = [nominal_area(case, one) for one in case.layout.by_face]
        return ContactSetting(
            points, defaults, face * stiffest, _at_points(damping, body), nominal=_at_points(nominal, body)
        )
    assert body.patch is not None
    whole = len(places) * stiffest
    return ContactSetting(points, (*defaults, body.patch), whole, _at_points(damping, body), body.contact.weights)


def friction_of(case: Case, body: Body, slip_velocity: float) -> CoulombFriction:
    """Return the law of friction: coefficients are one number, or one of each point, (m,)."""
    usual = case.contact.usual_friction
    coefficients, static = list[float](), list[float]()
    for own, own_static in zip(case.layout.own("friction"), case.layout.own("static_friction"), strict=True):
        sliding, sticking = usual.at_support(own, own_static)
        coefficients.append(sliding)
        static.append(sticking)
    plain = CoulombFriction(_at_points(coefficients, body), slip_velocity)
    return plain if static == coefficients else replace(plain, static_coefficient=_at_points(static, body))


def _law_of_faces(case: Case, body: Body, face: float) -> tuple[list[float], list[float], tuple[Default, ...]]:
    """Return K and c of each face, and the values that were computed or that supports bring themselves."""
    usual = squeezed_stiffness(case) or contact_stiffness(case, body.meshed.facet_length, face)
    owners = case.layout.by_face
    stiffness = [usual.value if (own := own_stiffness(case, one)) is None else own for one in owners]
    asked = [_damping_of_face(case, *face) for face in zip(stiffness, owners, line_radii(case), strict=True)]
    damping = []
    for computed, own in zip(asked, (own_damping(case, one) for one in owners), strict=True):
        damping.append(own if own is not None else case.contact.damping if computed is None else computed.value)
    of_supports = {one.name: computed for one, computed in zip(owners, asked, strict=True)}
    shared = [] if all(one.brings_stiffness for one in owners) else [usual]
    plain = [of_supports[one.name] for one in owners if not _stands_alone(one)]
    shared += [computed for computed in plain[:1] if computed is not None]
    brought = [default for one in case.layout.supports for default in _own(case, one, of_supports[one.name])]
    return stiffness, damping, (*shared, *brought)


def _damping_of_face(case: Case, stiffness: float, support: OneSupport, radius: float | None) -> Default | None:
    """Return the damping that the law of a face asks for; on a line of contact with the speed that it takes besides."""
    found, law = contact_damping(case, stiffness, support), law_at(case.contact, support)
    if found is None or radius is None or not isinstance(law, KelvinVoigt) or law.restitution is None:
        return found
    if case.contact.tension == "adhesive":
        return found  # nothing is clipped: strip and points are the same
    slower = f"{100.0 * slower_return(law.restitution):.2g} %"
    words = f"on lines of contact, clipped as a whole, a section comes back about {slower} slower than from points"
    return replace(found, reason=f"{found.reason}; {words}")


def _own(case: Case, support: OneSupport, damping: Default | None) -> Iterator[Default]:
    """Yield the stiffness that a support brings, and the damping that is computed for its stiffness or its body."""
    key = f"support.{support.name}"
    if support.stiffness is not None:
        unit = case.contact.unit_with(law_at(case.contact, support))
        yield Default(f"{key}.stiffness", support.stiffness, unit, "given in the case")
    if support.support_stiffness is not None:
        law = law_at(case.contact, support)
        name, unit = f"{key}.support_stiffness", whole_unit(law)
        per_area = f"{own_stiffness(case, support):.4g} {case.contact.unit_with(law)}"
        reason = f"given in the case; {per_area} over {nominal_area(case, support):.4g} m^2, length times width"
        yield Default(name, support.support_stiffness, unit, reason)
    if _stands_alone(support) and damping is not None and own_damping(case, support) is None:
        yield replace(damping, key=f"{key}.damping")


def _stands_alone(support: OneSupport) -> bool:
    """Return whether a support has another damping than a restitution in [contact] asks for."""
    return support.brings_stiffness or support.body is not None or own_law(support) is not None


def _at_points(values: list[float], body: Body) -> float | Array:
    """Return a value of each face at the contact points, (m,); one number where all are the same."""
    return values[0] if len(set(values)) == 1 else np.array(values)[body.contact.faces]


def met_along_lines(case: Case, body: Body) -> Body:
    """Return a body with one contact point for each flat wall at each station, where lines are met; or the same."""
    areas = [
        None if radius is None else nominal_area(case, one)
        for radius, one in zip(line_radii(case), case.layout.by_face, strict=True)
    ]
    contact, holding = whole_contact(body.contact, areas, on_lines=True), body.holding
    if holding is not None and isinstance(contact, ResultantOperator) and contact.distributed is body.contact:
        friction = holding.friction
        if friction.shape[1]:
            friction = friction @ sliding_shares(contact.shares, friction.shape[1] // body.contact.size).T
        holding = replace(holding, pressure=holding.pressure @ contact.shares.T, friction=friction)
    return replace(body, contact=contact, holding=holding)


def met_as_circles(body: Body) -> Body:
    """Return a body with stations instead of the points around its sections where a support is met as a circle.

    Raises:
        UserError: The sections there do not keep their shape.
    """
    exact = [face.circle for face in body.contact.support.faces]
    if not any(exact):
        return body
    return replace(body, contact=circle_contact(body.contact, exact, not body.case.model.keeps_sections))


def with_moving_holes(case: Case, contact: ContactOperator, dimension: int) -> ContactOperator:
    """Return an operator whose stations know how loads of a case move and open their holes: itself without stations."""
    if not isinstance(contact, CircleOperator) or not contact.walls.motions:
        return contact
    shifts = hole_shifts(case.load, case.layout, contact, dimension)
    return replace(contact, circles=replace(contact.circles, shifts=shifts))


def station_reactions(case: Case, body: Body, system: SemiDiscreteSystem) -> Reactions | None:
    """Return the reactions of all joints as `reactions_of` does, for contact at stations as well.

    Args:
        case: The case.
        body: Its body, with contact points around its sections.
        system: Its system.
    """
    contact = system.contact
    if not isinstance(contact, CircleOperator):
        return reactions_of(case, body, system)
    found = reactions_of(case, body, replace(system, contact=contact.around))
    return None if found is None else contact.reactions(found)


def law_of_case(case: Case, faces: Indices, setting: ContactSetting) -> ContactLaw:
    """Return the contact law of a case, without friction.

    Args:
        case: The case.
        faces: Index of the face of each contact point, (m,).
        setting: K, c and areas of the points.
    """
    laws = [law_at(case.contact, one) for one in case.layout.by_face]
    met = list(zip(laws, line_radii(case), strict=True))
    different = [one for number, one in enumerate(met) if one not in met[:number]]
    owners = np.array([different.index(one) for one in met])[faces]
    groups = []
    for number, (law, radius) in enumerate(different):
        points = np.flatnonzero(owners == number)
        values = setting.stiffness, setting.damping, setting.areas, setting.nominal
        made = _made(case, law, *(value[points] if isinstance(value, np.ndarray) else value for value in values))
        groups.append(LawGroup(points, made if radius is None else line_law(made, radius)))
    found = [group for group in groups if len(group.points) > 0]
    return mixed_law(found) if len(different) > 1 else found[0].law


def _made(
    case: Case,
    law: ChosenLaw,
    stiffness: float | Array,
    damping: float | Array,
    areas: float | Array,
    nominal: float | Array,
) -> ContactLaw:
    contact = case.contact
    adhesive, augmented = contact.tension == "adhesive", contact.formulation.left_by_multipliers
    return make_law(
        law, stiffness, touch_depth(case), damping, areas,
        adhesive=adhesive, augmented=augmented, slowest_touch=slowest_touch(case), nominal=nominal,
    )  # fmt: skip
