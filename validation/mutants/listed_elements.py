"""Mutants of films, arrays, data, channels and coupled models."""

from __future__ import annotations

from validation.mutants.mutant import Mutant, physics_test, unit_test

__all__ = ["ELEMENTS"]

WINGS = (
    Mutant(
        "hinge lines of wings on the wrong face",
        "fsm/case/derived/wing_scene.py",
        "side = -0.5 * sense * gap",
        "side = 0.5 * sense * gap",
        physics_test("wing", "test_parts_meet_at_their_hinges_in_any_direction"),
    ),
    Mutant(
        "cables of wings with the inverse ratio",
        "fsm/case/derived/wing_scene.py",
        "inner.angle / outer.angle",
        "outer.angle / inner.angle",
        physics_test("wing", "test_cables_have_the_ratios_of_the_stowed_angles"),
    ),
    Mutant(
        "springs that resist left out of margins",
        "fsm/case/derived/joint_margin.py",
        "f.spring * np.maximum(-driving, 0.0)",
        "0.0",
        unit_test("joint_margin", "test_the_required_moment_has_the_factors_of_the_standard"),
    ),
)

FILMS = (
    Mutant(
        "edge cables removed from films",
        "fsm/analyses/film.py",
        "builder.edge_cables(grid, material, viscosity, tension_only)",
        "pass",
        physics_test("edge_cables", "test_edge_cables_vibrate_as_ritz_says"),
    ),
    Mutant(
        "nu = 0 in plate bending of films",
        "fsm/model/nodes/films/film.py",
        "return self.stretch * self.thickness**2 / 12.0",
        "return self.young * self.thickness**3 / 12.0",
        physics_test("ancf_membrane", "test_square_plate"),
    ),
    Mutant(
        "mass of films in proportion to their length",
        "fsm/model/nodes/films/film.py",
        "mass = (areal_density * np.prod(sides, axis=1))",
        "mass = (areal_density * sides[:, 0])",
        unit_test("ancf_elements", "test_mass_of_a_translation_and_of_the_air"),
    ),
    Mutant(
        "prestress ignored in modes of films",
        "fsm/model/nodes/films/membrane.py",
        "stretch[a, a] += weight * nxx",
        "stretch[a, a] += 0.0 * weight * nxx",
        physics_test("ancf_membrane", "test_six_lowest_frequencies_of_a_tensioned_square"),
    ),
    Mutant(
        "twisting of films without its factor of two",
        "fsm/model/nodes/films/membrane.py",
        "m[2] = 2.0 * bending",
        "m[2] = bending",
        unit_test("ancf_elements", "test_patch_of_constant_curvature"),
    ),
    Mutant(
        "chambers of rigid panels without strips at creases",
        "fsm/builders/sheet/sheet_gas.py",
        "        if u < v:\n",
        "        if u < 0:\n",
        physics_test("gas_of_panels", "test_wrenches_and_tangent_are_derivatives"),
    ),
    Mutant(
        "moment of gas on a panel in axes of space",
        "fsm/model/joined/panel_gas.py",
        "f[a] = axes[0, a] * forces[3 * i] + axes[1, a] * forces[3 * i + 1] + axes[2, a] * forces[3 * i + 2]",
        "f[a] = forces[3 * i + a]",
        physics_test("gas_of_panels", "test_wrenches_and_tangent_are_derivatives"),
    ),
    Mutant(
        "driven panels do not compress the gas",
        "fsm/model/system/force_system.py",
        "change -= (weights @ (vectors @ moving.ravel())) @ free",
        "pass",
        physics_test("gas_of_panels", "test_reaction_of_a_driven_panel"),
    ),
    Mutant(
        "air of a folded film along one direction",
        "fsm/model/nodes/system/from_deployed.py",
        "normal = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])",
        "normal = np.tile([0.0, 0.0, 1.0], (len(corners), 1))",
        unit_test("from_deployed", "test_air_goes_along_the_normal"),
    ),
    Mutant(
        "creases of a film with their whole stiffness at every node",
        "fsm/model/nodes/system/from_deployed.py",
        "share = 0.5 * (np.append",
        "share = 1.0 * (np.append",
        unit_test("from_deployed", "test_the_moment_of_a_crease"),
    ),
    Mutant(
        "added air -25 %",
        "fsm/model/nodes/films/air.py",
        "MINAMI = 0.68",
        "MINAMI = 0.51",
        unit_test("film_case", "test_one_number_of_the_air"),
    ),
    Mutant(
        "added air -25 % in the mass matrix",
        "fsm/model/nodes/films/air.py",
        "np.full(len(sides), air)",
        "np.full(len(sides), 0.75 * air)",
        unit_test("ancf_elements", "test_mass_of_a_translation_and_of_the_air"),
    ),
    Mutant(
        "added air in all directions",
        "fsm/model/nodes/films/air.py",
        "np.outer(normal, normal)",
        "np.eye(3)",
        unit_test("ancf_elements", "test_mass_of_a_translation_and_of_the_air"),
    ),
    Mutant(
        "mass of ANCF cables halved",
        "fsm/model/nodes/cable.py",
        "mass = (self.line_density * self.length)",
        "mass = (0.5 * self.line_density * self.length)",
        unit_test("ancf_elements", "test_mass_of_a_translation_and_of_the_air"),
    ),
    Mutant(
        "rounded kinks of a tension field with a wrong second derivative",
        "fsm/model/nodes/tension_field.py",
        "over / (2.0 * width)",
        "over / width",
        unit_test("tension_field_law", "test_slopes_in_all_states"),
    ),
    Mutant(
        "a film bears both ways where it has wrinkles",
        "fsm/model/nodes/tension_field.py",
        "if e2 + poisson * e1 > 0.0:",
        "if e2 + e1 > 0.0:",
        unit_test("ancf_elements", "test_states_of_a_tension_field"),
    ),
    Mutant(
        "area of a half-sine pulse",
        "fsm/kernels/programs.py",
        "(1.0, math.pi / duration, 0.0)",
        "(0.9, math.pi / duration, 0.0)",
        unit_test("ancf_elements", "test_pulses"),
    ),
)

ARRAYS = (
    Mutant(
        "pivot of scissors at the wrong part of the bar",
        "fsm/case/derived/scissor.py",
        "return (1.0 - scissor.hinge) * scissor.bar_length, scissor.hinge * scissor.bar_length",
        "return scissor.hinge * scissor.bar_length, (1.0 - scissor.hinge) * scissor.bar_length",
        physics_test("scissor", "test_rigid_units_fit_at_every_angle"),
    ),
    Mutant(
        "shear of lattice hinges as stiff as their stretch",
        "fsm/builders/lattice.py",
        "translation=(axial, 0.0, shear)",
        "translation=(axial, 0.0, axial)",
        physics_test("rotating_squares", "test_forces_are_those_of_another_program"),
    ),
    Mutant(
        "shortening of bent hinges in pure bending twice too large",
        "fsm/interactions/ligament_planar.py",
        "row[_BENT] * value[2] / 12.0",
        "row[_BENT] * value[2] / 6.0",
        unit_test("ligament", "test_a_bent_ligament_is_nearly_the_elastica"),
    ),
    Mutant(
        "one r_x for both halves of a bar at its middle hinge",
        "fsm/model/nodes/beams/bars.py",
        'if i == 1 and k and self.element != "cable":',
        "if False:",
        unit_test("beams", "test_a_bent_bar_carries_its_moment_around_the_bend"),
    ),
    Mutant(
        "stress of bars a third of the way from the hinge",
        "fsm/model/nodes/beams/bar_stress.py",
        "math.sqrt(2.4)",
        "math.sqrt(5.4)",
        physics_test("scissor", "test_stress_at_hinges"),
    ),
    Mutant(
        "dissipation of slopes at the ends of a step",
        "fsm/model/nodes/system/array_kernels.py",
        "halfway[i] = last[i] + 0.5 * (q[i] - last[i])",
        "halfway[i] = q[i]",
        physics_test("scissor", "test_balance_of_damped_bars_that_turn"),
    ),
    Mutant(
        "latch holds from one side only",
        "fsm/model/nodes/beams/hinge.py",
        "if latched == 1 or (depth > 0.0 and damped > 0.0):",
        "if depth > 0.0 and damped > 0.0:",
        unit_test("latch", "test_forces_are_those_of_the_energies"),
    ),
    Mutant(
        "latches forget when they closed",
        "fsm/model/nodes/beams/hinge.py",
        "self.times[:] = times if len(times) else math.inf",
        "self.times[:] = math.inf",
        unit_test("latch", "test_latches_are_remembered"),
    ),
)

DATA = (
    Mutant(
        "pound per square inch", "fsm/case/schema/units.py", "6894.757293168361", "6894.0", unit_test("units",
        "test_value_in_si")
    ),
    Mutant(
        "kilogram-force", "fsm/case/schema/units.py", '"kgf": (9.80665', '"kgf": (9.81', unit_test("units",
        "test_value_in_si")
    ),
    Mutant(
        "covariance of a fit over all data",
        "fsm/calibrate/uncertainty.py",
        "float(residuals @ residuals) / freedom",
        "float(residuals @ residuals) / count",
        unit_test("uncertainty", "test_covariance_of_a_straight_line_is_the_textbook_one"),
    ),
    Mutant(
        "variance of a bootstrap not put right",
        "fsm/calibrate/uncertainty.py",
        " * repeats / (repeats - 1)\n",
        "\n",
        unit_test("uncertainty", "test_bootstrap_has_the_variance_of_a_mean"),
    ),
    Mutant(
        "relaxation of a crease without its time",
        "fsm/case/loading/crease_family.py",
        "math.log1p(time / self.tau)",
        "math.log1p(time)",
        unit_test("calibrate_crease", "test_relaxation_is_kept_with_the_curves"),
    ),
    Mutant(
        "peak of a curve at the wrong place",
        "fsm/results/quantities.py",
        "np.clip(-b / (2 * c), left, right)",
        "np.clip(-b / c, left, right)",
        unit_test("quantities", "test_peak_of_a_parabola_is_exact_at_any_spacing"),
    ),
    Mutant(
        "amplitudes of a spectrum halved",
        "fsm/results/spectrum.py",
        "lines[1:] *= 2.0",
        "lines[1:] *= 1.0",
        unit_test("spectrum", "test_a_sine_on_a_bin_has_its_amplitude"),
    ),
    Mutant(
        "decay of a vibration doubled",
        "fsm/results/spectrum.py",
        "envelope = np.exp(-decay * t)",
        "envelope = np.exp(-0.5 * decay * t)",
        unit_test("spectrum", "test_the_fit_is_exact"),
    ),
)

CHANNELS = (
    Mutant(
        "angle of a crease with its half segments",
        "fsm/channels/elements.py",
        "- soft * float(",
        "- 0.0 * float(",
        physics_test("channels", "test_the_moment_of_a_crease_is_its_stiffness_times_its_angle"),
    ),
    Mutant(
        "moment at a joint with the wrong arm",
        "fsm/channels/elements.py",
        "moment - np.cross(arm, force)",
        "moment + np.cross(arm, force)",
        physics_test("channels", "test_the_moment_vector_is_the_moment_about_the_crease"),
    ),
    Mutant(
        "wrenches of creases with the sliders of the start",
        "fsm/channels/elements.py",
        "reshape(count, 2))\n\n\ndef _arms",
        'reshape(count, 2), **({"sliders": group.sliders._replace(memory=group.sliders.first.copy())} '
        'if hasattr(group, "sliders") else {}))\n\n\ndef _arms',
        physics_test("channels", "test_a_crease_with_hysteresis_knows_its_memory_at_each_record"),
    ),
    Mutant(
        "reactions of half of the nodes",
        "fsm/channels/nodes.py",
        "mesh.positions(state.once(_reactions)).sum(axis=0)",
        "mesh.positions(state.once(_reactions))[::2].sum(axis=0) / 2.0",
        physics_test("channels", "test_reactions_of_a_held_cable_with_a_weight"),
    ),
    Mutant(
        "an effort without a slope has no geometric stiffness",
        "fsm/interactions/pose_spatial.py",
        "if stiffness[i, k] == 0.0 and damping[i, k] == 0.0 and effort[i, k] == 0.0:",
        "if stiffness[i, k] == 0.0 and damping[i, k] == 0.0:",
        unit_test("extensions", "test_geometric_stiffness_of_a_constant_effort"),
    ),
)

JOINED = (
    Mutant(
        "frames whose maps do not turn in accelerations",
        "fsm/model/system/array_locked.py",
        "rates[f.bodies[i], k] += turns[j, k, c] * now[3 * first[j] + c]",
        "rates[f.bodies[i], k] += 0.0 * turns[j, k, c] * now[3 * first[j] + c]",
        unit_test("joined_joints", "test_projected_states_open_no_joint"),
    ),
    Mutant(
        "edges of films with half of their mean position",
        "fsm/case/models/facet_mesh.py",
        "weights = [share * point.weights",
        "weights = [0.5 * share * point.weights",
        physics_test("flexible_joints", "test_tip_on_a_sprung_hinge_is_that_of_the_elastica"),
    ),
    Mutant(
        "hinges of flexible panels on the wrong edges",
        "fsm/case/derived/wing_scene.py",
        "names[int((x if along else y) > 0.0)]",
        "names[int((x if along else y) < 0.0)]",
        physics_test("flexible_joints", "test_deployed_wing_vibrates_as_beams_on_springs"),
    ),
    Mutant(
        "inertia of the mean-force method halved",
        "fsm/solve/stepping/vectors.py",
        "out[i] = (2.0 / h) * (x[i] / h - u[i])",
        "out[i] = (1.0 / h) * (x[i] / h - u[i])",
        unit_test("mean_force", "test_a_free_body_keeps_its_energy"),
    ),
    Mutant(
        "multipliers of the mean-force method along gradients at two points",
        "fsm/model/elements/joints.py",
        "found[k] += more[i, k]",
        "found[k] += 0.0 * more[i, k]",
        physics_test("mean_force_of_joints", "test_multipliers_do_no_work_and_no_joint_opens"),
    ),
    Mutant(
        "friction of explicit steps from the reactions of the last step",
        "fsm/model/system/array_locked.py",
        "if not feels or settled(",
        "if True or settled(",
        physics_test("joint_laws", "test_friction_that_follows_the_reaction"),
    ),
    Mutant(
        "contact stiffness of films that of the larger face",
        "fsm/model/contact/shapes/side_contacts.py",
        "(area / part).min(axis=1, initial=np.inf)",
        "(area / part).max(axis=1, initial=0.0)",
        unit_test("film_contact", "test_the_stiffness_is_that_of_the_smaller_face_for_any_mesh"),
    ),
    Mutant(
        "bending of beams in scenes doubled",
        "fsm/model/nodes/system/build.py",
        "self.width * self.thickness**3 / 12.0",
        "self.width * self.thickness**3 / 6.0",
        physics_test("films_in_scenes", "test_a_beam_in_a_scene_is_a_cantilever"),
    ),
)

FACETS = (
    Mutant(
        "twist of flexible facets with half of its energy",
        "fsm/model/nodes/facets/facet_group.py",
        "turn = np.diag([1.0, 1.0, 2.0])",
        "turn = np.diag([1.0, 1.0, 2.0**0.5])",
        unit_test("facets", "test_patch_of_uniform_curvature"),
    ),
    Mutant(
        "frame of a line without the slope of its linear fit",
        "fsm/case/models/facet_mesh.py",
        "12.0 * place / whole**2 * weight",
        "6.0 * place / whole**2 * weight",
        physics_test("frames_on_sheets", "test_axes_of_a_line_have_unit_length_at_the_start"),
    ),
    Mutant(
        "mean strain of flexible facets without the turns of their edges",
        "fsm/model/nodes/facets/facet_shape.py",
        "centre[:, :, 12 + k] += size[:, None] * bend[:, k]",
        "centre[:, :, 12 + k] += 0.0 * bend[:, k]",
        unit_test("facets", "test_linear_strain_is_exact"),
    ),
    Mutant(
        "efforts of flexible facets not advanced",
        "fsm/model/nodes/facets/facet.py",
        "total += _simpson(p) * _dot(slopes[k, p], rising[k, p])",
        "total += 0.0 * _dot(slopes[k, p], rising[k, p])",
        unit_test("facets", "test_efforts_of_the_mixed_newton_method"),
    ),
    Mutant(
        "creases of flexible facets of the opposite sense",
        "fsm/model/compile/compile_joined.py",
        "weights[:, side, 2 * side], weights[:, side, 2 * side + 1] = -y, x",
        "weights[:, 1 - side, 2 * side], weights[:, 1 - side, 2 * side + 1] = -y, x",
        unit_test("pattern_mesh", "test_creases_of_flexible_facets"),
    ),
    Mutant(
        "contact of flexible facets with the whole stiffness for each of both faces",
        "fsm/model/contact/sheets/array_sheets.py",
        "0.5 * own.node_area[node] / own.sizes[index.FACE]",
        "own.node_area[node] / own.sizes[index.FACE]",
        physics_test("flexible_facets_touch", "test_the_stiffness_of_an_area_does_not_depend_on_the_mesh"),
    ),
    Mutant(
        "closest points of flexible facets that do not move",
        "fsm/interactions/triangles/feature_contact.py",
        "shift -= tau[a, m] * by_beta[two, a]",
        "shift -= 0.0",
        unit_test("closest_features", "test_the_tangent_is_that_of_the_force"),
    ),
    Mutant(
        "near edges of flexible facets without their clearance",
        "fsm/interactions/triangles/closest_features.py",
        "within = clearance[i] + reach",
        "within = reach",
        unit_test("closest_features", "test_near_edges_contain_all_contacts_until_nodes_have_moved"),
    ),
    Mutant(
        "points pass through the planes of triangles, also beside them",
        "fsm/interactions/triangles/triangles_pass.py",
        "inside &= dot(part, normal) >= 0.0",
        "inside &= True",
        unit_test("closest_features", "test_points_that_pass_through_a_moving_triangle"),
    ),
)

JOINTS = (
    Mutant(
        "multipliers of joints that advance without the increment",
        "fsm/model/elements/joints.py",
        "(value[i] + _along(rates, bodies[i], gradient[i]))",
        "value[i]",
        physics_test("ideal_joints", "test_a_light_coupler_takes_no_more_iterations"),
    ),
    Mutant(
        "reactions of joints without the curvature of the motion",
        "fsm/model/elements/joints.py",
        "rate += bends[i] - pick_up",
        "rate -= pick_up",
        physics_test("ideal_joints", "test_a_spherical_pendulum"),
    ),
    Mutant(
        "motors without power",
        "fsm/model/elements/joints.py",
        "stored[2] -= effort[i] * speed",
        "stored[2] -= 0.0",
        physics_test("ideal_joints", "test_a_motor_turns_by_its_program_and_counts_turns"),
    ),
    Mutant(
        "equilibria without reactions of joints",
        "fsm/model/elements/joints.py",
        "kept[i] = _efforts(own)[i]",
        "kept[i] = 0.0",
        physics_test("joints_at_rest", "test_hinge_with_a_spring_follows_a_growing_dead_load"),
    ),
    Mutant(
        "latches that open keep their energy in the balance",
        "fsm/model/elements/joint_laws.py",
        "return float(0.5 * law[LATCH] *",
        "return float(0.0 * law[LATCH] *",
        physics_test("joint_events_at_rest", "test_a_driven_latch_opens_on_a_slow_path_and_loses_its_energy"),
    ),
    Mutant(
        "slow steps that pass events",
        "fsm/solve/stepping/path.py",
        "if 0.0 < record[index.PART] < 1.0 and",
        "if 0.0 > record[index.PART] and",
        physics_test("joint_events_at_rest", "test_a_driven_latch_opens_on_a_slow_path_and_loses_its_energy"),
    ),
    Mutant(
        "latches that never close",
        "fsm/model/elements/joint_events.py",
        "memory[laws.LATCHED * m + i], closed = 2.0, back",
        "memory[laws.LATCHED * m + i], closed = 0.0, back",
        physics_test("ideal_joints", "test_a_latch_holds_a_block_between_itself_and_the_stop"),
    ),
    Mutant(
        "a latch acts in the step in which it closes",
        "fsm/model/elements/joint_events.py",
        "memory[laws.LATCHED * m + i], closed = 2.0, back",
        "memory[laws.LATCHED * m + i], closed = 1.0, back",
        physics_test("joint_laws", "test_a_latch_does_not_act_in_the_step_in_which_it_closes"),
    ),
    Mutant(
        "steps up to a stop with the force after it",
        "fsm/laws/one_sided.py",
        "return bool(before < -near and beyond <= near)",
        "return bool(before < -near and beyond <= -near)",
        physics_test("events_in_the_balance", "test_a_damped_stop"),
    ),
    Mutant(
        "crossed cylinders without the stiffness of their curvature",
        "fsm/model/contact/geometries/cylinder_on_cylinder.py",
        "out.bend[:] += push * one.bend - steep * np.outer(one.way, one.way)",
        "out.bend[:] += -steep * np.outer(one.way, one.way)",
        physics_test("cylinder_on_cylinder", "test_forces_are_those_of_the_energy_and_tangents_those_of_the_forces"),
    ),
    Mutant(
        "walls of cells of boxes without energy",
        "fsm/model/contact/boxes.py",
        "total -= own.slopes[slot, wall] * np.sqrt(dot(area, area)) / 48.0 * (",
        "total -= 0.0 * own.slopes[slot, wall] * np.sqrt(dot(area, area)) / 48.0 * (",
        physics_test("box_on_box", "test_energy_is_the_integral_over_the_common_volume"),
    ),
    Mutant(
        "friction of boxes with the normal force of the law",
        "fsm/model/contact/boxes.py",
        "g.pull[i] = max(-dot(out.normal, out.pull), 0.0)",
        "g.pull[i] = 1.0",
        physics_test("box_on_box", "test_kinds_of_contact"),
    ),
    Mutant(
        "boxes without the look between two states",
        "fsm/model/contact/boxes.py",
        "looks = min(_LOOKS, 1 + int(moved / own.deepest[number]))",
        "looks = 1",
        physics_test("box_on_box", "test_a_step_does_not_carry_a_thin_box_through_a_thin_box"),
    ),
    Mutant(
        "stops that return all energy",
        "fsm/model/elements/joint_laws.py",
        "damper += stiffness * max(beyond, 0.0) * rebound",
        "damper += 0.0",
        physics_test("joint_laws", "test_a_stop_returns_with_its_restitution"),
    ),
    Mutant(
        "harnesses without hysteresis",
        "fsm/model/elements/joint_laws.py",
        "    effort = half * s + 0.5 * turn * width * s * s",
        "    effort = 0.0 * half * s",
        physics_test("joint_laws", "test_a_harness_loses_the_area_between_its_curves"),
    ),
    Mutant(
        "screws that slide without turning",
        "fsm/interactions/openings.py",
        "x -= lead * _angle(",
        "x -= 0.0 * _angle(",
        physics_test("joint_laws", "test_a_nut_runs_down_a_screw"),
    ),
    Mutant(
        "pulleys whose friction pushes",
        "fsm/model/elements/cords.py",
        "math.exp(-pulleys[j] * theta * tanh)",
        "math.exp(pulleys[j] * theta * tanh)",
        physics_test("cords", "test_a_spool_pulls_over_a_pulley_with_friction"),
    ),
    Mutant(
        "springs with the law of a crease on the wrong side",
        "fsm/model/compile/compile_joint_forces.py",
        "_over_angle(curve, rest, side, -side)",
        "_over_angle(curve, rest, side, side)",
        physics_test("joint_laws", "test_the_law_of_a_crease_is_a_spring"),
    ),
    Mutant(
        "joints that an event locks without a loss of energy",
        "fsm/solve/time/stepwise_run.py",
        "balance.dissipated += max(-change, 0.0)",
        "balance.dissipated += 0.0",
        physics_test("events", "test_a_joint_of_several_directions_is_locked_and_unlocked"),
    ),
    Mutant(
        "events at the ends of steps",
        "fsm/solve/time/event_steps.py",
        "if np.any(crossed):",
        "if not crossed.size:",
        physics_test("events", "test_a_run_ends"),
    ),
)

ELEMENTS = (*JOINTS, *WINGS, *FILMS, *FACETS, *JOINED, *ARRAYS, *DATA, *CHANNELS)
