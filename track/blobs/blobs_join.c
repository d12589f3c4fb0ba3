/*
 * From bright groups to spots: runs of bright pixels, joined as they come to the spots that they
 * touch. Bounded: what does not fit is counted, never written.
 */
#include "track/blobs/blobs_parts.h"

void run_table_reset(struct run_table *table)
{
	table->run_count = table->runs_lost = table->spot_count = table->spots_lost = 0;
	for (int c = 0; c < COPY_COUNT; c++)
		table->copies[c].spot = SPOT_NONE;
	run_table_start(table);
}

void run_table_start(struct run_table *table)
{
	table->row_y = -2;
	table->row_first = table->above = table->run_count;
}

uint32_t spot_root(struct run_table *table, uint32_t spot)
{
	struct spot *spots = table->spots;

	if (spot == SPOT_NONE)
		return SPOT_NONE;
	while (spots[spot].parent != spot)
		spot = spots[spot].parent = spots[spots[spot].parent].parent;
	return spot;
}

void spot_add_area(struct area_sums *sums, int64_t y, int64_t x0, int64_t x1)
{
	int64_t n = x1 - x0, x = x0 + x1 - 1;

	sums->x += n * x;
	sums->y += n * y;
	sums->xx += n * x * x;
	sums->xy += n * x * y;
	sums->yy += n * y * y;
	sums->cubes += n * n * n;
}

/* The older spot takes the other over: a spot's number follows its topmost, leftmost run. */
static uint32_t merge(struct run_table *table, uint32_t a, uint32_t b)
{
	struct spot *keep = &table->spots[a < b ? a : b], *give = &table->spots[a < b ? b : a];

	if (a == b)
		return a;
	table->runs[keep->last_run].next = give->first_run;
	keep->last_run = give->last_run;
	keep->x0 = give->x0 < keep->x0 ? give->x0 : keep->x0;
	keep->x1 = give->x1 > keep->x1 ? give->x1 : keep->x1;
	keep->y1 = give->y1 > keep->y1 ? give->y1 : keep->y1;
	keep->level = give->level > keep->level ? give->level : keep->level;
	keep->area_px2 += give->area_px2;
	keep->area.x += give->area.x;
	keep->area.y += give->area.y;
	keep->area.xx += give->area.xx;
	keep->area.xy += give->area.xy;
	keep->area.yy += give->area.yy;
	keep->area.cubes += give->area.cubes;
	give->area_px2 = 0;
	give->parent = a < b ? a : b;
	return give->parent;
}

static uint32_t new_spot(struct run_table *table, const struct run *run, uint32_t r)
{
	uint32_t s = table->spot_count;

	if (s == SPOT_MAX) {
		table->spots_lost++;
		return SPOT_NONE;
	}
	table->spots[s] = (struct spot){
		.parent = s,
		.first_run = r,
		.last_run = r,
		.x0 = run->x0,
		.x1 = run->x1,
		.y0 = run->y,
		.y1 = run->y + 1,
		.level = run->level,
		.area_px2 = run->x1 - run->x0,
	};
	spot_add_area(&table->spots[s].area, run->y, run->x0, run->x1);
	table->spot_count++;
	return s;
}

static void grow(struct run_table *table, uint32_t s, const struct run *run, uint32_t r)
{
	struct spot *spot = &table->spots[s];

	table->runs[spot->last_run].next = r;
	spot->last_run = r;
	spot->x0 = run->x0 < spot->x0 ? run->x0 : spot->x0;
	spot->x1 = run->x1 > spot->x1 ? run->x1 : spot->x1;
	spot->y1 = run->y + 1;
	spot->level = run->level > spot->level ? run->level : spot->level;
	spot->area_px2 += run->x1 - run->x0;
	spot_add_area(&spot->area, run->y, run->x0, run->x1);
}

/* The spot that a run touches to its left (across a group's border) or in the row above, or
 * SPOT_NONE; several become one. */
static uint32_t touched_spot(struct run_table *table, const struct run *run)
{
	const struct run *runs = table->runs, *left = runs + table->run_count - 1;
	uint32_t a = table->above, end = table->row_first, spot = SPOT_NONE;

	while (a < end && runs[a].x1 < run->x0)
		a++;
	table->above = a;
	if (a < end && runs[a].x0 <= run->x1)
		spot = spot_root(table, runs[a++].spot);
	for (; a < end && runs[a].x0 <= run->x1; a++) {
		uint32_t other = spot_root(table, runs[a].spot);

		if (other != SPOT_NONE)
			spot = spot == SPOT_NONE ? other : merge(table, spot, other);
	}
	if (run->x0 % GROUP_PX == 0 && end < table->run_count && left->x1 == run->x0 &&
	    left->spot != SPOT_NONE) {
		uint32_t other = spot_root(table, left->spot);

		spot = spot == SPOT_NONE ? other : merge(table, spot, other);
	}
	return spot;
}

static void add_run(struct run_table *table, int y, int x0, int x1, grey level)
{
	uint32_t r = table->run_count, spot;
	struct run *run = &table->runs[r];

	if (r == RUN_MAX) {
		table->runs_lost++;
		return;
	}
	if (y != table->row_y) {
		table->above = y == table->row_y + 1 ? table->row_first : r;
		table->row_first = r;
		table->row_y = y;
	}
	run->y = (uint16_t)y;
	run->x0 = (uint16_t)x0;
	run->x1 = (uint16_t)x1;
	run->level = level;
	run->next = RUN_NONE;
	spot = touched_spot(table, run);
	table->run_count++;
	if (spot == SPOT_NONE)
		spot = new_spot(table, run, r);
	else
		grow(table, spot, run, r);
	run->spot = spot;
}

void run_table_add(struct run_table *table, int y, int x, uint64_t mask, const grey *level)
{
	while (mask) {
		int from = __builtin_ctzll(mask);
		uint64_t gap = ~(mask >> from);
		int end = from + (gap ? __builtin_ctzll(gap) : GROUP_PX);

		add_run(table, y, x + from, x + end, level[from]);
		mask = end < GROUP_PX ? mask & (~0ULL << end) : 0;
	}
}
