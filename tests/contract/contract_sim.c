/*
 * The sim: driver keeps the contract.
 */
#include <stdio.h>
#include <string.h>

#include "sim/world/world.h"
#include "tests/contract/camera_contract.h"

/* The camera is named by the first argument. */
int main(int argc, char **argv)
{
	const struct sim_options options = {
		.scene = "rest", .camera_count = 4, .hd_camera_count = 1};
	const char *name = argc > 1 ? argv[1] : "ir0";
	struct diag diag = {0};

	if (sim_world_open(&options, 0, &diag)) {
		diag_print(&diag, stderr);
		return 1;
	}

	const struct camera_contract contract = {
		.driver = &sim_camera_driver,
		.rest = name,
		.bad_rest = "no-such-camera",
		.format = strncmp(name, "hd", 2) == 0 ? PIXEL_BAYER_RG8 : PIXEL_GREY8,
		.live = true,
		.frame_count = 8,
	};
	int failed = camera_contract_run(&contract);

	sim_world_close();
	return failed;
}
