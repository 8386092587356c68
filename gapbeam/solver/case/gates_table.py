"""The table [gates]: limits on energy, memory and the assumptions behind the equations."""

from __future__ import annotations

from math import inf
from typing import Literal

from pydantic import Field

from gapbeam.solver.table import NonNegative, Positive, Switch, Table

Bound = Positive | Literal["never"] | None


class AssumptionLimits(Table):
    """Other limits of the assumptions that a run watches, by their names in the summary; "never" is no limit."""

    small_rotation: Bound = Field(default=None, description="largest rotation, rad")
    small_strain: Bound = Field(default=None, description="largest strain at the surface, no unit")
    inside_the_support: Bound = Field(
        default=None,
        description="travel along the support over its length, no unit",
    )
    radii_in_supports_around_the_beam: Bound = Field(
        default=None,
        description="largest motion across the beam over its radius, no unit",
    )
    linear_seat: Bound = Field(default=None, description="largest rotation at the start, rad")
    penetration_beside_the_thickness: Bound = Field(
        default=None,
        description="largest penetration over the thickness, no unit",
    )
    penetration_beside_the_clearance: Bound = Field(
        default=None,
        description="largest penetration over the clearance, no unit",
    )
    contacts_resolved_by_the_step: Bound = Field(
        default=None,
        description="impulse in contacts of few steps over the whole, no unit",
    )
    weak_restraint: Bound = Field(
        default=None,
        description="energy of the restraint over the energy of the beam, no unit",
    )
    step_beside_the_frequencies: Bound = Field(
        default=None,
        description="mean error of periods by the scheme, no unit",
    )
    damping_of_the_scheme: Bound = Field(
        default=None,
        description="share of the amplitude that the scheme takes, no unit",
    )
    resonance_beside_the_scheme: Bound = Field(
        default=None,
        description="share of a resonant amplitude that the scheme takes, no unit",
    )
    mesh_beside_the_wavelengths: Bound = Field(
        default=None,
        description="distance of nodes over the bending wavelength, no unit",
    )
    basis_beside_the_frequencies: Bound = Field(
        default=None,
        description="highest frequency over the highest of the basis, no unit",
    )
    beam_model_beside_the_wavelengths: Bound = Field(
        default=None,
        description="thickness over the bending wavelength, no unit",
    )
    rigid_model_beside_the_frequencies: Bound = Field(
        default=None,
        description="highest frequency over the first of bending, no unit",
    )
    energy_under_noise_kept_by_the_scheme: Bound = Field(
        default=None,
        description="energy that the scheme took or created, no unit",
    )

    def of(self, assumption: str) -> float | None:
        """Return the limit of an assumption, infinite for "never"; None: the usual one."""
        asked: float | str | None = getattr(self, assumption.replace(" ", "_"), None)
        return inf if isinstance(asked, str) else asked


class Gates(Table):
    """Limits on the energy that the algorithm creates or loses, on memory, and on the assumptions of the equations."""

    impact_loss: NonNegative = Field(default=0.008, description="largest algorithmic loss in one impact, no unit")
    impact_growth: NonNegative = Field(default=0.0025, description="largest algorithmic growth in one impact, no unit")
    total_growth: Positive = Field(default=0.05, description="cumulative growth that ends the run, no unit")
    total_loss: Positive = Field(
        default=0.1, description="largest algorithmic loss in the whole run that ends with status 0, no unit"
    )
    accept_energy_loss: Switch = Field(default=False, description="end with status 0 in spite of such a loss")
    accept_energy_growth: Switch = Field(default=False, description="go on, and end with status 0, in spite of growth")
    accept_lack_of_memory: Switch = Field(
        default=False, description="run a model that is expected to need more memory than is free"
    )
    warnings: AssumptionLimits = Field(
        default=AssumptionLimits(),
        description='values of assumptions above which a run warns, as a table; "never": it does not',
    )
    failures: AssumptionLimits = Field(
        default=AssumptionLimits(),
        description='values of assumptions above which a run ends with status 4, as a table; "never": it goes on',
    )
