/*
 * Any bytes as a configuration: loaded, or refused with a message.
 */
#include <assert.h>

#include "config/config.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/fuzz/memory_file.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	static struct config config;
	struct diag diag = {0};
	int err = config_load(&config, memory_file(data, size), &diag);

	assert((err == 0) == (diag.count == 0));
	assert(err || (config.camera_count >= 1 && config.camera_count <= CAMERA_MAX));
	assert(err || config.plan.period_ns > 0);
	diag_finish(&diag);
	return 0;
}
