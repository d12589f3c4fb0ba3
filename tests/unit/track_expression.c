/*
 * Patterns of a face: learned while all is seen, they tell where hidden markers are, also beyond
 * what was seen, and one wrong name does not mislead them.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "base/rng.h"
#include "track/label/expression.h"
#include "track/predict.h"

#define MARKERS 60
#define PATTERNS 6
#define SHOT_NS 8333333
#define NOISE_M 3e-5

struct face {
	struct layout layout;
	struct vec3 shift_m[PATTERNS][MARKERS];
	struct rng rng;
};

static struct tracker_state tracker;

static struct vec3 random_vec3(struct rng *rng, double sigma_m)
{
	double x = rng_normal(rng), y = rng_normal(rng), z = rng_normal(rng);

	return vec3_scale((struct vec3){x, y, z}, sigma_m);
}

/* Each pattern moves the markers about a place, by up to 10 mm. */
static void make_face(struct face *face)
{
	memset(face, 0, sizeof(*face));
	rng_init(&face->rng, 7, 1);
	face->layout.actor_count = 1;
	face->layout.actors[0].count = face->layout.marker_count = MARKERS;
	for (int i = 0; i < MARKERS; i++) {
		struct layout_marker *marker = &face->layout.markers[i];

		snprintf(marker->name, sizeof(marker->name), "m%d", i);
		marker->neutral_m = random_vec3(&face->rng, 0.04);
	}
	for (int p = 0; p < PATTERNS; p++) {
		struct vec3 middle_m = random_vec3(&face->rng, 0.03);
		struct vec3 pull_m = vec3_scale(vec3_unit(random_vec3(&face->rng, 1)), 0.01);

		for (int i = 0; i < MARKERS; i++) {
			double far =
				vec3_distance(face->layout.markers[i].neutral_m, middle_m) / 0.04;

			face->shift_m[p][i] = vec3_scale(pull_m, exp(-far * far / 2));
		}
	}
}

static struct vec3 place_of(const struct face *face, int marker, double time_s, double scale)
{
	struct vec3 p = face->layout.markers[marker].neutral_m;

	for (int k = 0; k < PATTERNS; k++)
		p = vec3_add(p, vec3_scale(face->shift_m[k][marker],
					   scale * sin((1.3 + 1.1 * k) * time_s + k)));
	return p;
}

static void see(struct face *face, double time_s, double scale, struct vec3 seen_m[MARKERS])
{
	for (int i = 0; i < MARKERS; i++)
		seen_m[i] = vec3_add(place_of(face, i, time_s, scale),
				     random_vec3(&face->rng, NOISE_M));
}

static int64_t watch_those(struct face *face, const bool *those, double seconds)
{
	int64_t now_ns = SHOT_NS;

	memset(&tracker, 0, sizeof(tracker));
	predict_init(&tracker, &face->layout);
	for (; now_ns < seconds * 1e9; now_ns += SHOT_NS) {
		struct vec3 seen_m[LABEL_MAX];
		struct expression now;

		see(face, (double)now_ns * 1e-9, 1, seen_m);
		expression_solve(&tracker, 0, now_ns, those, seen_m, &now);
		expression_learn(&tracker, 0, &now, now_ns, SHOT_NS * 1e-9, those, seen_m);
	}
	return now_ns;
}

static int64_t watch(struct face *face, double seconds)
{
	bool all[LABEL_MAX];

	memset(all, true, sizeof(all));
	return watch_those(face, all, seconds);
}

static double rms_of_hidden_m(struct face *face, const bool *tells, const struct vec3 *seen_m,
			      int64_t now_ns, double scale, double *of_sigma2)
{
	static struct told told[LABEL_MAX];
	struct expression now;
	double sum_m2 = 0;
	int count = 0;

	expression_solve(&tracker, 0, now_ns, tells, seen_m, &now);
	assert_true(now.known);
	expression_tell(&tracker, 0, &now, tells, told);
	*of_sigma2 = 0;
	for (int i = 0; i < MARKERS; i++) {
		assert_int_equal(told[i].known, !tells[i]);
		if (tells[i])
			continue;
		double off_m = vec3_distance(told[i].local_m,
					     place_of(face, i, (double)now_ns * 1e-9, scale));
		sum_m2 += off_m * off_m;
		*of_sigma2 += off_m * off_m / (3 * told[i].sigma_m * told[i].sigma_m);
		count++;
	}
	*of_sigma2 /= count;
	return sqrt(sum_m2 / count);
}

static void hidden_markers_are_where_the_face_has_them(void **state)
{
	static struct face face;
	bool tells[LABEL_MAX];

	(void)state;
	make_face(&face);
	int64_t now_ns = watch(&face, 12);
	for (int i = 0; i < LABEL_MAX; i++)
		tells[i] = i % 3 != 0;
	for (double scale = 1; scale < 2.1; scale++) { /* as far as was seen, and twice that */
		struct vec3 seen_m[LABEL_MAX];
		double of_sigma2;

		see(&face, (double)now_ns * 1e-9, scale, seen_m);
		double rms_m = rms_of_hidden_m(&face, tells, seen_m, now_ns, scale, &of_sigma2);
		print_message("# at %.0f times the motion: %.3f mm rms, (error / sigma)^2 %.2f\n",
			      scale, 1e3 * rms_m, of_sigma2);
		assert_true(rms_m < 0.0005 * scale);
		assert_true(of_sigma2 < 1.5);
	}
}

static void one_wrong_name_does_not_mislead_the_rest(void **state)
{
	static struct face face;
	struct vec3 seen_m[LABEL_MAX];
	bool tells[LABEL_MAX];
	double of_sigma2;

	(void)state;
	make_face(&face);
	int64_t now_ns = watch(&face, 12);
	for (int i = 0; i < LABEL_MAX; i++)
		tells[i] = i % 3 != 0;
	see(&face, (double)now_ns * 1e-9, 1, seen_m);
	seen_m[1] = seen_m[2];
	double rms_m = rms_of_hidden_m(&face, tells, seen_m, now_ns, 1, &of_sigma2);
	print_message("# with a wrong name: %.3f mm rms\n", 1e3 * rms_m);
	assert_true(rms_m < 0.0008);
}

/* Of a marker that was never seen the patterns say that it moves as those that were, not farther.
 */
static void who_was_never_watched_moves_no_farther_than_others(void **state)
{
	static struct face face;
	static struct told told[LABEL_MAX];
	struct vec3 seen_m[LABEL_MAX];
	struct expression now;
	bool tells[LABEL_MAX];
	double sum2_m2 = 0, of_sigma2;

	(void)state;
	make_face(&face);
	for (int p = 0; p < PATTERNS; p++)
		for (int i = 0; i < MARKERS; i++)
			face.shift_m[p][i] = vec3_scale(face.shift_m[p][i], 0.3);
	for (int i = 0; i < LABEL_MAX; i++)
		tells[i] = i % 3 != 0;
	int64_t now_ns = watch_those(&face, tells, 4);
	see(&face, (double)now_ns * 1e-9, 1, seen_m);
	double rms_m = rms_of_hidden_m(&face, tells, seen_m, now_ns, 1, &of_sigma2);
	expression_solve(&tracker, 0, now_ns, tells, seen_m, &now);
	expression_tell(&tracker, 0, &now, tells, told);
	for (int i = 0; i < MARKERS; i += 3)
		sum2_m2 += told[i].sigma_m * told[i].sigma_m;
	double sigma_m = sqrt(sum2_m2 / (MARKERS / 3));
	print_message("# never watched: %.1f mm rms, sigma %.1f mm, (error / sigma)^2 %.2f\n",
		      1e3 * rms_m, 1e3 * sigma_m, of_sigma2);
	assert_true(of_sigma2 < 1.5);
	assert_true(sigma_m < 5 * rms_m);
}

static void few_markers_tell_nothing(void **state)
{
	static struct face face;
	static struct told told[LABEL_MAX];
	struct vec3 seen_m[LABEL_MAX];
	struct expression now;
	bool tells[LABEL_MAX] = {true, true, true};

	(void)state;
	make_face(&face);
	int64_t now_ns = watch(&face, 1);
	see(&face, (double)now_ns * 1e-9, 1, seen_m);
	expression_solve(&tracker, 0, now_ns, tells, seen_m, &now);
	assert_false(now.known);
	expression_tell(&tracker, 0, &now, tells, told);
	for (int i = 0; i < MARKERS; i++)
		assert_false(told[i].known);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(hidden_markers_are_where_the_face_has_them),
		cmocka_unit_test(one_wrong_name_does_not_mislead_the_rest),
		cmocka_unit_test(who_was_never_watched_moves_no_farther_than_others),
		cmocka_unit_test(few_markers_tell_nothing),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
