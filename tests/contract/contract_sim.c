/*
 * The sim: driver keeps the contract.
 */
#include <stdio.h>

#include "sim/world.h"
#include "tests/contract/camera_contract.h"

int main(void)
{
	const struct sim_options options = {.scene = "rest", .camera_count = 4};
	struct diag diag = {0};
	char name[64];

	if (sim_world_open(&options, 0, &diag)) {
		diag_print(&diag, stderr);
		return 1;
	}
	snprintf(name, sizeof(name), "%s", sim_scene_camera_name(sim_world_scene(), 0));

	const struct camera_contract contract = {
		.driver = &sim_camera_driver,
		.rest = name,
		.bad_rest = "no-such-camera",
		.live = true,
		.frame_count = 8,
	};
	int failed = camera_contract_run(&contract);

	sim_world_close();
	return failed;
}
