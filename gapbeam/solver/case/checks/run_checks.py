"""Contradictions between time, start and model of a run and the rest of a case."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, Protocol

import numpy as np

from gapbeam.solver.case.analysis_table import Analysis, RigidMotion, Transient, centered_pose, centering_faults
from gapbeam.solver.case.beam_motions import motions_of_tables
from gapbeam.solver.case.beam_profile import Beam, beam_at
from gapbeam.solver.case.case import Contact, Damping, Mesh, Output, advised_scheme
from gapbeam.solver.case.checks.attachment_checks import Joints
from gapbeam.solver.case.checks.contact_checks import by_penalty, rubbing
from gapbeam.solver.case.checks.place_checks import Loads, Probes, Segments
from gapbeam.solver.case.solution_tables import BeamModel, FullModel, ModelTable, ReducedModel, RigidModel, Time
from gapbeam.solver.loads.attachments import Joint, MotionName, PointMass
from gapbeam.solver.messages.errors import Fault, Key
from gapbeam.solver.messages.wording import apart, counted, exceeds
from gapbeam.solver.supports.layout import keyed
from gapbeam.solver.supports.support_tables import AnySupports, OneSupport

MOST_STEPS = 1e9
MULTIPLE_TOLERANCE = 1e-6
"""Tolerance of intervals against a whole number of steps, in steps."""


class MarchSpan(Protocol):
    """Step and end of a run, s, as the table [time] of cases and of files of several structures has them."""

    @property
    def step(self) -> float | str:
        """Step, s; "auto" until it is chosen."""

    @property
    def end(self) -> float:
        """End, s."""


def run_has_steps(time: MarchSpan) -> Iterator[Fault]:
    """A run has at least one step, and not more than can ever be marched."""
    if isinstance(time.step, str):
        return
    steps = time.end / time.step
    if steps < 1 - MULTIPLE_TOLERANCE:
        step, end = apart(time.step, time.end)
        yield Fault(
            ("time", "step"),
            f"{step} s, longer than the whole run",
            f"at most end, {end} s, and much less to be of use",
            "are step and end swapped, or in ms?",
            (("time", "end"),),
        )
    elif steps > MOST_STEPS:
        yield Fault(
            ("time", "step"),
            f"{time.step:g} s, which makes {steps:.3g} steps until {time.end:g} s",
            f"at most {MOST_STEPS:g} steps",
            f"a step of {time.end / 1e5:g} s makes 100000 steps",
            (("time", "end"),),
        )


def step_follows_the_forcing(time: MarchSpan, load: Mapping[int, Any]) -> Iterator[Fault]:
    """The step is far shorter than the period of every load."""
    if isinstance(time.step, str):
        return
    for number, entry in load.items():
        frequency = entry.forcing_frequency
        if frequency is not None and time.step >= 0.5 / frequency:
            step, half = apart(time.step, 0.5 / frequency)
            yield Fault(
                ("time", "step"),
                f"{step} s, with a load of {frequency:g} Hz",
                f"far less than {half} s, half its period; 50 steps per period are good",
                f"step = {0.02 / frequency:.3g}",
                (("load", number, "frequency"),),
            )


def interest_covers_the_forcing(time: Time, load: Loads) -> Iterator[Fault]:
    """The highest frequency of interest is not below that of a load."""
    for number, entry in load.items():
        frequency = entry.forcing_frequency
        if time.frequency and frequency is not None and exceeds(frequency, time.frequency):
            asked, loaded = apart(time.frequency, frequency)
            yield Fault(
                ("time", "frequency"),
                f"{asked} Hz, with a load of {loaded} Hz",
                "at least the frequency of every load",
                f"frequency = {5 * frequency:g}, or leave it out",
                (("load", number, "frequency"),),
            )


def outputs_fall_on_steps(time: Time, output: Output) -> Iterator[Fault]:
    """Output intervals are whole numbers of steps."""
    if time.step == "auto":
        return
    for name in ("history_interval", "fields_interval"):
        interval = getattr(output, name)
        if interval is None:
            continue
        nearest = whole_interval(interval, time.step)
        if nearest is not None:
            few = f"{interval / time.step:.6g} steps of {time.step:g} s"
            found, remedy, related = f"{interval:g} s, {few}", f"{name} = {nearest!r}", (("time", "step"),)
            yield Fault(("output", name), found, "a whole number of steps, at least 1", remedy, related)


def whole_interval(interval: float, step: float) -> float | None:
    """Return the whole number of steps that is nearest to an interval, s; None where the interval is one."""
    ratio = interval / step
    steps = max(1, round(ratio)) if ratio < 1e15 else 1
    return None if abs(ratio - steps) <= MULTIPLE_TOLERANCE else float(f"{steps * step:.12g}")


def adaptive_steps_resolve_a_contact(time: Time) -> Iterator[Fault]:
    """Adaptive steps resolve the time history of a contact; impulses take no time."""
    if time.adaptive and time.scheme.impulses:
        yield Fault(
            ("time", "adaptive"),
            f"true, with the scheme {time.scheme.type}",
            "false: impulses have no duration that steps could resolve",
            "adaptive = false, or another scheme",
            (("time", "scheme"),),
        )


ALLOWED = 1.0e-9  # of the largest displacement: what round-off leaves of a rotation about a joint
ROUNDED = 1.0e-9  # of time.end: how far behind it a time may lie
VECTORS = ("displacement", "velocity", "point")
TURNS = {"rotation": "tilt", "spin": "spin"}
TURNING: tuple[MotionName, ...] = ("rotation", "lateral_rotation", "twist")
SHIFTS: tuple[MotionName, ...] = ("axial", "lateral", "vertical")


def start_vectors_fit_the_mesh(mesh: Mesh, analysis: Analysis) -> Iterator[Fault]:
    """Vectors have as many components as the mesh has dimensions; a slice rotates in its plane alone."""
    motion = getattr(analysis, "motion", None)
    if motion is None:
        return
    for key in VECTORS:
        vector = getattr(motion, key)
        if isinstance(vector, tuple) and len(vector) != mesh.dimension:
            yield Fault(
                ("analysis", "motion", key),
                f"{counted(len(vector), 'component')} with dimension = {mesh.dimension}",
                f"{mesh.dimension} components, [{', '.join('xyz'[: mesh.dimension])}]",
                f"{key} = {[0.0] * mesh.dimension}",
                (("mesh", "dimension"),),
            )
    for key, number in TURNS.items():
        if mesh.dimension == 2 and isinstance(getattr(motion, key), tuple):
            yield Fault(
                ("analysis", "motion", key),
                "a vector with dimension = 2",
                f"the number {number}: a slice rotates in its plane alone",
                f"{number} = 0.1",
                (("mesh", "dimension"),),
            )


def start_is_given_once(analysis: Analysis) -> Iterator[Fault]:
    """A displacement replaces lift, a rotation tilt."""
    motion = getattr(analysis, "motion", None)
    if motion is None:
        return
    for number, vector in (("lift", "displacement"), ("tilt", "rotation")):
        if getattr(motion, number) != 0.0 and getattr(motion, vector) is not None:
            yield Fault(
                ("analysis", "motion", vector),
                f"{vector} together with {number} = {getattr(motion, number):g}",
                "one of both",
                f"leave out {number}, and put its value in {vector}",
                (("analysis", "motion", number),),
            )


def joints_let_the_start_move(beam: Beam, support: AnySupports, joint: Joints, analysis: Analysis) -> Iterator[Fault]:
    """Pose and velocity at the start are such that the joints allow them."""
    if not isinstance(analysis, Transient):
        return
    if analysis.start == "centered":
        pose = (centered_pose(support),)
        yield from _held(beam, joint, pose, ("analysis", "start"), 'start = "undeformed", or a support around the axis')
    if analysis.motion is not None:
        both = analysis.motion.pose(beam.length), analysis.motion.rate(beam.length)
        yield from _held(
            beam, joint, both, ("analysis", "motion"), "leave motion out; a load can set the beam in motion"
        )


def _held(
    beam: Beam, joint: Joints, motions: tuple[RigidMotion, ...], key: tuple[str, str], advice: str
) -> Iterator[Fault]:
    for number, entry in joint.items():
        rotates, moves = False, False
        for motion in motions:
            here = motion.section(entry.point)
            largest = max(abs(motion.section(x)[name]) for x in (0.0, beam.length) for name in SHIFTS)
            rotates |= any(name in entry.holds and here[name] != 0.0 for name in TURNING)
            moves |= any(name in entry.holds and abs(here[name]) > ALLOWED * largest for name in SHIFTS)
        if rotates or moves:
            yield Fault(
                key,
                f"a motion that {'rotates' if rotates else 'moves'} the section at x = {entry.point:g} m, which the "
                f"joint {entry.name} holds",
                "a rotation about a pinned joint, or no motion" if moves else "no rotation",
                advice,
                (("joint", number, "type"),),
            )


def centered_start_has_a_middle(support: AnySupports, analysis: Analysis) -> Iterator[Fault]:
    """A centered start has play to be centered in, in supports that do not contradict each other."""
    if isinstance(analysis, Transient) and analysis.start == "centered":
        yield from centering_faults(support, ("analysis", "start"))


def start_state_stands_alone(analysis: Analysis) -> Iterator[Fault]:
    """A state of another run replaces a pose; the time of a state is that of a run."""
    if isinstance(analysis, Transient) and analysis.state is not None and analysis.start != "seat":
        yield Fault(
            ("analysis", "state"),
            f'a state together with start = "{analysis.start}"',
            "one of both",
            "leave out start, or state",
            (("analysis", "start"),),
        )
    if isinstance(analysis, Transient) and analysis.state_time is not None and analysis.state is None:
        yield Fault(
            ("analysis", "state_time"),
            f"{analysis.state_time:g} s without a state",
            "a state with it, the results folder of the run that kept the state",
            'state = "results/first", or leave out state_time',
        )


def kept_checkpoint_has_a_march(analysis: Analysis, output: Output) -> Iterator[Fault]:
    """A search for periodic responses has no checkpoints."""
    for key, value, nothing in (("keep_checkpoint", "true", "false"), ("keep_states", "times", "[]")):
        if getattr(output, key) and not isinstance(analysis, Transient):
            yield Fault(
                ("output", key),
                f'{value} with type = "{analysis.type}", which has no checkpoints',
                'type = "transient"',
                f"{key} = {nothing}",
                (("analysis", "type"),),
            )


def kept_states_are_of_the_run(time: Time, output: Output) -> Iterator[Fault]:
    """The times of states that are kept lie in the run."""
    late = [moment for moment in output.keep_states if moment > time.end * (1.0 + ROUNDED)]
    if late:
        yield Fault(
            ("output", "keep_states"),
            f"{late[0]:g} s in a run that ends at {time.end:g} s",
            "times up to time.end",
            f"keep_states = [{time.end / 2:g}, {time.end:g}]",
            (("time", "end"),),
        )


def start_mode_bends_the_model(model: ModelTable, analysis: Analysis) -> Iterator[Fault]:
    """A rigid body has no mode that bends it."""
    if isinstance(model, RigidModel) and getattr(analysis, "mode", None) is not None:
        yield Fault(
            ("analysis", "mode"),
            "a vibration mode of the model rigid, which has rigid motions alone",
            "a model that bends, or a rigid motion",
            'type = "beam" in [model], or [analysis.motion]',
            (("model", "type"),),
        )


def start_mode_has_its_probe(probe: Probes, analysis: Analysis) -> Iterator[Fault]:
    """The amplitude of a mode is that of a probe of the case."""
    mode = getattr(analysis, "mode", None)
    if mode is None:
        return
    names = [entry.name for entry in probe.values()]
    if mode.probe not in names:
        yield Fault(
            ("analysis", "mode", "probe"),
            f'"{mode.probe}", and no probe of that name',
            f"one of {', '.join(names)}" if names else "the name of a [[probe]]",
            f'probe = "{names[0]}"' if names else 'add a [[probe]] with name = "tip" at the free end',
            (("probe",),),
        )


TYPE = ("model", "type")
SECTIONS = ("model", "sections")


def contact_fits_the_model(model: ModelTable, support: AnySupports, contact: Contact, time: Time) -> Iterator[Fault]:
    """A basis of few DOFs has no stress at the contact points, and few motions that constraints could hold."""
    if isinstance(model, FullModel):
        return
    formulation = contact.formulation
    keeps_all = isinstance(model, ReducedModel) and model.contact == "all"
    everything = 'contact = "all"' + (' and sections = "deformable"' if model.rings else "")
    either = f"{everything} in [model], or " if isinstance(model, ReducedModel) else ""
    if formulation.stress_terms is not None:
        expected = (
            f"full: the formulation {formulation.type} takes the stress at the contact points, which only the mesh has"
        )
        yield Fault(TYPE, model.type, expected, 'formulation = "penalty" in [contact]', (("contact", "formulation"),))
    elif not formulation.follows_the_law and not keeps_all:
        yield Fault(
            TYPE,
            f"{model.type}, with the formulation {formulation.type}",
            'full, or reduced with contact = "all": more points than motions of the faces cannot all be held exactly',
            either + by_penalty(contact, time),
            (("contact", "formulation"),),
        )
    if contact.mass == "redistributed":
        expected = "consistent: the contact nodes of any model but the full one have no mass of their own"
        yield Fault(("contact", "mass"), "redistributed", expected, "leave mass out", (TYPE,))
    rubs = rubbing(support, contact)
    if rubs is not None and not keeps_all and not isinstance(model, BeamModel):
        key, sliding = rubs
        yield Fault(
            key,
            f"a coefficient of {sliding:g}, with the model {model.type}",
            'full, beam, or reduced with contact = "all": the other bases have no flexibility along the faces',
            (either or 'type = "beam" in [model], or ') + "leave friction out",
            (TYPE,),
        )


def stations_are_of_rigid_sections(model: ModelTable) -> Iterator[Fault]:
    """The number of stations says nothing where sections deform."""
    if isinstance(model, ReducedModel) and model.rings is None and model.stations is not None:
        yield Fault(
            ("model", "stations"),
            f"{model.stations}, with sections that deform",
            'stations together with sections = "rigid"',
            'sections = "rigid", or leave stations out',
        )


def touching_sections_meet_their_supports(
    beam: Beam, segment: Segments, mesh: Mesh, model: ModelTable, support: AnySupports, contact: Contact
) -> Iterator[Fault]:
    """Sections of beam elements and rigid bodies that touch at stations are met all around, or along lines."""
    if not isinstance(model, BeamModel | RigidModel) or model.stations is None:
        return
    key, found = ("model", "stations"), f"{model.stations}"
    for at, one in _planes_without_lines(beam, segment, mesh, support):
        expected = "supports around the beam, or a round section (3D): stations are sections that keep their shape"
        yield Fault(key, f"{found}, with the {one.region.type} {one.name}", expected, "leave stations out", (at,))
        break
    if contact.points is not None:
        related = (("contact", "points"),)
        yield Fault(key, f"{found}, with contact.points", "one of both", "leave one of both out", related)


def _planes_without_lines(
    beam: Beam, segment: Segments, mesh: Mesh, support: AnySupports
) -> Iterator[tuple[Key, OneSupport]]:
    """Yield the planes below and above sections that are not round, or whose mesh is not a solid of gapbeam."""
    for at, one in keyed(support):
        here = beam_at(beam, segment.values(), 0.5 * (one.start + one.end))
        if not one.around and not (here.section.round and mesh.dimension == 3 and mesh.file is None):
            yield at, one


def rigid_sections_meet_their_supports(
    beam: Beam, segment: Segments, mesh: Mesh, model: ModelTable, support: AnySupports
) -> Iterator[Fault]:
    """Sections that keep their shape are round on planes, and take the place of shapes of pressure on a surface."""
    if not isinstance(model, ReducedModel) or model.rings is None:
        return
    flat = list(_planes_without_lines(beam, segment, mesh, support))
    for key, one in [*flat, *((at, one) for at, one in keyed(support) if len(one.sides) == 1)][:1]:
        yield Fault(
            SECTIONS,
            f"rigid, with the {one.region.type} {one.name}",
            "supports around the beam, or slots around a round section (3D): a surface on one plane alone, or a flat "
            "side, deforms",
            'section = "round" in slots, type = "beam", or leave sections out',
            (key,),
        )
    if model.contact == "all":
        expected = 'contact = "shapes": all motions of the surface are those of sections that deform'
        yield Fault(SECTIONS, 'rigid, with contact = "all"', expected, "leave one of both out", (("model", "contact"),))
    if model.interface == "fixed":
        expected = 'interface = "free": the modes of a body whose sections are not held'
        yield Fault(
            SECTIONS, 'rigid, with interface = "fixed"', expected, "leave interface out", (("model", "interface"),)
        )


def elements_are_above_round_off(model: ModelTable) -> Iterator[Fault]:
    """The stiffness of n elements in a row is conditioned as n^4: beyond 1 / eps, results are round-off."""
    most = int(float(np.finfo(float).eps) ** -0.25)
    if isinstance(model, BeamModel) and model.elements > most:
        yield Fault(
            ("model", "elements"),
            f"{model.elements}",
            f"at most {most}: the bending of shorter elements is lost in the round-off of their stiffness",
            f"elements = {min(most, 500)}",
        )


def modal_damping_has_modes(model: ModelTable, damping: Damping) -> Iterator[Fault]:
    """Modal damping belongs to the modes of small models."""
    if isinstance(model, FullModel) and damping.ratio:
        yield Fault(
            ("damping", "ratio"),
            f"{damping.ratio:g}, with the model full, whose modes are not computed",
            "a reduced, beam or rigid model, or Rayleigh damping",
            'type = "reduced" in [model], or frequencies and ratios',
            (TYPE,),
        )


def implicit_schemes_march_the_model(model: ModelTable, time: Time, contact: Contact) -> Iterator[Fault]:
    """Explicit steps march the lumped masses of a mesh."""
    if not isinstance(model, FullModel) and time.scheme.explicit:
        yield Fault(
            ("time", "scheme"),
            f"{time.scheme.type}, with the model {model.type}",
            "an implicit scheme: explicit steps are for the lumped masses of a mesh",
            f'scheme = "{advised_scheme(contact)}"',
            (TYPE,),
        )


def beams_move_as_asked(
    model: ModelTable,
    mesh: Mesh,
    support: AnySupports,
    load: Loads,
    joint: Mapping[int, Joint],
    mass: Mapping[int, PointMass],
    contact: Contact,
    analysis: Analysis,
) -> Iterator[Fault]:
    """A beam model has the motions that its case calls for, and a slice neither leaves its plane nor twists."""
    if not isinstance(model, BeamModel) or model.motions == "auto":
        return
    key, related = ("model", "motions"), (("mesh", "dimension"),)
    beyond = [name for name in ("lateral", "torsion") if name in model.motions and mesh.dimension == 2]
    if beyond:
        yield Fault(
            key, f'"{beyond[0]}", of a slice (dimension = 2)', '"bending" and "axial"', "dimension = 3", related
        )
        return
    for name, why in motions_of_tables(mesh, support, load, joint, mass, contact, analysis).items():
        if name not in model.motions:
            given = ", ".join(f'"{one}"' for one in (*model.motions, name))
            yield Fault(key, f"{list(model.motions)}", f'"{name}" among them: {why}', f"motions = [{given}], or auto")


def beam_is_prismatic(model: ModelTable, mesh: Mesh) -> Iterator[Fault]:
    """The section of beam elements is that of [beam]."""
    if isinstance(model, BeamModel) and mesh.file is not None:
        yield Fault(
            TYPE,
            "beam, with a mesh file",
            "full or reduced: the section of a mesh file is not known",
            'type = "reduced"',
            (("mesh", "file"),),
        )
