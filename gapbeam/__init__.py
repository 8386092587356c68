"""gapbeam: dynamic contact of beams and tubes in supports with play."""

from gapbeam.process.loading import leave_quietly_while_loading

leave_quietly_while_loading()  # before anything that takes long to load

from importlib import import_module  # noqa: E402
from typing import TYPE_CHECKING, Any  # noqa: E402

from gapbeam.process.extra_packages import find_extra_packages  # noqa: E402
from gapbeam.process.process_environment import (  # noqa: E402
    cache_by_default,
    home_by_default,
    one_thread_by_default,
    signals_by_default,
)

home_by_default()  # before anything loads Open MPI
cache_by_default()  # before anything loads DOLFINx
signals_by_default()  # before anything loads PETSc
find_extra_packages()  # before anything imports one
one_thread_by_default()  # before anything loads a numerical library

if TYPE_CHECKING:
    from gapbeam.interface.case_fmu import fmu
    from gapbeam.interface.case_picture import view
    from gapbeam.interface.case_source import read_case
    from gapbeam.interface.case_studies import Workers, identify, life, stability, sweep, tradeoff
    from gapbeam.interface.error_classes import (
        AssumptionBroken,
        BrowserError,
        CaseError,
        ComparisonError,
        EnergyCreated,
        EnergyLost,
        Interrupted,
        IntervalNotMet,
        MeshError,
        NotConverged,
        NotFinite,
        NotWritten,
        OptionError,
        OutOfMemory,
        RangeNotCovered,
        RenderError,
        ResultsError,
        RunError,
        SignalError,
        UserError,
    )
    from gapbeam.interface.shown_results import compare, open_results, plot, render, report
    from gapbeam.interface.single_case import check, model, modes, run, scene
    from gapbeam.solver.case.figure_table import figure
    from gapbeam.solver.scene.beam_structure import CrossSection, beam, material, section
    from gapbeam.solver.scene.contact_pair import Contact
    from gapbeam.solver.scene.convex_region import Disc, HalfPlane, Polar, Polygon, Slot, region
    from gapbeam.solver.scene.face_pair import face_contacts
    from gapbeam.solver.scene.feedback import Feedback, Joint
    from gapbeam.solver.scene.flow_force import in_fluid, quasi_steady, span
    from gapbeam.solver.scene.flow_margin import connors, critical_velocity, eigenvalues, idle_supports, root_locus
    from gapbeam.solver.scene.force_law import law
    from gapbeam.solver.scene.frame_structure import Member, SpaceSection, frame, space_section
    from gapbeam.solver.scene.lagged_force import aerodynamic_lag, measured, unsteady
    from gapbeam.solver.scene.lane_ensemble import ensemble
    from gapbeam.solver.scene.least_figure import optimize
    from gapbeam.solver.scene.limit_cycle import limit_cycle, periodic
    from gapbeam.solver.scene.linear_scheme import euler, generalized_alpha, hht, midpoint, newmark, theta
    from gapbeam.solver.scene.mesh_structure import from_mesh
    from gapbeam.solver.scene.modal_files import read_modes
    from gapbeam.solver.scene.orbit_tangents import tangents
    from gapbeam.solver.scene.scene import Scene
    from gapbeam.solver.scene.scene_load import BaseMotion, Force, Load, moving_force, moving_point, sine, weight
    from gapbeam.solver.scene.scene_march import history, march
    from gapbeam.solver.scene.scene_seat import NoSeat, seat
    from gapbeam.solver.scene.shipped_laws import Adhesive, Cubic, ElastoGap, HuntCrossley, KelvinVoigt
    from gapbeam.solver.scene.snubber import snubber
    from gapbeam.solver.scene.solid_material import orthotropic
    from gapbeam.solver.scene.structure import Structure, from_modes, mass, reduced_at_points
    from gapbeam.solver.scene.structure_files import read_structure, write_structure
    from gapbeam.solver.scene.structure_geometry import Pose
    from gapbeam.studies.atlas.atlas_figures import draw_basins, draw_responses
    from gapbeam.studies.atlas.followed_responses import follow
    from gapbeam.studies.atlas.response_atlas import atlas, drawn_starts, gridded_starts
    from gapbeam.studies.library.estimate import EstimatedValues, estimate, series
    from gapbeam.studies.library.posterior import posterior
    from gapbeam.studies.library.recording import Recording, read_recording
    from gapbeam.studies.library.recording_library import Library, library, read_library
    from gapbeam.studies.uncertain.uncertain_file import uncertain
    from gapbeam.studies.uncertain.uncertain_result import draw_distributions

    __version__: str

_MODULES = {
    "interface.case_fmu": ("fmu",),
    "interface.case_picture": ("view",),
    "interface.case_source": ("read_case",),
    "interface.case_studies": ("Workers", "identify", "life", "stability", "sweep", "tradeoff"),
    "interface.shown_results": ("compare", "export", "open_results", "plot", "render", "report"),
    "interface.single_case": ("check", "model", "modes", "run", "scene"),
    "solver.scene.beam_structure": ("CrossSection", "beam", "material", "section"),
    "solver.scene.contact_pair": ("Contact",),
    "solver.scene.convex_region": ("Disc", "HalfPlane", "Polar", "Polygon", "Slot", "region"),
    "solver.scene.face_pair": ("face_contacts",),
    "solver.scene.feedback": ("Feedback", "Joint"),
    "solver.scene.flow_force": ("in_fluid", "quasi_steady", "span"),
    "solver.scene.flow_margin": ("connors", "critical_velocity", "eigenvalues", "idle_supports", "root_locus"),
    "solver.scene.force_law": ("law",),
    "solver.scene.frame_structure": ("Member", "SpaceSection", "frame", "space_section"),
    "solver.scene.lagged_force": ("aerodynamic_lag", "measured", "unsteady"),
    "solver.scene.lane_ensemble": ("ensemble",),
    "solver.scene.least_figure": ("optimize",),
    "solver.scene.limit_cycle": ("limit_cycle", "periodic"),
    "solver.scene.linear_scheme": ("euler", "generalized_alpha", "hht", "midpoint", "newmark", "theta"),
    "solver.scene.mesh_structure": ("from_mesh",),
    "solver.scene.modal_files": ("read_modes",),
    "solver.scene.orbit_tangents": ("tangents",),
    "solver.scene.scene": ("Scene",),
    "solver.scene.scene_load": ("BaseMotion", "Force", "Load", "moving_force", "moving_point", "sine", "weight"),
    "solver.scene.scene_march": ("history", "march"),
    "solver.case.figure_table": ("figure",),
    "solver.scene.scene_seat": ("NoSeat", "seat"),
    "solver.scene.shipped_laws": ("Adhesive", "Cubic", "ElastoGap", "HuntCrossley", "KelvinVoigt"),
    "solver.scene.snubber": ("snubber",),
    "solver.scene.solid_material": ("orthotropic",),
    "solver.scene.structure": ("Structure", "from_modes", "mass", "reduced_at_points"),
    "solver.scene.structure_files": ("read_structure", "write_structure"),
    "solver.scene.structure_geometry": ("Pose",),
    "studies.atlas.atlas_figures": ("draw_basins", "draw_responses"),
    "studies.atlas.followed_responses": ("follow",),
    "studies.atlas.response_atlas": ("atlas", "drawn_starts", "gridded_starts"),
    "studies.library.estimate": ("EstimatedValues", "estimate", "series"),
    "studies.library.posterior": ("posterior",),
    "studies.library.recording": ("Recording", "read_recording"),
    "studies.library.recording_library": ("Library", "library", "read_library"),
    "studies.uncertain.uncertain_file": ("uncertain",),
    "studies.uncertain.uncertain_result": ("draw_distributions",),
}
"""Modules of the public names, each loaded on first use of one of its names; error classes share one module."""

__all__ = [
    "Adhesive",
    "AssumptionBroken",
    "BaseMotion",
    "BrowserError",
    "CaseError",
    "ComparisonError",
    "Contact",
    "CrossSection",
    "Cubic",
    "Disc",
    "ElastoGap",
    "EnergyCreated",
    "EnergyLost",
    "EstimatedValues",
    "Feedback",
    "Force",
    "HalfPlane",
    "HuntCrossley",
    "Interrupted",
    "IntervalNotMet",
    "Joint",
    "KelvinVoigt",
    "Library",
    "Load",
    "Member",
    "MeshError",
    "NoSeat",
    "NotConverged",
    "NotFinite",
    "NotWritten",
    "OptionError",
    "OutOfMemory",
    "Polar",
    "Polygon",
    "Pose",
    "RangeNotCovered",
    "Recording",
    "RenderError",
    "ResultsError",
    "RunError",
    "Scene",
    "SignalError",
    "Slot",
    "SpaceSection",
    "Structure",
    "UserError",
    "Workers",
    "__version__",
    "aerodynamic_lag",
    "atlas",
    "beam",
    "check",
    "compare",
    "connors",
    "critical_velocity",
    "draw_basins",
    "draw_distributions",
    "draw_responses",
    "drawn_starts",
    "eigenvalues",
    "ensemble",
    "estimate",
    "euler",
    "export",
    "face_contacts",
    "figure",
    "fmu",
    "follow",
    "frame",
    "from_mesh",
    "from_modes",
    "generalized_alpha",
    "gridded_starts",
    "hht",
    "history",
    "identify",
    "idle_supports",
    "in_fluid",
    "law",
    "library",
    "life",
    "limit_cycle",
    "march",
    "mass",
    "material",
    "measured",
    "midpoint",
    "model",
    "modes",
    "moving_force",
    "moving_point",
    "newmark",
    "open_results",
    "optimize",
    "orthotropic",
    "periodic",
    "plot",
    "posterior",
    "quasi_steady",
    "read_case",
    "read_library",
    "read_modes",
    "read_recording",
    "read_structure",
    "reduced_at_points",
    "region",
    "render",
    "report",
    "root_locus",
    "run",
    "scene",
    "seat",
    "section",
    "series",
    "sine",
    "snubber",
    "space_section",
    "span",
    "stability",
    "sweep",
    "tangents",
    "theta",
    "tradeoff",
    "uncertain",
    "unsteady",
    "view",
    "weight",
    "write_structure",
]


def __getattr__(name: str) -> Any:
    """Return a name of the interface, loaded now."""
    if name == "__version__":
        from importlib.metadata import version

        return version("gapbeam")
    if name in __all__:
        module = next((module for module, names in _MODULES.items() if name in names), "interface.error_classes")
        found = getattr(import_module(f"gapbeam.{module}"), name)
        globals()[name] = found
        return found
    raise AttributeError(f"module 'gapbeam' has no attribute {name!r}")


def __dir__() -> list[str]:
    """Return the names of the interface besides those that are loaded."""
    return sorted({*globals(), *__all__})
