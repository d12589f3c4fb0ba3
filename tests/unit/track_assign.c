/*
 * The assignment solver against every possible assignment of small random problems.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "base/rng.h"
#include "track/label/assign.h"

#define ROWS 5
#define COLUMNS 5

/* Least cost of rows `row`.. with the columns in `taken` gone. */
static double best_of_all(const struct assign *a, int row, uint32_t taken)
{
	if (row == a->row_count)
		return 0;
	double best = a->skip_cost + best_of_all(a, row + 1, taken);

	for (int e = a->row_start[row]; e < a->row_start[row + 1]; e++) {
		uint32_t bit = 1u << a->edges[e].column;

		if (!(taken & bit))
			best = fmin(best, a->edges[e].cost + best_of_all(a, row + 1, taken | bit));
	}
	return best;
}

static double cost_of_answer(const struct assign *a)
{
	uint32_t taken = 0;
	double cost = 0;

	for (int r = 0; r < a->row_count; r++) {
		double own = a->skip_cost;

		for (int e = a->row_start[r]; e < a->row_start[r + 1]; e++)
			if (a->edges[e].column == a->column_of_row[r])
				own = a->edges[e].cost;
		cost += own;
		if (a->column_of_row[r] == ASSIGN_NONE)
			continue;
		assert_false(taken & (1u << a->column_of_row[r]));
		taken |= 1u << a->column_of_row[r];
		assert_int_equal(a->row_of_column[a->column_of_row[r]], r);
	}
	return cost;
}

static void random_problem(struct rng *rng, struct assign *a)
{
	int edge_count = 0;

	a->row_count = ROWS;
	a->column_count = COLUMNS;
	a->skip_cost = 10;
	a->row_start[0] = 0;
	for (int r = 0; r < ROWS; r++) {
		for (int c = 0; c < COLUMNS; c++)
			if (rng_uniform(rng) < 0.6)
				a->edges[edge_count++] =
					(struct assign_edge){(int16_t)c, 12 * rng_uniform(rng)};
		a->row_start[r + 1] = edge_count;
	}
}

static void finds_the_least_cost_of_all_assignments(void **state)
{
	static struct assign a;
	struct rng rng;

	(void)state;
	rng_init(&rng, 7, 0);
	for (int trial = 0; trial < 2000; trial++) {
		random_problem(&rng, &a);
		assign_solve(&a);
		assert_true(fabs(cost_of_answer(&a) - best_of_all(&a, 0, 0)) < 1e-9);
	}
}

static void a_row_without_edges_gets_nothing(void **state)
{
	static struct assign a = {.row_count = 2, .column_count = 1, .skip_cost = 5};

	(void)state;
	a.row_start[1] = 0;
	a.row_start[2] = 1;
	a.edges[0] = (struct assign_edge){0, 1};
	assign_solve(&a);
	assert_int_equal(a.column_of_row[0], ASSIGN_NONE);
	assert_int_equal(a.column_of_row[1], 0);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(finds_the_least_cost_of_all_assignments),
		cmocka_unit_test(a_row_without_edges_gets_nothing),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
