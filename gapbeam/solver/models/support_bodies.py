"""Flexible supports: the motions of their bodies as further DOFs of a dense system.

With q the motions of the bodies along unit vectors e_j, and n_i what opens the gap of contact point i,

    diag(M, m) (u, q)'' + diag(C, c) (u, q)' + diag(K, k) (u, q) = (f, f_q) + (G, N)^T (w p),
    g = g0 + G u + N q,    N_ij = -n_i . e_j at the points of the support with the motion j, else 0.

Friction sees T u + S q alike. The DOFs of the bodies come after those of the beam, which all rows of probes, poses
and fields read alone. Gravity and base motion act on the masses. Rayleigh and modal damping are those of the
beam: what c_M m + c_K k would add goes off the dashpot again.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.sparse import csr_matrix, hstack

from gapbeam.solver.case.case import Case
from gapbeam.solver.contact.formulations.contact_points import ResultantOperator
from gapbeam.solver.loads.load_choice import load_direction
from gapbeam.solver.loads.places import BodyForce, SupportAcceleration
from gapbeam.solver.supports.layout import BodyMotion, body_motions
from gapbeam.solver.system.dense_operators import DenseOperators, MassesBeside
from gapbeam.solver.system.operators import Array, Interface, RankOnes
from gapbeam.solver.system.semi_discrete import ContactOperator, SemiDiscreteSystem


def with_support_bodies(case: Case, system: SemiDiscreteSystem, dimension: int) -> SemiDiscreteSystem:
    """Return a system with the motions of the support bodies of its case; itself where there are none.

    Args:
        case: The case.
        system: The beam under its loads, in contact with supports that stand still.
        dimension: 2 or 3.

    Raises:
        TypeError: The system has bodies and is not dense.
    """
    motions = body_motions(case.layout, dimension)
    if not motions:
        return system
    beam = system.operators
    if not isinstance(beam, DenseOperators):
        raise TypeError("bodies of supports need a model of few DOFs")
    masses, springs, dampers = np.array(
        [[one.body.mass, one.body.stiffness, one.body.damping] for one in motions]
    ).T  # (k,) each
    reactions = system.reactions
    if reactions is not None:
        rows = (_padded(reactions.displacement, len(motions)), _padded(reactions.velocity, len(motions)))
        reactions = replace(reactions, displacement=rows[0], velocity=rows[1])
    pushes = np.zeros((len(system.loads), len(motions)))  # preloads come after the loads of the case
    for push, load in zip(pushes, case.load, strict=False):
        if isinstance(load.place, BodyForce | SupportAcceleration):
            along = load_direction(load, dimension)
            push[:] = masses * [along[one.axis] for one in motions]
    loads = [
        replace(load, pattern=np.concatenate([load.pattern, push]))
        for load, push in zip(system.loads, pushes, strict=True)
    ]
    return replace(
        system,
        operators=MassesBeside(beam, masses, springs),
        contact=_on_bodies(system.contact, motions),
        loads=tuple(loads),
        dashpots=_with_dampers(
            system, dampers - system.mass_damping * masses - system.stiffness_damping * springs, beam.size
        ),
        reactions=reactions,
    )


def _padded(rows: Array | csr_matrix, count: int) -> Array:
    """Return a vector or rows on the DOFs of the beam with zeros for those of bodies behind them."""
    found = rows if isinstance(rows, np.ndarray) else rows.toarray()
    return np.concatenate([found, np.zeros((*found.shape[:-1], count))], axis=-1)


def _with_dampers(system: SemiDiscreteSystem, coefficients: Array, size: int) -> RankOnes | None:
    """Return the dashpots of a system with one of each body that is not 0."""
    there = np.flatnonzero(coefficients)
    patterns = np.eye(len(coefficients), size + len(coefficients), k=size)[there]
    added = RankOnes(patterns, coefficients[there])
    if system.dashpots is None:
        return added if len(there) else None
    old = RankOnes(_padded(system.dashpots.patterns, len(coefficients)), system.dashpots.coefficients)
    return old.and_also(added)


def _on_bodies(contact: ContactOperator, motions: Sequence[BodyMotion]) -> ContactOperator:
    """Return an operator on all DOFs of a dense system, in which the supports have motions."""
    size = contact.interface.size + len(motions)
    opening, sliding = _rows(contact, motions)
    changed = {
        "interface": Interface(size, np.arange(size), np.arange(size)),
        "gap_matrix": csr_matrix(hstack([contact.gap_matrix, opening])),
        "tangents": None if contact.tangents is None else csr_matrix(hstack([contact.tangents, sliding])),
    }
    if isinstance(contact, ResultantOperator):
        return replace(contact, **changed, distributed=_on_bodies(contact.distributed, motions))
    return replace(contact, **changed)


def _rows(contact: ContactOperator, motions: Sequence[BodyMotion]) -> tuple[csr_matrix, csr_matrix]:
    """Return N, (m, k), and S, (m t, k): of t tangents the last goes around supports that are met around the beam."""
    tangents = 0 if contact.tangents is None else contact.tangents.shape[0] // contact.size
    opening, sliding = np.zeros((contact.size, len(motions))), np.zeros((contact.size, tangents, len(motions)))
    for number, one in enumerate(motions):
        faces = [contact.face_names.index(face.name) for face in one.support.faces]
        there = np.isin(contact.faces, faces)
        aside, up = contact.across[there].T
        opening[there, number] = -up if one.bends else -aside
        if tangents > 1 and one.support.around:
            sliding[there, -1, number] = -aside if one.bends else up
    return csr_matrix(opening), csr_matrix(sliding.reshape(contact.size * tangents, len(motions)))
