"""Linear contact stiffness with Kelvin-Voigt damping, per area."""

from solver.contact.law import kelvin_voigt as KelvinVoigt  # noqa: N812

__all__ = ["KelvinVoigt"]
