/*
 * Points without names on a face that moved farther than its markers are apart: it is laid on them
 * as a whole, and where it could as well lie one row aside, nobody is told.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "base/rng.h"
#include "track/label/expression_search.h"
#include "track/predict.h"

#define ROWS 12
#define COLUMNS 10
#define MARKERS (ROWS * COLUMNS)
#define PATTERNS 3
#define SPACING_M 0.008
#define SHOT_NS 33333333
#define NOISE_M 3e-5

struct face {
	struct layout layout;
	struct vec3 shift_m[PATTERNS][MARKERS];
	struct rng rng;
};

static struct tracker_state tracker;

static struct vec3 noise_m(struct rng *rng, double sigma_m)
{
	double x = rng_normal(rng), y = rng_normal(rng), z = rng_normal(rng);

	return vec3_scale((struct vec3){x, y, z}, sigma_m);
}

/* A grid. The first pattern moves all below `still_rows` by three rows, the others bulge. */
static void make_face(struct face *face, int still_rows, double uneven_m)
{
	memset(face, 0, sizeof(*face));
	rng_init(&face->rng, 11, 1);
	face->layout.actor_count = 1;
	face->layout.actors[0].count = face->layout.marker_count = MARKERS;
	for (int i = 0; i < MARKERS; i++) {
		struct layout_marker *marker = &face->layout.markers[i];
		int row = i / COLUMNS, column = i % COLUMNS;
		struct vec3 at = {SPACING_M * column, -SPACING_M * row, 0};

		snprintf(marker->name, sizeof(marker->name), "m%d", i);
		marker->neutral_m = vec3_add(at, noise_m(&face->rng, uneven_m));
		face->shift_m[0][i].y = row < still_rows ? 0 : -3 * SPACING_M;
		face->shift_m[1][i].z = 0.006 * exp(-0.1 * (column - 2) * (column - 2));
		face->shift_m[2][i].x = 0.004 * exp(-0.1 * (row - 3) * (row - 3));
	}
}

static struct vec3 place_of(const struct face *face, int marker, const double amount[PATTERNS])
{
	struct vec3 p = face->layout.markers[marker].neutral_m;

	for (int k = 0; k < PATTERNS; k++)
		p = vec3_add(p, vec3_scale(face->shift_m[k][marker], amount[k]));
	return p;
}

/* Some seconds in which all names are known. */
static int64_t watch(struct face *face)
{
	bool all[LABEL_MAX];
	int64_t now_ns = SHOT_NS;

	memset(all, true, sizeof(all));
	memset(&tracker, 0, sizeof(tracker));
	predict_init(&tracker, &face->layout);
	for (; now_ns < 8000000000; now_ns += SHOT_NS) {
		double t = (double)now_ns * 1e-9;
		double amount[PATTERNS] = {0.5 - 0.5 * cos(5 * t), sin(3.1 * t), sin(4.3 * t + 1)};
		struct vec3 seen_m[LABEL_MAX];
		struct expression now;

		for (int i = 0; i < MARKERS; i++) {
			seen_m[i] =
				vec3_add(place_of(face, i, amount), noise_m(&face->rng, NOISE_M));
			tracker.labels[i].seen_ns = now_ns;
		}
		expression_solve(&tracker, 0, now_ns, all, seen_m, &now);
		expression_learn(&tracker, 0, &now, now_ns, SHOT_NS * 1e-9, all, seen_m);
	}
	return now_ns;
}

/* The points of the rows from `first` on and before `end`; point i is marker i's. */
static void search(struct face *face, int64_t now_ns, const double amount[PATTERNS], int first,
		   int end, struct expression_search *out)
{
	static struct point points[MARKERS];
	static struct nearby nearby;
	struct pose here = POSE_IDENTITY;

	for (int i = 0; i < MARKERS; i++) {
		points[i].fix.p_stage_m =
			vec3_add(place_of(face, i, amount), noise_m(&face->rng, NOISE_M));
		points[i].claimed_mask =
			i / COLUMNS >= first && i / COLUMNS < end ? 7 : 0; /* three cameras */
	}
	nearby_build(&nearby, points, MARKERS, NULL);
	expression_search(&tracker, 0, now_ns, &nearby, &here, out);
}

static void a_face_that_jumped_is_laid_on_its_points(void **state)
{
	static struct face face;
	static struct expression_search found;

	(void)state;
	make_face(&face, ROWS / 2, 0.0005);
	int64_t now_ns = watch(&face);
	for (double open = 0; open < 1.05; open += 0.1) {
		double amount[PATTERNS] = {open, 0.7, -0.6};
		int right = 0;

		search(&face, now_ns, amount, 0, ROWS, &found);
		assert_true(found.known);
		for (int i = 0; i < MARKERS; i++) {
			right += found.point_of_label[i] == i;
			assert_true(found.point_of_label[i] == i || found.point_of_label[i] == -1);
		}
		assert_true(right >= 0.98 * MARKERS);
	}
}

static void a_hidden_row_does_not_draw_the_others_aside(void **state)
{
	static struct face face;
	static struct expression_search found;
	double amount[PATTERNS] = {0.9, -0.3, 0.2};

	(void)state;
	make_face(&face, ROWS / 2, 0.0005);
	int64_t now_ns = watch(&face);
	search(&face, now_ns, amount, 0, ROWS - 1, &found);
	assert_true(found.known);
	for (int i = 0; i < MARKERS; i++)
		assert_int_equal(found.point_of_label[i], i / COLUMNS < ROWS - 1 ? i : -1);
}

/* All rows move alike, and the outer ones are hidden: nothing tells which row is which. */
static void what_could_be_a_row_aside_is_not_told(void **state)
{
	static struct face face;
	static struct expression_search found;
	double amount[PATTERNS] = {0.5, 0, 0};
	int told = 0;

	(void)state;
	make_face(&face, 0, 0);
	int64_t now_ns = watch(&face);
	search(&face, now_ns, amount, 2, ROWS - 2, &found);
	for (int i = 0; i < MARKERS; i++)
		told += found.known && found.point_of_label[i] >= 0;
	assert_int_equal(told, 0);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_face_that_jumped_is_laid_on_its_points),
		cmocka_unit_test(a_hidden_row_does_not_draw_the_others_aside),
		cmocka_unit_test(what_could_be_a_row_aside_is_not_told),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
