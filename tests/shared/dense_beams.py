"""Random dense systems with two faces: what reduced models, and beams in holes, look like to a march."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_matrix

from gapbeam.solver.supports.regions.around_face import BoreFace
from gapbeam.solver.supports.support import Support
from gapbeam.solver.supports.support_tables import BaseAndGland
from gapbeam.solver.system.dense_operators import DenseOperators
from gapbeam.solver.system.operators import Interface, Load
from gapbeam.solver.system.semi_discrete import ContactOperator, SemiDiscreteSystem, State, imaged


def dense_beam(size: int = 8, points: int = 12, seed: int = 0, damping: float = 0.3) -> SemiDiscreteSystem:
    """A body of some DOFs in full matrices between two faces, pushed about by two forces.

    Args:
        size: DOFs.
        points: Contact points, half of them on each face.
        seed: Seed of the matrices.
        damping: Damping by M, 1/s; damping by K follows.
    """
    random = np.random.default_rng(seed)
    mixed = random.standard_normal((size, size)) + 2.0 * np.eye(size)
    squares = np.geomspace(4.0, 4.0e4, size)
    stiffness = mixed.T @ np.diag(squares) @ mixed
    shapes = random.standard_normal((points, size)) / np.sqrt(size)
    shapes[points // 2 :] = -shapes[: points - points // 2]
    contact = ContactOperator(
        interface=Interface(size, np.arange(size), np.arange(size)),
        gap_matrix=csr_matrix(shapes),
        weights=random.uniform(0.5, 1.5, points) / points,
        initial_gap=random.uniform(0.0, 0.02, points),
        faces=np.repeat([0, 1], [points // 2, points - points // 2]),
        support=Support(BaseAndGland(length=1.0, clearance=0.0).faces, area=1.0),
        positions=random.uniform(0.0, 1.0, (points, 3)),
    )
    weight, push = random.standard_normal((2, size))
    loads = (
        Load("weight", weight, lambda _time: 1.0, static=True),
        Load("push", push, lambda time: 8.0 * float(np.sin(9.0 * time))),
    )
    operators = DenseOperators(mixed.T @ mixed, stiffness, np.diag(np.linspace(0.0, 1.0, size)))
    return SemiDiscreteSystem(operators, contact, loads, damping, 1.0e-5)


def dense_shaft(
    sections: int = 3,
    around: int = 24,
    seed: int = 0,
    damping: float = 0.3,
    clearance: tuple[float, float] = (0.005, 0.02),
    rubs: bool = False,
) -> SemiDiscreteSystem:
    """A shaft of rigid sections in two holes: every section has DOFs of its own, and points around it.

    Args:
        sections: Sections, those of the first half in the first hole.
        around: Contact points around each.
        seed: Seed of the matrices.
        damping: Damping by M, 1/s; damping by K follows.
        clearance: Bounds of the gaps of the points.
        rubs: Whether sections have the other four motions of rigid ones too, and the points directions to rub along.
    """
    random, size = np.random.default_rng(seed), (6 if rubs else 2) * sections
    mixed = random.standard_normal((size, size)) + 2.0 * np.eye(size)
    stiffness = mixed.T @ np.diag(np.geomspace(4.0, 4.0e3, size)) @ mixed
    turns = np.tile(2.0 * np.pi * np.arange(around) / around, sections)
    numbers = np.repeat(np.arange(sections), around)
    faces = (BoreFace("first_hole", 1.0), BoreFace("second_hole", 1.0, offset=0.004))
    positions = np.column_stack([0.2 * (1.0 + numbers), np.sin(turns), -np.cos(turns)])
    owners = np.where(numbers < sections // 2, 0, 1)
    order = random.permutation(len(numbers))  # no point need stand beside its neighbor
    positions, owners, numbers = positions[order], owners[order], numbers[order]
    gaps = np.zeros((len(order), size))
    gaps[np.arange(len(order)), 2 * numbers], gaps[np.arange(len(order)), 2 * numbers + 1] = -positions[:, 1:].T
    contact = ContactOperator(
        interface=Interface(size, np.arange(size), np.arange(size)),
        gap_matrix=csr_matrix(gaps),
        weights=random.uniform(0.5, 1.5, len(order)) / len(order),
        initial_gap=random.uniform(*clearance, len(order)),
        faces=owners,
        support=Support(faces, area=1.0),
        positions=positions,
        tangents=_slips(positions[:, 1:], numbers, size) if rubs else None,
    )
    weight, push = random.standard_normal((2, size))
    loads = (
        Load("weight", weight, lambda _time: 1.0, static=True),
        Load("push", push, lambda time: 8.0 * float(np.sin(9.0 * time))),
    )
    return SemiDiscreteSystem(DenseOperators(mixed.T @ mixed, stiffness), contact, loads, damping, 1.0e-5)


def _slips(places: np.ndarray, numbers: np.ndarray, size: int) -> csr_matrix:
    """Return the motions of points on sections along x and around, (2 m, size): the last DOFs of a section cause them.

    They are an axial motion, two rotations of the section out of its plane, and one about the axis.
    """
    (y, z), every, first = places.T, np.arange(len(places)), size - 4 * (numbers + 1)
    slips = np.zeros((len(places), 2, size))
    for column, shares in enumerate((np.ones(len(places)), y, z)):
        slips[every, 0, first + column] = shares
    slips[every, 1, first + 3] = 1.0
    slips[every, 1, 2 * numbers], slips[every, 1, 2 * numbers + 1] = -z, y
    return csr_matrix(slips.reshape(-1, size))


def thrown_start(system: SemiDiscreteSystem, speed: float = 1.0) -> State:
    """The undeformed body, thrown."""
    size = system.operators.size
    v = speed * np.cos(np.arange(size))
    depth = system.contact.depth(np.zeros(size))
    return State(
        0.0,
        imaged(system.operators, np.zeros(size)),
        imaged(system.operators, v),
        depth,
        np.zeros(system.contact.size),
    )
