/*
 * From bright groups to spots: runs of bright pixels, union-find over touching runs, and integer
 * sums. Bounded: what does not fit is counted, never written.
 */
#include <string.h>

#include "track/blobs_parts.h"

static void add_run(struct run_table *table, int y, unsigned x0, unsigned x1, uint8_t level)
{
	struct run *run;

	if (table->run_count == RUN_MAX) {
		table->runs_lost++;
		return;
	}
	run = &table->runs[table->run_count];
	*run = (struct run){(uint16_t)y, (uint16_t)x0,     (uint16_t)x1,
			    level,       table->run_count, RUN_NONE};
	table->run_count++;
}

void run_table_add_row(struct run_table *table, int y, const struct bright_group *groups,
		       int group_count, const uint8_t *cells)
{
	unsigned start = 0, end = 0; /* the open run; empty when equal */

	for (int g = 0; g < group_count; g++) {
		unsigned base = groups[g].group * GROUP_PX;
		uint64_t mask = groups[g].mask;

		while (mask) {
			unsigned from = (unsigned)__builtin_ctzll(mask);
			uint64_t gap = ~(mask >> from);
			unsigned length = gap ? (unsigned)__builtin_ctzll(gap) : GROUP_PX;

			if (base + from != end || start == end) {
				if (start != end)
					add_run(table, y, start, end, cells[start]);
				start = base + from;
			}
			end = base + from + length;
			mask = from + length < GROUP_PX ? mask & (~0ULL << (from + length)) : 0;
		}
	}
	if (start != end)
		add_run(table, y, start, end, cells[start]);
}

static uint32_t root_of(struct run *runs, uint32_t r)
{
	while (runs[r].parent != r) {
		runs[r].parent = runs[runs[r].parent].parent;
		r = runs[r].parent;
	}
	return r;
}

/* The older root stays: a spot's root is its first run in raster order. */
static void unite(struct run *runs, uint32_t a, uint32_t b)
{
	a = root_of(runs, a);
	b = root_of(runs, b);
	if (a < b)
		runs[b].parent = a;
	else
		runs[a].parent = b;
}

/* `above` walks along the row over the current run, so each pair is looked at once. */
static void unite_touching(struct run *runs, uint32_t first, uint32_t count)
{
	uint32_t above = first;

	for (uint32_t r = first; r < count; r++) {
		while (above < r &&
		       (runs[above].y + 1 < runs[r].y ||
			(runs[above].y + 1 == runs[r].y && runs[above].x1 < runs[r].x0)))
			above++;
		for (uint32_t a = above;
		     a < r && runs[a].y + 1 == runs[r].y && runs[a].x0 <= runs[r].x1; a++)
			unite(runs, a, r);
	}
}

static struct spot *new_spot(struct run_table *table, uint32_t r)
{
	const struct run *run = &table->runs[r];
	struct spot *spot;

	if (table->spot_count == SPOT_MAX) {
		table->spots_lost++;
		return NULL;
	}
	spot = &table->spots[table->spot_count++];
	*spot = (struct spot){.first_run = r,
			      .last_run = r,
			      .x0 = run->x0,
			      .x1 = run->x1,
			      .y0 = run->y,
			      .y1 = run->y + 1};
	return spot;
}

static void append(struct run *runs, struct spot *spot, uint32_t r)
{
	const struct run *run = &runs[r];

	if (r != spot->first_run)
		runs[spot->last_run].next = r;
	spot->last_run = r;
	spot->x0 = run->x0 < spot->x0 ? run->x0 : spot->x0;
	spot->x1 = run->x1 > spot->x1 ? run->x1 : spot->x1;
	spot->y1 = run->y + 1;
	spot->level = run->level > spot->level ? run->level : spot->level;
	spot->area_px2 += run->x1 - run->x0;
}

/* After this a run's parent is the number of its spot, or RUN_NONE when the spot was lost. Roots
 * come first, so a root is renamed only once nobody follows links through it: renamed numbers are
 * looked up in one step because unite_touching's links are flattened here in order. */
static void gather(struct run_table *table, uint32_t first)
{
	struct run *runs = table->runs;

	for (uint32_t r = first; r < table->run_count; r++)
		runs[r].parent = root_of(runs, r);
	for (uint32_t r = first; r < table->run_count; r++) {
		uint32_t root = runs[r].parent;
		struct spot *spot;

		if (root == r) {
			spot = new_spot(table, r);
			runs[r].parent = spot ? table->spot_count - 1 : RUN_NONE;
		} else {
			runs[r].parent = runs[root].parent;
		}
		if (runs[r].parent != RUN_NONE)
			append(runs, &table->spots[runs[r].parent], r);
	}
}

static void sum_run(struct spot *spot, const struct run *run, const uint8_t *row)
{
	int sum = 0, sum_x = 0;

	for (int x = run->x0; x < run->x1; x++) {
		int value = row[x], weight = value - spot->level;

		spot->peak = value > spot->peak ? value : spot->peak;
		spot->saturated_count += value == 255;
		weight = weight > 0 ? weight : 0;
		sum += weight;
		sum_x += (x - run->x0) * weight;
	}
	spot->sum += sum;
	spot->sum_x += sum_x + (int64_t)sum * run->x0;
	spot->sum_y += (int64_t)sum * run->y;
}

void run_table_join(struct run_table *table, uint32_t first, const struct grey_image *image)
{
	uint32_t first_spot = table->spot_count;

	unite_touching(table->runs, first, table->run_count);
	gather(table, first);
	for (uint32_t s = first_spot; s < table->spot_count; s++) {
		struct spot *spot = &table->spots[s];

		for (uint32_t r = spot->first_run; r != RUN_NONE; r = table->runs[r].next)
			sum_run(spot, &table->runs[r],
				image->pixels + (ptrdiff_t)table->runs[r].y * image->stride_bytes);
	}
}
