"""Vibration modes of a beam as contact holds it: seated, free, and with both faces closed.

    (K + G^T (w kappa) G) x = (2 pi f)^2 M x

kappa is the slope of the contact law where a point is closed, 0 where it is open: small vibrations about a state in
which no point opens or closes. Masses and springs of exciters are included. By SLEPc for finite elements, by LAPACK for
reduced models and beam elements.

A mode of a finite element body is named by the motion of its cross-sections as a beam: bending, stretching or twist.
The nodes are gathered in slices along x. In each slice their masses (the diagonal of M, scaled to its total) give the
mean motion, and its first moment about the axis the twist; the share of the kinetic energy that each of these holds
names the mode.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from math import pi

import numpy as np
from scipy.sparse import csr_matrix

from gapbeam.solver.assembly.elasticity import mass_of
from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.models.body import Body
from gapbeam.solver.models.model import Model
from gapbeam.solver.seat.escape import RigidMotions
from gapbeam.solver.seat.static_seat import find_seat
from gapbeam.solver.system.dense_operators import DenseOperators
from gapbeam.solver.system.operators import Array, Springs
from gapbeam.solver.system.rank_one_update import AttachedOperators

KINDS = {2: ("axial", "bending"), 3: ("axial", "lateral", "bending", "torsional")}
MIXED = "mixed"
OF_SUPPORT = "support"
MOST_SLICES = 96
HELD = 0.5  # of the kinetic energy, for a name


@dataclass(frozen=True)
class SectionMotion:
    """The motion of the sections in one mode.

    Attributes:
        kind: "axial", "bending", "lateral", "torsional", or "mixed" where no share is above one half; "support" where
            the bodies of supports hold more than that.
        share: Share of the kinetic energy that the motion of that kind holds.
        bending: Mean motion in the bending direction, (slices,), as the shape is scaled.
    """

    kind: str
    share: float
    bending: Array


class Sections:
    """Slices of a beam along its axis, on all ranks.

    Attributes:
        places: Mean x of each slice, (slices,), m.
        masses: Mass of each slice, (slices,), kg.

    Collective to make and to use.
    """

    def __init__(self, model: Model) -> None:
        self._model, self._comm = model, model.space.mesh.comm
        space = model.space
        self._components = space.dofmap.index_map_bs
        owned = space.dofmap.index_map.size_local
        x = space.tabulate_dof_coordinates()[:owned]
        self._node_masses = self._masses()
        slices = self._slices(x)
        edges = np.linspace(0.0, model.length, slices + 1)
        self._slice = np.clip(np.searchsorted(edges, x[:, 0], side="right") - 1, 0, slices - 1)
        self._count = slices
        sums = self._sums(np.stack([np.ones(owned), *x.T]))
        self._filled = sums[0] > 0.0
        inverse = np.where(self._filled, 1.0, 0.0) / np.where(self._filled, sums[0], 1.0)
        self._inverse = inverse
        means = sums[1:] * inverse
        self._off = x.T - means[:, self._slice]
        self._moments = self._sums(self._off**2)
        self.masses, self.places = sums[0][self._filled], means[0][self._filled]

    def motion(self, shape: Array) -> SectionMotion:
        """Return the motion of the sections.

        Args:
            shape: Marched DOFs that this rank owns, (n,).
        """
        of_bodies = self._of_bodies(shape)
        if of_bodies > HELD:
            return SectionMotion(OF_SUPPORT, of_bodies, np.zeros(int(np.sum(self._filled))))
        return self._of_beam(self._model.expand(shape))

    def _of_bodies(self, shape: Array) -> float:
        """Return the share of the kinetic energy that the bodies of supports have."""
        size = self._model.body.operators.size
        if len(shape) == size:
            return 0.0
        weighted = self._model.system.operators.apply_mass(shape)
        return float(shape[size:] @ weighted[size:] / (shape @ weighted))

    def _of_beam(self, shape: Array) -> SectionMotion:
        """Return the motion of the sections where the nodes of this rank move so, (n,)."""
        u = shape.reshape(-1, self._components).T
        components = self._components
        bending = components - 1
        sums = self._sums(np.concatenate([u, (u * u).sum(axis=0)[None]]))
        means = sums[:components] * self._inverse
        energies = [float(mass) for mass in (sums[:components] * means).sum(axis=1)]
        if components == 3:
            energies.append(self._twisting(u))
        total = float(sums[components].sum())
        best = int(np.argmax(energies))
        share = energies[best] / total
        kind = KINDS[components][best] if share > HELD else MIXED
        return SectionMotion(kind, share, means[bending][self._filled])

    def _twisting(self, u: Array) -> float:
        """Return the share of u_z = r y and of u_y = -r z, each with its own r in a slice."""
        energy = 0.0
        for component, lever in ((2, 1), (1, 2)):
            moved = self._sums((u[component] * self._off[lever])[None])[0]
            held = self._moments[lever] > 0.0
            energy += float(np.sum(moved[held] ** 2 / self._moments[lever][held]))
        return energy

    def _sums(self, values: Array) -> Array:
        """Return sum of m v over the nodes of each slice, (rows, slices), the same on all ranks."""
        local = np.stack(
            [np.bincount(self._slice, weights=self._node_masses * row, minlength=self._count) for row in values]
        )
        total: Array = np.empty_like(local)
        self._comm.Reduce(local, total)
        self._comm.Bcast(total)
        return total

    def _masses(self) -> Array:
        """Return masses of the nodes: the diagonal of the consistent mass matrix, scaled to the mass of the beam."""
        space, meshed = self._model.space, self._model.body.meshed
        profile = self._model.profile
        diagonal = mass_of(space, profile, 1.0).of_nodes()
        total = self._comm.bcast(self._comm.reduce(float(diagonal.sum())))
        mass = profile.pieces[0].material.density * meshed.section.volume if profile.one_material else profile.mass
        return np.asarray(diagonal * (mass / total))

    def _slices(self, x: Array) -> int:
        """Return the number of slices with at least one node each, from the largest distance between columns."""
        gathered = self._comm.gather(np.unique(np.round(x[:, 0] / self._model.length, 6)))
        widest = 0.0
        if gathered is not None:
            widest = float(np.max(np.diff(np.unique(np.concatenate(gathered)))))
        widest = self._comm.bcast(widest)
        return int(np.clip(np.floor(1.0 / widest), 4, MOST_SLICES))


SEATED, FREE, CLOSED = "seated", "free", "closed"
KINDS_PER_BENDING = {2: 2, 3: 4}  # modes of all kinds to look at for one of bending
BESIDES = 8
RIGID = 2  # bending modes of the free beam that are rigid motions
SLICES_A_HALF_WAVE = 2
GROWTH = 2


@dataclass(frozen=True)
class HeldModes:
    """Modes of a beam in one state of contact.

    Attributes:
        name: "seated", "free" or "closed".
        closed: Contact points that are closed.
        points: Contact points.
        frequencies: Frequencies of all modes that were found, ascending, (k,), Hz.
        shapes: Mode shapes, on the DOFs of the model that this rank owns, (n, k).
        motions: Motions of the sections, (k,).
        places: Places of the sections, (slices,), m.
        masses: Masses of the sections, (slices,), kg.
        length: Length of the beam, m.
    """

    name: str
    closed: int
    points: int
    frequencies: Array
    shapes: Array
    motions: tuple[SectionMotion, ...]
    places: Array
    masses: Array
    length: float

    def bending(self) -> tuple[Array, Array]:
        """Return frequencies (b,), Hz, and motions of sections (b, slices) of the bending modes, ascending."""
        chosen = [number for number, motion in enumerate(self.motions) if motion.kind == "bending"]
        return self.frequencies[chosen], np.array([self.motions[number].bending for number in chosen])


def held_modes(model: Model, count: int, more: int = 0) -> tuple[HeldModes, HeldModes, HeldModes]:
    """Return the modes of a beam seated under its static loads, free of contact, and with both faces closed.

    Args:
        model: The model; its contact has to be symmetric (H = G).
        count: Number of bending modes of each; of the free beam two more, which are rigid.
        more: Number returned where the model has so many.

    Raises:
        UserError: The contact is not symmetric, or the model has fewer bending modes.
        NotConverged: No seat was found.
        RunError: The modes could not be found.

    Collective.
    """
    contact, law = model.system.contact, model.law
    if not contact.symmetric:
        raise UserError(
            'contact.formulation = "nitsche" with theta other than 1: its tangent is not symmetric, so that it has no '
            "modes of vibration; take theta = 1"
        )
    sections = Sections(model)
    most = most_bending_modes(model, sections)
    if count > most:
        raise UserError(
            f"{count} bending modes were asked for; expected 1 to {most}: half a wave of more would be shorter than "
            "two distances between the nodes of the mesh or than the thickness of the beam; ask for fewer, or refine "
            "the mesh"
        )
    wanted = min(max(count, more), most)
    rigid = partial(RigidMotions.of_body, model.body, model.system.operators.size)
    seat = find_seat(model.system, law, model.seat_springs, rigid=rigid)
    everywhere = np.full(contact.size, model.compared_depth)
    states = {
        SEATED: law.static(seat.state.depth).slope,
        FREE: np.zeros(contact.size),
        CLOSED: law.closed_slope(everywhere),
    }
    seated, free, closed = (
        _modes(model, sections, name, np.asarray(slopes), count, wanted, 0 if np.any(slopes > 0.0) else RIGID)
        for name, slopes in states.items()
    )
    return seated, free, closed


def free_bending_modes(model: Model, count: int) -> HeldModes:
    """Return the modes of a beam free of contact, at least `count` bending modes; 1 and 2 of a free beam are rigid.

    Raises:
        UserError: The model has fewer bending modes.
        RunError: The modes could not be found.

    Collective.
    """
    sections = Sections(model)
    most = most_bending_modes(model, sections) + RIGID
    if count > most:
        raise UserError(
            f"bending mode {count} was asked for; expected 1 to {most}: half a wave of a higher one would be shorter "
            "than two distances between the nodes of the mesh or than the thickness of the beam; refine the mesh"
        )
    return _modes(model, sections, FREE, np.zeros(model.system.contact.size), count, count)


def most_bending_modes(model: Model, sections: Sections) -> int:
    """Return the number of bending modes that mesh and beam have: half waves of two slices and of a thickness."""
    return min(len(sections.places) // SLICES_A_HALF_WAVE - RIGID, int(model.length / model.profile.thickest))


def _modes(
    model: Model, sections: Sections, name: str, slopes: Array, count: int, more: int, rigid: int = 0
) -> HeldModes:
    """Return the modes for contact slopes kappa, (m,), Pa/m: as many as hold `count` bending modes, `more` if it can.

    Rigid modes come on top of both. Collective.
    """
    least, most = count + rigid, more + rigid
    contact, gap = model.system.contact, model.system.contact.gap_matrix
    springs = Springs(contact.interface, csr_matrix(gap.T @ gap.multiply((contact.weights * slopes)[:, None])))
    wanted = KINDS_PER_BENDING[model.dimension] * most + BESIDES
    while True:
        frequencies, shapes = _lowest(model, springs, wanted)
        motions = tuple(sections.motion(shape) for shape in shapes.T)
        found = sum(motion.kind == "bending" for motion in motions)
        if found >= most or (found >= least and len(frequencies) < wanted):
            kept = _of_basis(model.body, frequencies, motions, least)
            break
        if len(frequencies) < wanted:
            raise UserError(
                f"{count} bending modes were asked for; the model with {model.dofs} DOFs has "
                f"{found - rigid} ({name}); ask for fewer, or take more model.modes, more elements or a finer mesh"
            )
        wanted *= GROWTH
    closed = int(np.count_nonzero(slopes > 0.0))
    return HeldModes(
        name=name,
        closed=closed,
        points=contact.size,
        frequencies=frequencies[:kept],
        shapes=shapes[:, :kept],
        motions=motions[:kept],
        places=sections.places,
        masses=sections.masses,
        length=model.length,
    )


def _of_basis(body: Body, frequencies: Array, motions: tuple[SectionMotion, ...], count: int) -> int:
    """Return the number of modes below the highest that a reduced basis was made of; all for other models.

    Raises:
        UserError: Not all of the bending modes wanted do.
    """
    basis = body.basis
    if basis is None:
        return len(frequencies)
    bending = [number for number, motion in enumerate(motions) if motion.kind == "bending"]
    highest = frequencies[bending[count - 1]]
    if highest > basis.highest_mode:
        raise UserError(
            f"{count} bending modes reach to {highest:.4g} Hz, the modes of the reduced basis only to "
            f"{basis.highest_mode:.4g} Hz; take {body.case.model.more_modes}, or ask for fewer"
        )
    return int(np.count_nonzero(frequencies <= basis.highest_mode))


def _lowest(model: Model, springs: Springs, count: int) -> tuple[Array, Array]:
    """Return the lowest frequencies, (k,), Hz, and shapes, (n, k); fewer than asked for where there are fewer."""
    operators, on_mass, on_stiffness = model.system.operators, [], [springs]
    if not isinstance(operators, DenseOperators):
        from gapbeam.solver.linear_algebra.petsc_operators import PetscOperators
        from gapbeam.solver.models.reduction.vibration_modes import lowest_modes

        if isinstance(operators, AttachedOperators):
            outer, operators = operators, operators.body
            assert isinstance(operators, PetscOperators)
            on_mass.append(operators.as_springs(outer.masses))
            on_stiffness.append(operators.as_springs(outer.springs))
        assert isinstance(operators, PetscOperators)
        mass, stiffness = operators.with_springs(on_mass, on_stiffness)
        shift = (2.0 * pi * model.bending_frequency) ** 2
        factor = operators.shifted_solver(mass, stiffness.copy(), shift, operators.solver.tolerance)
        modes = lowest_modes(mass, stiffness, factor, shift, count)
        return modes.frequencies, modes.shapes
    owned, slots = springs.interface.owned, springs.interface.slots
    stiffness = operators.stiffness.copy()
    stiffness[np.ix_(owned, owned)] += springs.matrix.toarray()[np.ix_(slots, slots)]
    squares, shapes = DenseOperators(operators.mass, stiffness).modes
    order = np.argsort(squares)[:count]
    return np.sqrt(np.maximum(squares[order], 0.0)) / (2.0 * pi), shapes[:, order]
