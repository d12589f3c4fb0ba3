/*
 * The finder's parts are built twice where there may be AVX2: once for any processor, and with
 * these names for those that have it. Nothing in them lets the two round differently: no fused
 * multiplications, and sums whose order does not depend on the width of a register.
 */
#pragma once

#define blob_mask blob_mask_wide
#define blob_mask_rows blob_mask_rows_wide
#define blob_run blob_run_wide
#define blob_scan blob_scan_wide
#define level_map_cells level_map_cells_wide
#define level_map_coarse level_map_coarse_wide
#define level_map_expect level_map_expect_wide
#define level_map_finish level_map_finish_wide
#define level_map_init level_map_init_wide
#define level_map_plane level_map_plane_wide
#define level_map_start level_map_start_wide
#define measurer_end measurer_end_wide
#define measurer_start measurer_start_wide
#define measurer_step measurer_step_wide
#define ring_background ring_background_wide
#define run_table_add run_table_add_wide
#define run_table_add_patch run_table_add_patch_wide
#define run_table_reset run_table_reset_wide
#define run_table_start run_table_start_wide
#define spot_add_area spot_add_area_wide
#define spot_area_moments spot_area_moments_wide
#define spot_finish spot_finish_wide
#define spot_is_suspect spot_is_suspect_wide
#define spot_prepare spot_prepare_wide
#define spot_root spot_root_wide
#define spot_split spot_split_wide
#define spot_step spot_step_wide
#define spot_sum spot_sum_wide
#define window_around window_around_wide
#define window_newton window_newton_wide
#define spot_is_surely_one spot_is_surely_one_wide
#define spot_is_whole spot_is_whole_wide
