/*
 * The libcamera driver keeps the contract, on a real camera: contract_libcamera ID [FORMAT [WIDTH
 * HEIGHT]], as in a config. Without arguments they are in STAGE_LIBCAMERA_ID and
 * STAGE_LIBCAMERA_FORMAT, or it is skipped.
 */
#include <stdio.h>
#include <stdlib.h>

#include "base/clock.h"
#include "drivers/libcamera/libcamera.h"
#include "tests/contract/camera_contract.h"

int main(int argc, char **argv)
{
	const char *rest = argc > 1 ? argv[1] : getenv("STAGE_LIBCAMERA_ID");
	const char *format = argc > 2 ? argv[2] : getenv("STAGE_LIBCAMERA_FORMAT");
	struct camera_contract contract = {
		.driver = &libcamera_camera_driver,
		.rest = rest,
		.bad_rest = "no-such-camera",
		.period_ns = NS_PER_S / 30,
		.live = true,
		.frame_count = 8,
		.width_px = argc > 4 ? atoi(argv[3]) : 0,
		.height_px = argc > 4 ? atoi(argv[4]) : 0,
	};

	if (!rest) {
		puts("1..0 # SKIP STAGE_LIBCAMERA_ID names no camera");
		return 0;
	}
	if (pixel_format_by_name(&contract.format, format ? format : "grey")) {
		fprintf(stderr, "%s: no such format\n", format);
		return EXIT_FAILURE;
	}
	return camera_contract_run(&contract);
}
