/*
 * The sim: trigger keeps the contract.
 */
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

#include "base/clock.h"
#include "sim/world/world.h"
#include "tests/contract/trigger_contract.h"

int main(void)
{
	const struct sim_options options = {.scene = "rest", .camera_count = 4};
	char line[] = "/tmp/stage-strobes-XXXXXX", bad[] = "/nonexistent/line";
	const char *const dark[] = {line, NULL};
	struct diag diag = {0};
	int fd = mkstemp(line);

	if (fd < 0 || write(fd, "0\n", 2) != 2 || sim_world_open(&options, 0, &diag)) {
		diag_print(&diag, stderr);
		return 1;
	}
	close(fd);
	const struct trigger_plan plan = {.period_ns = sim_scene_period_ns(sim_world_scene()),
					  .ir_exposure_ns = 250 * NS_PER_US,
					  .strobe_width_ns = 250 * NS_PER_US,
					  .strobe_duty_max = 0.1,
					  .hd_divider = 4};
	const struct trigger_contract contract = {.driver = &sim_trigger_driver,
						  .rest = line,
						  .bad_rest = bad,
						  .dark = dark,
						  .plan = &plan};
	int failed = trigger_contract_run(&contract);

	sim_world_close();
	unlink(line);
	return failed;
}
