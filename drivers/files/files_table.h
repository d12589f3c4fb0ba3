/*
 * frames.csv of a recording: which image was taken when. Columns by name in any order:
 *   shot (optional), mid_exposure_ns, uncertainty_ns (optional, else 0), file
 */
#pragma once

#include <stddef.h>
#include <stdint.h>

#include "base/diag.h"

struct files_row {
	uint64_t shot; /* UINT64_MAX without the column */
	int64_t mid_exposure_ns;
	int64_t uncertainty_ns;
	const char *file; /* relative to the recording's directory; the table's */
	int line;
};

struct files_table {
	struct files_row *rows; /* owned; by time, and by shot where it is known */
	size_t row_count;
	int cut_line; /* the last, which has no end and is no row; 0: none */
	char *text;   /* owned */
};

/* Reads and checks the table at `path`, not the files it names. Every bad row is one message
 * "path:line: column: what is wrong". Returns 0, -EINVAL, -ENOMEM or the errno of reading it. */
int files_table_load(struct files_table *table, const char *path, struct diag *diag);

/* Between frames where none is missing, whatever is missing elsewhere; 0 when it cannot be told. */
int64_t files_table_period_ns(const struct files_table *table);

void files_table_finish(struct files_table *table); /* a zeroed table is fine */
