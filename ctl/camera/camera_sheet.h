/*
 * The running station's cameras on one contact sheet, with the names that it gives its markers.
 */
#pragma once

#include <stdbool.h>

struct camera_sheet_options {
	const char *socket_dir, *output;
	bool whole, json;
};

/* Returns an exit code, after a message on stderr when it is none of success. */
int camera_sheet(const struct camera_sheet_options *options);
