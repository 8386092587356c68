"""Identification of unknown parameters from measurements."""
