"""Basis of a beam of many elements, span by span: u = V q with columns that are 0 outside of one or two spans.

Nodes, the cuts, divide the beam into spans. The columns are the static shapes of unit motions of the cuts, and in each
span with its cuts held (Craig and Bampton 1968)

    the modes below a frequency, and K^-1 b of forces b: of contact, of loads and of what is attached.

A response of the whole beam to such a force is a sum of columns: contact faces and loads keep their static flexibility.
All work and V itself grow in proportion to the spans, and M, K and the motions of contact points stay sparse.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import ceil, pi

import numpy as np
from scipy.linalg import cho_factor, cho_solve, eigh, qr
from scipy.sparse import coo_matrix, csr_matrix, vstack
from scipy.sparse.csgraph import connected_components

from gapbeam.solver.case.case import Case
from gapbeam.solver.case.model_choice import bending_wavelength, highest_frequency
from gapbeam.solver.models.reduction.modal_basis import modal_basis
from gapbeam.solver.system.dense_operators import DenseOperators, SparseOperators
from gapbeam.solver.system.operators import Array, Indices

MODES_ABOVE = 3.0  # times the highest frequency of interest
NOTABLE_SMOOTH = 1.0e-3  # of the flexibility, for pressures that vary over half a shape
NOTABLE_SECTIONS = 1.0e-2  # of the flexibility, for pressures on half of a section that is rigid


@dataclass(frozen=True)
class BasisReport:
    """A reduced basis in figures.

    Attributes:
        modes: Vibration modes in it, rigid ones included.
        highest_mode: The highest of their frequencies, Hz; 0 without modes.
        contact_shapes: Shapes that contact forces gave it.
        load_shapes: Shapes that loads gave it.
        size: DOFs that are marched.
        left_out: Modes that neither loads nor symmetric contact can move, and that are not marched.
        highest: Highest frequency of the reduced model, Hz.
        neglected: Share of the static flexibility of the contact faces that is neglected, for pressures that vary from
            point to point.
        neglected_smooth: The same for pressures that vary over half a shape; for rigid sections, that press on half of
            the circumference.
        modes_left: Error of the mode shapes in the energy norm, where round-off left more than was asked for; else 0.
        section_flexibility: Deformation of a section under a force of 1 N on half of its circumference, which
            rigid sections leave out, m/N; None: sections deform.
    """

    modes: int
    highest_mode: float
    contact_shapes: int
    load_shapes: int
    size: int
    left_out: int
    highest: float
    neglected: float
    neglected_smooth: float
    modes_left: float = 0.0
    section_flexibility: float | None = None


def basis_remarks(basis: BasisReport | None, frequency: float) -> Iterator[str]:
    """Yield the remarks on a basis before its use, one sentence each.

    Args:
        basis: The basis; None: there is none.
        frequency: Highest frequency of interest, Hz.
    """
    if basis is None:
        return
    if basis.highest_mode < MODES_ABOVE * frequency:
        yield (
            f"the modes of the basis reach to {basis.highest_mode:.4g} Hz, the frequencies of interest to "
            f"{frequency:.4g} Hz: try more modes in [model], up to {MODES_ABOVE:g} times that"
        )
    if basis.section_flexibility is not None:
        if basis.neglected_smooth > NOTABLE_SECTIONS:
            yield (
                f"rigid sections leave out {100 * basis.neglected_smooth:.2g} % of the static flexibility of the beam "
                f"under a pressure on half of a section ({basis.section_flexibility:.2g} m/N): "
                'sections = "deformable" in [model] keeps it'
            )
    elif basis.neglected_smooth > NOTABLE_SMOOTH:
        yield (
            f"the basis misses {100 * basis.neglected_smooth:.2g} % of the contact faces' static flexibility even "
            'where the pressure is smooth: try more modes and shapes in [model], or contact = "all"'
        )
    if basis.modes_left > 0.0:
        yield (
            f"round-off left errors of {basis.modes_left:.1e} in the mode shapes of the basis (in the energy norm; "
            'their frequencies are off by its square): solver.effective = "factor" finds them to round-off'
        )


FEWEST_WAVES = 50
FAINT = 1.0e-4  # of the flexibility of the contact faces in a span: forces that nearly balance each other there
INDEPENDENT = 1.0e-7  # of the largest motion of a face in a span
ALIKE = 1.0e-6  # of the lengths of two elements
ROUND_OFF = 1.0e-14  # of such a motion: planes that a hold does not couple stay apart
SAME_HOLD = 1.0e-10  # of a motion of unit energy: two holds may hold the same motion, and share its force


@dataclass(frozen=True)
class SpanBasis:
    """Columns of V, and the error of the basis.

    Attributes:
        columns: V, (n, r).
        modes: Number of columns that are modes of a span, or motions of a cut.
        highest_mode: Frequency below which each span, with its cuts held, has all of its modes, Hz: at least that asked
            for; infinite where none is left out.
        contact_shapes: Number of responses to contact forces.
        neglected: Share of the static flexibility of the contact faces in the spans that V has not.
    """

    columns: csr_matrix
    modes: int
    highest_mode: float
    contact_shapes: int
    neglected: float

    def report(self, operators: DenseOperators, loads: int) -> BasisReport:
        """Return the size and the error of the basis.

        Args:
            operators: M and K of the beam in it.
            loads: Number of forces that are no contact.
        """
        highest = float(np.sqrt(operators.modes[0].max()) / (2.0 * pi))
        return BasisReport(
            modes=self.modes,
            highest_mode=min(self.highest_mode, highest),
            contact_shapes=self.contact_shapes,
            load_shapes=loads,
            size=operators.size,
            left_out=0,
            highest=highest,
            neglected=self.neglected,
            neglected_smooth=self.neglected,
        )


def wave_count(case: Case) -> int:
    """Return the number of half waves along the beam well above the highest frequency of interest."""
    highest = MODES_ABOVE * highest_frequency(case)
    wavelength = min(bending_wavelength(piece, highest) for piece in case.profile.pieces)
    return max(FEWEST_WAVES, ceil(2.0 * case.beam.length / wavelength) + 2)


def cut_nodes(lengths: Array, spans: int) -> Indices:
    """Return about so many nodes less one, at the longest elements nearby: away from supports where these are graded.

    Args:
        lengths: Lengths of the elements, (elements,).
        spans: Their number.
    """
    size, found, node = len(lengths) / spans, list[int](), 0
    around = np.concatenate([[0.0], lengths[:-1] + lengths[1:]])  # of the elements beside each node
    while node + 1.5 * size < len(lengths):
        near = np.arange(node + ceil(0.5 * size), min(node + ceil(1.5 * size) + 1, len(lengths)))
        longest = near[around[near] > (1.0 - ALIKE) * around[near].max()]
        node = int(longest[np.argmin(np.abs(longest - node - size))])
        found.append(node)
    return np.array(found, dtype=int)


def span_basis(
    operators: SparseOperators,
    cuts: Indices,
    contact: csr_matrix,
    acting: Sequence[Array],
    highest: float,
    fewest: int,
) -> SpanBasis:
    """Return the basis of a beam.

    Args:
        operators: M and K.
        cuts: The DOFs of the cuts.
        contact: Motions of contact points, rows (k, n).
        acting: Forces of loads and of what is attached, (n,) each.
        highest: Frequency up to which the modes of spans are kept, Hz.
        fewest: Number of modes of all spans, at least.
    """
    stiffness, mass = csr_matrix(operators.stiffness), operators.mass
    inner = np.setdiff1d(np.arange(operators.size), cuts)
    coupled = abs(stiffness) + abs(mass)
    count, labels = connected_components(coupled[inner][:, inner], directed=False)
    order = np.argsort(labels, kind="stable")
    spans = np.split(inner[order], np.cumsum(np.bincount(labels, minlength=count))[:-1])
    rows = csr_matrix(vstack([contact, csr_matrix(np.array(acting).reshape(len(acting), operators.size))])).tocsc()
    random = np.random.default_rng(0).choice([-1.0, 1.0], contact.shape[0])  # forces that measure what is left out
    fewest, force = ceil(fewest / count), np.asarray(random @ contact)
    entries = [(np.ones(len(cuts)), cuts, np.arange(len(cuts)))]
    number = np.full(operators.size, -1)
    number[cuts] = np.arange(len(cuts))
    size = modes = len(cuts)
    shapes, missed, whole, complete = 0, 0.0, 0.0, np.inf
    for span in spans:
        near = stiffness[span]
        ends = np.setdiff1d(near.indices, span)
        both = near[:, np.concatenate([span, ends])].toarray()
        own, outer = both[:, : len(span)], both[:, len(span) :]
        inertia = mass[span][:, span].toarray()
        factor = cho_factor(own)
        squares, vibration = eigh(own, inertia)
        kept = max(fewest, int(np.searchsorted(squares, (2.0 * pi * highest) ** 2)))
        complete = min([complete, *squares[kept : kept + 1]])
        acted = rows[:, span].tocsr()
        touched = acted[: contact.shape[0]]
        answers = _contact_responses(touched[np.unique(touched.nonzero()[0])].toarray(), factor)
        loaded = acted[contact.shape[0] :].toarray()
        loaded = cho_solve(factor, loaded[np.any(loaded != 0.0, axis=1)].T)
        vectors = np.concatenate([vibration[:, :kept], answers, loaded], axis=1)
        basis = modal_basis(DenseOperators(inertia, own), vectors, 0.0)
        parts = ((-cho_solve(factor, outer), number[ends]), (basis.columns, size + np.arange(len(basis.squares))))
        for values, columns in parts:
            entries.append((values.ravel(), np.repeat(span, values.shape[1]), np.tile(columns, len(span))))
        size, modes, shapes = size + len(basis.squares), modes + min(kept, len(span)), shapes + answers.shape[1]
        elastic = float(force[span] @ cho_solve(factor, force[span]))
        missed += elastic - float(np.sum((force[span] @ basis.columns) ** 2 / basis.squares))
        whole += elastic
    values, places, columns = (np.concatenate(one) for one in zip(*entries, strict=True))
    found = csr_matrix(coo_matrix((values, (places, columns)), (operators.size, size)))
    below = float(np.sqrt(complete) / (2.0 * pi))
    return SpanBasis(found, modes, below, shapes, max(missed / whole, 0.0) if whole > 0.0 else 0.0)


def _contact_responses(rows: Array, factor: tuple[Array, bool]) -> Array:
    """Return responses to forces that span nearly all that contact does to a span, (n, k).

    Args:
        rows: Motions of contact points, (points, n).
        factor: Factor of K.
    """
    if len(rows) == 0:
        return np.zeros((rows.shape[1], 0))
    _, sizes, directions = np.linalg.svd(rows, full_matrices=False)
    independent = sizes > INDEPENDENT * sizes[0]
    forces = sizes[independent, None] * directions[independent]
    responses = cho_solve(factor, forces.T)
    flexibility = forces @ responses
    flexibilities, mixes = np.linalg.eigh(0.5 * (flexibility + flexibility.T))
    return np.asarray(responses @ mixes[:, flexibilities > FAINT * flexibilities[-1]])


def free_motions(holds: Array, operators: SparseOperators, shift: float) -> csr_matrix:
    """Return the motions that satisfy B u = 0 as sparse columns, (n, n - rank): some DOFs follow from others.

    Args:
        holds: B, (h, n).
        operators: M and K.
        shift: sigma > 0, 1/s^2, about the square of the lowest angular frequency.
    """
    scale = 1.0 / np.sqrt(operators.stiffness.diagonal() + shift * operators.mass.diagonal())
    scaled = holds * scale
    lengths = np.linalg.norm(scaled, axis=1, keepdims=True)
    _, triangle, pivots = qr(scaled / np.where(lengths > 0.0, lengths, 1.0), mode="economic", pivoting=True)
    sizes = np.abs(np.diagonal(triangle))
    rank = int(np.count_nonzero(sizes > SAME_HOLD * sizes.max()))
    following, others = pivots[:rank], pivots[rank:]
    order = np.argsort(others)
    shares = -np.linalg.solve(triangle[:rank, :rank], triangle[:rank, rank:])[:, order]
    follow = coo_matrix(np.where(np.abs(shares) > ROUND_OFF, shares, 0.0))
    others = others[order]
    places = np.concatenate([others, following[follow.row]]), np.concatenate([np.arange(len(others)), follow.col])
    entries = follow.data * scale[following[follow.row]] / scale[others[follow.col]]
    values = np.concatenate([np.ones(len(others)), entries])
    return csr_matrix((values, places), (operators.size, len(others)))
