/*
 * The v4l2 driver keeps the contract, on a real device: contract_v4l2 ADDRESS [FORMAT], the address
 * as behind the colon ("/dev/video0", "serial=XYZ"), the format as in a config. Without arguments
 * those are in STAGE_V4L2_DEVICE and STAGE_V4L2_FORMAT, or it is skipped.
 */
#include <stdio.h>
#include <stdlib.h>

#include "base/clock.h"
#include "drivers/v4l2/v4l2.h"
#include "tests/contract/camera_contract.h"

int main(int argc, char **argv)
{
	const char *rest = argc > 1 ? argv[1] : getenv("STAGE_V4L2_DEVICE");
	const char *format = argc > 2 ? argv[2] : getenv("STAGE_V4L2_FORMAT");
	struct camera_contract contract = {
		.driver = &v4l2_camera_driver,
		.rest = rest,
		.bad_rest = "/dev/video-none",
		.period_ns = NS_PER_S / 30,
		.live = true,
		.frame_count = 8,
	};

	if (!rest) {
		puts("1..0 # SKIP STAGE_V4L2_DEVICE names no device");
		return 0;
	}
	if (pixel_format_by_name(&contract.format, format ? format : "grey")) {
		fprintf(stderr, "%s: no such format\n", format);
		return EXIT_FAILURE;
	}
	return camera_contract_run(&contract);
}
