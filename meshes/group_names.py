"""Names of the groups of cells and facets of a beam."""

from __future__ import annotations

BODY = "body"
"""The group of all cells."""

CONTACT_FACES = ("base", "gland")
"""Facets below and above in the support."""

FACES = {"base": 1, "gland": 2, "end": 3, "tip": 4}
"""All facet groups and their tags in meshes that gapbeam builds; end is at x = 0, tip at x = length."""
