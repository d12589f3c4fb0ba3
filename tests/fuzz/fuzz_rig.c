/*
 * Any bytes as a rig.yaml: read, or refused with a message.
 */
#include <assert.h>

#include "config/rig_worth.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/fuzz/memory_file.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	struct rig_worth worth;
	struct diag diag = {0};
	int err = rig_worth_load(&worth, memory_file(data, size), &diag);

	assert((err == 0) == (diag.count == 0));
	assert(err || worth.poses >= 0);
	assert(err || !(worth.rms_px < 0));
	diag_finish(&diag);
	return 0;
}
