"""Comparison of the modes of a case with beam theory, and the end springs that reproduce them."""
