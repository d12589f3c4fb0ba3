/*
 * Reads YAML (so JSON too) from outside by a table of keys. Every error of the file is one message
 * "file:line:column: field: what is wrong"; reading goes on behind it. Anchors are ignored and
 * aliases refused, so that a small file cannot become a large one.
 */
#pragma once

#include <libfyaml.h>
#include <stdbool.h>
#include <stdint.h>

#include "base/diag.h"

struct yaml {
	const char *path;
	struct diag *diag;
	bool failed; /* some message was added */
	/* owned */
	char *text;
	struct fy_diag *parse_errors;
	struct fy_parser *parser;
	struct fy_document *document;
};

struct yaml_place {
	int line, column; /* from 1 */
};

/* A value in the file. `field` is its whole name, "cameras[2].address". */
struct yaml_value {
	struct fy_node *node;
	const char *field;
	struct yaml_place place;
};

enum yaml_kind {
	YAML_TEXT,   /* char[size] */
	YAML_NAME,   /* char[size] of letters, digits, _ and -: fit for a file name */
	YAML_BOOL,   /* bool */
	YAML_CHOICE, /* int, the index into the NULL-terminated `choices` */
	YAML_INT,    /* int */
	YAML_INT64,  /* int64_t, not negative */
	YAML_UINT64, /* uint64_t */
	YAML_DOUBLE, /* double */
	YAML_MICROS, /* int64_t nanoseconds, written in microseconds */
	YAML_CUSTOM, /* `read` does it */
};

struct yaml_key {
	const char *name;
	enum yaml_kind kind;
	size_t offset; /* of the member in the target */
	bool required;
	size_t size;                /* of a text or name */
	double min, max;            /* of a number */
	const char *unit;           /* of a number, for messages; may be NULL */
	const char *const *choices; /* of a choice */
	void (*read)(struct yaml *yaml, const struct yaml_value *value, void *target);
};

/* Returns 0, -EINVAL when it is not YAML, or the errno of reading it. On failure nothing is held.
 */
int yaml_open(struct yaml *yaml, const char *path, size_t size_max, struct diag *diag);
void yaml_close(struct yaml *yaml);
struct yaml_value yaml_root(const struct yaml *yaml);

/* Adds "path:line:column: field: ..." */
void yaml_complain(struct yaml *yaml, struct yaml_place place, const char *field,
		   const char *format, ...) __attribute__((format(printf, 4, 5)));

/* Reads a mapping into `target` by the table, which ends with a NULL name. Members of absent keys
 * keep what they were. `places`, when not NULL, gets one place per key; line 0 = absent. */
void yaml_read_mapping(struct yaml *yaml, const struct yaml_value *value,
		       const struct yaml_key *keys, void *target, struct yaml_place *places);

/* Reads one scalar as `key` says. */
void yaml_read_scalar(struct yaml *yaml, const struct yaml_value *value, const struct yaml_key *key,
		      void *target);

/* Reads a list of exactly `count` numbers, each as `key` says, into `numbers`. True if all were
 * good; else some of them may be set. */
bool yaml_read_numbers(struct yaml *yaml, const struct yaml_value *value,
		       const struct yaml_key *key, double *numbers, int count);

/* Hands each item of a list to `read`, of which there may be `max`; one more is the message "more
 * than MAX WHAT" and the end. Returns how many there were, at most max. */
int yaml_read_list(struct yaml *yaml, const struct yaml_value *list, int max, const char *what,
		   void (*read)(struct yaml *yaml, const struct yaml_value *item, void *target),
		   void *target);

#define YAML_FIELD_BYTES 160

/* Steps through a sequence; false at its end or, with a message, when it is none. Start with
 * *iterator = NULL and *index = -1. `field` is the room for the item's name. */
bool yaml_next_item(struct yaml *yaml, const struct yaml_value *sequence, void **iterator,
		    int *index, struct yaml_value *item, char field[YAML_FIELD_BYTES]);

/* Steps through a mapping whose keys are the file's own; false at its end or, with a message, when
 * it is none. Start with *iterator = NULL. `name` gets the key. */
bool yaml_next_pair(struct yaml *yaml, const struct yaml_value *mapping, void **iterator,
		    char *name, size_t name_bytes, struct yaml_value *item,
		    char field[YAML_FIELD_BYTES]);
