/*
 * Each row has a private column behind the real ones that stands for "none" at skip_cost, so that
 * an augmenting path always exists.
 */
#include "track/label/assign.h"

static void reach(struct assign *a, int column, double distance, int row)
{
	if (a->reached_from[column] == ASSIGN_NONE)
		a->touched[a->touched_count++] = (int16_t)column;
	else if (a->done[column] || distance >= a->distance[column])
		return;
	a->distance[column] = distance;
	a->reached_from[column] = (int16_t)row;
}

static void reach_from(struct assign *a, int row, double so_far)
{
	int none = a->column_count + row;

	for (int e = a->row_start[row]; e < a->row_start[row + 1]; e++) {
		int column = a->edges[e].column;

		reach(a, column,
		      so_far + a->edges[e].cost - a->row_price[row] - a->column_price[column], row);
	}
	reach(a, none, so_far + a->skip_cost - a->row_price[row] - a->column_price[none], row);
}

static int nearest_open(const struct assign *a)
{
	int best = ASSIGN_NONE;

	for (int t = 0; t < a->touched_count; t++) {
		int column = a->touched[t];

		if (!a->done[column] &&
		    (best == ASSIGN_NONE || a->distance[column] < a->distance[best]))
			best = column;
	}
	return best;
}

static void update_prices(struct assign *a, int row, double length)
{
	a->row_price[row] += length;
	for (int t = 0; t < a->touched_count; t++) {
		int column = a->touched[t];

		if (!a->done[column] || a->row_of_column[column] == ASSIGN_NONE)
			continue;
		a->row_price[a->row_of_column[column]] += length - a->distance[column];
		a->column_price[column] -= length - a->distance[column];
	}
}

static void flip_path(struct assign *a, int row, int column)
{
	for (;;) {
		int from = a->reached_from[column];
		int next = a->column_of_row[from];

		a->row_of_column[column] = (int16_t)from;
		a->column_of_row[from] = (int16_t)column;
		if (from == row)
			return;
		column = next;
	}
}

static void augment(struct assign *a, int row)
{
	int from = row, column;
	double length = 0;

	a->touched_count = 0;
	for (;;) {
		reach_from(a, from, length);
		column = nearest_open(a);
		a->done[column] = 1;
		length = a->distance[column];
		if (a->row_of_column[column] == ASSIGN_NONE)
			break;
		from = a->row_of_column[column];
	}
	update_prices(a, row, length);
	flip_path(a, row, column);
	for (int t = 0; t < a->touched_count; t++) {
		a->reached_from[a->touched[t]] = ASSIGN_NONE;
		a->done[a->touched[t]] = 0;
	}
}

/* The row's price is its cheapest edge; where no row before has that column, it is the row's. */
static void take_cheapest(struct assign *a, int row)
{
	int cheapest = a->column_count + row;

	a->row_price[row] = a->skip_cost;
	for (int e = a->row_start[row]; e < a->row_start[row + 1]; e++)
		if (a->edges[e].cost < a->row_price[row]) {
			a->row_price[row] = a->edges[e].cost;
			cheapest = a->edges[e].column;
		}
	a->column_of_row[row] = ASSIGN_NONE;
	if (a->row_of_column[cheapest] != ASSIGN_NONE)
		return;
	a->column_of_row[row] = (int16_t)cheapest;
	a->row_of_column[cheapest] = (int16_t)row;
}

void assign_solve(struct assign *a)
{
	int columns = a->column_count + a->row_count;

	for (int c = 0; c < columns; c++) {
		a->row_of_column[c] = a->reached_from[c] = ASSIGN_NONE;
		a->column_price[c] = 0;
		a->done[c] = 0;
	}
	for (int r = 0; r < a->row_count; r++)
		take_cheapest(a, r);
	for (int r = 0; r < a->row_count; r++)
		if (a->column_of_row[r] == ASSIGN_NONE)
			augment(a, r);
	for (int r = 0; r < a->row_count; r++)
		if (a->column_of_row[r] >= a->column_count)
			a->column_of_row[r] = ASSIGN_NONE;
}
