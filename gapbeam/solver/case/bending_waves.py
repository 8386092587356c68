"""Bending waves in a Timoshenko beam.

    k^2 = w^2 (1/c^2 + 1/s^2) / 2 + sqrt(w^4 (1/c^2 - 1/s^2)^2 / 4 + w^2 / (c r)^2)

c^2 = E / rho, s^2 = kappa G / rho, r^2 = I / A: the branch that becomes c r k^2 = w at low frequencies, and
waves of shear above.

Source: Timoshenko (1921), Philosophical Magazine 41, 744-746.
"""

from __future__ import annotations

from math import pi, sqrt

from gapbeam.solver.case.beam_profile import BeamPiece


def bending_wavelength(piece: BeamPiece, frequency: float) -> float:
    """Return the length of bending waves of a frequency, Hz, in a prismatic beam, m."""
    material, beam = piece.material, piece.beam
    omega, nu = 2.0 * pi * frequency, material.poisson_ratio
    kappa = beam.shear_coefficient(nu)
    bar = material.density / material.young_modulus  # 1 / c^2
    shear = bar * 2.0 * (1.0 + nu) / kappa  # 1 / s^2
    mean = 0.5 * omega**2 * (bar + shear)
    square = mean + sqrt((0.5 * omega**2 * (bar - shear)) ** 2 + bar * (omega / beam.gyration_radius) ** 2)
    return 2.0 * pi / sqrt(square)
