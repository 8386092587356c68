"""Spectra of random loads: densities over frequency that a user asks for."""
