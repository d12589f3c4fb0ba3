/*
 * The finder's parts are built for 8-bit and for 16-bit pixels ("deep"), and both twice where there
 * may be AVX2: for any processor, and for those that have it ("wide"). meson gives the flags; each
 * build has its own names. Nothing in them lets wide and narrow round differently: no fused
 * multiplications, and sums whose order does not depend on the width of a register.
 */
#pragma once

#ifdef BLOBS_BUILD

#define BLOBS_JOIN_NAMES(a, b) a##b
#define BLOBS_JOIN(a, b) BLOBS_JOIN_NAMES(a, b)
#define OF_BUILD(name) BLOBS_JOIN(name, BLOBS_BUILD)

#define blob_mask OF_BUILD(blob_mask)
#define blob_mask_rows OF_BUILD(blob_mask_rows)
#define blob_run OF_BUILD(blob_run)
#define blob_scan OF_BUILD(blob_scan)
#define level_map_cells OF_BUILD(level_map_cells)
#define level_map_coarse OF_BUILD(level_map_coarse)
#define level_map_expect OF_BUILD(level_map_expect)
#define level_map_plane OF_BUILD(level_map_plane)
#define level_map_start OF_BUILD(level_map_start)
#define measurer_end OF_BUILD(measurer_end)
#define measurer_start OF_BUILD(measurer_start)
#define measurer_step OF_BUILD(measurer_step)
#define ring_background OF_BUILD(ring_background)
#define run_table_add OF_BUILD(run_table_add)
#define run_table_add_patch OF_BUILD(run_table_add_patch)
#define run_table_reset OF_BUILD(run_table_reset)
#define run_table_start OF_BUILD(run_table_start)
#define sample_level OF_BUILD(sample_level)
#define sample_noise OF_BUILD(sample_noise)
#define sample_two_levels OF_BUILD(sample_two_levels)
#define spot_add_area OF_BUILD(spot_add_area)
#define spot_area_moments OF_BUILD(spot_area_moments)
#define spot_finish OF_BUILD(spot_finish)
#define spot_is_suspect OF_BUILD(spot_is_suspect)
#define spot_is_surely_one OF_BUILD(spot_is_surely_one)
#define spot_is_whole OF_BUILD(spot_is_whole)
#define spot_moment OF_BUILD(spot_moment)
#define spot_prepare OF_BUILD(spot_prepare)
#define spot_root OF_BUILD(spot_root)
#define spot_shapes OF_BUILD(spot_shapes)
#define spot_split OF_BUILD(spot_split)
#define spot_step OF_BUILD(spot_step)
#define spot_sum OF_BUILD(spot_sum)
#define spot_sum_patch OF_BUILD(spot_sum_patch)
#define spot_sum_short OF_BUILD(spot_sum_short)
#define window_around OF_BUILD(window_around)
#define window_newton OF_BUILD(window_newton)

#endif
