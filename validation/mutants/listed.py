"""Mutants of strips, laws and solvers, and the list of all mutants."""

from __future__ import annotations

from validation.mutants.listed_elements import ELEMENTS
from validation.mutants.mutant import Mutant, physics_test, unit_test

__all__ = ["MUTANTS"]

STRIP = "fsm/builders/strip.py"
STRIPS = (
    Mutant(
        "torsion stiffness of strips doubled",
        STRIP,
        "torsion = self.shear",
        "torsion = 2 * self.shear",
        unit_test("strip_stiffness", "test_springs_of_a_panel_are_those_of_a_strip"),
    ),
    Mutant(
        "shear of strips without 5/6",
        STRIP,
        "shear = 5 / 6 * self.shear",
        "shear = self.shear",
        unit_test("strip_stiffness", "test_springs_of_a_panel_are_those_of_a_strip"),
    ),
    Mutant(
        "half segments beside creases without energy",
        "fsm/model/compile/compile.py",
        'e.crease_flexibility * e.twist_stiffness if e.kind == "crease" else 1.0',
        '0.0 if e.kind == "crease" else 1.0',
        physics_test("stages", "test_half_segments_beside_a_crease_store_energy_of_the_panels"),
    ),
    Mutant(
        "bending of strips in their plane halved",
        STRIP,
        "thickness * strip.width**3 / 12",
        "thickness * strip.width**3 / 24",
        unit_test("strip_stiffness", "test_springs_of_a_panel_are_those_of_a_strip"),
    ),
    Mutant(
        "nu = 0 in bending of strips as plates",
        "fsm/case/models/materials.py",
        "/ (1 - self.poisson**2)",
        "/ 1.0",
        unit_test("strip_stiffness", "test_plates_bend_with_poissons_ratio"),
    ),
    Mutant(
        "inertia of segments about their end",
        STRIP,
        "inertia = mass / 12",
        "inertia = mass / 3",
        unit_test("strip_stiffness", "test_inertia_of_segments_is_that_of_boxes"),
    ),
    Mutant(
        "half cells beside creases ignored",
        STRIP,
        "distance / self.bending if self.strip.half_cell else 0.0",
        "0.0",
        physics_test("strip_convergence", "test_second_order_with_half_cell"),
    ),
    Mutant(
        "half cells beside creases counted twice",
        STRIP,
        "distance / self.bending if self",
        "2 * distance / self.bending if self",
        physics_test("strip_convergence", "test_second_order_with_half_cell"),
    ),
    Mutant(
        "rest angle of creases ignored",
        STRIP,
        "rest = abs(folded) if self.crease.rest_angle is None else self.crease.rest_angle",
        "rest = abs(folded)",
        unit_test("compile", "test_moment_of_a_folded_crease_is_that_of_its_curve"),
    ),
    Mutant(
        "share of a contact probe doubled",
        "fsm/model/contact/surfaces/panel_points.py",
        "weight = rows(0.5 * weights * cell)",
        "weight = rows(weights * cell)",
        unit_test("strip_stiffness", "test_probes_of_a_panel_add_up_to_its_face"),
    ),
    Mutant(
        "shares of both panels of a pair doubled",
        "fsm/model/compile/compile_surfaces.py",
        "0.5 * weight / smaller",
        "weight / smaller",
        unit_test("strip_stiffness", "test_panels_that_lie_on_each_other_have_the_stiffness_of_one_face"),
    ),
    Mutant(
        "sign of gravity",
        "fsm/model/bodies/loads.py",
        "+= self.mass[:, None] * self.acceleration",
        "-= self.mass[:, None] * self.acceleration",
        unit_test("strip_stiffness", "test_weight_acts_along_gravity"),
    ),
    Mutant(
        "energy of gravity doubled",
        "fsm/model/bodies/loads.py",
        "-float(self.mass @ height)",
        "-2.0 * float(self.mass @ height)",
        unit_test("strip_stiffness", "test_weight_acts_along_gravity"),
    ),
    Mutant(
        "stiffness of follower loads with the wrong sign",
        "fsm/interactions/applied.py",
        "block[0, 2] -= c",
        "block[0, 2] += c",
        physics_test("tangents", "test_loads_alone"),
    ),
    Mutant(
        "compiled steps without the input power of drives",
        "fsm/model/bodies/array_energies.py",
        "power += of_drives",
        "power += 0.0 * of_drives",
        physics_test("many_steps", "test_same_steps"),
    ),
    Mutant(
        "compiled steps without the inertial force of bodies that turn",
        "fsm/interactions/driven.py",
        "+= twist[k] * inertia[body, k] * change[k]",
        "+= 0.0 * twist[k] * inertia[body, k] * change[k]",
        physics_test("many_steps", "test_same_steps"),
    ),
    Mutant(
        "drive at half its speed in the run-up",
        "fsm/model/bodies/drive.py",
        "(0.0, 0.0, 0.0, speed / start**2, -0.5 * speed / start**3)",
        "(0.0, 0.0, 0.0, 0.5 * speed / start**2, -0.25 * speed / start**3)",
        unit_test("drive", "test_run_up_is_smooth"),
    ),
    Mutant(
        "drive reaction lost by a factor of two",
        "fsm/model/system/force_system.py",
        "np.asarray(drive_reactions(reactions, self.driven, self._motion, self._directions))",
        "0.5 * np.asarray(drive_reactions(reactions, self.driven, self._motion, self._directions))",
        physics_test("rigid_zigzag", "test_static_pull_with_the_strips_own_springs"),
    ),
    Mutant(
        "ramp of a load not smooth",
        "fsm/model/bodies/time_function.py",
        "else (0.0, 0.0, 3.0 / length**2, -2.0 / length**3)",
        "else (0.0, 1.0 / length)",
        unit_test("time_function", "test_ramp_is_zero_then_smooth_then_one"),
    ),
)

LAWS = (
    Mutant(
        "sign of dampers",
        "fsm/interactions/bushing_planar.py",
        "+ row[_DAMPING + 2] * rp",
        "- row[_DAMPING + 2] * rp",
        unit_test("one_pass", "test_one_pass_is_one_after_the_other"),
    ),
    Mutant(
        "rest of springs ignored",
        "fsm/interactions/bushing_planar.py",
        "(psi - row[_REST + 2])",
        "psi",
        unit_test("one_pass", "test_one_pass_is_one_after_the_other"),
    ),
    Mutant(
        "creases constant beyond their data",
        "fsm/kernels/spline.py",
        "value + slope * step, slope",
        "value, slope",
        unit_test("laws", "test_curve_goes_through_the_data_and_straight_on"),
    ),
    Mutant(
        "half of the flexibility beside a measured crease",
        "fsm/laws/crease.py",
        "total = opening + moment * flexibility",
        "total = opening + 0.5 * moment * flexibility",
        unit_test("laws", "test_series_flexibility"),
    ),
    Mutant(
        "moment of a gear on the second joint without the ratio",
        "fsm/model/elements/gears.py",
        "effort[i, j] = way[j] * push",
        "effort[i, j] = (1 - 2 * j) * push",
        unit_test("couplings", "test_force_energy_and_tangent_agree"),
    ),
    Mutant(
        "coupled angles without their turns",
        "fsm/model/elements/couplings.py",
        "angles[k] += 2.0 * np.pi * np.round(",
        "angles[k] += 0.0 * np.pi * np.round(",
        physics_test("coupled_joints", "test_a_gear_accelerates_two_wheels_over_many_turns"),
    ),
    Mutant(
        "dampers of stops and gears that pull back",
        "fsm/laws/one_sided.py",
        "if elastic + damped > 0.0:",
        "if elastic > 0.0:",
        physics_test("coupled_joints", "test_backlash_ends_in_an_impact"),
    ),
    Mutant(
        "couplings without the turning of their axes",
        "fsm/model/elements/couplings.py",
        "block[first + a, first + b] = efforts[i, j] * hessian[k, a, b]",
        "block[first + a, first + b] = 0.0",
        unit_test("couplings", "test_force_energy_and_tangent_agree"),
    ),
    Mutant(
        "exponent of Hertz' law",
        "fsm/laws/normal/hertz.py",
        "total = stiffness * d**exponent +",
        "total = stiffness * d +",
        unit_test("normal_laws", "test_energy_is_the_integral_of_the_elastic_force"),
    ),
    Mutant(
        "slope of Hertz' law halved",
        "fsm/laws/normal/hertz.py",
        "by_depth = stiffness * exponent",
        "by_depth = 0.5 * stiffness * exponent",
        unit_test("normal_laws", "test_slopes"),
    ),
    Mutant(
        "factor of the exact restitution",
        "fsm/laws/normal/restitution.py",
        "return -math.expm1(-s) / c",
        "return -math.expm1(-s)",
        unit_test("normal_laws", "test_exact_factor"),
    ),
    Mutant(
        "factor of Flores' restitution",
        "fsm/laws/normal/flores.py",
        "1.6 *",
        "1.5 *",
        unit_test("normal_laws", "test_factors_of_the_approximations"),
    ),
    Mutant(
        "static friction ignored",
        "fsm/laws/friction/stribeck.py",
        "excess = (mu_static - mu_dynamic)",
        "excess = 0.0 * (mu_static - mu_dynamic)",
        unit_test("friction_laws", "test_values"),
    ),
    Mutant(
        "static friction ignored by bristles",
        "fsm/laws/friction/lugre.py",
        "            friction.mu_static,\n",
        "            friction.mu_dynamic,\n",
        physics_test("restitution_laws", "test_bristles_hold_the_block"),
    ),
    Mutant(
        "friction across a plate as along it",
        "fsm/interactions/contact/anisotropic_friction.py",
        "vector[c] += (across - 1.0) * along",
        "vector[c] += 0.0 * (across - 1.0) * along",
        physics_test("sliding", "test_friction_across_a_plate"),
    ),
    Mutant(
        "slider of a crease does not move back",
        "fsm/laws/crease_hysteresis.py",
        "moved[i] = opening[i] + strength / stiffness[i]",
        "moved[i] = slider[i]",
        unit_test("crease_hysteresis_law", "test_work_is_stored_or_lost_on_any_way"),
    ),
    Mutant(
        "loss of a crease without its spring",
        "fsm/laws/crease_hysteresis.py",
        " - 0.5 * (strength * strength - there * there) / stiffness[i]",
        "",
        unit_test("crease_hysteresis_law", "test_work_is_stored_or_lost_on_any_way"),
    ),
)

CUTS = "fsm/builders/patterns/cuts.py"
SHEETS = (
    Mutant(
        "sides of cuts joined at their vertices",
        CUTS,
        "np.flatnonzero(between & ~cut))",
        "np.flatnonzero(between))",
        unit_test("open_cuts", "test_vertices_are_split_where_the_material_is_not_joined"),
    ),
    Mutant(
        "contact between both sides of a cut",
        "fsm/model/contact/sheets/sheet_tables.py",
        "_to_segment(a[:, k], b) < 0.5 * reach",
        "_to_segment(a[:, k], b) < 0.0",
        physics_test("cuts", "test_both_sides_of_a_cut_do_not_press_each_other"),
    ),
    Mutant(
        "fold angles from a corner on the wrong side of a crease",
        "fsm/builders/patterns/folding.py",
        "math.copysign(float(np.linalg.norm(area)), float(area @ normal))",
        "float(np.linalg.norm(area))",
        physics_test("cuts", "test_cards_start_folded"),
    ),
)

SOLVERS = (
    Mutant(
        "beta of generalized-alpha",
        "fsm/solve/time/generalized_alpha.py",
        "1.0 / (1.0 + rho_inf) ** 2",
        "1.1 / (1.0 + rho_inf) ** 2",
        physics_test("generalized_alpha", "test_spectral_radius_at_infinity"),
    ),
    Mutant(
        "gamma of generalized-alpha",
        "fsm/solve/time/generalized_alpha.py",
        "0.5 * (3.0 - rho_inf) / (1.0 + rho_inf)",
        "0.5",
        physics_test("generalized_alpha", "test_first_step_is_as_good_as_the_others", "test_spectral_radius_at_infinity"),
    ),
    Mutant(
        "tangent of contacts in statics without the stiffness of the law",
        "fsm/interactions/surfaces/gap_planar.py",
        "normal_x = -by_depth[i] * gradient[i, 0, n] -",
        "normal_x = -0.5 * by_depth[i] * gradient[i, 0, n] -",
        physics_test("tangents", "test_contact_alone"),
    ),
    Mutant(
        "numerical damping in Newmark's method",
        "fsm/solve/time/generalized_alpha.py",
        "cls._with(0.0, 0.0, 0.25, 0.5)",
        "cls._with(0.0, 0.0, 0.3025, 0.6)",
        physics_test("generalized_alpha", "test_newmark_is_the_method_without_its_two_shifts"),
    ),
    Mutant(
        "dissipation not counted",
        "fsm/solve/stepping/march.py",
        "stored - start + dissipated - work",
        "stored - start - work",
        physics_test("energy_balance", "test_strip_with_contact_and_friction"),
    ),
    Mutant(
        "half of the work of a step counted",
        "fsm/solve/outcome/energy_balance.py",
        "self.work += work",
        "self.work += 0.5 * work",
        physics_test("energy_balance", "test_records_add_up"),
    ),
    Mutant(
        "frequencies of modes doubled",
        "fsm/solve/modal.py",
        "self.squared) / (2 * math.pi)",
        "self.squared) / math.pi",
        physics_test("modal", "test_string_under_tension"),
    ),
    Mutant(
        "gyroscopic moment with the wrong sign",
        "fsm/kernels/newton_euler.py",
        "force[i, 3] -= (jz - jy) * wy * wz",
        "force[i, 3] += (jz - jy) * wy * wz",
        physics_test("momentum", "test_angular_momentum_of_a_run"),
    ),
)

MUTANTS = (*STRIPS, *LAWS, *SHEETS, *SOLVERS, *ELEMENTS)
