/*
 * A configuration that a program's tests write and load again: head and cameras of most, the
 * answer, the messages about it.
 */
#pragma once

#include <errno.h>
#include <string.h>

#include "config/config.h"
#include "one_file.h"

#define HEAD "rig: rig\nlayout: face.yaml\n"
#define CAMERAS                                          \
	"cameras:\n"                                     \
	"- {name: ir1, address: 'aravis:192.168.1.7'}\n" \
	"- {name: ir2, address: 'files:take/ir2'}\n"

static struct config config;

static inline int load(const char *text, struct diag *diag)
{
	write_file(text, strlen(text));
	return config_load(&config, path, diag);
}

static inline void expect_messages(const char *text, const char *messages)
{
	struct diag diag = {0};

	assert_int_equal(load(text, &diag), -EINVAL);
	expect_lines(&diag, messages);
}
