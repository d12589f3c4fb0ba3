/*
 * The v4l2 driver keeps the contract, on a fake device: contract_v4l2_fake FORMAT SETTING...
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "drivers/v4l2/v4l2.h"
#include "tests/contract/camera_contract.h"
#include "tests/contract/fake_v4l2.h"

int main(int argc, char **argv)
{
	struct camera_contract contract = {
		.driver = &v4l2_camera_driver,
		.rest = "serial=A1",
		.bad_rest = "/dev/video9",
		.live = true,
		.frame_count = 8,
	};
	char settings[500] = "";

	if (argc < 2 || pixel_format_by_name(&contract.format, argv[1])) {
		fprintf(stderr, "usage: %s FORMAT SETTING...\n", argv[0]);
		return EXIT_FAILURE;
	}
	for (int i = 2; i < argc; i++) {
		strncat(settings, argv[i], sizeof(settings) - strlen(settings) - 2);
		strcat(settings, "\n");
	}
	fake_v4l2_begin();
	fake_v4l2_plug(3, "A1", settings);
	int failed = camera_contract_run(&contract);

	fake_v4l2_end();
	return failed;
}
