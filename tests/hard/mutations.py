"""A mutation of each contact law and each wall motion, and the test that must detect it."""

LAW = "tisim/effects/contact/granular"
PARTS = "tests/effects/contact/test_granular_parts.py::test_"
PARTS_OF_LAWS = {
    "hooke": (
        f"{LAW}/hooke.py", "(w, pair) * overlap", "(w, pair) * overlap * 1.01",
        f"{PARTS}hooke_spring_and_constant_damping",
    ),
    "hertz_material": (
        f"{LAW}/hertz.py", "2.0 / 3.0", "0.66", f"{PARTS}cohesion_pulls_while_surfaces_touch",
    ),
    "jkr": (
        f"{LAW}/jkr.py", "1.5 * (ratio", "1.4 * (ratio",
        f"{PARTS}jkr_force_from_contact_to_pull_off",
    ),
    "restitution_damping": (
        f"{LAW}/restitution.py", "hypot(logarithm, math.pi)", "hypot(logarithm, 3.0)",
        f"{PARTS}restitution_with_hookes_spring",
    ),
    "viscoelastic_damping": (
        f"{LAW}/viscoelastic.py", "* stiffness", "* stiffness * 1.1",
        f"{PARTS}viscoelastic_restitution_falls_as_the_fifth_root_of_the_speed",
    ),
    "constant_damping": (
        f"{LAW}/constant.py", "+ 0.0 * stiffness", "+ 1e-3 * stiffness",
        f"{PARTS}hooke_spring_and_constant_damping",
    ),
    "mindlin_displacement": (
        f"{LAW}/mindlin.py", "known / spring, 0.0)", "0.9 * known / spring, 0.0)",
        f"{PARTS}mindlins_spring_stores_its_displacement",
    ),
    "linear_spring": (
        f"{LAW}/mindlin.py", "return self.stiffness_ratio", "return 0.9 * self.stiffness_ratio",
        f"{PARTS}a_linear_spring_has_history_and_slides",
    ),
    "mindlin_force": (
        f"{LAW}/mindlin.py", "elastic += spring * dt * sliding",
        "elastic = spring * dt * sliding",
        "tests/effects/contact/test_walls.py::test_a_grain_between_two_walls_hangs_by_mindlins_springs",
    ),
    "viscous_friction": (
        f"{LAW}/viscous.py", "grip *= most / ti.sqrt(square)", "grip *= 1.0",
        f"{PARTS}viscous_friction_has_no_history",
    ),
    "rolling_cdt": (
        f"{LAW}/rolling.py", "share * rolling, past", "-share * rolling, past",
        f"{PARTS}a_constant_torque_holds_back_rolling_at_any_speed",
    ),
    "rolling_epsd": (
        f"{LAW}/rolling.py", "2.25 * friction", "2.0 * friction",
        "tests/effects/contact/test_compositions.py::test_steps_equal_the_reference[jkr]",
    ),
    "rolling_sds": (
        f"{LAW}/rolling.py", "return grip, known / spring", "return grip, drawn",
        f"{PARTS}a_rolling_spring_slips_at_its_limit",
    ),
    "twisting_marshall": (
        f"{LAW}/twisting.py", "return spring * (0.5 * circle", "return spring * (circle",
        f"{PARTS}a_twisting_spring_slips_at_its_limit",
    ),
    "twisting_sds": (
        f"{LAW}/twisting.py", "known / stiffness", "1.1 * known / stiffness",
        f"{PARTS}a_twisting_spring_slips_at_its_limit",
    ),
    "sjkr": (
        f"{LAW}/cohesion.py", "2.0 * ti.math.pi", "ti.math.pi", f"{PARTS}cohesion_pulls_while_surfaces_touch",
    ),
    "dmt": (
        f"{LAW}/cohesion.py", "adhesive: ClassVar[bool] = True", "adhesive: ClassVar[bool] = False",
        f"{PARTS}cohesion_pulls_while_surfaces_touch",
    ),
}  # fmt: skip
"""For each part of a composed law: a file, a text that occurs in it once, its replacement, and the test that
must then fail."""
CONTACT = "tisim/effects/contact"
LAWS = "tests/effects/contact/test_contact.py::test_contact_equals_its_numpy_reference"
SOFT_GRAINS = {
    "hard_rods": (
        f"{CONTACT}/rods.py", "0.5 * self.size(s, w, i) * self.rods.diameter",
        "0.4 * self.size(s, w, i) * self.rods.diameter",
        "tests/steppers/packing/test_mechanical_contraction.py::test_an_attempt_equals_its_reference[revised]",
    ),
    "hard_superquadrics": (
        f"{CONTACT}/superquadrics.py", "return self.superquadrics.exponents(w, self",
        "return 2.0 + 0.0 * self.superquadrics.exponents(w, self",
        "tests/steppers/packing/test_mechanical_contraction.py::test_an_attempt_equals_its_reference[cuboids]",
    ),
    "hard_mixture": (
        f"{CONTACT}/mixture.py", "s.shape[w, i] - self.rod_shapes", "s.shape[w, i] - self.rod_shapes - 1",
        "tests/steppers/packing/test_mixtures.py::test_an_attempt_equals_its_reference",
    ),
    "contact": (f"{CONTACT}/power_law.py", "0.5 * (self", "0.6 * (self", f"{LAWS}[contact]"),
    "hertz": (f"{CONTACT}/hertz.py", "4.0 / 3.0 * modulus", "1.3 * modulus", f"{LAWS}[hertz]"),
    "contact_softening": (
        f"{CONTACT}/softening.py", "ti.max(stiffness", "ti.min(stiffness", f"{LAWS}[softening]",
    ),
    "contact_dissipation": (
        f"{CONTACT}/dissipation.py", "* opening *", "* ti.max(opening, 0.0) *", f"{LAWS}[dissipation]",
    ),
    "contact_friction": (
        f"{CONTACT}/friction.py", "self.dynamic(w) * pressed", "self.static(w) * pressed",
        f"{LAWS}[friction]",
    ),
    "contact_bond": (
        f"{CONTACT}/bond.py", "if e >= self.threshold(w)", "if e >= 0.9 * self.threshold(w)", f"{LAWS}[bond]",
    ),
}  # fmt: skip
"""Mutations of hard bodies, and of the laws of Z16."""
BONDS = "tests/effects/contact/test_bonds.py::test_"
BONDED = {
    "capillary_bridge": (
        f"{CONTACT}/capillary_bridge.py", "2.5 * gap", "2.4 * gap",
        f"{BONDS}a_liquid_bridge_follows_willett",
    ),
    "parallel_bond": (
        f"{CONTACT}/parallel_bond.py", "ti.abs(twist) * r / (2.0 * second)", "ti.abs(twist) * r / second",
        f"{BONDS}a_bond_breaks_at_its_strength_and_stays_broken",
    ),
}  # fmt: skip
"""Mutations of liquid bridges and bonds."""
MOTION = "tisim/effects/walls"
MOVING = "tests/effects/contact/test_moving_walls.py::test_"
WALLS = {
    "walls": (
        f"{MOTION}/wall_contacts.py", "self.past[w, i, begin + c] = known[c]",
        "self.past[w, i, begin + c] = 0.0 * known[c]",
        "tests/effects/contact/test_walls.py::test_a_grain_between_two_walls_hangs_by_mindlins_springs",
    ),
    "servo": (
        f"{MOTION}/servo.py", "/ QUANTA - 1.0", "/ QUANTA - 1.01",
        f"{MOVING}a_servo_presses_with_the_wanted_force",
    ),
    "oscillation": (
        f"{MOTION}/oscillation.py", "elementary.sin(", "elementary.cos(",
        f"{MOVING}a_grain_follows_a_gently_shaking_plate",
    ),
    "rotation": (
        f"{MOTION}/rotation.py", "return self.rate(w).cross(", "return 0.9 * self.rate(w).cross(",
        f"{MOVING}a_turning_drum_drags_a_grain_with_mu_times_its_weight",
    ),
    "translation": (
        f"{MOTION}/translation.py", "return r - self.displacement", "return r - 0.99 * self.displacement",
        f"{MOVING}moving_walls_are_galilean_invariant",
    ),
    "confinement": (
        "tisim/geometry/round_containers.py", "0.5 * self.diameter(w)", "0.49 * self.diameter(w)",
        "tests/steppers/packing/test_confinement.py::"
        "test_an_attempt_equals_its_reference[spherocylinder_shape-cylindrical_container-exact]",
    ),
}  # fmt: skip
"""Mutations of walls and their motions."""
MOTIONS, SHAPES = "tisim/effects/constraint", "tests/effects/constraint/test_rigid_shapes.py::test_"
MUTATIONS = {**PARTS_OF_LAWS, **SOFT_GRAINS, **BONDED, **WALLS}
STEPS = "tests/hard/test_granular_steps.py::test_steps_beyond_the_limit_stop_the_world"
HERTZ_MINDLIN = "tests/effects/contact/test_hertz_mindlin.py::test_"
SHARED = {
    "corners_of_rods": (
        f"{MOTIONS}/rigid_rods.py", "self.rod_radius(s, w, i))", "0.99 * self.rod_radius(s, w, i))",
        f"{SHAPES}a_rod_falls_and_comes_to_rest_on_both_ends",
    ),
    "corners_of_superquadrics": (
        f"{MOTIONS}/rigid_superquadrics.py", "self.farthest(s, w, i, q, direction)",
        "0.99 * self.farthest(s, w, i, q, direction)",
        f"{SHAPES}a_brick_comes_to_rest_on_its_largest_face",
    ),
    "curved_walls": (
        "tisim/effects/walls/curved_walls.py", "deep = n.dot(place + y) - planes[2]",
        "deep = n.dot(place + 0.99 * y) - planes[2]",
        "tests/effects/constraint/test_shapes_in_curved_walls.py::"
        "test_the_force_of_a_wall_is_the_one_of_the_deepest_point_of_the_surface",
    ),
    "rods_beside_superquadrics": (
        f"{MOTIONS}/rigid_mixture.py", "RigidRods.corner(self, s, w, i, c,",
        "RigidRods.corner(self, s, w, i, 0 * c,",
        "tests/effects/constraint/test_rigid_mixture.py::test_all_bodies_come_to_rest_on_a_floor",
    ),
    "mobility": (
        f"{LAW}/shape_contact.py", "(about / inertia).dot(about)", "0.9 * (about / inertia).dot(about)",
        f"{SHAPES}restitution_holds_wherever_a_body_hits_a_floor[rods]",
    ),
    "free_bodies": (
        f"{MOTIONS}/rigid_shapes.py", "s.radius[w, i] * s.radius[w, i] * self.inertia",
        "s.radius[w, i] * s.radius[w, i] * 1.01 * self.inertia",
        f"{SHAPES}a_free_top_keeps_its_angular_momentum_and_turns_to_second_order[egg]",
    ),
    "levers": (
        f"{LAW}/shape_contact.py", "arm_i = x_i - 0.5 * overlap * normal", "arm_i = 0.99 * x_i",
        f"{SHAPES}two_bodies_collide_as_in_a_numpy_reference[rods]",
    ),
    "eased": (
        f"{LAW}/spring.py", "ti.min(stiffness", "ti.max(stiffness",
        f"{HERTZ_MINDLIN}a_closed_path_gains_no_work",
    ),
    "turned": (
        f"{LAW}/spring.py", "known *= ti.sqrt(size / flat)", "known *= 1.0",
        "tests/effects/contact/test_turning_springs.py::test_projected_springs_equal_the_reference",
    ),
    "carried": (
        f"{LAW}/spring.py", "remembered.dot(normal) * (normal + tilt)", "remembered.dot(normal) * normal",
        f"{HERTZ_MINDLIN}the_contact_history_rotates_with_the_pair",
    ),
    "carried_about_the_normal": (
        f"{LAW}/spring.py", "turn * (normal.cross(known)", "turn * (0.99 * normal.cross(known)",
        f"{HERTZ_MINDLIN}steps_equal_the_reference",
    ),
    "slipping": (
        f"{LAW}/spring.py", "known = grip - drag", "known = elastic",
        f"{HERTZ_MINDLIN}coulombs_limit_includes_damping_and_ends_at_once",
    ),
    "can_follow": (
        f"{LAW}/step_limit.py", "+ 2.0 * damping)", "+ 0.0 * damping)",
        f"{STEPS}[hooke]",
    ),
    "can_follow_both": (
        f"{LAW}/step_limit.py", "> (both * first) * (both * second)", "> 0.0 * both * first * second",
        f"{STEPS}[jkr]",
    ),
    "can_follow_what_slides": (
        f"{LAW}/step_limit.py", "slides = 1.0 + TURNING", "slides = 0.5 + TURNING", f"{STEPS}[jkr]",
    ),
    "can_follow_what_slides_at_a_wall": (
        f"{LAW}/step_limit.py", "[1.0, 1.0 + TURNING * arm", "[1.0, 0.5 + TURNING * arm", f"{STEPS}[hooke]",
    ),
    "can_follow_what_rolls": (
        f"{LAW}/step_limit.py", "rolls = TURNING * (", "rolls = 0.8 * TURNING * (", f"{STEPS}[jkr]",
    ),
    "can_follow_what_twists": (
        f"{LAW}/guards.py", "can_follow(twists, ", "can_follow(0.0 * twists, ", f"{STEPS}[hooke]",
    ),
    "least_held": (
        f"{LAW}/step_limit.py", "ti.select(friction > 0.0, ", "ti.select(friction >= 0.0, ",
        "tests/hard/test_granular_steps.py::test_springs_without_friction_stop_nothing",
    ),
    "cohesion_by_overlap": (
        f"{LAW}/guards.py", "radius, radius) < push", "radius, radius) < 2.0 * push",
        f"{PARTS}cohesion_pulls_while_surfaces_touch",
    ),
    "bonds_of_unlike_grains": (
        f"{CONTACT}/parallel_bond.py", "free * (arm / inertia - back / other)", "0.0 * arm",
        f"{BONDS}too_long_steps_for_unlike_grains_stop_the_world",
    ),
    "can_follow_at_walls": (
        f"{LAW}/step_limit.py", "TURNING * arm * arm, TURNING, TURNING * arm]",
        "TURNING * arm * arm, TURNING, 0.0 * arm]", f"{STEPS}[jkr]",
    ),
    "cohesion_limit": (
        f"{LAW}/cohesion_limit.py", "a * b / (a + b)", "0.9 * a * b / (a + b)",
        "tests/effects/contact/test_granular_input.py::test_cohesion_without_an_equilibrium_is_refused",
    ),
    "translation_begins": (
        f"{MOTION}/translation.py", "ti.max(t - ti.cast(self.begin(w), ti.f64), 0.0)", "ti.max(t, 0.0)",
        "tests/effects/constraint/test_prescribed_motion.py"
        "::test_a_driven_group_follows_its_motion[translation later]",
    ),
    "force_of_a_pair": (
        f"{LAW}/contact.py", "back = (distance - arm) * moment", "back = arm * moment",
        "tests/effects/contact/test_compositions.py::test_steps_equal_the_reference[jkr]",
    ),
    "force_of_a_wall": (
        f"{LAW}/contact.py", "arm, radius = s.radius[w, i] - 0.5 * overlap", "arm, radius = s.radius[w, i]",
        "tests/effects/contact/test_compositions.py::test_steps_equal_the_reference[jkr]",
    ),
    "memory_at_surfaces": (
        f"{MOTION}/wall_contacts.py", "STILL_THE_SAME = 0.9", "STILL_THE_SAME = 1.1",
        "tests/effects/contact/test_surfaces.py::test_a_sphere_that_rolls_downhill_over_seams_keeps_its_grip",
    ),
    "arm": (
        f"{CONTACT}/normal.py", "0.5 * (distance + (a - b)", "0.5 * (distance - (a - b)", f"{LAWS}[friction]",
    ),
}  # fmt: skip
"""Mutations of code that several laws share."""
MAGNETIC = "tisim/effects/magnetic"
DIPOLES = "tests/effects/magnetic/test_"
SUMS = {
    "dipoles": (
        f"{MAGNETIC}/dipole_dipole.py", "(5.0 * along_a * along_b - a.dot(b)) * n",
        "(4.9 * along_a * along_b - a.dot(b)) * n",
        f"{DIPOLES}rigid_bodies.py::test_a_cut_off_beyond_all_is_a_sum_over_all_pairs",
    ),
    "dipoles_within_bodies": (
        "tisim/pairs/half_list.py", "if ti.static(not self.within_bodies):", "if ti.static(True):",
        f"{DIPOLES}rigid_bodies.py::test_a_cut_off_beyond_all_is_a_sum_over_all_pairs",
    ),
    "contacts_within_bodies": (
        "tisim/forces/force_sum.py", "apart = not self.half_list.joined(w, i, j)", "apart = True",
        f"{DIPOLES}rigid_bodies.py::test_a_cut_off_beyond_all_is_a_sum_over_all_pairs",
    ),
    "exports_of_two_sorts_of_laws": (
        "tisim/pairs/listed_pairs.py", "self.total.combine(self.exported.read(w, m), term)", "term",
        "tests/pairs/test_short_ranged.py::test_contacts_within_a_far_cut_off_equal_the_reference",
    ),
    "shifted_cut_off": (
        f"{MAGNETIC}/dipole_pairs.py", "slope = 12.0 * x", "slope = 11.9 * x",
        f"{DIPOLES}cutoff.py::test_forces_and_torques_are_minus_the_gradient_of_the_energy[True]",
    ),
    "mutual_moments": (
        f"{MAGNETIC}/mutual_moment.py", "field *= part", "field *= 0.99 * part",
        f"{DIPOLES}rigid_bodies.py::test_a_cut_off_beyond_all_is_a_sum_over_all_pairs",
    ),
    "moments_without_end": (
        "tisim/self_consistent/self_consistent.py",
        "ti.select(first, self.effect.largest_change(w), tolerance)",
        "ti.select(first, 1e300, tolerance)",
        f"{DIPOLES}sweeps.py::test_approaching_spheres_stop_when_their_moments_diverge",
    ),
    "ewald_pairs": (
        f"{MAGNETIC}/ewald_pairs.py", "c = 3.0 * b + 2.0 * square", "c = 3.0 * b + 1.9 * square",
        f"{DIPOLES}ewald.py::test_forces_and_torques_are_those_in_numpy[periodic0]",
    ),
    "ewald_waves": (
        f"{MAGNETIC}/wave_sum.py", "-0.25 * square / (alpha * alpha)", "-0.26 * square / (alpha * alpha)",
        f"{DIPOLES}ewald.py::test_forces_and_torques_are_those_in_numpy[periodic0]",
    ),
    "ewald_layers": (
        f"{MAGNETIC}/wave_sum.py", "if not a.is_inside(w, i):", "if False:",
        f"{DIPOLES}ewald.py::test_a_magnet_that_leaves_its_layer_stops_the_world",
    ),
    "virial": (
        "tisim/forces/loads.py", "= -0.5 * separation[a]", "= 0.5 * separation[a]",
        "tests/effects/pair/test_virial.py::test_contacts_in_shear_have_the_virial_of_their_reference",
    ),
    "gravity_by_a_tree": (
        "tisim/effects/gravitation/tree_gravity.py", "return s.mass[w, i] * self.sum",
        "return 1.01 * s.mass[w, i] * self.sum",
        "tests/effects/gravitation/test_tree_gravity.py::test_with_all_cells_opened_it_sums_all_pairs[0.2]",
    ),
}  # fmt: skip
"""Mutations of sums over many particles: dipoles up to a cut-off and with all images, their virial, and the
tree."""
EVERY = {**MUTATIONS, **SHARED, **SUMS}
