"""Exciters against closed forms: of oscillators, of a floating rigid beam, of a cantilever with a mass at its tip."""

from __future__ import annotations

from dataclasses import replace
from math import cos, cosh, pi, sin, sinh, sqrt
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mpi4py import MPI
from scipy.optimize import brentq
from scipy.sparse import csr_matrix, identity

import gapbeam
from gapbeam.solver.case.checks.periodic_checks import value_of
from gapbeam.solver.case.reading.case_reader import read_case
from gapbeam.solver.diagnostics.march_diagnostics import Accounts
from gapbeam.solver.integrators.scheme_choice import scheme_names, scheme_of
from gapbeam.solver.integrators.time_scheme import TimeScheme
from gapbeam.solver.march.compiled.compiled_march import CompiledLoop
from gapbeam.solver.march.stepwise_march import EffectiveOperators, March, begun, march
from gapbeam.solver.messages.errors import CaseError
from gapbeam.solver.models.body import body_key
from gapbeam.solver.models.model import Model, build_body, model_of
from gapbeam.solver.models.timoshenko_beam import TimoshenkoBeam, of_elements
from gapbeam.solver.periodic.harmonic_balance import HarmonicBalance
from gapbeam.solver.periodic.period_map import MarchedMap, ModalMap
from gapbeam.solver.periodic.shooting import Fourier
from gapbeam.solver.run.run_case import run_case
from gapbeam.solver.system.modal_coordinates import modal_system
from gapbeam.solver.system.operators import RankOnes
from gapbeam.solver.system.rank_one_update import AttachedOperators, attached
from gapbeam.solver.system.semi_discrete import VALUE, SemiDiscreteSystem, State, imaged
from tests.shared.case_texts import GOOD, assert_says, faults_of, written
from tests.shared.command import alone, on_ranks
from tests.shared.dense_beams import dense_beam, thrown_start
from tests.shared.models import (
    BEAM,
    GRAVITY,
    SOLID,
    beam_case,
    beam_model,
    mass_of,
    out_of_reach,
    seat_of,
    stiffness_of,
)
from tests.shared.passages import followed
from tests.shared.toys import ledger_of, steps_of
from tests.verification.test_compiled_march import LAWS, assert_same_accounts, close

WEIGHTLESS = {"type": "exciter", "point": 0.255, "amplitude": 0.0, "frequency": 20.0}
EXCITER_CASE = Path(__file__).parents[2] / "cases" / "exciter.toml"
MASS, SPRING, DAMPER = 0.3, 2.0e4, 12.0
EXCITER = {**WEIGHTLESS, "mass": MASS, "stiffness": SPRING, "damping": DAMPER}
BEAM_MASS = 7919.0 * 0.51 * 0.012 * 0.02
STIFF: dict[str, Any] = {"material": {**BEAM["material"], "young_modulus": 2.1e13}}
"""A beam that is rigid to five digits at the frequencies of these tests."""
SCHEMES: dict[str, TimeScheme] = {
    name: scheme_of(name) for name in scheme_names() if name not in scheme_names("explicit")
}


def floating(loads: tuple[Any, ...], model: str, **damping: float) -> Model:
    """A rigid beam far from its support, under these loads."""
    changes: dict[str, Any] = {**STIFF, "damping": damping or {}, "model": {"type": model}}
    made = beam_model(changes, loads, {"middle": 0.255})
    return replace(made, system=out_of_reach(made.system))


def lifted(model: Model, speed: float) -> State:
    """The undeformed beam moving upward as a whole."""
    operators, dimension = model.system.operators, model.case.mesh.dimension
    v = np.zeros(model.mesh_dofs)
    v[dimension - 1 :: dimension] = speed
    if model.case.model.type == "beam":
        v = speed * np.tile([1.0, 0.0], operators.size // 2)
    elif model.case.model.type == "reduced":
        v = np.linalg.lstsq(np.asarray(model.body.expansion), v)[0]
    contact = model.system.contact
    depth = contact.depth(np.zeros(contact.interface.size))
    still = np.zeros(contact.size)
    return State(0.0, imaged(operators, np.zeros(operators.size)), imaged(operators, v), depth, still)


def motion(model: Model, scheme: TimeScheme, start: State, dt: float, steps: int) -> np.ndarray:
    """The motion of the first probe in the bending direction."""
    probe = next(iter(model.probes.values()))
    taken = steps_of(model.system, model.law, scheme, start, dt, steps)
    return np.array([probe.evaluate(step.new.u[VALUE], model.system.operators)[-1] for step in taken])


def decaying(times: np.ndarray, mass: float, spring: float, damper: float, speed: float) -> np.ndarray:
    """The free motion of an oscillator from rest position at a speed."""
    omega, decay = sqrt(spring / mass), damper / (2.0 * mass)
    damped = sqrt(omega**2 - decay**2)
    return speed / damped * np.exp(-decay * times) * np.sin(damped * times)


@pytest.mark.parametrize("kind", ["full", "reduced", "beam"])
def test_a_rigid_beam_swings_on_the_suspension(kind: str) -> None:
    """Frequency sqrt(k / (M + m)) and decay c / (2 (M + m)), in every model."""
    model, dt, steps = floating((EXCITER,), kind), 2.0e-4, 300
    found = motion(model, scheme_of("discrete-gradient"), lifted(model, 0.1), dt, steps)
    expected = decaying(dt * np.arange(1, steps + 1), BEAM_MASS + MASS, SPRING, DAMPER, 0.1)
    assert np.abs(found - expected).max() < 6e-4 * np.abs(expected).max()
    free = decaying(dt * np.arange(1, steps + 1), BEAM_MASS, SPRING, DAMPER, 0.1)
    assert np.abs(found - free).max() > 0.1 * np.abs(expected).max(), "the mass makes no difference"


@pytest.mark.parametrize("scheme", SCHEMES)
def test_every_scheme_knows_the_damper(scheme: str) -> None:
    model, dt, steps = floating((EXCITER,), "beam"), 2.0e-4, 300
    start = begun(_plan(model.system, model, SCHEMES[scheme], dt, steps), lifted(model, 0.1))
    found = motion(model, SCHEMES[scheme], start, dt, steps)
    expected = decaying(dt * np.arange(1, steps + 1), BEAM_MASS + MASS, SPRING, DAMPER, 0.1)
    assert np.abs(found - expected).max() < 1e-3 * np.abs(expected).max()


def _plan(system: SemiDiscreteSystem, model: Model, scheme: TimeScheme, dt: float, steps: int) -> March:
    return March(system, model.law, scheme, EffectiveOperators(system, scheme), dt, steps)


@pytest.mark.slow(minutes=0.1)
def test_the_explicit_scheme_agrees_with_the_implicit_one() -> None:
    """On the finite elements, with a stable step that the mass and the spring do not spoil."""
    loads = ({**EXCITER, "amplitude": 20.0},)
    explicit = beam_model(
        {"contact": {"stiffness": 1e9}, "time": {"scheme": "central-difference", "step": "auto", "end": 1e-3}},
        loads,
        {"tip": 0.51},
    )
    implicit = beam_model({"contact": {"stiffness": 1e9}}, loads, {"tip": 0.51})
    implicit = replace(implicit, system=out_of_reach(implicit.system))
    explicit = replace(explicit, system=out_of_reach(explicit.system))
    assert isinstance(explicit.system.operators, AttachedOperators)
    dt, steps = explicit.step, 3000
    assert dt < 5e-7
    start = begun(_plan(explicit.system, explicit, scheme_of("central-difference"), dt, steps), lifted(explicit, 0.1))
    taken = steps_of(explicit.system, explicit.law, scheme_of("central-difference"), start, dt, steps)
    ledger = ledger_of(explicit.system, explicit.law, start, taken)
    assert abs(ledger.residual) < 1e-9 * ledger.exchanged
    coarse = 1.0e-5
    slow = motion(implicit, scheme_of("discrete-gradient"), lifted(implicit, 0.1), coarse, round(steps * dt / coarse))
    end = explicit.probes["tip"].evaluate(taken[-1].new.u[VALUE], explicit.system.operators)[-1]
    assert end == pytest.approx(slow[-1], rel=5e-3)


def test_the_steady_amplitude_is_that_of_an_oscillator() -> None:
    """F / |k - w^2 (M + m) + i w c|, by harmonic balance and by a march."""
    force = 30.0
    model = floating(({**EXCITER, "amplitude": force},), "beam")
    modal, omega = modal_system(model.system), 2.0 * pi * 20.0
    assert modal is not None
    series = Fourier(3, 64, omega)
    balance = HarmonicBalance(modal, model.law, series)
    found = balance.solve(np.zeros((series.size, balance.basis[1].shape[0])))
    row = model.probes["middle"].evaluate(modal.shapes.T, model.system.operators)[:, -1]
    expected = force / abs(SPRING - omega**2 * (BEAM_MASS + MASS) + 1j * omega * DAMPER)
    assert series.amplitudes(found.coordinates @ row[:, None])[0, 0] == pytest.approx(expected, rel=1e-4)
    period_map = ModalMap(modal, model.law, scheme_of("discrete-gradient"), 1.0 / 20.0 / 400, 400)
    end = period_map.over(80).after(np.zeros(2 * len(modal.squares)))
    places, _ = period_map.history(end)
    middle = model.probes["middle"].evaluate(places, model.system.operators)[:, -1]
    assert np.abs(middle).max() == pytest.approx(expected, rel=1e-3)


def test_rayleigh_damping_is_that_of_the_beam_alone() -> None:
    """A floating body loses its speed at c_M M / (M + m): the moving mass feels no damping of the material."""
    model, dt, steps = floating(({**WEIGHTLESS, "mass": MASS},), "full", mass=20.0, stiffness=1e-5), 1e-3, 50
    found = motion(model, scheme_of("discrete-gradient"), lifted(model, 1.0), dt, steps)
    rate = 20.0 * BEAM_MASS / (BEAM_MASS + MASS)
    expected = (1.0 - np.exp(-rate * dt * np.arange(1, steps + 1))) / rate
    assert np.abs(found - expected).max() < 1e-4 * expected.max()


def test_base_motion_shakes_the_moving_mass_too() -> None:
    """In the frame of the support (M + m) u'' + k u = -(M + m) a."""
    shake = {"type": "base_motion", "amplitude": 5.0, "frequency": 20.0}
    model, dt, steps = floating(({**WEIGHTLESS, "mass": MASS, "stiffness": SPRING}, shake), "full"), 1e-4, 600
    found = motion(model, scheme_of("discrete-gradient"), lifted(model, 0.0), dt, steps)
    times, forced = dt * np.arange(1, steps + 1), 2.0 * pi * 20.0
    own = sqrt(SPRING / (BEAM_MASS + MASS))
    # the step response to -5 sin(w t) from rest
    expected = -5.0 / (own**2 - forced**2) * (np.sin(forced * times) - forced / own * np.sin(own * times))
    assert np.abs(found - expected).max() < 1e-3 * np.abs(expected).max()


@pytest.mark.parametrize(("mass", "spring"), [(0.0, 0.0), (0.8, 0.0), (0.0, 5.0), (1.5, 12.0)])
def test_frequencies_of_a_cantilever_with_a_mass_and_a_spring_at_its_tip(mass: float, spring: float) -> None:
    """Euler-Bernoulli: EI w''' = (k - m w^2) w at the tip, in units of the beam's own mass and of EI / L^3."""

    def missed(x: float) -> float:
        share = (cosh(x) + cos(x)) / (sinh(x) + sin(x))
        place = cosh(x) - cos(x) - share * (sinh(x) - sin(x))
        third = sinh(x) - sin(x) - share * (cosh(x) + cos(x))
        return x**3 * third - (spring - mass * x**4) * place

    grid = np.linspace(0.3, 12.0, 4000)
    values = [missed(x) for x in grid]
    roots = [brentq(missed, a, b) for a, b, p, q in zip(grid, grid[1:], values, values[1:], strict=False) if p * q < 0]
    # slender: shear and rotation of the section below 1e-6
    beam = TimoshenkoBeam(length=1.0, elements=30, bending=1.0, shear=1.0e7, mass=1.0, inertia=1.0e-9)
    free = of_elements([beam]).dense
    held = type(free)(free.mass[2:, 2:], free.stiffness[2:, 2:])
    tip = np.zeros((1, held.size))
    tip[0, -2] = 1.0
    together = attached(
        held, RankOnes(tip, np.array([mass])), RankOnes(tip, np.array([spring])), RankOnes(tip, np.zeros(1))
    )
    assert isinstance(together, type(free))
    assert np.sqrt(together.modes[0][:3]) == pytest.approx(np.array(roots[:3]) ** 2, rel=2e-5)


def test_matrices_are_not_changed_on_a_mesh() -> None:
    """What is added to products and factors is what adding to the matrices gives."""
    loads = ({**EXCITER, "direction": [1.0, 2.0]}, {**EXCITER, "name": "other", "point": [0.402, 0.004], "mass": 0.0})
    model = beam_model({}, loads)
    system, operators = model.system, model.system.operators
    assert isinstance(operators, AttachedOperators)
    assert system.dashpots is not None
    rows = np.array([load.pattern for load in system.loads])
    assert rows.sum(axis=1) == pytest.approx([3.0 / sqrt(5.0), 1.0])
    body = replace(model, system=replace(system, operators=model.body.operators))
    mass = mass_of(body) + csr_matrix(MASS * np.outer(rows[0], rows[0]))
    stiffness = stiffness_of(body) + csr_matrix(SPRING * (rows.T @ rows))
    x = np.random.default_rng(2).standard_normal(operators.size)
    assert operators.apply_mass(x) == pytest.approx(mass @ x, rel=1e-9, abs=1e-12)
    assert np.abs(operators.apply_stiffness(x) - stiffness @ x).max() < 1e-9 * np.abs(stiffness @ x).max()
    interface = system.contact.interface
    springs = system.contact.springs(1e9)
    factor = operators.factor(1.0e4, 1.0, springs, system.dashpots.times(30.0))
    place = np.empty(interface.size, dtype=int)
    place[interface.slots] = interface.owned
    onto = csr_matrix((np.ones(interface.size), (place, np.arange(interface.size))), (operators.size, interface.size))
    effective = (1.0e4 * mass + stiffness + onto @ springs.matrix @ onto.T).toarray() + 30.0 * system.dashpots.matrix
    right = operators.apply_mass(x)
    solved = np.linalg.solve(effective, right)
    assert np.abs(factor.solve(right) - solved).max() < 1e-7 * np.abs(solved).max()
    columns = factor.solve_columns(interface, csr_matrix(identity(interface.size)))
    expected = np.linalg.solve(effective, onto.toarray())
    assert np.abs(columns - expected).max() < 1e-7 * np.abs(expected).max()


RATTLED = {
    "contact": {"stiffness": 1.0e11, "damping": 1.0e6},
    "damping": {"mass": 4.4, "stiffness": 9.4e-6},
    "time": {"end": 0.05, "step": 5.0e-5},
}
SHAKEN = {**EXCITER, "point": 0.15, "amplitude": 60.0, "frequency": 40.0, "preload": -8.0}


def rattled(model: Model, steps: int = 600) -> tuple[np.ndarray, list[Any]]:
    """The motion of the tip from the seat, and the steps."""
    start = seat_of(model).state
    taken = steps_of(model.system, model.law, scheme_of("discrete-gradient"), start, model.step, steps)
    probe = model.probes["tip"]
    places = [probe.evaluate(step.new.u[VALUE], model.system.operators)[-1] for step in taken]
    return np.array(places) - probe.evaluate(start.u[VALUE], model.system.operators)[-1], taken


def test_models_agree_and_balance_their_energy() -> None:
    loads, tip = (GRAVITY, SHAKEN), {"tip": 0.51}
    full = beam_model(RATTLED, loads, tip)
    motions = {}
    for kind in ("full", "reduced", "beam"):
        model = full if kind == "full" else beam_model({**RATTLED, "model": {"type": kind}}, loads, tip)
        assert [load.name for load in model.system.loads] == ["gravity", "exciter", "exciter preload"]
        motions[kind], taken = rattled(model)
        ledger = ledger_of(model.system, model.law, taken[0].old, taken)
        assert abs(ledger.residual) < 1e-7 * ledger.exchanged
        assert abs(ledger.algorithmic) < 1e-6 * ledger.exchanged
        assert ledger.structural > 0.0
        assert ledger.contact_loss > 0.0, "nothing touched"
    size = np.abs(motions["full"]).max()
    assert np.abs(motions["reduced"] - motions["full"]).max() < 5e-3 * size
    assert np.abs(motions["beam"] - motions["full"]).max() < 5e-2 * size
    bare, _ = rattled(beam_model(RATTLED, (GRAVITY, {**SHAKEN, "mass": 0.0, "stiffness": 0.0, "damping": 0.0}), tip))
    assert np.abs(bare - motions["full"]).max() > 0.05 * size, "the exciter makes no difference"


def test_the_damper_takes_what_it_should() -> None:
    """Its loss is the integral of c v^2; mass and spring are in the energies of the system."""
    model, dt, steps = floating((EXCITER,), "beam"), 5.0e-5, 800
    start = lifted(model, 0.1)
    taken = steps_of(model.system, model.law, scheme_of("discrete-gradient"), start, dt, steps)
    ledger = ledger_of(model.system, model.law, start, taken)
    assert ledger.start == pytest.approx(0.5 * (BEAM_MASS + MASS) * 0.1**2)
    times = np.linspace(0.0, dt * steps, 20001)
    speed = np.gradient(decaying(times, BEAM_MASS + MASS, SPRING, DAMPER, 0.1), times)
    assert ledger.structural == pytest.approx(DAMPER * np.trapezoid(speed**2, times), rel=3e-4)
    assert abs(ledger.residual) < 1e-6 * ledger.start


def test_a_preload_is_part_of_the_seat() -> None:
    """The reactions of base and gland bear weight, preload and what the suspension pulls with."""
    model = beam_model(RATTLED, (GRAVITY, SHAKEN))
    state = seat_of(model).state
    contact = model.system.contact
    forces = contact.weights * state.pressure
    up = forces[contact.faces == contact.face_names.index("base")].sum()
    down = forces[contact.faces == contact.face_names.index("gland")].sum()
    moved = float(model.system.loads[1].pattern @ state.u[VALUE])
    assert moved < -1e-5
    assert up - down == pytest.approx(BEAM_MASS * 9.81 + 8.0 + SPRING * moved, rel=1e-6)


@pytest.mark.parametrize("kind", ["full", "reduced"])
def test_without_mass_spring_and_damper_it_is_a_harmonic_force(kind: str) -> None:
    bare = {**WEIGHTLESS, "amplitude": 60.0, "name": "force"}
    ends = []
    for load in (bare, {**bare, "type": "harmonic_force"}):
        model = beam_model({**RATTLED, "model": {"type": kind}}, (GRAVITY, load), {"tip": 0.51})
        ends.append(rattled(model, 60)[0])
    assert np.array_equal(*ends)


def dense_with_exciters(seed: int) -> SemiDiscreteSystem:
    """A random body with two exciters, the Rayleigh damping of the body alone."""
    system, random = dense_beam(seed=seed), np.random.default_rng(100 + seed)
    rows = random.standard_normal((2, system.operators.size))
    mass, spring, damper = np.array([0.5, 0.0]), np.array([40.0, 0.0]), np.array([0.05, 4.0])
    dashpots = damper - system.mass_damping * mass - system.stiffness_damping * spring
    assert dashpots.min() < 0.0 < dashpots.max()
    operators = attached(system.operators, RankOnes(rows, mass), RankOnes(rows, spring), RankOnes(rows, np.zeros(2)))
    return replace(system, operators=operators, dashpots=RankOnes(rows, dashpots))


@pytest.mark.parametrize("scheme", [name for name, scheme in SCHEMES.items() if not scheme.impulses])
def test_the_compiled_loop_agrees_with_the_march(scheme: str) -> None:
    system, law = dense_with_exciters(4), LAWS["kelvin-voigt"]
    plan = March(system, law, SCHEMES[scheme], EffectiveOperators(system, SCHEMES[scheme]), 1.0e-3, 200)
    start = thrown_start(system)
    expected = Accounts.opened(system, law, begun(plan, start), plan.dt)
    for step in march(plan, start):
        expected.take(step)
    passage = followed(CompiledLoop(plan), start, plan.steps)
    assert passage.accounts.gates.impacts >= 2
    assert close(passage.end.u[VALUE], step.new.u[VALUE])
    assert close(passage.end.v[VALUE], step.new.v[VALUE])
    assert_same_accounts(passage.accounts, expected, 1.0e-9)
    assert abs(expected.ledger.residual) < 1e-9 * expected.ledger.exchanged


@pytest.mark.slow(minutes=0.3)
def test_derivatives_of_the_period_map_know_the_dashpots() -> None:
    """By differences, by the compiled monodromy matrix, and by disturbances marched through the condensed operator."""
    system, law = dense_with_exciters(6), LAWS["kelvin-voigt"]
    modal = modal_system(system)
    assert modal is not None
    period_map = ModalMap(modal, law, scheme_of("discrete-gradient"), 1.0e-3, 80)
    random = np.random.default_rng(1)
    n = len(modal.squares)
    x = period_map.coordinates(thrown_start(system))
    direction = random.standard_normal(2 * n)
    _, tangent = period_map.with_tangent(x)
    size = 1.0e-6
    differences = (period_map.after(x + size * direction) - period_map.after(x - size * direction)) / (2.0 * size)
    assert np.abs(tangent @ direction - differences).max() < 1e-4 * np.abs(differences).max()
    marched = MarchedMap(period_map.plan)
    _, tangents = marched.linearized(period_map.state(x))
    assert any(len(one.active) for one in tangents), "nothing touched"
    parts = [imaged(system.operators, modal.dofs(part)) for part in (direction[:n], direction[n:])]
    moved = marched.disturbed(tangents, np.stack(parts))
    found = np.concatenate([modal.coordinates(part[VALUE]) for part in moved])
    assert np.abs(found - tangent @ direction).max() < 1e-7 * np.abs(found).max()


def test_what_is_cheap_to_change_leaves_the_body() -> None:
    changes: dict[str, Any] = {"model": {"type": "reduced"}}
    one = beam_case(changes, (GRAVITY, SHAKEN), {"tip": 0.51})
    other = beam_case(changes, (GRAVITY, {**SHAKEN, "mass": 1.0, "preload": 0.0, "stiffness": 0.0}), {"tip": 0.51})
    assert body_key(one) == body_key(other)
    assert body_key(one) != body_key(beam_case(changes, (GRAVITY, {**SHAKEN, "point": 0.2}), {"tip": 0.51}))
    body = build_body(one, MPI.COMM_SELF)
    before = body.operators.modes  # type: ignore[attr-defined]
    model = model_of(other, body)
    fresh = beam_model(changes, (GRAVITY, {**SHAKEN, "mass": 1.0, "preload": 0.0, "stiffness": 0.0}), {"tip": 0.51})
    assert model.system.operators is not body.operators
    assert body.operators.modes is before  # type: ignore[attr-defined]
    assert np.abs(rattled(model, 60)[0] - rattled(fresh, 60)[0]).max() < 1e-12


BAD = """
[[load]]
type = "exciter"
name = "modal"
point = 0.02
amplitude = 10.0
frequency = 20.0
mass = -0.1
stiffness = -5.0
damping = "much"
"""


def test_all_that_is_wrong_with_an_exciter_is_reported_at_once(tmp_path: Path) -> None:
    faults = faults_of(written(tmp_path, GOOD + BAD))
    assert {fault.key[-1] for fault in faults} == {"mass", "stiffness", "damping"}
    for fault in faults:
        assert_says(fault, ["case.toml", "[[load]]"])


def test_curves_in_what_an_exciter_adds_stay_physical() -> None:
    curve = "analysis.continuation={key='load.exciter.mass', low=-0.1, high=0.3}"
    with pytest.raises(CaseError) as caught:
        read_case(EXCITER_CASE, [curve])
    assert_says(caught.value.faults[0], ["-0.1, of load.exciter.mass", "0 or more"])
    case = read_case(EXCITER_CASE, [curve.replace("-0.1", "0.0")])
    assert value_of("load.exciter.mass", {}, dict(enumerate(case.load))) == 0.15
    assert value_of("load.exciter.preload", {}, dict(enumerate(case.load))) == 0.0
    assert value_of("load.gravity.mass", {}, dict(enumerate(case.load))) is None


def test_an_exciter_needs_mass_and_a_name_of_its_own(tmp_path: Path) -> None:
    mended = BAD.replace("-0.1", "0.1").replace("-5.0", "5.0").replace('"much"', "1.0") + "preload = 3.0\n"
    text = GOOD.replace('name = "shaker"', 'name = "modal preload"') + mended
    massless = text.replace('stiffness = "auto"\n', 'stiffness = "auto"\nmass = "redistributed"\n')
    faults = faults_of(written(tmp_path, massless))
    assert {fault.key for fault in faults} == {("load", 1, "name"), ("load", 2, "point")}
    assert_says(faults[0] if faults[0].key[-1] == "point" else faults[1], ["0.02", "no mass", "consistent"])


@pytest.mark.slow(minutes=0.3)
@alone
def test_ranks_agree(tmp_path: Path) -> None:
    """Mesh, an exciter that moves aside, recorded base motion, friction-free contact: the same history."""
    loads = """
[[load]]
type = "recorded_motion"
file = "base.csv"
scale = 10.0

[[load]]
type = "exciter"
name = "modal"
point = [0.203, 0.0, 0.0]
direction = [0.0, 0.3, 1.0]
amplitude = 100.0
frequency = 100.0
mass = 0.2
stiffness = 2e4
damping = 20.0
preload = -5.0
"""
    lines = "".join(f"{key} = {value}\n" for key, value in SOLID.items() if key != "dimension")
    text = GOOD.replace("dimension = 2\ndegree = 2\n", f"dimension = 3\ndegree = 2\n{lines}") + loads
    text = text.replace("end = 0.6", "end = 0.004").replace('stiffness = "auto"', "stiffness = 1e12")
    case = written(tmp_path, text)
    times = np.arange(0.0, 0.0051, 1.0e-4)
    np.savetxt(tmp_path / "base.csv", np.column_stack([times, 2.0 * np.sin(200.0 * pi * times)]), delimiter=",")
    lateral = "restraint.lateral=1e6"
    assert gapbeam.run(case, [lateral], tmp_path / "1").exit_status == 0
    done = on_ranks(2, "run", case, "--output", tmp_path / "2", "--set", lateral)
    assert done.returncode == 0, done.stderr
    one, two = (gapbeam.open_results(tmp_path / str(count)).history for count in (1, 2))
    assert one["load"].values.tolist()[-1] == "modal preload"
    for name in ("displacement", "contact_force", "load_work", "structural_dissipation", "kinetic_energy"):
        size = float(np.abs(one[name]).max())
        assert size > 0.0
        assert np.abs(one[name].values - two[name].values).max() < 1e-7 * size, name


@pytest.mark.slow(minutes=0.3)
def test_periodic_responses_of_mesh_and_basis_agree(tmp_path: Path) -> None:
    """Newton-Krylov on all DOFs of a coarse mesh, and shooting on a basis of it, with the exciter coupled."""
    found = []
    for model in ("{type='full'}", "{type='reduced'}"):
        overrides = {
            "model": model,
            "mesh.support_size": "0.0125",
            "mesh.size": "0.06",
            "mesh.cells_through_thickness": "1",
            "time.step": "5e-4",
            "time.end": "0.2",
            "load.exciter.ramp": "0.05",
        }
        words = [f"{key}={value}" for key, value in overrides.items()]
        outcome = run_case(read_case(EXCITER_CASE, words), tmp_path / model[7:11], MPI.COMM_SELF)
        assert outcome.exit_status == 0, outcome.message
        probes = outcome.summary["periodic"]["probes"]
        found.append([probes["tip"]["peak_to_peak"], *probes["tip"]["harmonics"][:3]])
    assert found[1] == pytest.approx(found[0], rel=5e-3)
