"""Kinds of results folders that the shipped studies write, and the reports on them."""

from __future__ import annotations

from gapbeam.postprocess.report.folder_report import Kind
from gapbeam.postprocess.report.sections.atlas_section import ATLAS_FILE, atlas_sections
from gapbeam.postprocess.report.sections.curve_section import (
    COMPARISON_FILE,
    LIFE_FILE,
    comparison_sections,
    life_sections,
)
from gapbeam.postprocess.report.sections.optimum_section import OPTIMUM_FILE, optimum_sections
from gapbeam.postprocess.report.sections.sweep_section import (
    SWEEP_FILE,
    UNCERTAIN_FILE,
    sweep_sections,
    uncertain_sections,
)
from gapbeam.postprocess.report.sections.tradeoff_section import (
    IDENTIFICATION_FILE,
    STABILITY_FILE,
    TRADEOFF_FILE,
    identification_blocks,
    stability_sections,
    tradeoff_sections,
)

_KINDS = (
    Kind("sweep", "Sweep", (SWEEP_FILE,), sweep_sections),
    Kind("stability", "Stability", (STABILITY_FILE,), stability_sections),
    Kind("tradeoff", "Trade-off", (TRADEOFF_FILE,), tradeoff_sections),
    Kind("atlas", "Atlas", (ATLAS_FILE,), atlas_sections),
    Kind("uncertain", "Uncertain values", (UNCERTAIN_FILE,), uncertain_sections),
    Kind("identification", "Identification", (IDENTIFICATION_FILE,), identification_blocks),
    Kind("optimum", "Optimum", (OPTIMUM_FILE,), optimum_sections),
    Kind("life", "Life", (LIFE_FILE,), life_sections),
    Kind("comparison", "Comparison", (COMPARISON_FILE,), comparison_sections),
)
KINDS = {kind.name: kind for kind in _KINDS}
"""Kinds by their names."""
