/*
 * Any bytes as a scene: loaded, or refused with a message.
 */
#include <assert.h>

#include "sim/cameras.h"
#include "sim/world/scene_file.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/fuzz/memory_file.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	static struct sim_script script;
	struct sim_options options = {.scene = memory_file(data, size)};
	struct diag diag = {0};
	int err = sim_script_load(&script, &options, &diag);

	assert((err == 0) == (diag.count == 0));
	assert(err || (script.actor_count <= SIM_ACTOR_MAX && script.seconds > 0));
	assert(err ||
	       (script.camera_count >= SIM_CAMERA_MIN && script.camera_count <= SIM_CAMERA_MAX));
	for (uint32_t i = 0; !err && i < script.event_count; i++)
		assert(script.events[i].kind >= 0 && script.events[i].at_s < script.seconds);
	for (uint32_t i = 0; !err && i < script.faults.count; i++)
		assert(script.faults.faults[i].kind >= 0);
	diag_finish(&diag);
	return 0;
}
