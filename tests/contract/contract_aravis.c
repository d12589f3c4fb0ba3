/*
 * The aravis driver keeps the contract, on simulated GigE Vision cameras.
 */
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

#include "drivers/aravis/aravis.h"
#include "tests/contract/camera_contract.h"
#include "tests/contract/gige_child.h"

int main(int argc, char **argv)
{
	char log_path[] = "/tmp/stage-test-gige-XXXXXX", rest[16], bad_rest[16];
	struct gige_child child;

	if (argc < 2 || close(mkstemp(log_path)) ||
	    gige_child_start(&child, argv[1], 0, NULL, log_path)) {
		fprintf(stderr, "usage: %s PATH-OF-STAGE-SIM-GIGE\n", argv[0]);
		return EXIT_FAILURE;
	}
	gige_child_address(&child, 0, rest);
	gige_child_address(&child, 6, bad_rest);

	const struct camera_contract contract = {
		.driver = &aravis_camera_driver,
		.rest = rest,
		.bad_rest = bad_rest,
		.live = true,
		.frame_count = 8,
	};
	int failed = camera_contract_run(&contract);

	gige_child_end(&child, SIGTERM);
	unlink(log_path);
	return failed;
}
