"""Description of a run and its cost before it starts, in tables."""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from math import ceil, log10, pi, sqrt
from typing import TYPE_CHECKING

import numpy as np
from rich.table import Table
from rich.text import Text

from gapbeam.postprocess.display_units import shown, shown_by, words_by_size
from gapbeam.solver.case.analysis_table import Periodic, Transient, centered_pose
from gapbeam.solver.case.beam_motions import axial_restraint, lateral_restraint, motions_in_words
from gapbeam.solver.case.case import Case
from gapbeam.solver.case.checks.case_warnings import warnings
from gapbeam.solver.case.computed_defaults import Default, bending_words, overhang_frequency, stiffness_unit
from gapbeam.solver.case.solution_tables import BeamModel
from gapbeam.solver.march.simulation import Simulation
from gapbeam.solver.march.stepwise_march import RESOLVING_SHARE
from gapbeam.solver.memory.memory_check import (
    GIGABYTE,
    expected_dofs,
    lack_of_memory,
    offer_simpler,
    refuse_too_large_before_meshing,
)
from gapbeam.solver.messages.wording import counted
from gapbeam.solver.models.body import MeshedBeam, mesh_beam, mesh_dofs
from gapbeam.solver.models.energy_creation import accepted_energy_creators, refuse_energy_creators
from gapbeam.solver.models.model import Model, build_model
from gapbeam.solver.run.verdict import remarks_on_model
from gapbeam.studies.printed_results import PrintedResult
from gapbeam.studies.trial_prediction import LARGEST, Prediction, predict, predict_large

if TYPE_CHECKING:
    from mpi4py import MPI

Row = tuple[str, str, str]

FEW = 6  # faces that are named
SOFT_ENOUGH = 1.0 / 3.0
PERHAPS = 0.5  # of the DOFs of a model that is tried out: with more expected, the mesh is made and counted


@dataclass(frozen=True, repr=False)
class CaseDescription(PrintedResult):
    """Description of a run and its cost before it starts.

    Attributes:
        title: Title of the case.
        sections: Rows of name, value and explanation under each heading.
        warnings: Warnings.
        cost: Predicted times and memory.
    """

    title: str
    sections: dict[str, tuple[Row, ...]]
    warnings: tuple[str, ...]
    cost: Prediction

    def headline(self) -> str:
        """Return the predicted wall time and memory."""
        words = f"{_duration(self.cost.total)}, {self.cost.memory / GIGABYTE:.2f} GB"
        return f"{self.title}: {words}, {counted(len(self.warnings), 'warning')}"

    def tables(self) -> list[Table | Text]:
        """Return a table for each heading, and the warnings."""
        tables = [_table(heading, rows) for heading, rows in self.sections.items()]
        return [*tables, *(Text(f"warning: {text}") for text in self.warnings)]


def describe_case(case: Case, comm: MPI.Comm) -> CaseDescription:
    """Mesh, assemble and seat a case, march some steps and describe its run; of a large one, on coarser meshes.

    Raises:
        UserError: The run would be refused: scheme and contact are known to create energy, a point lies outside, or
            there is no memory for what is tried out.
        CaseError: The computed time step does not go with the rest of the case.
        MeshError: A user's mesh does not fit the case.
        NotConverged: The beam finds no seat.

    Collective.
    """
    refuse_too_large_before_meshing(case, comm, mesh_alone=True)
    offer_simpler(case)
    started, dofs = time.perf_counter(), comm.bcast(expected_dofs(case))
    if not isinstance(case.model, BeamModel) and (dofs is None or dofs > PERHAPS * LARGEST):
        meshed = mesh_beam(case, comm)
        if mesh_dofs(meshed) > LARGEST:
            cost = predict_large(case, mesh_dofs(meshed), comm)
            sections = {"Model": tuple(_mesh_rows(case, meshed)), "Run": tuple(_cost_rows(cost))}
            return CaseDescription(
                case.title, sections, (*warnings(case), *_memory_warnings(case, meshed, comm)), cost
            )  # fmt: skip
        started += meshed.seconds
    model = build_model(case, comm)
    refuse_energy_creators(case, model)
    simulation = Simulation(model)
    case = simulation.case  # its step is a number
    prediction = predict(simulation, time.perf_counter() - started, comm)
    sections = {
        "Model": tuple(_model_rows(case, model)),
        "Computed defaults": tuple(_once(_default_rows(default) for default in model.defaults)),
        "Dynamics": tuple(_dynamics_rows(case, model)),
        "Run": (
            ("scheme", case.time.scheme.type, ""),
            *_analysis_rows(case),
            *_adaptive_rows(case, model),
            ("steps", f"{prediction.steps}", f"of {model.step:.6g} s up to {case.time.end:g} s"),
            *_cost_rows(prediction),
        ),
    }
    doubts = [f"the run ends at its start: {prediction.ended}"] if prediction.ended else []
    doubts += [*warnings(case), *accepted_energy_creators(model), *remarks_on_model(case, model)]
    return CaseDescription(case.title, sections, (*doubts, *_restraint_warnings(case)), prediction)


def _cost_rows(cost: Prediction) -> list[Row]:
    rows = [("set-up", _duration(sum(cost.setup.values())), ", ".join(_part(*part) for part in cost.setup.items()))]
    if cost.back_substitution > 0.0:
        rows.append(("back-substitution", f"{1e3 * cost.back_substitution:.3g} ms", "of one step"))
    return [
        *rows,
        *([] if cost.ended else [("step", f"{1e3 * cost.per_step:.3g} ms", "with its records; " + cost.basis)]),
        ("field", f"{1e3 * cost.per_field:.3g} ms", f"{cost.fields} of them"),
        *([] if cost.ended else [("march", _duration(cost.march), "predicted from these")]),
        *([("errors", _duration(cost.errors), f"{cost.companions} comparison runs")] if cost.companions else []),
        ("wall time", _duration(cost.total), f"{cost.certainty}; without pictures"),
        ("memory", f"{cost.memory / GIGABYTE:.2f} GB", "peak of all ranks together"),
    ]


def _part(name: str, seconds: float) -> str:
    return f"{name} {_duration(seconds)}"


def _once(groups: Iterable[Sequence[Row]]) -> Iterator[Row]:
    """Yield rows; of groups that differ by their names alone the first one stands for all."""
    alike = dict[tuple[tuple[str, ...], ...], list[Sequence[Row]]]()
    for group in groups:
        alike.setdefault(tuple(row[1:] for row in group), []).append(group)
    for (first, *rest), *others in alike.values():
        name, value, words = first
        yield name, value, f"{words}; and {len(others)} alike" if others else words
        yield from rest


def _default_rows(default: Default) -> list[Row]:
    rows = [(default.key, f"{default.value:.4g} {default.unit}", default.reason)]
    return rows + ([("", "", default.consequence)] if default.consequence else [])


def _mesh_rows(case: Case, meshed: MeshedBeam) -> list[Row]:
    topology = meshed.space.mesh.topology
    cells = topology.index_map(topology.dim).size_global
    return [
        ("mesh", f"{cells} cells", f"{topology.cell_name()}, degree {case.mesh.degree}"),
        ("degrees of freedom", f"{mesh_dofs(meshed)}", ""),
    ]


def _model_rows(case: Case, model: Model) -> list[Row]:
    contact = model.system.contact
    areas = np.bincount(contact.faces, weights=contact.weights)
    unit, factor = shown("m", float(np.sqrt(areas.max(initial=0.0))))
    alike = dict[str, list[str]]()
    for name, area in zip(contact.face_names, areas, strict=True):
        alike.setdefault(f"{factor**2 * area:.5g} {unit.replace('µ', 'u')}^2", []).append(name)
    faces = ", ".join(
        f"{area} on {', '.join(names) if len(names) <= FEW else f'each of {len(names)} faces'}"
        for area, names in alike.items()
    )
    return [
        *_mesh_rows(case, model.body.meshed),
        *([] if model.dofs == model.mesh_dofs else [("marched", f"{model.dofs} DOFs", f"model {case.model.type}")]),
        *(("model auto", "", reason) for reason in case.model.reasons),
        *(("beam motion", name, why) for name, why in motions_in_words(case)),
        ("contact points", f"{contact.size}", f"on {contact.interface.size} interface DOFs; {faces}"),
    ]


def _dynamics_rows(case: Case, model: Model) -> list[Row]:
    duration = model.contact_duration
    bounded = "first bending frequency, Euler-Bernoulli, at most that of a shear wave"
    rows = [(bending_words(case), f"{overhang_frequency(case):.4g} Hz", bounded)]
    for spring in _restraints(case):
        on_it = f"rigid beam on {spring.value:.3g} N/m" if spring.value > 0.0 else "none"
        rows.append((spring.key, f"{restraint_frequency(case, spring.value):.3g} Hz", f"{on_it}: {spring.reason}"))
    rows.append(
        (
            "contact duration",
            _brief(duration),
            "at least: half a period of the supported part on "
            f"{model.support.stiffness_per_area:.3g} {stiffness_unit(case)}; {duration / model.step:.2g} steps. "
            "After a run, contact_episodes in summary.json gives the share of the impulse "
            "that passes in contacts of fewer than 10 steps",
        )
    )
    bodies = ((one.name, one.body) for one in case.layout.supports if one.body is not None)
    on_spring = "its body on its spring, without the beam"
    rows += _once([(f"support {name}", f"{body.frequency:.4g} Hz", on_spring)] for name, body in bodies)
    for load in case.load:
        if (words := load.frequency_words(model.step)) is not None:
            rows.append((load.name, *words))
    return rows


def _restraints(case: Case) -> list[Default]:
    """Return the restraints of the motions along the faces that a case has."""
    sideways = case.mesh.dimension == 3 and not case.layout.holes
    return [axial_restraint(case), *([lateral_restraint(case)] if sideways else [])]


def restraint_frequency(case: Case, stiffness: float) -> float:
    """Return the frequency of the rigid beam on a restraint, Hz."""
    return sqrt(stiffness / case.profile.mass) / (2.0 * pi)


def _analysis_rows(case: Case) -> list[Row]:
    if not isinstance(case.analysis, Periodic):
        return _start_rows(case, case.analysis)
    return [("analysis", "periodic", "predicted is a march to time.end; the search from there is not")]


def _start_rows(case: Case, analysis: Transient) -> list[Row]:
    """Return rows on the start of the run, where it is not at rest on the seat."""
    words = list[str]()
    if analysis.state is not None:
        time = analysis.state_time
        which = "last checkpoint" if time is None else f"checkpoint at {time:g} s"
        return [("start", "state", f"the {which} in {analysis.state}")]
    if analysis.start == "centered":
        ends = [centered_pose(case.support).section(x) for x in (0.0, case.beam.length)]
        unit, factor = shown_by("m", (way for end in ends for way in (end["lateral"], end["vertical"])))
        moved = [f"({factor * end['lateral']:.3g}, {factor * end['vertical']:.3g})" for end in ends]
        places = f"{' and '.join(dict.fromkeys(moved))} {unit.replace('µ', 'u')}"
        words.append(f"both ends of the axis moved by {places} sideways and upward")
    if analysis.motion is not None:
        pose, rate = analysis.motion.pose(case.beam.length), analysis.motion.rate(case.beam.length)
        parts = (
            *(f"position {name}" for name in sorted(pose.names)),
            *(f"velocity {name}" for name in sorted(rate.names)),
        )
        words.append("a rigid motion: " + (", ".join(parts) or "none"))
    if analysis.mode is not None:
        mode = analysis.mode
        words.append(
            f"bending mode {mode.number} with {mode.amplitude:g} m at {mode.probe}, phase {mode.phase:g} degrees"
        )
    return [("start", analysis.start, "; ".join(words))] if words else []


def _adaptive_rows(case: Case, model: Model) -> list[Row]:
    if not case.time.adaptive:
        return []
    shortest = model.step / 2**case.time.max_halvings
    wanted = RESOLVING_SHARE * model.contact_duration
    words = f"an impact asks for {wanted:.2g} s" + (", which is out of reach" if shortest > wanted else "")
    return [("adaptive steps", f"down to {shortest:.2g} s", f"time.max_halvings = {case.time.max_halvings}; {words}")]


def _memory_warnings(case: Case, meshed: MeshedBeam, comm: MPI.Comm) -> list[str]:
    fault = lack_of_memory(case, mesh_dofs(meshed), comm)
    return [] if fault is None else [f"{fault}: gapbeam run refuses it unless gates.accept_lack_of_memory = true"]


def _restraint_warnings(case: Case) -> list[str]:
    wanted = [load.forcing_frequency for load in case.load if load.forcing_frequency is not None]
    lowest = min([overhang_frequency(case), *wanted])
    held = {one.motion.name for joint in case.joint for one in joint.attached()}  # there the restraint has no say
    return [
        f"{one.key} gives {frequency:.3g} Hz, not soft against the lowest frequency of interest, "
        f"{lowest:.3g} Hz; make it at least {(frequency / (SOFT_ENOUGH * lowest)) ** 2:.2g} times softer"
        for one in _restraints(case)
        if one.key.removeprefix("restraint.") not in held
        and (frequency := restraint_frequency(case, one.value)) > SOFT_ENOUGH * lowest
    ]


def _brief(seconds: float) -> str:
    """Return the duration of a contact in words."""
    power = min(max(ceil(-log10(float(f"{seconds:.3g}")) / 3.0), 0), 3)
    return f"{1e3**power * seconds:.3g} {('s', 'ms', 'us', 'ns')[power]}"


def _duration(seconds: float) -> str:
    if seconds < 120.0:
        return f"{seconds:.2g} s" if seconds < 10.0 else f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 7200.0 else f"{seconds / 3600.0:.1f} h"


def _table(title: str, rows: Sequence[Row]) -> Table:
    table = Table(title=title, title_justify="left", show_header=False, box=None, padding=(0, 2, 0, 0))
    for row in rows:
        table.add_row(*(Text(words_by_size(cell)) for cell in row))
    return table
