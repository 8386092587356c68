"""Beams on end springs: frequency equation, roots and mode shapes."""
