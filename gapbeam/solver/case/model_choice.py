"""The model and the dimension that `model.type = "auto"` stands for: the simplest that fits the scene.

Models are tried from the simplest to the full one, first on a slice, then on the solid where the case leaves
`mesh.dimension` out. A model is taken that no check of cases contradicts and whose range holds the scene.
"""

from __future__ import annotations

from math import inf, pi, sqrt

from gapbeam.solver.case.bending_waves import bending_wavelength
from gapbeam.solver.case.case import Case
from gapbeam.solver.case.checks.all_checks import contradictions_in
from gapbeam.solver.case.computed_defaults import lightest_supported, overhang_frequency
from gapbeam.solver.case.element_spacing import graded_count, highest_frequency
from gapbeam.solver.case.model_table import (
    AutoModel,
    BeamModel,
    FullModel,
    ModelTable,
    ReducedModel,
    RigidModel,
    SceneFigures,
    Wanted,
)
from gapbeam.solver.faults import CaseError, Fault

LEVELS: tuple[tuple[str, ModelTable], ...] = (
    ("rigid", RigidModel(type="rigid")),
    ("beam", BeamModel(type="beam")),
    ("reduced", ReducedModel(type="reduced")),
    ('reduced with contact = "all"', ReducedModel(type="reduced", contact="all")),
    ("full", FullModel()),
)
"""The models with their names in reasons, the simplest first."""


def chosen_case(case: Case) -> Case:
    """Return a case with the model that its model "auto" stands for, and why; other cases as they are.

    Raises:
        CaseError: No model fits: what all of them contradict, or else the reasons of each.
    """
    asked = case.model
    if not isinstance(asked, AutoModel):
        return case
    wanted = wanted_of(case) if asked.wanted == "auto" else asked.wanted
    reasons = [f"wanted: {wanted}, " + (why_wanted(case) if asked.wanted == "auto" else "given in the case")]
    refused: list[list[Fault]] = []
    for dimension in dimensions(case):
        mesh = case.mesh.model_copy(update={"dimension": dimension})
        place = "on the solid" if dimension == 3 else "on the slice"
        for name, level in LEVELS:
            plain = case.model_copy(update={"model": level, "mesh": mesh})
            faults = contradictions_in(plain)
            refused.append(faults)
            if faults:
                reasons.append(f"not {name} {place}: {faults[0].found}; expected {faults[0].expected}")
                continue
            figures = scene_figures(plain, wanted)
            doubt = next(level.doubts(figures), None)
            if doubt is not None:
                reasons.append(f"not {name} {place}: {doubt}")
                continue
            reasons.append(f"{name} {place}: the simplest model that is left")
            given = level.fitted(figures).model_copy(update={"reasons": tuple(reasons)})
            return case.model_copy(update={"model": given, "mesh": mesh})
    raise CaseError("", in_common(refused) or [none_fits(reasons)])


def wanted_of(case: Case) -> Wanted:
    """Return the results of interest, by what is recorded."""
    return "stresses" if case.output.stress or any(probe.stress for probe in case.probe) else "motion"


def why_wanted(case: Case) -> str:
    """Return the part of a case that asks for these results."""
    found = ["output.stress = true"] if case.output.stress else []
    found += [f"the probe {probe.name} records stress" for probe in case.probe if probe.stress]
    return found[0] if found else "neither probes nor fields record stress"


def dimensions(case: Case) -> tuple[int, ...]:
    """Return the dimensions to try: one where the case or its mesh file gives it."""
    if "dimension" in case.mesh.model_fields_set or case.mesh.file is not None:
        return (case.mesh.dimension,)
    return (2, 3)


def scene_figures(case: Case, wanted: Wanted) -> SceneFigures:
    """Return the figures that models of a scene are judged by; the model of the case makes no difference."""
    profile = case.profile
    loads = [found for load in case.load if (found := load.forcing_frequency) is not None]
    interest = [one[0] for one in (load.frequency_of_interest for load in case.load) if one is not None]
    highest = highest_frequency(case)
    return SceneFigures(
        wanted=wanted,
        driven=max([contact_frequency(case), *loads, *interest]),
        first_bending=overhang_frequency(case),
        highest=highest,
        length=case.beam.length,
        thickness=profile.thickest,
        wavelength=min(bending_wavelength(piece, highest) for piece in profile.pieces),
        shortest_support=case.layout.shortest,
        squeezed=any(one.clearance < 0.0 for one in case.layout.supports),
        graded=graded_count(case),
        around=all(one.around for one in case.layout.supports),
    )


def contact_frequency(case: Case) -> float:
    """Return the frequency of the supported part of the beam on a given linear contact, Hz; infinite on others."""
    contact = case.contact
    if contact.stiffness == "auto" or contact.points is not None or contact.law.spring_exponent > 1.0:
        return inf
    return sqrt(contact.stiffness / lightest_supported(case).face_mass) / (2.0 * pi)


def in_common(refused: list[list[Fault]]) -> list[Fault]:
    """Return the faults that all models have: those of the scene."""
    first, *others = refused
    keys = [{(fault.key, fault.found) for fault in faults} for faults in others]
    return [fault for fault in first if all((fault.key, fault.found) in known for known in keys)]


def none_fits(reasons: list[str]) -> Fault:
    """Return the fault of a scene that each model refuses for another reason."""
    words = "; ".join(reasons[1:])
    hint = "give the model, and change what it does not take"
    return Fault(("model", "type"), "auto, and no model fits", f"a scene that one of the models takes; {words}", hint)
