/*
 * A contact sheet: the pictures of several cameras side by side as one PNG, light enough for a
 * person, with what was found and what is meant marked and named.
 */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#include "ctl/camera/snapshot.h"
#include "track/layout.h"

enum sheet_mark_kind {
	SHEET_SPOT,   /* a ring around a found spot */
	SHEET_STRAY,  /* a found spot that is nobody's */
	SHEET_CROSS,  /* where something is */
	SHEET_MISSED, /* where something is and no spot was found */
};

struct sheet_mark {
	enum sheet_mark_kind kind;
	double x_px, y_px, radius_px; /* of the picture; the radius of rings only */
	int group;                    /* colours alike what belongs together; -1: of no group */
	char label[NAME_BYTES];       /* "": none */
};

#define SHEET_MARK_MAX (BLOB_MAX + LABEL_MAX)

struct sheet_tile {
	const struct snapshot *snapshot; /* borrowed */
	char caption[400];
	uint32_t mark_count;
	struct sheet_mark marks[SHEET_MARK_MAX];
};

struct sheet_legend {
	int group;
	const char *name; /* borrowed */
};

struct sheet {
	char title[256];
	int width_px; /* made smaller to that; 0: as it is */
	bool whole;   /* each picture as a whole; else the part with the marks, larger */
	uint32_t tile_count;
	const struct sheet_tile *tiles; /* borrowed */
	uint32_t legend_count;
	const struct sheet_legend *legend; /* borrowed */
};

/* Adds a mark while there is room. */
struct sheet_mark *sheet_add_mark(struct sheet_tile *tile, enum sheet_mark_kind kind, double x_px,
				  double y_px);

/* The group's number in order of appearance in the layout, for sheet_mark.group. */
int sheet_group(const struct layout *layout, uint32_t marker);

/* Gathers the groups of a layout into `out[max]`; returns how many. */
uint32_t sheet_layout_legend(const struct layout *layout, struct sheet_legend *out, uint32_t max);

/* Circles the snapshot's spots: each in the colours of the cross nearest to it, or as a stray one;
 * crosses without a spot become missed ones. Returns how many crosses have a spot. */
uint32_t sheet_match_spots(struct sheet_tile *tile);

/* Returns 0 or a negative errno. */
int sheet_write_png(const struct sheet *sheet, const char *path);
