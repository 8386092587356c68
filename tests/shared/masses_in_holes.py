"""Masses on springs in round holes that are met as circles, and before flat stops: any contact law, any step."""

from __future__ import annotations

from collections.abc import Mapping
from math import pi

import numpy as np
from pydantic import TypeAdapter
from scipy.sparse import csr_matrix

from gapbeam.solver.contact.formulations.circle_contact import circle_contact
from gapbeam.solver.contact.laws.contact_law import ContactLaw, make_law
from gapbeam.solver.contact.laws.law_choice import Law
from gapbeam.solver.integrators.scheme_choice import scheme_of
from gapbeam.solver.march.stepwise_march import EffectiveOperators, March, begun
from gapbeam.solver.supports.regions.around_face import BoreFace
from gapbeam.solver.supports.support import Support
from gapbeam.solver.system.dense_operators import DenseOperators
from gapbeam.solver.system.operators import Interface, Load
from gapbeam.solver.system.semi_discrete import ContactOperator, SemiDiscreteSystem, State, imaged

AROUND = 8  # points around a section, which a station stands for
LAWS: TypeAdapter[Law] = TypeAdapter(Law)


def law_of(table: Mapping[str, object], stiffness: float, damping: float = 0.0, adhesive: bool = False) -> ContactLaw:
    """Return the law of a table of a case file, on an area of 1 m^2.

    Args:
        table: contact.law.
        stiffness: K, N/m^n.
        damping: contact.damping, N s/m.
        adhesive: Whether the damper may pull.
    """
    chosen = LAWS.validate_python(table)
    return make_law(chosen, stiffness, 1.0e-6, damping, adhesive=adhesive, slowest_touch=1.0e-4)


def masses_in_holes(
    law: ContactLaw,
    dt: float,
    holes: int,
    stops: int,
    seed: int = 0,
    speed: float = 1.0,
) -> tuple[March, State]:
    """Return the march of masses of 1 kg that fly at a speed, and its start.

    Each mass moves along y and z. Springs of about 1 N/m tie all of them; some are in holes with a radial clearance of
    0.5 m, others have a stop 0.5 m below. A harmonic force shakes them along y and z.

    Args:
        law: The contact law at all stations and stops.
        dt: Step, s.
        holes: Number of masses in holes.
        stops: Number of masses before a stop.
        seed: Seed of places, speeds and springs.
        speed: About how fast masses are, m/s.
    """
    random, count = np.random.default_rng(seed), holes + stops
    size = 2 * count
    angles = np.arange(AROUND) * 2.0 * pi / AROUND
    outward = np.column_stack([np.sin(angles), -np.cos(angles)])
    rows, places, faces = list[np.ndarray](), list[np.ndarray](), list[int]()
    for mass in range(count):
        directions = outward if mass < holes else outward[:1]
        block = np.zeros((len(directions), size))
        block[:, 2 * mass : 2 * mass + 2] = -directions
        rows.append(block)
        places.append(np.column_stack([np.full(len(directions), float(mass)), 5.0 * directions]))
        faces += [mass] * len(directions)
    points = ContactOperator(
        interface=Interface(size, np.arange(size), np.arange(size)),
        gap_matrix=csr_matrix(np.concatenate(rows)),
        weights=np.where(np.array(faces) < holes, pi / AROUND, 1.0),
        initial_gap=np.full(len(faces), 0.5),
        faces=np.array(faces),
        support=Support(tuple(BoreFace(f"hole_{mass}", mass, 0.5, exact=True) for mass in range(count)), area=pi),
        positions=np.concatenate(places),
    )
    contact = circle_contact(points, [mass < holes for mass in range(count)])
    mixed = random.normal(size=(size, size))
    operators = DenseOperators(np.eye(size), mixed @ mixed.T / size)
    loads = tuple(
        Load(f"force_{axis}", random.normal(size=size), lambda time, w=w: speed * float(np.cos(w * time)))
        for axis, w in enumerate((1.1, 2.7))
    )
    system = SemiDiscreteSystem(operators, contact, loads)
    scheme = scheme_of("discrete-gradient")
    plan = March(system, law, scheme, EffectiveOperators(system, scheme), dt, 1)
    u = 0.4 * random.uniform(-1.0, 1.0, size) / np.sqrt(2.0)
    v = speed * random.normal(size=size)
    depth = contact.depth(u)
    state = State(0.0, imaged(operators, u), imaged(operators, v), depth, np.zeros(contact.size))
    return plan, begun(plan, state)
