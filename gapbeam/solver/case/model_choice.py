"""The model and the dimension that `model.type = "auto"` stands for: the simplest that fits the scene.

Models are tried from the simplest to the full one, first on a slice, then on the solid where the case leaves
`mesh.dimension` out. A model is taken that no check of cases contradicts and whose range holds the scene.

Beam elements are graded: short in supports, and longer away from them, up to a share of the bending waves.

    h(x) = length of the support / 5 within a support, and at most ln(1.25) |x - x_end| more away from it, where two
    neighbors differ by a factor of 1.25; at most 1/8 of the bending wavelength of the highest frequency of interest

Supports and segments begin and end at nodes. Elements of a number that is given are shared out by 1 / h.

The wavelength is 2 pi / k of a Timoshenko beam at the angular frequency w,

    k^2 = w^2 (1/c^2 + 1/s^2) / 2 + sqrt(w^4 (1/c^2 - 1/s^2)^2 / 4 + w^2 / (c r)^2)

with c^2 = E / rho, s^2 = kappa G / rho, r^2 = I / A: the branch that becomes c r k^2 = w at low frequencies, and waves
of shear above.

Source: Timoshenko (1921), Philosophical Magazine 41, 744-746.

Supports may bring stiffness, damping and yield pressure themselves, per area.

What a case gives for a whole support, in N/m, N s/m and N, is divided by its nominal area, its length times the width
of the beam. The weights of its contact points add up to this area (`contact.formulations.contact_points`).
"""

from __future__ import annotations

from itertools import pairwise
from math import ceil, inf, pi, sqrt

import numpy as np
from numpy.typing import NDArray

from gapbeam.meshes.mesh_size import CellLength
from gapbeam.solver.case.beam_motions import beam_motions
from gapbeam.solver.case.beam_profile import BeamPiece
from gapbeam.solver.case.case import Case, law_at
from gapbeam.solver.case.checks.all_checks import contradictions_in
from gapbeam.solver.case.computed_defaults import lightest_supported, overhang_frequency
from gapbeam.solver.case.solution_tables import (
    ELEMENTS_IN_SUPPORT,
    SPACING_OF_WAVE,
    AutoModel,
    BeamModel,
    FullModel,
    ModelTable,
    ReducedModel,
    RigidModel,
    SceneFigures,
    Wanted,
)
from gapbeam.solver.messages.errors import CaseError, Fault
from gapbeam.solver.supports.regions.around_face import WallsFace
from gapbeam.solver.supports.support_tables import OneSupport


def nominal_area(case: Case, support: OneSupport) -> float:
    """Return the length of a support times the smallest width of the beam in it, m^2."""
    return support.length * min(piece.beam.width for piece in case.profile.between(support.start, support.end))


def line_radii(case: Case) -> tuple[float | None, ...]:
    """Return the radius of the sections that meet flat walls along lines, face by face, m; None: contact has an area.

    Sections do so that keep their round shape at stations along a support, where the pressure follows a law per area
    whose resultant on a line is known.
    """
    return tuple(rolling_radius(case, one) if case.model.rings is not None else None for one in case.layout.by_face)


def rolling_radius(case: Case, support: OneSupport) -> float | None:
    """Return the radius of a round beam in a support of flat walls that it can meet along lines, m; else None."""
    beams = [piece.beam for piece in case.profile.between(support.start, support.end)]
    widths = {beam.width for beam in beams}
    lines = (
        all(isinstance(face, WallsFace) or not face.around for face in support.faces)
        and len(widths) == 1
        and all(beam.section.round for beam in beams)
        and case.mesh.dimension == 3
        and case.mesh.file is None
        and law_at(case.contact, support).rolls
        and case.contact.formulation.follows_the_law
        and support.support_stiffness is None
        and case.contact.points is None
    )
    return 0.5 * widths.pop() if lines else None


def meets_sections(case: Case, support: OneSupport) -> bool:
    """Return whether sections that keep their shape meet a support: around the beam, or along lines."""
    return support.around or rolling_radius(case, support) is not None


def own_stiffness(case: Case, support: OneSupport) -> float | None:
    """Return the stiffness of a support per area, Pa/m^n; None: that of [contact]."""
    whole = support.support_stiffness
    return support.stiffness if whole is None else whole / nominal_area(case, support)


def own_damping(case: Case, support: OneSupport) -> float | None:
    """Return the damping of a support per area, Pa s/m; None: that of [contact], or the one of a law."""
    whole = support.support_damping
    return support.damping if whole is None else whole / nominal_area(case, support)


def bending_wavelength(piece: BeamPiece, frequency: float) -> float:
    """Return the length of bending waves of a frequency, Hz, in a prismatic beam, m."""
    material, beam = piece.material, piece.beam
    omega, nu = 2.0 * pi * frequency, material.poisson_ratio
    kappa = beam.shear_coefficient(nu)
    bar = material.density / material.young_modulus  # 1 / c^2
    shear = bar * 2.0 * (1.0 + nu) / kappa  # 1 / s^2
    mean = 0.5 * omega**2 * (bar + shear)
    square = mean + sqrt((0.5 * omega**2 * (bar - shear)) ** 2 + bar * (omega / beam.gyration_radius) ** 2)
    return 2.0 * pi / sqrt(square)


SAMPLES = 64  # of h in each part of the beam between two ends of supports or segments
ALMOST = 1.0e-9  # of an element: round-off

Array = NDArray[np.float64]


def highest_frequency(case: Case) -> float:
    """Return the highest frequency of interest, Hz."""
    if case.time.frequency:
        return case.time.frequency
    interest = [one[0] for one in (load.frequency_of_interest for load in case.load) if one is not None]
    return max([overhang_frequency(case, 2), *interest])


def resolved_frequency(case: Case) -> float | None:
    """Return the frequency that graded elements or spans of a beam resolve, Hz; None for equal ones marched whole."""
    model = case.model
    if not isinstance(model, BeamModel) or (not model.graded and model.is_whole(len(beam_motions(case)))):
        return None
    return highest_frequency(case)


def graded_count(case: Case) -> int:
    """Return the number of graded elements of a case."""
    _, wanted = _parts(case)
    return sum(max(1, ceil(share - ALMOST)) for share in wanted)


def graded_places(case: Case, elements: int) -> Array:
    """Return the nodes of so many graded elements, (elements + 1,), m.

    Where there are fewer than parts of the beam between ends of supports and segments, those of supports are passed
    over, and each segment has one element at least.
    """
    breaks, wanted = _parts(case)
    if elements < len(wanted):
        kept = [0.0, *case.profile.steps, case.beam.length]
        wanted = np.array([wanted[(breaks[:-1] >= start) & (breaks[:-1] < end)].sum() for start, end in pairwise(kept)])
        breaks = np.array(kept)
    counts = _shared_out(wanted, max(elements, len(wanted)))
    length = _element_length(case)
    places = [np.array([breaks[0]])]
    for (start, end), count in zip(pairwise(breaks), counts, strict=True):
        x = np.linspace(start, end, SAMPLES * max(int(count), 1) + 1)
        passed = _passed(length.between(float(start), float(end)), x)
        inner = np.interp(np.linspace(0.0, passed[-1], int(count) + 1)[1:-1], passed, x)
        places.append(np.concatenate([inner, [end]]))
    return np.concatenate(places)


def longest_element(case: Case, model: BeamModel) -> float:
    """Return the length of the longest element of a beam model, m."""
    if model.graded:
        return float(np.diff(graded_places(case, model.elements)).max())
    return case.beam.length / model.elements


def _parts(case: Case) -> tuple[Array, Array]:
    """Return the ends of supports and segments, (k + 1,), m, and the elements between, (k,)."""
    total = case.beam.length
    ends = [place for one in case.layout.supports for place in (one.start, one.end)]
    inside = {float(place) for place in (*ends, *case.profile.steps) if 0.0 < place < total}
    breaks = np.array([0.0, *sorted(inside), total])
    length = _element_length(case)
    wanted = [
        _passed(length.between(start, end), np.linspace(start, end, SAMPLES + 1))[-1] for start, end in pairwise(breaks)
    ]
    return breaks, np.array(wanted)


def _element_length(case: Case) -> CellLength:
    """Return h."""
    profile, supports = case.profile, case.layout.supports
    highest = highest_frequency(case)
    places = {place for one in supports for place in (one.start, one.end)}
    breaks = sorted({place for place in (*places, *profile.steps) if 0.0 < place < case.beam.length})
    regions, sources = list[tuple[float, float]](), set[tuple[float, float]]()
    for start, end in pairwise([0.0, *breaks, case.beam.length]):
        middle = 0.5 * (start + end)
        within = [one.end - one.start for one in supports if one.start <= middle <= one.end]
        free = SPACING_OF_WAVE * bending_wavelength(profile.at(middle), highest)
        size = min([free, *(span / ELEMENTS_IN_SUPPORT for span in within)])
        regions.append((end, size))
        sources |= {(start, size), (end, size)} if within else set()
    return CellLength(tuple(regions), tuple(sorted(sources)))


def _passed(length: CellLength, x: Array) -> Array:
    """Return the number of elements from the first place to each, by the middles between, (k,)."""
    return np.concatenate([[0.0], np.cumsum(np.diff(x) / length(0.5 * (x[1:] + x[:-1])))])


def _shared_out(wanted: Array, count: int) -> NDArray[np.int64]:
    """Return whole shares of a count, one at least each, about as large as those wanted."""
    free = (count - len(wanted)) * wanted / wanted.sum()
    shares = np.floor(free).astype(np.int64)
    left = count - len(wanted) - int(shares.sum())
    shares[np.argsort(shares - free, kind="stable")[:left]] += 1
    return np.asarray(shares + 1)


LEVELS: tuple[tuple[str, ModelTable], ...] = (
    ("rigid", RigidModel(type="rigid")),
    ("beam", BeamModel(type="beam")),
    ("reduced", ReducedModel(type="reduced")),
    ('reduced with contact = "all"', ReducedModel(type="reduced", contact="all")),
    ("full", FullModel()),
)
"""The models with their names in reasons, the simplest first."""


def chosen_case(case: Case) -> Case:
    """Return a case with the model that "auto" stands for, and why; or what was not given of a beam or a rigid body.

    Raises:
        CaseError: No model fits: what all of them contradict, or else the reasons of each.
    """
    asked = case.model
    if isinstance(asked, BeamModel | RigidModel):
        return case.model_copy(update={"model": asked.fitted(scene_figures(case, "motion"))})
    if not isinstance(asked, AutoModel):
        return case
    wanted, why = _recorded(case) if asked.wanted == "auto" else (asked.wanted, "given in the case")
    reasons = [f"wanted: {wanted}, {why}"]
    refused: list[list[Fault]] = []
    decided = "dimension" in case.mesh.model_fields_set or case.mesh.file is not None
    for dimension in (case.mesh.dimension,) if decided else (2, 3):
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
            fitted = level.fitted(figures)
            lines = figures.rolls and fitted.rings is not None
            added = f"; its sections meet flat walls along lines, {fitted.rings} in each support" if lines else ""
            reasons.append(f"{name} {place}: the simplest model that is left{added}")
            given = fitted.model_copy(update={"reasons": tuple(reasons)})
            return case.model_copy(update={"model": given, "mesh": mesh})
    raise CaseError("", in_common(refused) or [none_fits(reasons)])


def _recorded(case: Case) -> tuple[Wanted, str]:
    """Return the results of interest, by record, and the part of a case that asks for them."""
    found = ["output.stress = true"] if case.output.stress else []
    found += [f"the probe {probe.name} records stress" for probe in case.probe if probe.stress]
    return ("stresses", found[0]) if found else ("motion", "neither probes nor fields record stress")


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
        around=all(meets_sections(case, one) for one in case.layout.supports),
        longest_support=max(one.length for one in case.layout.supports),
        rolls=rolls(case),
    )


def rolls(case: Case) -> bool:
    """Return whether a model whose sections keep their shape meets flat walls along lines, and holes as circles."""
    lines = [rolling_radius(case, one) is not None for one in case.layout.supports]
    others = [one for one, line in zip(case.layout.supports, lines, strict=True) if not line]
    return any(lines) and all(face.circle for one in others for face in one.faces)


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
