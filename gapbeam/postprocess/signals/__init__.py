"""Signals: peaks, spectra, harmonics, periodicity."""
