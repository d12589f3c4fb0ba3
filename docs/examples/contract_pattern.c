/*
 * The pattern: driver keeps the contract.
 */
#include "pattern.h"
#include "tests/contract/camera_contract.h"

int main(void)
{
	const struct camera_contract contract = {
		.driver = &pattern_camera_driver,
		.rest = "spot",
		.bad_rest = "no-such-pattern",
		.format = PIXEL_GREY8,
		.live = true,
		.frame_count = 8,
	};

	return camera_contract_run(&contract);
}
