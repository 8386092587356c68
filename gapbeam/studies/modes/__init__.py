"""Modes of a case beside beam theory, and the end springs that reproduce them."""
