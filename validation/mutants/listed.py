"""The mutants, by what they break."""

from __future__ import annotations

from validation.mutants.mutant import Mutant

__all__ = ["MUTANTS"]


def _unit(file: str, *tests: str) -> tuple[str, ...]:
    return tuple(f"tests/unit/test_{file}.py::{test}" for test in tests)


def _physics(file: str, *tests: str) -> tuple[str, ...]:
    return tuple(f"tests/physics/test_{file}.py::{test}" for test in tests)


STRIP = "fsm/scene/builders/strip.py"
STRIPS = (
    Mutant(
        "torsion stiffness of strips doubled",
        STRIP,
        "torsion = self.shear",
        "torsion = 2 * self.shear",
        _unit("strip_stiffness", "test_springs_of_a_panel_are_those_of_a_strip"),
    ),
    Mutant(
        "shear of strips without 5/6",
        STRIP,
        "shear = 5 / 6 * self.shear",
        "shear = self.shear",
        _unit("strip_stiffness", "test_springs_of_a_panel_are_those_of_a_strip"),
    ),
    Mutant(
        "bending of strips in their plane halved",
        STRIP,
        "thickness * strip.width**3 / 12",
        "thickness * strip.width**3 / 24",
        _unit("strip_stiffness", "test_springs_of_a_panel_are_those_of_a_strip"),
    ),
    Mutant(
        "nu = 0 in bending of strips as plates",
        "fsm/scene/materials.py",
        "/ (1 - self.poisson**2)",
        "/ 1.0",
        _unit("strip_stiffness", "test_plates_bend_with_poissons_ratio"),
    ),
    Mutant(
        "inertia of segments about their end",
        STRIP,
        "inertia = mass / 12",
        "inertia = mass / 3",
        _unit("strip_stiffness", "test_inertia_of_segments_is_that_of_boxes"),
    ),
    Mutant(
        "half cells beside creases ignored",
        STRIP,
        "distance / self.bending if self.strip.half_cell else 0.0",
        "0.0",
        _physics("strip_convergence", "test_second_order_with_half_cell"),
    ),
    Mutant(
        "half cells beside creases counted twice",
        STRIP,
        "distance / self.bending if self",
        "2 * distance / self.bending if self",
        _physics("strip_convergence", "test_second_order_with_half_cell"),
    ),
    Mutant(
        "rest angle of creases ignored",
        STRIP,
        "rest = abs(folded) if self.crease.rest_angle is None else self.crease.rest_angle",
        "rest = abs(folded)",
        _unit("compile", "test_moment_of_a_folded_crease_is_that_of_its_curve"),
    ),
    Mutant(
        "share of a contact probe doubled",
        "fsm/segments/panel_points.py",
        "weight = rows(0.5 * weights * cell)",
        "weight = rows(weights * cell)",
        _unit("strip_stiffness", "test_probes_of_a_panel_add_up_to_its_face"),
    ),
    Mutant(
        "shares of both panels of a pair doubled",
        "fsm/segments/compile_surfaces.py",
        "0.5 * weight / smaller",
        "weight / smaller",
        _unit("strip_stiffness", "test_panels_that_lie_on_each_other_have_the_stiffness_of_one_face"),
    ),
    Mutant(
        "sign of gravity",
        "fsm/segments/loads.py",
        "+= self.mass[:, None] * self.acceleration",
        "-= self.mass[:, None] * self.acceleration",
        _unit("strip_stiffness", "test_weight_acts_along_gravity"),
    ),
    Mutant(
        "energy of gravity doubled",
        "fsm/segments/loads.py",
        "-float(self.mass @ height)",
        "-2.0 * float(self.mass @ height)",
        _unit("strip_stiffness", "test_weight_acts_along_gravity"),
    ),
    Mutant(
        "stiffness of follower loads with the wrong sign",
        "fsm/segments/loads.py",
        "-_TURN @ rotation @ load.force",
        "_TURN @ rotation @ load.force",
        _physics("tangents", "test_loads_alone"),
    ),
    Mutant(
        "drive at half its speed in the run-up",
        "fsm/segments/drive.py",
        "self.speed * x * x * (3.0 - 2.0 * x)",
        "0.5 * self.speed * x * x * (3.0 - 2.0 * x)",
        _unit("drive", "test_rates_are_derivatives"),
    ),
    Mutant(
        "drive reaction lost by a factor of two",
        "fsm/segments/system.py",
        "np.asarray(drive_reactions(reactions, self.driven, self._motion, self._directions))",
        "0.5 * np.asarray(drive_reactions(reactions, self.driven, self._motion, self._directions))",
        _physics("rigid_zigzag", "test_static_pull_with_the_strips_own_springs"),
    ),
    Mutant(
        "ramp of a load not smooth",
        "fsm/segments/time_function.py",
        "else x * x * (3.0 - 2.0 * x)",
        "else x",
        _unit("time_function", "test_ramp_is_zero_then_smooth_then_one"),
    ),
)

LAWS = (
    Mutant(
        "sign of dampers",
        "fsm/interactions/bushing_planar.py",
        "+ row[_DAMPING + 2] * rp",
        "- row[_DAMPING + 2] * rp",
        _unit("one_pass", "test_one_pass_is_one_after_the_other"),
    ),
    Mutant(
        "rest of springs ignored",
        "fsm/interactions/bushing_planar.py",
        "(psi - row[_REST + 2])",
        "psi",
        _unit("one_pass", "test_one_pass_is_one_after_the_other"),
    ),
    Mutant(
        "creases constant beyond their data",
        "fsm/kernels/spline.py",
        "value + slope * step, slope",
        "value, slope",
        _unit("laws", "test_curve_goes_through_the_data_and_straight_on"),
    ),
    Mutant(
        "half of the flexibility beside a measured crease",
        "fsm/laws/crease.py",
        "total = opening + moment * flexibility",
        "total = opening + 0.5 * moment * flexibility",
        _unit("laws", "test_series_flexibility"),
    ),
    Mutant(
        "exponent of Hertz' law",
        "fsm/laws/normal/hertz.py",
        "total = stiffness * d**exponent +",
        "total = stiffness * d +",
        _unit("normal_laws", "test_energy_is_the_integral_of_the_elastic_force"),
    ),
    Mutant(
        "slope of Hertz' law halved",
        "fsm/laws/normal/hertz.py",
        "by_depth = stiffness * exponent",
        "by_depth = 0.5 * stiffness * exponent",
        _unit("normal_laws", "test_slopes"),
    ),
    Mutant(
        "factor of the exact restitution",
        "fsm/laws/normal/restitution.py",
        "return -math.expm1(-s) / c",
        "return -math.expm1(-s)",
        _unit("normal_laws", "test_exact_factor"),
    ),
    Mutant(
        "factor of Flores' restitution",
        "fsm/laws/normal/flores.py",
        "1.6 *",
        "1.5 *",
        _unit("normal_laws", "test_factors_of_the_approximations"),
    ),
    Mutant(
        "static friction ignored",
        "fsm/laws/friction/stribeck.py",
        "excess = (mu_static - mu_dynamic)",
        "excess = 0.0 * (mu_static - mu_dynamic)",
        ("gallery closed_forms/static_friction",),
    ),
    Mutant(
        "static friction ignored by bristles",
        "fsm/laws/friction/lugre.py",
        "            friction.mu_static,\n",
        "            friction.mu_dynamic,\n",
        _physics("restitution_laws", "test_bristles_hold_the_block"),
    ),
    Mutant(
        "friction across a plate as along it",
        "fsm/segments/friction_force.py",
        "return vectors + (across - 1.0)",
        "return vectors + 0.0 * (across - 1.0)",
        _physics("sliding", "test_friction_across_a_plate"),
    ),
    Mutant(
        "slider of a crease does not move back",
        "fsm/laws/crease_hysteresis.py",
        "moved[i] = opening[i] + strength / stiffness[i]",
        "moved[i] = slider[i]",
        _unit("crease_hysteresis_law", "test_work_is_stored_or_lost_on_any_way"),
    ),
    Mutant(
        "loss of a crease without its spring",
        "fsm/laws/crease_hysteresis.py",
        " - 0.5 * (strength * strength - there * there) / stiffness[i]",
        "",
        _unit("crease_hysteresis_law", "test_work_is_stored_or_lost_on_any_way"),
    ),
)

SOLVERS = (
    Mutant(
        "beta of generalized-alpha",
        "fsm/solve/generalized_alpha.py",
        "1.0 / (1.0 + rho_inf) ** 2",
        "1.1 / (1.0 + rho_inf) ** 2",
        _physics("generalized_alpha", "test_spectral_radius_at_infinity"),
    ),
    Mutant(
        "gamma of generalized-alpha",
        "fsm/solve/generalized_alpha.py",
        "0.5 * (3.0 - rho_inf) / (1.0 + rho_inf)",
        "0.5",
        _physics("generalized_alpha", "test_first_step_is_as_good_as_the_others", "test_spectral_radius_at_infinity"),
    ),
    Mutant(
        "tangent of contacts in statics without the stiffness of the law",
        "fsm/interactions/contact_tangent.py",
        "normal_x = -by_depth * gradient[0, n] -",
        "normal_x = -0.5 * by_depth * gradient[0, n] -",
        _physics("tangents", "test_contact_alone"),
    ),
    Mutant(
        "numerical damping in Newmark's method",
        "fsm/solve/generalized_alpha.py",
        "cls._with(0.0, 0.0, 0.25, 0.5)",
        "cls._with(0.0, 0.0, 0.3025, 0.6)",
        _physics("generalized_alpha", "test_newmark_is_the_method_without_its_two_shifts"),
    ),
    Mutant(
        "dissipation not booked",
        "fsm/stepping/march.py",
        "stored - start + dissipated - work",
        "stored - start - work",
        _physics("energy_balance", "test_strip_with_contact_and_friction"),
    ),
    Mutant(
        "work of a step booked half",
        "fsm/solve/energy_balance.py",
        "self.work += work",
        "self.work += 0.5 * work",
        _physics("energy_balance", "test_records_add_up"),
    ),
    Mutant(
        "frequencies of modes doubled",
        "fsm/solve/modal.py",
        "self.squared) / (2 * math.pi)",
        "self.squared) / math.pi",
        _physics("modal", "test_string_under_tension"),
    ),
    Mutant(
        "gyroscopic moment with the wrong sign",
        "fsm/kernels/newton_euler.py",
        "force[i, 3] -= (jz - jy) * wy * wz",
        "force[i, 3] += (jz - jy) * wy * wz",
        _physics("rigid_body", "test_heavy_top_is_where_it_should_be"),
    ),
)

FILMS = (
    Mutant(
        "edge cables removed from films",
        "fsm/analyses/film.py",
        "builder.edge_cables(grid, material, viscosity, limp)",
        "pass",
        _physics("edge_cables", "test_edge_cables_vibrate_as_ritz_says"),
    ),
    Mutant(
        "nu = 0 in plate bending of films",
        "fsm/ancf/film.py",
        "return self.stretch * self.thickness**2 / 12.0",
        "return self.young * self.thickness**3 / 12.0",
        _physics("ancf_membrane", "test_square_plate"),
    ),
    Mutant(
        "mass of films in proportion to their length",
        "fsm/ancf/film.py",
        "mass = (areal_density * np.prod(sides, axis=1))",
        "mass = (areal_density * sides[:, 0])",
        _unit("ancf_elements", "test_mass_of_a_translation_and_of_the_air"),
    ),
    Mutant(
        "prestress ignored in modes of films",
        "fsm/ancf/membrane.py",
        "stretch[a, a] += weight * nxx",
        "stretch[a, a] += 0.0 * weight * nxx",
        _physics("ancf_membrane", "test_six_lowest_frequencies_of_a_tensioned_square"),
    ),
    Mutant(
        "twisting of films without its factor of two",
        "fsm/ancf/membrane.py",
        "m[2] = 2.0 * bending",
        "m[2] = bending",
        _unit("ancf_elements", "test_patch_of_constant_curvature"),
    ),
    Mutant(
        "air of a folded film along one direction",
        "fsm/ancf/from_deployed.py",
        "normal = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])",
        "normal = np.tile([0.0, 0.0, 1.0], (len(corners), 1))",
        _unit("from_deployed", "test_air_goes_along_the_normal"),
    ),
    Mutant(
        "creases of a film with their whole stiffness at every node",
        "fsm/ancf/from_deployed.py",
        "share = 0.5 * (np.append",
        "share = 1.0 * (np.append",
        _unit("from_deployed", "test_the_moment_of_a_crease"),
    ),
    Mutant(
        "added air -25 %",
        "fsm/ancf/air.py",
        "MINAMI = 0.68",
        "MINAMI = 0.51",
        _unit("film_case", "test_one_number_of_the_air"),
    ),
    Mutant(
        "added air -25 % in the mass matrix",
        "fsm/ancf/air.py",
        "np.full(len(sides), air)",
        "np.full(len(sides), 0.75 * air)",
        _unit("ancf_elements", "test_mass_of_a_translation_and_of_the_air"),
    ),
    Mutant(
        "added air in all directions",
        "fsm/ancf/air.py",
        "np.outer(normal, normal)",
        "np.eye(3)",
        _unit("ancf_elements", "test_mass_of_a_translation_and_of_the_air"),
    ),
    Mutant(
        "mass of ANCF cables halved",
        "fsm/ancf/cable.py",
        "mass = (self.line_density * self.length)",
        "mass = (0.5 * self.line_density * self.length)",
        _unit("ancf_elements", "test_mass_of_a_translation_and_of_the_air"),
    ),
    Mutant(
        "rounded kinks of a tension field with a wrong second derivative",
        "fsm/ancf/tension_field.py",
        "over / (2.0 * width)",
        "over / width",
        _unit("tension_field_law", "test_slopes_in_all_states"),
    ),
    Mutant(
        "tension field ends where the film still bears both ways",
        "fsm/ancf/tension_field.py",
        "if e2 + poisson * e1 > 0.0:",
        "if e2 > 0.0:",
        _unit("ancf_elements", "test_states_of_a_tension_field"),
    ),
    Mutant(
        "area of a half-sine pulse",
        "fsm/ancf/time_functions.py",
        "return math.sin(angle), rate",
        "return 0.9 * math.sin(angle), rate",
        _unit("ancf_elements", "test_pulses"),
    ),
)

ARRAYS = (
    Mutant(
        "pivot of scissors at the wrong part of the bar",
        "fsm/scene/builders/scissor.py",
        "return (1.0 - scissor.hinge) * scissor.bar_length, scissor.hinge * scissor.bar_length",
        "return scissor.hinge * scissor.bar_length, (1.0 - scissor.hinge) * scissor.bar_length",
        _physics("scissor", "test_rigid_units_fit_at_every_angle"),
    ),
    Mutant(
        "shear of lattice hinges as stiff as their stretch",
        "fsm/scene/builders/lattice.py",
        "translation=(lattice.axial, 0.0, lattice.shear)",
        "translation=(lattice.axial, 0.0, lattice.axial)",
        _physics("rotating_squares", "test_forces_are_those_of_another_program"),
    ),
    Mutant(
        "one r_x for both halves of a bar at its middle hinge",
        "fsm/ancf/bars.py",
        'if i == 1 and k and self.element != "cable":',
        "if False:",
        _unit("beams", "test_a_bent_bar_carries_its_moment_around_the_bend"),
    ),
    Mutant(
        "stress of bars a third of the way from the hinge",
        "fsm/ancf/scissor_system.py",
        "math.sqrt(2.4)",
        "math.sqrt(5.4)",
        _physics("scissor", "test_stress_at_hinges"),
    ),
    Mutant(
        "dissipation of slopes at the ends of a step",
        "fsm/solve/dissipation.py",
        "if halfway:",
        "if False:",
        _physics("scissor", "test_balance_of_damped_bars_that_turn"),
    ),
    Mutant(
        "latch holds from one side only",
        "fsm/ancf/hinge.py",
        "if latched or (depth > 0.0 and damped > 0.0):",
        "if depth > 0.0 and damped > 0.0:",
        _unit("latch", "test_forces_are_those_of_the_energies"),
    ),
    Mutant(
        "latches forget when they closed",
        "fsm/ancf/latch.py",
        "self.times[:] = times if len(times) else math.inf",
        "self.times[:] = math.inf",
        _unit("latch", "test_latches_are_remembered"),
    ),
)

DATA = (
    Mutant("pound per square inch", "fsm/scene/units.py", "6894.757293168361", "6894.0", _unit("units", "test_value_in_si")),
    Mutant("kilogram-force", "fsm/scene/units.py", '"kgf": (9.80665', '"kgf": (9.81', _unit("units", "test_value_in_si")),
    Mutant(
        "covariance of a fit over all data",
        "fsm/calibrate/uncertainty.py",
        "float(residuals @ residuals) / freedom",
        "float(residuals @ residuals) / count",
        _unit("uncertainty", "test_covariance_of_a_straight_line_is_the_textbook_one"),
    ),
    Mutant(
        "variance of a bootstrap not put right",
        "fsm/calibrate/uncertainty.py",
        " * repeats / (repeats - 1)\n",
        "\n",
        _unit("uncertainty", "test_bootstrap_has_the_variance_of_a_mean"),
    ),
    Mutant(
        "relaxation of a crease without its time",
        "fsm/scene/crease_family.py",
        "math.log1p(time / self.tau)",
        "math.log1p(time)",
        ("gallery closed_forms/relaxation",),
    ),
    Mutant(
        "peak of a curve at the wrong place",
        "fsm/results/quantities.py",
        "np.clip(-b / (2 * c), left, right)",
        "np.clip(-b / c, left, right)",
        _unit("quantities", "test_peak_of_a_parabola_is_exact_at_any_spacing"),
    ),
    Mutant(
        "amplitudes of a spectrum halved",
        "fsm/results/spectrum.py",
        "lines[1:] *= 2.0",
        "lines[1:] *= 1.0",
        _unit("spectrum", "test_a_sine_on_a_bin_has_its_amplitude"),
    ),
    Mutant(
        "decay of a vibration doubled",
        "fsm/results/spectrum.py",
        "envelope = np.exp(-decay * t)",
        "envelope = np.exp(-0.5 * decay * t)",
        _unit("spectrum", "test_the_fit_is_exact"),
    ),
)

CHANNELS = (
    Mutant(
        "angle of a crease with its half segments",
        "fsm/channels/elements.py",
        "- soft * float(",
        "- 0.0 * float(",
        _physics("channels", "test_the_moment_of_a_crease_is_its_stiffness_times_its_angle"),
    ),
    Mutant(
        "moment at a joint with the wrong arm",
        "fsm/channels/elements.py",
        "moment - np.cross(arm, force)",
        "moment + np.cross(arm, force)",
        _physics("channels", "test_the_moment_vector_is_the_moment_about_the_crease"),
    ),
    Mutant(
        "wrenches of creases with the sliders of the start",
        "fsm/channels/elements.py",
        "alone.restore(group.memory())",
        "alone.restore(np.zeros(0))",
        _physics("channels", "test_a_crease_with_hysteresis_knows_its_memory_at_each_record"),
    ),
    Mutant(
        "reactions of half of the nodes",
        "fsm/channels/nodes.py",
        "mesh.positions(state.once(_reactions)).sum(axis=0)",
        "mesh.positions(state.once(_reactions))[::2].sum(axis=0) / 2.0",
        _physics("channels", "test_reactions_of_a_held_cable_with_a_weight"),
    ),
    Mutant(
        "an effort without a slope has no geometric stiffness",
        "fsm/interactions/pose_spatial.py",
        "if stiffness[i, k] == 0.0 and damping[i, k] == 0.0 and effort[i, k] == 0.0:",
        "if stiffness[i, k] == 0.0 and damping[i, k] == 0.0:",
        _unit("extensions", "test_geometric_stiffness_of_a_constant_effort"),
    ),
)

JOINED = (
    Mutant(
        "inertia of the mean-force method halved",
        "fsm/solve/mean_force.py",
        "self._mass @ ((2.0 / h) * (rate - self.u))",
        "self._mass @ ((1.0 / h) * (rate - self.u))",
        _unit("mean_force", "test_a_free_body_keeps_its_energy"),
    ),
    Mutant(
        "contact stiffness of films that of the larger face",
        "fsm/segments/flexible_contacts.py",
        "self._whole[members].min(axis=1, initial=np.inf)",
        "self._whole[members].max(axis=1, initial=0.0)",
        _unit("film_contact", "test_the_stiffness_is_that_of_the_smaller_face_for_any_mesh"),
    ),
    Mutant(
        "bending of beams in scenes doubled",
        "fsm/ancf/build.py",
        "self.width * self.thickness**3 / 12.0",
        "self.width * self.thickness**3 / 6.0",
        _physics("films_in_scenes", "test_a_beam_in_a_scene_is_a_cantilever"),
    ),
)

MUTANTS = (*STRIPS, *LAWS, *SOLVERS, *FILMS, *JOINED, *ARRAYS, *DATA, *CHANNELS)
