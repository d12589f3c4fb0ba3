/*
 * Any bytes as a layout: loaded, or refused with a message.
 */
#include <assert.h>

#include "config/layout_file.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/fuzz/memory_file.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	static struct layout layout;
	struct diag diag = {0};
	int err = layout_load(&layout, memory_file(data, size), &diag);

	assert((err == 0) == (diag.count == 0));
	assert(err || (layout.marker_count >= 4 && layout.marker_count <= LABEL_MAX));
	diag_finish(&diag);
	return 0;
}
