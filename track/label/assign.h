/*
 * Optimal sparse assignment: every row gets one column or none, at the least total cost.
 * Shortest augmenting paths with potentials (Jonker and Volgenant 1987). Pure and real-time safe.
 */
#pragma once

#include <stdint.h>

#define ASSIGN_ROW_MAX 768
#define ASSIGN_COLUMN_MAX 1024
#define ASSIGN_EDGE_MAX (ASSIGN_ROW_MAX * 10)
#define ASSIGN_NONE (-1)

struct assign_edge {
	int16_t column;
	double cost; /* >= 0 */
};

struct assign {
	/* the problem: edges of row r are edges[row_start[r] .. row_start[r + 1]) */
	int row_count, column_count;
	double skip_cost; /* of leaving a row without a column */
	int row_start[ASSIGN_ROW_MAX + 1];
	struct assign_edge edges[ASSIGN_EDGE_MAX];

	/* the answer */
	int16_t column_of_row[ASSIGN_ROW_MAX]; /* or ASSIGN_NONE */
	int16_t row_of_column[ASSIGN_COLUMN_MAX + ASSIGN_ROW_MAX];

	/* scratch */
	double row_price[ASSIGN_ROW_MAX];
	double column_price[ASSIGN_COLUMN_MAX + ASSIGN_ROW_MAX];
	double distance[ASSIGN_COLUMN_MAX + ASSIGN_ROW_MAX];
	int16_t reached_from[ASSIGN_COLUMN_MAX + ASSIGN_ROW_MAX];
	uint8_t done[ASSIGN_COLUMN_MAX + ASSIGN_ROW_MAX];
	int16_t touched[ASSIGN_COLUMN_MAX + ASSIGN_ROW_MAX];
	int touched_count;
};

void assign_solve(struct assign *assign);
