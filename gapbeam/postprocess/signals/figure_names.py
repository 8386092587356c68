"""The names of figures of a motion: each says how it is defined, and is the same in every table, message and file."""

from __future__ import annotations

DISPLACEMENT = "peak-to-peak displacement"
ACCELERATION = "peak-to-peak acceleration"
SMOOTHED_ACCELERATION = "peak-to-peak smoothed acceleration"
LARGEST_FORCE = "largest recorded force"
MEAN_FORCE = "mean force over the contact"
AXIAL_STRESS = "peak-to-peak axial stress"
VON_MISES_STRESS = "largest von Mises stress"
