"""Forms of a contact law in a step, as schemes and compiled laws name them."""

from __future__ import annotations

MEAN, IMPLICIT, ENDPOINT = 0, 1, 2  # its discrete gradient, at the end of the step, at one instant
