"""Modes of a seated beam beside those of beams on springs."""
