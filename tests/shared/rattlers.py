"""Oscillators with play under white noise, whose stationary law is known exactly.

    m a + c v + k u = f + contact,    one-sided density of f: S = 4 c T

The density of place and velocity is exp(-(m v^2 / 2 + U(u)) / T), U the potential of spring and contact: contact share,
mean force, mean square and impact rate sqrt(T / (2 pi m)) p(gap) are integrals over the place.
The law holds for any potential, so that in a hole it belongs to the points around, not to the circle.

Source: Risken, The Fokker-Planck Equation (1989), chapter 10, for the stationary solution of Kramers' equation.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import pi, sqrt

import numpy as np
from scipy.integrate import quad
from scipy.sparse import csr_matrix

from gapbeam.solver.contact.laws.contact_law import ContactLaw
from gapbeam.solver.contact.laws.springs import Spring
from gapbeam.solver.diagnostics.march_diagnostics import Accounts
from gapbeam.solver.diagnostics.statistics.run_statistics import RunStatistics
from gapbeam.solver.integrators.scheme_choice import scheme_of
from gapbeam.solver.loads.random_function import RandomSignal
from gapbeam.solver.loads.random_spectra import PowerSpectrum
from gapbeam.solver.march.compiled.compiled_march import CompiledLoop, instants_of
from gapbeam.solver.march.stepwise_march import EffectiveOperators, March, begun
from gapbeam.solver.supports.regions.around_face import BoreFace
from gapbeam.solver.supports.support import Face, Support
from gapbeam.solver.system.dense_operators import DenseOperators
from gapbeam.solver.system.operators import Interface, Load
from gapbeam.solver.system.semi_discrete import ContactOperator, SemiDiscreteSystem, State, imaged

DAMPING = 0.2  # c / m, 1/s: the energy relaxes in 5 s
TEMPERATURE = 1.0  # J; mass, spring and gap are 1 as well
STIFFNESS = 100.0  # of the contact, N/m
CONTACT_TIME = pi / sqrt(1.0 + STIFFNESS)
HIGH = 15.0  # Hz; noise above it would add 0.1 % to the mean square of the velocity
EVERY = 5  # steps between records
AROUND = 24  # points around a hole


@dataclass(frozen=True)
class Rattler:
    """An oscillator with play.

    Attributes:
        system: Function that returns the system under given loads.
        law: The contact law.
        exact: Exact figures, by their names.
    """

    system: Callable[[tuple[Load, ...]], SemiDiscreteSystem]
    law: ContactLaw
    exact: dict[str, float]


def between_stops(count: int) -> Rattler:
    """Return a mass between one or two stops."""
    signs = np.array([-1.0, 1.0])[:count]
    faces = (Face("upper", -1.0), Face("lower", 1.0))[:count]

    def system(loads: tuple[Load, ...]) -> SemiDiscreteSystem:
        contact = ContactOperator(
            interface=Interface(1, np.array([0]), np.array([0])),
            gap_matrix=csr_matrix(signs[:, None]),
            weights=np.ones(count),
            initial_gap=np.ones(count),
            faces=np.arange(count),
            support=Support(faces, area=1.0),
            positions=np.zeros((count, 3)),
        )
        operators = DenseOperators(np.eye(1), np.eye(1))
        return SemiDiscreteSystem(operators, contact, loads, mass_damping=DAMPING)

    def potential(x: float) -> float:
        depths = np.maximum(-(1.0 + signs * x), 0.0)
        return 0.5 * x * x + 0.5 * STIFFNESS * float(depths @ depths)

    def mean(of: Callable[[float], float]) -> float:
        weighted = quad(lambda x: of(x) * np.exp(-potential(x) / TEMPERATURE), -8, 8, points=(-1, 0, 1), epsabs=1e-12)
        return float(weighted[0]) / partition

    partition = 1.0
    partition = mean(lambda _x: 1.0)
    middle = mean(lambda x: x)
    exact = {"probe.mass.rms": sqrt(mean(lambda x: (x - middle) ** 2))}
    for face, sign in zip(faces, signs, strict=True):
        depth = lambda x, s=sign: max(-(1.0 + s * x), 0.0)  # noqa: E731
        exact[f"face.{face.name}.contact_share"] = mean(lambda x, d=depth: float(d(x) > 0.0))
        exact[f"face.{face.name}.mean_force"] = mean(lambda x, d=depth: STIFFNESS * d(x))
        exact[f"face.{face.name}.rms_force"] = sqrt(mean(lambda x, d=depth: (STIFFNESS * d(x)) ** 2))
        density = float(np.exp(-potential(-1.0 / sign) / TEMPERATURE)) / partition
        rate = sqrt(TEMPERATURE / (2.0 * pi)) * density
        exact[f"face.{face.name}.impact_rate"] = rate
        exact[f"face.{face.name}.approach_speed"] = sqrt(0.5 * pi * TEMPERATURE)  # the flux of Maxwell's speeds
        exact[f"face.{face.name}.impact_impulse"] = exact[f"face.{face.name}.mean_force"] / rate
        exact[f"face.{face.name}.impact_duration"] = exact[f"face.{face.name}.contact_share"] / rate
    return Rattler(system, ContactLaw(Spring(STIFFNESS)), exact)


def in_a_hole() -> Rattler:
    """Return a mass that moves in a plane, in a round hole with points around."""
    turns = 2.0 * pi * np.arange(AROUND) / AROUND
    outward = np.column_stack([np.sin(turns), -np.cos(turns)])
    law = ContactLaw(Spring(STIFFNESS))

    def system(loads: tuple[Load, ...]) -> SemiDiscreteSystem:
        contact = ContactOperator(
            interface=Interface(2, np.arange(2), np.arange(2)),
            gap_matrix=csr_matrix(-outward),
            weights=np.ones(AROUND),
            initial_gap=np.ones(AROUND),
            faces=np.zeros(AROUND, dtype=int),
            support=Support((BoreFace("hole", 1.0),), area=1.0),
            positions=np.column_stack([np.zeros(AROUND), outward]),
        )
        operators = DenseOperators(np.eye(2), np.eye(2))
        return SemiDiscreteSystem(operators, contact, loads, mass_damping=DAMPING)

    side = np.linspace(-2.5, 2.5, 1501)
    places = np.stack(np.meshgrid(side, side, indexing="ij"), axis=-1)
    depths = np.maximum(places @ outward.T - 1.0, 0.0)
    potential = 0.5 * np.sum(places**2, axis=-1) + 0.5 * STIFFNESS * np.sum(depths**2, axis=-1)
    density = np.exp(-potential / TEMPERATURE)
    density /= density.sum()
    exact = {
        "probe.mass.rms": sqrt(float(np.sum(density * places[..., 1] ** 2))),
        "probe.mass.lateral_rms": sqrt(float(np.sum(density * places[..., 0] ** 2))),
        "face.hole.contact_share": float(np.sum(density * (depths.max(axis=-1) > 0.0))),
        "face.hole.mean_force": float(np.sum(density * STIFFNESS * depths.sum(axis=-1))),
        "face.hole.rms_force": sqrt(float(np.sum(density * (STIFFNESS * depths.sum(axis=-1)) ** 2))),
    }
    return Rattler(system, law, exact)


def sliding_on_a_stop() -> Rattler:
    """Return a mass that strikes one stop and moves along it, in two directions that do not know of each other.

    The speed along the stop is independent of the place: the work rate is E N E |v_t| = E N sqrt(2 T / (pi m)).
    """
    one = between_stops(1)

    def system(loads: tuple[Load, ...]) -> SemiDiscreteSystem:
        contact = ContactOperator(
            interface=Interface(2, np.arange(2), np.arange(2)),
            gap_matrix=csr_matrix([[-1.0, 0.0]]),
            weights=np.ones(1),
            initial_gap=np.ones(1),
            faces=np.zeros(1, dtype=int),
            support=Support((Face("upper", -1.0),), area=1.0),
            positions=np.zeros((1, 3)),
            tangents=csr_matrix([[0.0, 1.0]]),
            frictionless=True,
            measures_sliding=True,
        )
        return SemiDiscreteSystem(DenseOperators(np.eye(2), np.eye(2)), contact, loads, mass_damping=DAMPING)

    force = one.exact["face.upper.mean_force"]
    exact = {"face.upper.mean_force": force, "face.upper.work_rate": force * sqrt(2.0 * TEMPERATURE / pi)}
    return Rattler(system, one.law, exact)


def marched(rattler: Rattler, seed: int, seconds: float, steps_of_contact: float = 16.0) -> RunStatistics:
    """Return the statistics of a compiled march under white noise; arguments as in `rattled`."""
    return rattled(rattler, seed, seconds, steps_of_contact)[0]


def rattled(
    rattler: Rattler, seed: int, seconds: float, steps_of_contact: float = 16.0
) -> tuple[RunStatistics, Accounts]:
    """Return the statistics and the accounts of a compiled march under white noise.

    Args:
        rattler: Oscillator with play.
        seed: Seed of the noise.
        seconds: Span, s.
        steps_of_contact: Steps in the duration of a contact.
    """
    size = rattler.system(()).operators.size
    step = CONTACT_TIME / steps_of_contact
    density = 4.0 * DAMPING * TEMPERATURE
    spectrum = PowerSpectrum((0.0, HIGH), (density, density))
    loads = tuple(
        Load(f"noise {axis}", np.eye(size)[axis], RandomSignal(spectrum, seed, f"noise {axis}", 0.0).value,
             of_arrays=True)
        for axis in range(size)
    )  # fmt: skip
    system, scheme = rattler.system(loads), scheme_of("discrete-gradient")
    steps = round(seconds / (step * EVERY)) * EVERY
    plan = March(system, rattler.law, scheme, EffectiveOperators(system, scheme), step, steps)
    still = np.zeros(size)
    depth = system.contact.depth(still)
    rest = State(0.0, imaged(system.operators, still), imaged(system.operators, still), depth, np.zeros_like(depth))
    start = begun(plan, rest)
    accounts = Accounts.opened(system, rattler.law, start, step)
    found = RunStatistics(
        system.contact.face_names, ("mass",), size > 1, EVERY * step, slides=system.contact.measures_sliding
    )
    none = np.zeros((1, len(system.contact.face_names)))
    found.see(_rows(np.zeros(1), none, none, none, none, none, none, still[None]))
    for block in CompiledLoop(plan).blocks(start, EVERY, accounts):
        now = instants_of(block, len(block.times))
        found.see(
            _rows(
                now.times,
                now.contact_time,
                now.impulse,
                now.closings,
                now.approach,
                now.force_square,
                now.sliding_work,
                now.u,
            )
        )
    return found, accounts


def _rows(times: np.ndarray, closed: np.ndarray, impulse: np.ndarray, closings: np.ndarray, approach: np.ndarray,
    square: np.ndarray, sliding: np.ndarray | None, u: np.ndarray,
) -> dict[str, np.ndarray]:  # fmt: skip
    """Return records as histories have them; components of the place stand as x, lateral, bending."""
    place = np.zeros((len(times), 1, 3))
    place[:, 0, -u.shape[1] :] = u
    parts = None if sliding is None else np.stack([np.zeros_like(sliding), sliding, np.zeros_like(sliding)], axis=-1)
    return {
        "time": times, "contact_time": closed, "impulse": impulse, "closings": closings,
        "approach_speeds": approach, "force_square": square, "sliding_work": sliding,
        "work_by_mode": parts,
        "displacement": place, "acceleration_absolute": np.zeros_like(place),
    }  # fmt: skip
