/*
 * Any bytes as a recording's frames.csv.
 */
#include <assert.h>
#include <string.h>

#include "drivers/files/files_table.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/fuzz/memory_file.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	struct files_table table;
	struct diag diag = {0};
	int err = files_table_load(&table, memory_file(data, size), &diag);

	assert((err == 0) == (diag.count == 0));
	for (size_t i = 0; !err && i < table.row_count; i++) {
		assert(table.rows[i].file[0] != '/' && strlen(table.rows[i].file) > 0);
		assert(i == 0 || table.rows[i].mid_exposure_ns > table.rows[i - 1].mid_exposure_ns);
	}
	if (!err)
		files_table_finish(&table);
	diag_finish(&diag);
	return 0;
}
