"""From the scheme of a case to the scheme that marches it."""

from __future__ import annotations

from typing import Protocol

from solver.case_tables.time import CentralDifference as CentralDifferenceScheme
from solver.case_tables.time import DiscreteGradient, HHTAlpha, ImplicitMidpoint, Newmark, Scheme
from solver.case_tables.time import MoreauJean as MoreauJeanScheme
from solver.contact.law import ContactLaw
from solver.integrators.central_difference import CentralDifference
from solver.integrators.generalized_alpha import GeneralizedAlpha
from solver.integrators.midpoint import Midpoint
from solver.integrators.moreau_jean import MoreauJean
from solver.matrix_free import Condensed
from solver.system import SemiDiscreteSystem, State, Step


class Integrator(Protocol):
    """One time integration scheme."""

    @property
    def carries_acceleration(self) -> bool:
        """Whether its state holds an acceleration."""

    def coefficients(self, system: SemiDiscreteSystem, dt: float) -> tuple[float, float, float]:
        """Return (c_m, c_k, c_d) of the effective operator c_m M + c_k K + c_d dashpots."""

    def advance(
        self,
        system: SemiDiscreteSystem,
        condensed: Condensed,
        law: ContactLaw,
        old: State,
        dt: float,
        max_iterations: int = 60,
    ) -> Step:
        """Advance by one step. Collective."""


def make_integrator(scheme: Scheme) -> Integrator:
    """Return the integrator that a case asks for."""
    if isinstance(scheme, DiscreteGradient):
        return Midpoint()
    if isinstance(scheme, ImplicitMidpoint):
        return Midpoint(implicit=True)
    if isinstance(scheme, Newmark):
        return GeneralizedAlpha.newmark(scheme.beta, scheme.gamma)
    if isinstance(scheme, HHTAlpha):
        return GeneralizedAlpha.hht(scheme.alpha)
    if isinstance(scheme, MoreauJeanScheme):
        return MoreauJean(scheme.theta, scheme.restitution)
    if isinstance(scheme, CentralDifferenceScheme):
        return CentralDifference()
    return GeneralizedAlpha.from_spectral_radius(scheme.rho_inf)
