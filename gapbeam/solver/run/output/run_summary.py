"""summary.json: the figures of a run, its gates, its costs."""

from __future__ import annotations

import resource
from typing import TYPE_CHECKING, Any

import numpy as np

from gapbeam.solver.case.beam_motions import beam_motions
from gapbeam.solver.case.case import Case, own_law
from gapbeam.solver.case.solution_tables import BeamModel
from gapbeam.solver.loads.support_walls import face_motions
from gapbeam.solver.models.model import Model
from gapbeam.solver.seat.static_seat import Seat
from gapbeam.solver.supports.layout import body_motions
from gapbeam.solver.supports.support import Face
from gapbeam.solver.supports.support_tables import OWN_CONTACT
from gapbeam.solver.system.semi_discrete import VALUE

if TYPE_CHECKING:
    from mpi4py import MPI


def describe_model(case: Case, model: Model) -> dict[str, Any]:
    """Return the size of the model of a case. Collective."""
    contact, comm = model.system.contact, model.space.mesh.comm
    topology = model.space.mesh.topology
    parts: dict[str, Any] = {} if model.body.basis is None else {"basis": vars(model.body.basis)}
    if model.solver is not None:
        parts["solver"] = vars(model.solver)
    if isinstance(case.model, BeamModel):
        parts["motions"] = beam_motions(case)
    if case.model.reasons:
        parts["reasons"] = list(case.model.reasons)
    return parts | {
        "type": case.model.type,
        "dimension": case.mesh.dimension,
        "cell": topology.cell_name(),
        "cells": topology.index_map(topology.dim).size_global,
        "degree": case.mesh.degree,
        "bending": vars(model.body.bending) | {"off": model.body.bending.off},
        "dofs": model.dofs,
        "mesh_dofs": model.mesh_dofs,
        "contact_points": contact.size,
        "interface_dofs": contact.interface.size,
        "ranks": comm.size,
        "contact_facets_per_rank": comm.allgather(sum(map(len, model.body.meshed.faces.values()))),
        "supports": describe_supports(case),
        "rayleigh": {"mass": model.system.mass_damping, "stiffness": model.system.stiffness_damping},
    }


def describe_supports(case: Case) -> list[dict[str, Any]]:
    """Return the places of the supports, their gaps to the undeformed beam, m, their contact and body.

    Supports of a beam with steps also say how thick it is there.
    """
    profile = case.profile
    moves = face_motions(case.load, case.layout, case.mesh.dimension)
    for motion in body_motions(case.layout, case.mesh.dimension):
        for name, changes in motion.face_changes().items():
            moves.setdefault(name, {})[motion.label] = changes

    def described(face: Face) -> dict[str, Any]:
        moved = {"moves": moves[face.name]} if face.name in moves else {}
        side = "around" if face.around else "below" if face.side > 0.0 else "above"
        return {"name": face.name, "side": side, "gap": face.gap} | face.shape | moved

    return [
        {
            "name": one.name,
            "from": one.start,
            "to": one.end,
            "clearance": one.clearance,
            "faces": [described(face) for face in one.faces],
            **{key: getattr(one, key) for key in OWN_CONTACT if getattr(one, key) is not None},
            **({} if (law := own_law(one)) is None else {"law": law.model_dump()}),
            **({} if one.body is None else {"body": one.body.model_dump()}),
            **({} if profile.one_section else {"thickness": profile.between(one.start, one.end)[0].beam.thickness}),
        }
        for one in case.layout.supports
    ]


def describe_seat(seat: Seat, model: Model) -> dict[str, Any]:
    """Return reactions, penetration and displacements of support bodies and probes of the seat. Collective."""
    contact, state = model.system.contact, seat.state
    forces = contact.weights * state.pressure
    total = np.bincount(contact.faces, weights=forces, minlength=len(contact.face_names))
    reactions: dict[str, Any] = {f"{name}_force": float(f) for name, f in zip(contact.face_names, total, strict=True)}
    if bodies := model.bodies:
        places = state.u[VALUE][len(state.u[VALUE]) - len(bodies) :]
        reactions["support_displacement"] = {one.label: float(place) for one, place in zip(bodies, places, strict=True)}
    return reactions | {
        "largest_penetration": float(np.max(contact.penetration_of(state, model.system.operators))),
        "iterations": seat.iterations,
        "last_update": seat.last_update,
        "probes": {
            name: [float(x) for x in probe.evaluate(state.u[VALUE], model.system.operators)]
            for name, probe in model.probes.items()
        },
    }


def peak_memory(comm: MPI.Comm) -> list[int]:
    """Return the largest resident memory of every rank, bytes. Collective."""
    return list(comm.allgather(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024))
