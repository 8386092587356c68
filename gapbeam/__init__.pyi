"""The names of gapbeam and their modules; each is loaded on first use."""

from gapbeam.interface.case_fmu import fmu as fmu
from gapbeam.interface.case_picture import view as view
from gapbeam.interface.case_source import read_case as read_case
from gapbeam.interface.case_studies import (
    Workers as Workers,
    identify as identify,
    life as life,
    stability as stability,
    sweep as sweep,
    tradeoff as tradeoff,
)
from gapbeam.interface.drawn_results import plot as plot, render as render
from gapbeam.interface.shown_results import (
    compare as compare,
    export as export,
    open_results as open_results,
    report as report,
)
from gapbeam.interface.single_case import check as check, model as model, modes as modes, run as run, scene as scene
from gapbeam.meshes.mesh_errors import MeshError as MeshError
from gapbeam.postprocess.render import RenderError as RenderError
from gapbeam.postprocess.report.pdf_page import BrowserError as BrowserError
from gapbeam.postprocess.results_errors import OptionError as OptionError, ResultsError as ResultsError
from gapbeam.postprocess.run_comparison import ComparisonError as ComparisonError
from gapbeam.postprocess.signals.fitted_record import fitted_record as fitted_record
from gapbeam.postprocess.signals.signal import SignalError as SignalError
from gapbeam.solver.case.figure_table import figure as figure
from gapbeam.solver.messages.errors import (
    AssumptionBroken as AssumptionBroken,
    CaseError as CaseError,
    EnergyCreated as EnergyCreated,
    EnergyLost as EnergyLost,
    Interrupted as Interrupted,
    IntervalNotMet as IntervalNotMet,
    NotConverged as NotConverged,
    NotFinite as NotFinite,
    NotWritten as NotWritten,
    OutOfMemory as OutOfMemory,
    RangeNotCovered as RangeNotCovered,
    RunError as RunError,
    UserError as UserError,
)
from gapbeam.solver.scene.beam_structure import (
    CrossSection as CrossSection,
    beam as beam,
    material as material,
    section as section,
)
from gapbeam.solver.scene.contact_pair import Contact as Contact
from gapbeam.solver.scene.convex_region import (
    Disc as Disc,
    HalfPlane as HalfPlane,
    Polar as Polar,
    Polygon as Polygon,
    Slot as Slot,
    region as region,
)
from gapbeam.solver.scene.face_pair import face_contacts as face_contacts
from gapbeam.solver.scene.feedback import Feedback as Feedback, Joint as Joint
from gapbeam.solver.scene.flow_force import in_fluid as in_fluid, quasi_steady as quasi_steady, span as span
from gapbeam.solver.scene.flow_margin import (
    connors as connors,
    critical_velocity as critical_velocity,
    eigenvalues as eigenvalues,
    idle_supports as idle_supports,
    root_locus as root_locus,
)
from gapbeam.solver.scene.force_law import law as law
from gapbeam.solver.scene.frame_structure import (
    Member as Member,
    SpaceSection as SpaceSection,
    frame as frame,
    space_section as space_section,
)
from gapbeam.solver.scene.lagged_force import (
    aerodynamic_lag as aerodynamic_lag,
    measured as measured,
    unsteady as unsteady,
)
from gapbeam.solver.scene.lane_ensemble import ensemble as ensemble
from gapbeam.solver.scene.least_figure import optimize as optimize
from gapbeam.solver.scene.limit_cycle import limit_cycle as limit_cycle, periodic as periodic
from gapbeam.solver.scene.linear_scheme import (
    euler as euler,
    generalized_alpha as generalized_alpha,
    hht as hht,
    midpoint as midpoint,
    newmark as newmark,
    theta as theta,
)
from gapbeam.solver.scene.mesh_structure import from_mesh as from_mesh
from gapbeam.solver.scene.modal_files import read_modes as read_modes
from gapbeam.solver.scene.orbit_tangents import tangents as tangents
from gapbeam.solver.scene.scene import Scene as Scene
from gapbeam.solver.scene.moving_point import moving_force as moving_force
from gapbeam.solver.scene.moving_point import moving_point as moving_point
from gapbeam.solver.scene.scene_load import (
    BaseMotion as BaseMotion,
    Force as Force,
    Load as Load,
    sine as sine,
    weight as weight,
)
from gapbeam.solver.scene.scene_march import history as history, march as march
from gapbeam.solver.scene.scene_seat import NoSeat as NoSeat, seat as seat
from gapbeam.solver.scene.shipped_laws import (
    Adhesive as Adhesive,
    Cubic as Cubic,
    ElastoGap as ElastoGap,
    HuntCrossley as HuntCrossley,
    KelvinVoigt as KelvinVoigt,
)
from gapbeam.solver.scene.snubber import snubber as snubber
from gapbeam.solver.scene.solid_material import orthotropic as orthotropic
from gapbeam.solver.scene.structure import (
    Structure as Structure,
    from_modes as from_modes,
    mass as mass,
    reduced_at_points as reduced_at_points,
)
from gapbeam.solver.scene.structure_files import read_structure as read_structure, write_structure as write_structure
from gapbeam.solver.scene.structure_geometry import Pose as Pose
from gapbeam.solver.scene.unilateral_law import Unilateral as Unilateral
from gapbeam.studies.atlas.atlas_figures import draw_basins as draw_basins, draw_responses as draw_responses
from gapbeam.studies.atlas.followed_responses import follow as follow
from gapbeam.studies.atlas.response_atlas import (
    atlas as atlas,
    drawn_starts as drawn_starts,
    gridded_starts as gridded_starts,
)
from gapbeam.studies.library.estimate import EstimatedValues as EstimatedValues, estimate as estimate, series as series
from gapbeam.studies.library.posterior import posterior as posterior
from gapbeam.studies.library.recording import Recording as Recording, read_recording as read_recording
from gapbeam.studies.library.recording_library import (
    Library as Library,
    library as library,
    read_library as read_library,
)
from gapbeam.studies.uncertain.uncertain_file import uncertain as uncertain
from gapbeam.studies.uncertain.uncertain_result import draw_distributions as draw_distributions

__version__: str
