"""How a step takes the contact law: what schemes and compiled laws call the forms of a law by."""

from __future__ import annotations

MEAN, IMPLICIT, ENDPOINT = 0, 1, 2  # its discrete gradient, at the end of the step, at one instant
