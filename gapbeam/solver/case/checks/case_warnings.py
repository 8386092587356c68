"""Warnings about a valid case: choices that are probably not meant, cost more or show less than expected.

A value beyond what is usual, or beside another value that it does not fit, brings the question whether it is in another
unit. It is never a fault: cases of unusual size and material are allowed.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from itertools import chain

import numpy as np

from gapbeam.solver.case.beam_profile import Segment
from gapbeam.solver.case.case import Case, damps, law_at
from gapbeam.solver.case.checks.contact_checks import idle_keys
from gapbeam.solver.case.checks.run_checks import MULTIPLE_TOLERANCE
from gapbeam.solver.case.checks.usual_ranges import (
    MUCH_PLAY,
    NAMED,
    USUAL,
    asked,
    damping_questions,
    in_si,
    load_warnings,
    material_questions,
    play_question,
    shape_questions,
    step_warnings,
)
from gapbeam.solver.case.computed_defaults import contact_patch, overhang_frequency
from gapbeam.solver.case.model_choice import bending_wavelength, graded_count
from gapbeam.solver.case.solution_tables import BeamModel, RigidModel
from gapbeam.solver.loads.attachments import bending_rank
from gapbeam.solver.loads.load_choice import Load
from gapbeam.solver.messages.wording import apart, exceeds
from gapbeam.solver.supports.layout import keyed

LEAST_YIELD = 1e5  # Pa
SLOW = 1.0  # Hz
FAINT = (1e-3, 3e-2)  # m/s^2: gravity of moons and planets a thousand times too small
MOST_TILT = 3.0  # degrees: the cosine of a small rotation is 1 within 0.14 %


def unit_questions(case: Case) -> Iterator[str]:
    """Yield values that look like another unit, one line each; of a case that names its units, unusual ones alone."""
    for usual in USUAL:
        value = getattr(getattr(case, usual.table), usual.key)
        yield from asked(f"[{usual.table}]", usual, value, case.units is not None)
        segments: tuple[Segment, ...] = case.segment
        for number, segment in enumerate(segments, 1):
            own = getattr(segment, usual.key, None)
            if usual.key != "length" and own is not None:
                place = f'[[segment]] number {number} (name "{segment.name}")'
                yield from asked(place, usual, own, case.units is not None)
    if case.units is None:
        yield from _shape(case)
        yield from _material(case)
        yield from _clearances(case)
    else:
        yield from _weight(case)
    yield from _damping(case)
    yield from _frequencies(case)


def _shape(case: Case) -> Iterator[str]:
    """Ask about the section beside the length."""
    yield from shape_questions("[beam]", case.beam.length, case.beam.thickness, case.beam.width)


def _material(case: Case) -> Iterator[str]:
    """Ask about a modulus too small for the density, and a yield stress too small for any material."""
    material = case.material
    yield from material_questions("[material]", material.young_modulus, material.density)
    stress = material.yield_stress
    if stress is not None and stress < LEAST_YIELD:
        yield (
            f"[material] yield_stress = {stress:g} is unusual; the unit is Pa: is it in MPa, {in_si(1e6 * stress)} Pa?"
        )


def _clearances(case: Case) -> Iterator[str]:
    """Ask about play of several thicknesses; of several supports about the first."""
    large = []
    for key, support in keyed(case.support):
        thickness = case.profile.at(0.5 * (support.start + support.end)).beam.thickness
        if exceeds(abs(support.clearance), MUCH_PLAY * thickness):
            large.append((key, support, thickness))
    for key, support, thickness in large[:1]:
        place = "[support]" if len(key) == 1 else f'[[support]] number {int(key[1]) + 1} (name "{support.name}")'
        place += f", and {len(large) - 1} after it:" if large[1:] else ""
        yield play_question(place, support.clearance, thickness)


def _weight(case: Case) -> Iterator[str]:
    """Ask about gravity that would be one of a planet in mm/s^2."""
    for number, load in enumerate(case.load, 1):
        if FAINT[0] <= load.weight_acceleration <= FAINT[1]:
            yield (
                f'[[load]] number {number} (name "{load.name}") acceleration: {load.weight_acceleration:g} m/s^2 is '
                f"unusual; {NAMED}"
            )


def _damping(case: Case) -> Iterator[str]:
    """Ask about half of the critical damping and more."""
    damping = case.damping
    for key, values in (("ratios", damping.ratios or ()), ("ratio", (damping.ratio,) if damping.ratio else ())):
        largest = max(values, default=0.0)
        yield from damping_questions(f"[damping] {key}", largest)


def _frequencies(case: Case) -> Iterator[str]:
    """Ask about slow loads of which the run has no whole period; short runs with fast loads are usual."""
    for number, load in enumerate(case.load, 1):
        frequency = load.forcing_frequency
        if frequency is not None and frequency <= SLOW and frequency * case.time.end < 1.0 - 1e-9:
            period, end = apart(1.0 / frequency, case.time.end)
            yield (
                f'[[load]] number {number} (name "{load.name}") frequency = {frequency:g}: its period, '
                f"{period} s, is longer than the run, {end} s: is it in kHz, "
                f"{in_si(1e3 * frequency)} Hz, or time.end too short?"
            )


FEWEST_ELEMENTS = 5  # of a beam in its support
MOST_UNKNOWNS = 1e6
FIXED_NORMALS = 0.01  # clearance over radius, up to which forces act along the radii of the beam
MOST_STEPS = 1e7
MOST_FIELDS = 1e4


def warnings(case: Case) -> list[str]:
    """Return the warnings about a case without faults, one line each."""
    return [line for look in LOOKS for line in look(case)]


def beam_elements(case: Case) -> Iterator[str]:
    """Yield beam elements too long for the support."""
    if not isinstance(case.model, BeamModel):
        return
    if case.model.graded:
        asked = graded_count(case)
        if 2 * case.model.elements < asked:
            yield (
                f"[model] elements = {case.model.elements} graded ones are few where the beam is pressed; try "
                f"elements = {asked}"
            )
        return
    in_support = case.model.elements * case.layout.shortest / case.beam.length
    if in_support < FEWEST_ELEMENTS * (1.0 - MULTIPLE_TOLERANCE):
        enough = math.ceil(FEWEST_ELEMENTS * case.beam.length / case.layout.shortest)
        yield (
            f"[model] elements = {case.model.elements} leaves {in_support:.2g} of them to the support, too few for "
            f"where the beam is pressed; try elements = {enough}, or elements = {graded_count(case)} with "
            'spacing = "graded"'
        )


def unusual_loads(case: Case) -> Iterator[str]:
    """Yield values of loads that look like another unit."""
    speed = math.sqrt(case.material.young_modulus / case.material.density)
    yield from load_warnings(
        case.load, lambda load: chain(load.unusual_values(), load.unusual_shaking(speed, case.beam.length))
    )


def waves(case: Case) -> Iterator[str]:
    """Yield loads along the beam that do not follow its bending waves."""

    def look(load: Load) -> Iterator[str]:
        if (span := load.extent) is None or (asked := load.frequency_of_interest) is None:
            return
        loaded = [piece for piece in case.profile.pieces if piece.start < span[1] and piece.end > span[0]]
        yield from load.unusual_waves(0.5 * min(bending_wavelength(piece, asked[0]) for piece in loaded))

    yield from load_warnings(case.load, look)


def shape(case: Case) -> Iterator[str]:
    """Yield a beam that is not slender, and a clearance that is not small: of several supports the worst."""
    profile = case.profile
    if profile.thinnest > case.beam.length / 5:
        yield f"[beam] thickness = {profile.thinnest:g} m is over a fifth of the length: this is hardly a beam"
    turns = not any(one.held and one.motion.turns for joint in case.joint for one in joint.attached())
    turns = turns and bending_rank(case.joint, held_only=True) < 2
    tilted, off, squeezed = (list[tuple[float, str, str]]() for _ in range(3))  # size, place and words of each
    for key, support in keyed(case.support):
        beam = profile.at(0.5 * (support.start + support.end)).beam
        place = "[support]" if len(key) == 1 else f'[[support]] number {int(key[1]) + 1} (name "{support.name}")'
        around = support.length if len(key) == 1 else max(support.length, case.layout.reach)
        arms = [abs(joint.point - x) for joint in case.joint for x in (support.start, support.end)]
        tilt = math.degrees(math.atan2(support.clearance, max([around, *arms])))
        if turns and tilt > MOST_TILT:
            words = (
                f"clearance = {support.clearance:g} m lets the beam tilt by {tilt:.2g} degrees; "
                f"the equations are those of small rotations{'' if case.units else ', and the unit is m, not mm'}"
            )
            tilted.append((tilt, place, words))
        if support.around and support.met_region.along_radii:
            share = (abs(support.clearance) + support.region.recess) / (0.5 * beam.thickness)
            if share > FIXED_NORMALS:
                words = (
                    f"leaves the beam up to {100 * share:.2g} % of its radius: forces "
                    f"in the {support.region.type} act along radii of the beam, which is up to {share:.2g} rad off"
                )
                off.append((share, place, words))
        if support.clearance < -0.01 * beam.thickness:
            strain = -support.clearance / beam.thickness
            words = f"clearance = {support.clearance:g} m squeezes the beam by {100 * strain:.2g} %"
            squeezed.append((strain, place, words))
    for found in (tilted, off, squeezed):
        if found:
            _, place, words = max(found, key=lambda one: one[0])
            yield f"{place}{f', and {len(found) - 1} more:' if found[1:] else ''} {words}"


def motion(case: Case) -> Iterator[str]:
    """Yield a case in which nothing moves, holds, fades or is looked at."""
    falls = not case.analysis.needs_seat or any(getattr(case.analysis, key, None) for key in ("motion", "mode"))
    bodies = [one.body for one in case.layout.supports if one.body is not None]
    falls = falls or any(one.velocity != 0.0 or one.displacement != 0.0 for one in bodies)
    if all(load.static for load in case.load) and not falls:
        kind = "gravity" if all(load.weight_acceleration for load in case.load) else "static loads"
        yield f"no load but {kind}: the beam stays on its seat, nothing sets it in motion"
    pressed = any((load.static and load.peak) or load.static_force is not None for load in case.load)
    held = bending_rank(case.joint, held_only=False) == 2
    if case.analysis.needs_seat and not (pressed or held) and case.layout.interference == 0.0:
        yield "no gravity: nothing seats the beam on the base before it moves"
    damping = case.damping
    dampers = [added.damping for load in case.load if (added := load.attachment) is not None]
    dampers += [one.attachment.damping for entry in (*case.joint, *case.fluid) for one in entry.attached()]
    dampers += [support.body.damping for support in case.layout.supports if support.body is not None]
    dampers += [case.friction is not None]
    given = [*(damping.ratios or ()), damping.mass, damping.stiffness, damping.ratio, *dampers]
    if not any(given) and not any(damps(case.contact, one) for one in case.layout.supports):
        yield "no damping, neither in [damping] nor in contact: motion never fades, and no steady state is reached"
    if not case.probe:
        yield "no [[probe]]: no motion of any point is recorded"


def start(case: Case) -> Iterator[str]:
    """Yield loads that start with a jump, that never reach their amplitude, or whose record does not suit the run."""
    yield from load_warnings(case.load, lambda load: load.unusual_in_run(case.time.end))


def steps(case: Case) -> Iterator[str]:
    """Yield steps that are coarse for the forcing or for bending, that are many, or that miss the end."""
    time = case.time
    if time.step == "auto":
        return
    periods = dict[str, float]()
    if not isinstance(case.model, RigidModel):
        periods["first bending mode"] = 1 / overhang_frequency(case)
    if time.frequency:
        periods["time.frequency"] = 1 / time.frequency
    yield from step_warnings(case.load, time.step, periods)
    count = time.end / time.step
    if count > MOST_STEPS:
        yield f"[time] {count:.3g} steps until the end: this takes long"
    if abs(count - round(count)) > MULTIPLE_TOLERANCE:
        yield f"[time] end = {time.end:g} is not a whole number of steps; the run ends within a step of it"


def scheme(case: Case) -> Iterator[str]:
    """Yield schemes that create energy at impacts or are stable only with tiny steps."""
    for words in case.time.scheme.warnings():
        yield f"[time.scheme] {words}"


def contact(case: Case) -> Iterator[str]:
    """Yield a contact that is soft for its clearance, or keys of it without effect."""
    clearance, law = case.layout.clearance, case.contact
    yield from weight_on_contact(case)
    yield from chords(case)
    idle = idle_keys(law, case.layout)
    if idle:
        yield f"[contact] {' and '.join(idle)} {'acts' if len(idle) == 1 else 'act'} at no support: each brings its own"
    if law.tension == "adhesive" and not any(damps(law, one) for one in case.layout.supports):
        yield '[contact] tension = "adhesive" has no effect without damping'
    if law.quadrature_degree is not None and law.quadrature_degree < 2 * case.mesh.degree:
        yield f"[contact] quadrature_degree = {law.quadrature_degree} is low: {2 * case.mesh.degree} or more"
    patch, cell = (
        contact_patch(case).value,
        case.mesh.support_size or case.profile.supported(case.layout)[0].beam.thickness / 3,
    )
    if law.points and case.mesh.file is None and patch < cell:
        yield (
            f"[contact] points: patches of {patch:.3g} m are smaller than the cells of {cell:.3g} m, which then decide "
            f"how far the body gives way; mesh.support_size = {0.5 * patch:.3g} is fine enough"
        )
    if law.points and case.mesh.dimension == 3 and not holds_rolling(law.points):
        yield (
            "[contact] points lie on one line: only the weak lateral restraint holds the beam against rolling; "
            "corners hold it, [x, y] at both sides"
        )
    if law.touch_depth != "auto" and 0 < clearance < 10 * law.touch_depth:
        yield f"[contact] touch_depth = {law.touch_depth:g} is not small compared with the clearance"
    if case.mesh.dimension == 2 and case.restraint.lateral != "auto":
        yield "[restraint] lateral has no effect in 2D"


def weight_on_contact(case: Case) -> Iterator[str]:
    """Yield stiffnesses that the weight of the beam presses deep into, where contact alone carries it."""
    if bending_rank(case.joint, held_only=False) > 0:
        return
    seen = set()
    for key, support in keyed(case.support):
        own = support.stiffness is not None
        stiffness, law = support.stiffness if own else case.contact.stiffness, law_at(case.contact, support)
        if support.support_stiffness is not None:
            continue
        if stiffness is None or stiffness == "auto" or not any(face.carries for face in support.faces):
            continue
        held = case.profile.at(0.5 * (support.start + support.end)).beam
        points = case.contact.points
        share = held.width * case.layout.length / len(points) if points else 1.0
        depth = float((share * weight_pressure(case) / stiffness) ** (1.0 / law.spring_exponent))
        place = f'[[support]] number {int(key[1]) + 1} (name "{support.name}")' if own else "[contact]"
        if place in seen:
            continue
        unit = case.contact.unit_with(law)
        if depth > held.thickness:
            seen.add(place)
            yield (
                f"{place} stiffness = {stiffness:g} {unit}: the weight pushes the beam {depth:.2g} m in, more than its "
                'thickness: is it N/m? That is support_stiffness, of a whole [[support]]; "auto" computes it'
            )
        elif depth > 0.1 * support.clearance > 0.0:
            seen.add(place)
            yield (
                f"{place} stiffness = {stiffness:g}: the weight presses the beam {depth:.2g} m into it, "
                "more than a tenth of the clearance"
            )


def chords(case: Case) -> Iterator[str]:
    """Yield stiffnesses per area of planes under round sections, which touch along a chord that grows with depth."""
    for key, support in keyed(case.support):
        beam = case.profile.at(0.5 * (support.start + support.end)).beam
        if support.stiffness is None or support.around or not beam.section.round:
            continue
        if law_at(case.contact, support).spring_exponent == 1.0:
            whole = support.stiffness * support.length * beam.width
            yield (
                f'[[support]] number {int(key[1]) + 1} (name "{support.name}") stiffness = {support.stiffness:g} Pa/m '
                "acts per area, and a plane touches a round section along a chord that grows with the depth: the force "
                f"is not proportional to the depth; support_stiffness = {whole:.6g} N/m would be that of its length "
                "times width"
            )


def holds_rolling(points: Sequence[float | tuple[float, float]]) -> bool:
    """Return whether points of a face do not all lie on one line; a patch over the width acts at y = 0."""
    places = np.array([point if isinstance(point, tuple) else (point, 0.0) for point in points])
    return bool(np.linalg.matrix_rank(places - places[0]) == 2)


def weight_pressure(case: Case) -> float:
    """Return the weight of the beam spread over the base, Pa."""
    beam = case.beam
    gravity = max((load.weight_acceleration for load in case.load), default=0.0)
    pressure = case.material.density * gravity * beam.height * beam.length / case.layout.length
    return pressure * case.profile.mass / (case.material.density * beam.length * beam.area)


def output(case: Case) -> Iterator[str]:
    """Yield outputs that are too coarse to show the forcing, or too many to keep."""
    for name in ("history_interval", "fields_interval"):
        interval = getattr(case.output, name)
        if interval is not None and interval > case.time.end * (1 + MULTIPLE_TOLERANCE):
            yield f"[output] {name} = {interval:g} is longer than the run: only its start and end are written"
    step = 0.0 if case.time.step == "auto" else case.time.step
    interval = case.output.history_interval or step
    for load in case.load:
        frequency = load.forcing_frequency
        if frequency is not None and interval > 0.1 / frequency >= step:
            yield (
                f"[output] history_interval = {interval:g} keeps {1 / frequency / interval:.3g} records "
                f"in a period of the load {load.name}; its waveform is lost"
            )
        if interval > step > 0.0:
            for line in load.unusual_records(interval):
                yield f"[output] history_interval = {interval:g} {line}"
    fields = case.time.end / case.output.fields_interval if case.output.fields_interval else 0
    if fields > MOST_FIELDS:
        yield f"[output] fields_interval = {case.output.fields_interval:g} writes {fields:.3g} fields to disk"


def mesh(case: Case) -> Iterator[str]:
    """Yield meshes that come out otherwise than asked for, or too large for a small machine."""
    points = [point for load in case.load if (point := load.place.point) is not None]
    points += [probe.point for probe in case.probe]
    if case.beam.rectangular and any(not isinstance(point, tuple) or not any(point[1:]) for point in points):
        for key in ("cells_through_thickness", "cells_across_width"):
            if (getattr(case.mesh, key) or 0) % 2 == 1:
                yield f"[mesh] {key} is odd: a point on the axis makes it another number"
    unknowns = estimated_unknowns(case)
    solved = not isinstance(case.model, BeamModel | RigidModel)  # these take no more of the mesh than its faces
    if solved and unknowns > MOST_UNKNOWNS and case.mesh.file is None:
        yield f"[mesh] about {unknowns:.1g} unknowns, and 15 GB of memory for every million of them"


def estimated_unknowns(case: Case) -> float:
    """Return roughly how many unknowns the built mesh has."""
    beam, wanted = case.beam, case.mesh
    far = wanted.size or case.profile.thinnest
    near = wanted.support_size or case.profile.thinnest / 3
    supported = case.layout.length
    along = supported / near + (beam.length - supported) / far
    if (patches := case.beam.patches(wanted.cells_through_thickness, wanted.cells_across_width)) is not None:
        return 3 * (wanted.degree * along + 1) * patches.nodes(wanted.degree)
    nodes = (wanted.degree * along + 1) * (wanted.degree * (wanted.cells_through_thickness or 4) + 1)
    across = wanted.degree * (wanted.cells_across_width or 4) + 1
    return 2 * nodes if wanted.dimension == 2 else 3 * nodes * across


LOOKS: tuple[Callable[[Case], Iterator[str]], ...] = (
    unit_questions,
    unusual_loads,
    waves,
    beam_elements,
    shape,
    motion,
    start,
    steps,
    scheme,
    contact,
    output,
    mesh,
)
