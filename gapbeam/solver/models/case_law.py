"""The contact law of a case on a body: one law, or those that supports name, each at its points."""

from __future__ import annotations

import numpy as np

from gapbeam.solver.case.case import Case
from gapbeam.solver.case.computed_defaults import slowest_touch, touch_depth
from gapbeam.solver.case.placed_support import law_at
from gapbeam.solver.contact.laws.chosen_law import ChosenLaw
from gapbeam.solver.contact.laws.contact_law import ContactLaw, make_law
from gapbeam.solver.contact.laws.mixed_law import LawGroup, mixed_law
from gapbeam.solver.contact.laws.shaped_law import shaped_law
from gapbeam.solver.models.contact_setting import ContactSetting
from gapbeam.solver.system.operators import Array, Indices


def law_of_case(case: Case, faces: Indices, setting: ContactSetting) -> ContactLaw:
    """Return the contact law of a case, without friction.

    Args:
        case: The case.
        faces: Index of the face of each contact point, (m,).
        setting: K, c and areas of the points.
    """
    laws = [law_at(case.contact, one) for one in case.layout.supports for _ in one.faces]
    different = list[ChosenLaw]()
    for law in laws:
        if law not in different:
            different.append(law)
    if len(different) == 1:
        return _made(case, different[0], setting.stiffness, setting.damping, setting.areas, setting.nominal)
    owners = np.array([different.index(law) for law in laws])[faces]
    groups = []
    for number, law in enumerate(different):
        points = np.flatnonzero(owners == number)
        parts = (
            _taken(value, points) for value in (setting.stiffness, setting.damping, setting.areas, setting.nominal)
        )
        groups.append(LawGroup(points, _made(case, law, *parts)))
    return mixed_law([group for group in groups if len(group.points) > 0])


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
    made = make_law(
        law, stiffness, touch_depth(case), damping, areas,
        adhesive=adhesive, augmented=augmented, slowest_touch=slowest_touch(case),
    )  # fmt: skip
    return shaped_law(law, made, areas, nominal)


def _taken(value: float | Array, points: Indices) -> float | Array:
    return value[points] if isinstance(value, np.ndarray) else value
