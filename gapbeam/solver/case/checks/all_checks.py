"""Contradictions between the tables of a case, each found by a function that takes the tables it needs."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator, Mapping

from gapbeam.solver.case.case import Case
from gapbeam.solver.case.checks.attachment_checks import (
    elastic_joints_do_something,
    fluid_names_differ,
    fluids_move_mass,
    fluids_surround_the_beam,
    holds_need_implicit_steps,
    joint_names_differ,
    joints_keep_apart,
    joints_let_the_body_move,
    joints_lie_on_the_beam,
    mass_names_differ,
    masses_lie_on_the_beam,
    masses_sit_on_mass,
    offsets_fit_the_mesh,
)
from gapbeam.solver.case.checks.circle_checks import CIRCLE_CHECKS
from gapbeam.solver.case.checks.contact_checks import (
    contact_is_shallow,
    exact_contact_starts_outside,
    explicit_scheme_fits_the_contact,
    friction_fits_the_formulation,
    friction_is_implicit,
    impulses_are_unilateral,
    impulses_need_mass,
    law_fits_the_formulation,
    law_fits_the_rest,
    point_results_follow_the_law,
    scheme_fits_the_formulation,
)
from gapbeam.solver.case.checks.contact_point_checks import (
    patches_have_points,
    patches_keep_apart,
    points_hold_the_beam,
    points_lie_on_the_faces,
    points_need_a_penalty,
)
from gapbeam.solver.case.checks.damping_checks import damping_is_given_once, damping_is_positive
from gapbeam.solver.case.checks.factor_checks import iterations_can_solve
from gapbeam.solver.case.checks.friction_checks import static_friction_holds_more
from gapbeam.solver.case.checks.gate_checks import gates_are_in_order, limits_are_in_order
from gapbeam.solver.case.checks.geometry_checks import (
    cells_fit_the_beam,
    cells_fit_the_dimension,
    mesh_file_says_it_all,
    support_is_part_of_the_beam,
    supports_squeeze_little,
)
from gapbeam.solver.case.checks.hole_checks import (
    beams_fit_in,
    holes_are_met_along_radii,
    planes_are_not_moved_aside,
    regions_fit_the_beam,
    round_beams_are_met_around,
)
from gapbeam.solver.case.checks.load_checks import (
    attached_masses_sit_on_mass,
    loads_are_sound,
    loads_fit_each_other,
    loads_fit_the_run,
    static_force_names_differ,
)
from gapbeam.solver.case.checks.model_checks import (
    beam_is_prismatic,
    beams_move_as_asked,
    contact_fits_the_model,
    elements_are_above_round_off,
    implicit_schemes_march_the_model,
    modal_damping_has_modes,
    rigid_sections_are_in_holes,
    stations_are_of_rigid_sections,
    touching_sections_are_in_holes,
)
from gapbeam.solver.case.checks.moving_support_checks import (
    closures_leave_a_beam,
    motions_reach_the_beam,
    moved_supports_are_there,
    moving_supports_are_marched,
    moving_supports_do_not_rub_around,
)
from gapbeam.solver.case.checks.own_law_checks import (
    own_laws_fit_the_rest,
    own_laws_follow_the_penetration,
    own_laws_have_their_stiffness,
    yielding_laws_are_marched,
)
from gapbeam.solver.case.checks.periodic_checks import (
    balance_has_a_law,
    curve_is_in_reach,
    forcing_is_periodic,
    march_reaches_the_amplitude,
    model_is_dense,
    period_map_is_smooth,
    shooting_has_whole_steps,
)
from gapbeam.solver.case.checks.place_checks import (
    directions_point_somewhere,
    load_names_differ,
    loads_have_a_node,
    loads_lie_in_the_beam,
    points_keep_apart,
    probe_names_differ,
    probes_have_a_node,
    probes_lie_in_the_beam,
)
from gapbeam.solver.case.checks.section_checks import (
    beam_elements_bend_alone,
    contact_points_fit_the_section,
    curved_cells_are_quadratic,
    points_are_in_the_section,
    section_fits_the_beam,
    sections_are_solids,
    stress_fields_need_a_body_that_deforms,
    stress_is_that_of_the_material,
    supports_touch_flat_sides,
)
from gapbeam.solver.case.checks.segment_checks import (
    fields_of_stress_take_one_material,
    materials_fit_the_formulation,
    segment_names_differ,
    segments_are_meshed,
    segments_change_something,
    segments_fit_their_sections,
    segments_join_their_neighbors,
    segments_keep_apart,
    segments_lie_on_the_beam,
    steps_leave_room_for_cells,
    stress_has_one_value,
    supports_lie_in_one_segment,
)
from gapbeam.solver.case.checks.start_checks import (
    centered_start_has_a_middle,
    joints_let_the_start_move,
    kept_checkpoint_has_a_march,
    kept_states_are_of_the_run,
    start_is_given_once,
    start_mode_bends_the_model,
    start_mode_has_its_probe,
    start_state_stands_alone,
    start_vectors_fit_the_mesh,
)
from gapbeam.solver.case.checks.support_body_checks import (
    bodies_need_few_dofs,
    bodies_stand_on_the_frame,
    bodies_start_in_a_run,
)
from gapbeam.solver.case.checks.support_checks import (
    own_contact_fits_the_case,
    something_carries_the_beam,
    support_names_differ,
    supports_keep_apart,
    supports_lie_on_the_beam,
)
from gapbeam.solver.case.checks.time_checks import (
    adaptive_steps_resolve_a_contact,
    interest_covers_the_forcing,
    outputs_fall_on_steps,
    run_has_steps,
    step_follows_the_forcing,
)
from gapbeam.solver.case.checks.wear_checks import WEAR_CHECKS
from gapbeam.solver.case.checks.whole_support_checks import WHOLE_SUPPORT_CHECKS
from gapbeam.solver.case.reading.known_keys import numbered
from gapbeam.solver.faults import Fault, Key


def contradictions(tables: Mapping[str, object], incomplete: frozenset[str] = frozenset()) -> list[Fault]:
    """Return the faults found by all checks whose tables are there.

    Args:
        tables: The tables without faults of their own, by name; loads and probes as {number: entry}.
        incomplete: Arrays of tables that lack an entry, since it has a fault of its own. What is said of such an array
            as a whole, or of another table for the sake of it, may be the lack of that entry, and is left out.
    """
    faults: dict[tuple[Key, str], Fault] = {}  # a key that clashes with several others is reported once
    for check in CHECKS:
        names = inspect.signature(check).parameters
        if set(names) <= set(tables):
            partial = incomplete & set(names)
            for fault in check(**{name: tables[name] for name in names}):
                of_an_entry = len(fault.key) > 1 and fault.key[0] in partial
                if (of_an_entry or not partial) and not incomplete & set(fault.lacks):
                    faults.setdefault((fault.key, fault.found), fault)
    return list(faults.values())


def contradictions_in(case: Case) -> list[Fault]:
    """Return the contradictions of a case that was made in Python."""
    return contradictions(numbered(dict(case)))


CHECKS: tuple[Callable[..., Iterator[Fault]], ...] = (
    support_is_part_of_the_beam,
    support_names_differ,
    supports_lie_on_the_beam,
    supports_keep_apart,
    own_contact_fits_the_case,
    *WHOLE_SUPPORT_CHECKS,
    *WEAR_CHECKS,
    bodies_need_few_dofs,
    bodies_stand_on_the_frame,
    bodies_start_in_a_run,
    something_carries_the_beam,
    regions_fit_the_beam,
    round_beams_are_met_around,
    beams_fit_in,
    planes_are_not_moved_aside,
    holes_are_met_along_radii,
    *CIRCLE_CHECKS,
    supports_squeeze_little,
    section_fits_the_beam,
    segment_names_differ,
    segments_lie_on_the_beam,
    segments_keep_apart,
    segments_change_something,
    segments_fit_their_sections,
    segments_join_their_neighbors,
    segments_are_meshed,
    steps_leave_room_for_cells,
    supports_lie_in_one_segment,
    fields_of_stress_take_one_material,
    materials_fit_the_formulation,
    stress_has_one_value,
    curved_cells_are_quadratic,
    sections_are_solids,
    supports_touch_flat_sides,
    beam_elements_bend_alone,
    points_are_in_the_section,
    stress_is_that_of_the_material,
    stress_fields_need_a_body_that_deforms,
    contact_points_fit_the_section,
    damping_is_given_once,
    damping_is_positive,
    cells_fit_the_dimension,
    cells_fit_the_beam,
    mesh_file_says_it_all,
    joints_lie_on_the_beam,
    joint_names_differ,
    joints_keep_apart,
    elastic_joints_do_something,
    joints_let_the_body_move,
    joints_let_the_start_move,
    start_vectors_fit_the_mesh,
    start_is_given_once,
    start_mode_has_its_probe,
    start_mode_bends_the_model,
    centered_start_has_a_middle,
    start_state_stands_alone,
    kept_checkpoint_has_a_march,
    kept_states_are_of_the_run,
    holds_need_implicit_steps,
    masses_lie_on_the_beam,
    offsets_fit_the_mesh,
    mass_names_differ,
    masses_sit_on_mass,
    fluid_names_differ,
    fluids_surround_the_beam,
    fluids_move_mass,
    loads_lie_in_the_beam,
    loads_have_a_node,
    directions_point_somewhere,
    attached_masses_sit_on_mass,
    load_names_differ,
    static_force_names_differ,
    probes_lie_in_the_beam,
    probes_have_a_node,
    probe_names_differ,
    points_keep_apart,
    run_has_steps,
    step_follows_the_forcing,
    interest_covers_the_forcing,
    outputs_fall_on_steps,
    contact_is_shallow,
    law_fits_the_formulation,
    law_fits_the_rest,
    point_results_follow_the_law,
    own_laws_follow_the_penetration,
    own_laws_have_their_stiffness,
    own_laws_fit_the_rest,
    yielding_laws_are_marched,
    impulses_are_unilateral,
    exact_contact_starts_outside,
    adaptive_steps_resolve_a_contact,
    scheme_fits_the_formulation,
    explicit_scheme_fits_the_contact,
    impulses_need_mass,
    friction_fits_the_formulation,
    friction_is_implicit,
    static_friction_holds_more,
    points_need_a_penalty,
    patches_have_points,
    points_lie_on_the_faces,
    points_hold_the_beam,
    patches_keep_apart,
    contact_fits_the_model,
    stations_are_of_rigid_sections,
    touching_sections_are_in_holes,
    rigid_sections_are_in_holes,
    implicit_schemes_march_the_model,
    modal_damping_has_modes,
    elements_are_above_round_off,
    beams_move_as_asked,
    beam_is_prismatic,
    iterations_can_solve,
    gates_are_in_order,
    limits_are_in_order,
    forcing_is_periodic,
    period_map_is_smooth,
    shooting_has_whole_steps,
    model_is_dense,
    balance_has_a_law,
    march_reaches_the_amplitude,
    curve_is_in_reach,
    loads_are_sound,
    loads_fit_each_other,
    loads_fit_the_run,
    moved_supports_are_there,
    motions_reach_the_beam,
    moving_supports_do_not_rub_around,
    moving_supports_are_marched,
    closures_leave_a_beam,
)
"""All checks; the names of their parameters are those of the tables they take."""
