/*
 * The libcamera driver keeps the contract, on a camera without libcamera: contract_libcamera_fake
 * FORMAT NAME, the wanted format and libcamera's name of what the camera has.
 */
#include <stdio.h>
#include <stdlib.h>

#include "drivers/libcamera/libcamera.h"
#include "tests/contract/camera_contract.h"
#include "tests/contract/fake_libcamera.h"

int main(int argc, char **argv)
{
	struct camera_contract contract = {
		.driver = &libcamera_camera_driver,
		.rest = FAKE_ID,
		.bad_rest = "no-such-camera",
		.live = true,
		.frame_count = 8,
	};

	fake_libcamera_begin();
	if (argc < 3 || pixel_format_by_name(&contract.format, argv[1])) {
		fprintf(stderr, "usage: %s FORMAT NAME\n", argv[0]);
		return EXIT_FAILURE;
	}
	fake.formats[0] = argv[2];
	fake.stride_bytes = 256;
	return camera_contract_run(&contract);
}
