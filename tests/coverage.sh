#!/bin/sh
# Lines and branches of tlsph.h that the tests took, by gcov; then the branches that none took, by function, each with the
# reason why (the list at the end; a function that is not on it says so).
# Run from the repository's root after build/test_coverage has run. GCOV names the program.
out=build/obj/coverage/tlsph.gcov
${GCOV:-gcov} -b -t -o build/obj/coverage/tests tests/implementation.c > $out 2> /dev/null
reasons() { sed -n 's/^#= //p' "$0"; }
reasons | awk '
FILENAME == "-" { kind = $1; if ($2 == ":") { text[kind] = substr($0, index($0, ":") + 2); next } for (i = 2; i <= NF; i++) why[$i] = kind; next }
/:Source:/ { header = /tlsph\.h$/ }
!header { next }
/^function / { name = $2; next }
/^branch/ { all++; of[name]++; if ($0 ~ /never executed|taken 0%/) { none++; un[name]++; where[name] = where[name] (line == last[name] ? "" : " " line); last[name] = line } next }
/^ *[0-9#=-]+\*?: *[0-9]+:/ { split($0, part, ":"); line = part[2] + 0; if (part[1] ~ /#/) skipped++; if (part[1] !~ /-/) lines++ }
END {
    for (name in un) {
        kind = name in why ? why[name] : "unlisted"
        sum[kind] += un[name]
        printf "%4d of %4d  %-36s %-9s line%s\n", un[name], of[name], name, kind, where[name] | "sort -rn"
    }
    close("sort -rn")
    for (kind in sum) printf "%4d %-9s %s\n", sum[kind], kind, text[kind]
    printf "result line_coverage %.2f %%\nresult branch_coverage %.2f %%  (%d of %d not taken)\n", 100 * (lines - skipped) / lines, 100 * (all - none) / all, none, all
}' - $out
exit

#= guard : divisor, length or area of zero, in loops whose bodies and surfaces creation has checked
#= guard tlsphi_bond_kernel tlsphi_turn tlsphi_pressure_pair tlsphi_diamond tlsphi_patch_normal tlsphi_side
#= guard tlsphi_mesh_normal tlsphi_distance_normal tlsphi_evenness tlsphi_node_at tlsphi_sample_push tlsphi_voronoi_measure
#= guard tlsphi_layout tlsphi_fill_graph tlsphi_survey_particles tlsphi_load_is_huge tlsphi_sample_inside tlsphi_row_keys
#= size : sizes that only 32-bit machines or more memory than there is can reach (counts are below 2^32)
#= size tlsphi_take tlsphi_scratch_take tlsphi_grid_build tlsphi_contour_make tlsphi_sample_add tlsphi_sample_faces tlsphi_lattice_make
#= size tlsphi_find_planes tlsphi_measure_plan tlsphi_layout_state tlsphi_layout_loads tlsphi_create_planned
#= inner : error of an inner call, which so late has none left but no memory at a place where every allocation was made to fail
#= inner tlsphi_closure_particle tlsphi_closure_start tlsphi_closure_tighten tlsphi_closure_solve tlsphi_line_walk
#= inner tlsphi_sample_lines tlsphi_sample_begin tlsphi_cloud_voronoi tlsphi_fill_solver
#= round : ends a search or an iteration that round-off alone could drive so far
#= round tlsphi_closure_iterate tlsphi_pressure_conjugate tlsphi_pressure_dual_time tlsphi_cut_polygon tlsphi_close_cut tlsphi_split_volume tlsphi_near
#= round tlsphi_crossing tlsphi_contour_vertex tlsphi_surface_distance tlsphi_feature_find tlsphi_sample_relax tlsphi_tile_pattern
#= round tlsphi_mesh_check tlsphi_row_spacing
#= inside : loop that is always left from inside, or condition that the one before it decides
#= inside tlsphi_voronoi_balance tlsphi_sample_store tlsphi_cloud_fill tlsphi_tile_find tlsphi_tile_scattered tlsphi_tile_begins
#= inside tlsphi_each_body tlsphi_line_pair tlsphi_closed_neighbours tlsphi_check_fill tlsphi_field_writable tlsphi_read_derived
#= value : value that is not finite, or has run away, and is found by another check first
#= value tlsphi_nan tlsphi_respond_at tlsphi_constitute tlsphi_return_map tlsphi_flow tlsphi_heat_of_flow tlsph_step tlsph_restore
#= value tlsphi_principal_data tlsphi_describe_collapse tlsphi_describe_failure tlsphi_allowed_step tlsph_advance tlsphi_step_by
#= rare : combination of options, conditions and places that is allowed and that no test makes
#= rare tlsphi_mark_mirrors tlsphi_cut_axis tlsphi_particle_step tlsphi_gradient_rest tlsphi_mirror_gradients tlsphi_heat_flux
#= rare tlsphi_gradient_block tlsphi_pair_printed tlsphi_flux_slots tlsphi_right_hand_side tlsphi_pressure_force tlsphi_pressure_balance
#= rare tlsphi_pressure_solve tlsphi_theta_gradient tlsphi_theta_rate tlsphi_cause_of_scene tlsphi_cause_of_inversion
#= rare tlsphi_cause_of_cold tlsphi_check_condition tlsphi_plan_make tlsph_preflight
