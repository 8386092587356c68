"""Contradictions between the start of a run and the rest of a case: directions, joints, play, and probes of modes."""

from __future__ import annotations

from collections.abc import Iterator

from gapbeam.solver.attachments.mean_motion import MotionName
from gapbeam.solver.case.analysis_table import Analysis, Transient
from gapbeam.solver.case.case import Beam, Mesh, Output
from gapbeam.solver.case.centered_pose import centered_pose, centering_faults
from gapbeam.solver.case.checks.attachment_checks import Joints
from gapbeam.solver.case.checks.place_checks import Probes
from gapbeam.solver.case.model_table import ModelTable, RigidModel
from gapbeam.solver.case.rigid_motion import RigidMotion
from gapbeam.solver.case.time_table import Time
from gapbeam.solver.faults import Fault
from gapbeam.solver.supports.support_tables import AnySupports

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
                f"{len(vector)} components with dimension = {mesh.dimension}",
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
