/*
 * Both models of lens and sensor keep their promises: spots balance on the projected truth, light
 * is neither lost nor made, and noise has the variance that is stated.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "sim/render/canvas.h"
#include "sim/render/lamps.h"
#include "sim/render/marker_spot.h"
#include "sim/render/optics.h"
#include "sim/render/render.h"
#include "sim/world/scene_parts.h"

#define KINDS 2
#define PHASES 6
#define RAD (M_PI / 180.0)

static struct optics optics[KINDS]; /* made once for all tests */
static struct sim_scene *scene;
static float light[SPOT_WINDOW_MAX * SPOT_WINDOW_MAX];

static int make(void **state)
{
	const struct sim_options options = {.scene = "rest", .seed = 5};

	(void)state;
	for (int kind = 0; kind < KINDS; kind++)
		if (optics_init(&optics[kind], kind, 0.3, 1280, 1024))
			return -1;
	return sim_scene_create(&scene, &options, NULL);
}

static int unmake(void **state)
{
	(void)state;
	for (int kind = 0; kind < KINDS; kind++)
		optics_finish(&optics[kind]);
	sim_scene_destroy(scene);
	return 0;
}

struct moments {
	double sum, x, y, peak;
};

/* Of the noise-free image. */
static struct moments draw(int kind, const struct spot *spot)
{
	struct pixel_window w = optics_window(&optics[kind], spot);
	struct moments m = {0, 0, 0, 0};
	const float *pixel = light;

	optics_fill(&optics[kind], spot, &w, light);
	for (int y = w.y0; y < w.y1; y++)
		for (int x = w.x0; x < w.x1; x++, pixel++) {
			m.sum += (double)*pixel;
			m.peak = fmax(m.peak, (double)*pixel);
			m.x += (double)*pixel * x;
			m.y += (double)*pixel * y;
		}
	m.x /= m.sum;
	m.y /= m.sum;
	return m;
}

/* A marker before the camera, its normal tilted from the line of sight. */
struct pose_of_marker {
	struct vec3 p_stage_m, normal;
	double tilt_rad;
};

static struct vec3 stage_point(const struct sim_camera *camera, double x_px, double y_px,
			       double range_m)
{
	struct pose rt_stage_cam = pose_inverse(&camera->rt_cam_stage);
	struct vec3 p = {(x_px - camera->intrinsics[2]) / camera->focal_px * range_m,
			 (y_px - camera->intrinsics[3]) / camera->focal_px * range_m, range_m};

	return pose_apply(&rt_stage_cam, p);
}

static struct vec3 tilted(const struct sim_camera *camera, struct vec3 p, double tilt_rad,
			  double way_rad)
{
	struct vec3 to_camera = vec3_unit(vec3_sub(camera->centre_stage_m, p));
	struct vec3 side = vec3_unit(vec3_cross(to_camera, (struct vec3){0, 0, 1}));
	struct vec3 up = vec3_cross(side, to_camera);
	struct vec3 way = vec3_add(vec3_scale(side, cos(way_rad)), vec3_scale(up, sin(way_rad)));

	return vec3_add(vec3_scale(to_camera, cos(tilt_rad)), vec3_scale(way, sin(tilt_rad)));
}

struct bias {
	double x, y, worst; /* mean over phases; worst single one */
};

/* Mean distance of the light's first moment from the projected disc's centre, over phases. */
static struct bias disc_bias(int kind, double diameter_m, double tilt_deg, double way_deg,
			     double range_m)
{
	const struct sim_camera *camera = &scene->cameras[1];
	struct bias bias = {0, 0, 0};

	for (int i = 0; i < PHASES * PHASES; i++) {
		struct vec3 p = stage_point(camera, 700 + (double)(i % PHASES) / PHASES,
					    610 + (double)(i / PHASES) / PHASES, range_m);
		double truth[2];
		struct spot spot;

		assert_true(sim_camera_project(camera, p, truth));
		assert_true(disc_spot(camera, p, tilted(camera, p, tilt_deg * RAD, way_deg * RAD),
				      diameter_m / 2, 200, &spot));
		struct moments m = draw(kind, &spot);

		bias.x += (m.x - truth[0]) / (PHASES * PHASES);
		bias.y += (m.y - truth[1]) / (PHASES * PHASES);
		bias.worst = fmax(bias.worst, hypot(m.x - truth[0], m.y - truth[1]));
	}
	return bias;
}

static void discs_balance_on_their_projected_centre(void **state)
{
	static const double diameters_m[] = {1.5e-3, 3.2e-3, 6e-3, 9e-3, 14e-3};
	static const double ranges_m[] = {0.9, 1.3, 1.8};

	(void)state;
	for (int kind = 0; kind < KINDS; kind++) {
		double mean = 0, worst = 0;

		for (size_t d = 0; d < 5; d++)
			for (int t = 0; t < 9; t++) {
				struct bias bias = disc_bias(kind, diameters_m[d], 30.0 * (t % 3),
							     47.0 * t, ranges_m[t / 3]);

				mean = fmax(mean, hypot(bias.x, bias.y));
				worst = fmax(worst, bias.worst);
			}
		print_message("# model %d: %.5f px over phases, %.5f px at the worst\n", kind, mean,
			      worst);
		assert_true(mean < 0.005);
		assert_true(worst < 0.02);
	}
}

/* The perspective that the drawing leaves out, from its rim projected all around. */
static void perspective_shifts_large_discs_by_as_much_as_is_said(void **state)
{
	const struct sim_camera *camera = &scene->cameras[1];
	const double radius_m = 7e-3, range_m = 1.3;
	struct vec3 p = stage_point(camera, 640, 512, range_m);
	struct vec3 normal = tilted(camera, p, 45 * RAD, 0);
	struct vec3 a = vec3_unit(vec3_cross(normal, (struct vec3){0, 0, 1}));
	struct vec3 b = vec3_cross(normal, a);
	double area = 0, moment[2] = {0, 0}, last[2], next[2], truth[2];

	(void)state;
	sim_camera_project(camera, p, truth);
	for (int i = 0; i <= 720; i++, memcpy(last, next, sizeof(last))) {
		struct vec3 rim = vec3_add(vec3_scale(a, radius_m * cos(0.5 * i * RAD)),
					   vec3_scale(b, radius_m * sin(0.5 * i * RAD)));

		sim_camera_project(camera, vec3_add(p, rim), next);
		next[0] -= truth[0];
		next[1] -= truth[1];
		if (i == 0)
			continue;
		double cross = last[0] * next[1] - next[0] * last[1];

		area += cross / 2;
		moment[0] += cross * (last[0] + next[0]) / 6;
		moment[1] += cross * (last[1] + next[1]) / 6;
	}
	double shift = hypot(moment[0], moment[1]) / fabs(area);
	double said = camera->focal_px * pow(radius_m / range_m, 2) * 0.5;

	assert_true(fabs(shift / said - 1) < 0.1);
	assert_true(shift < 0.025);
}

static void hemispheres_lean_to_their_near_side(void **state)
{
	(void)state;
	for (int kind = 0; kind < KINDS; kind++)
		for (double squeeze = 0; squeeze < 0.8; squeeze += 0.25)
			for (double radius_px = 1; radius_px < 9; radius_px += 1.7) {
				struct spot spot = {.centre_px = {500.3, 400.6},
						    .axes_px = {{radius_px, 0.6 * radius_px},
								{-0.6 * radius_px, radius_px}},
						    .squeeze = squeeze,
						    .brightness = 200};
				double shift = 4 / (3 * M_PI) * squeeze;
				struct moments m = draw(kind, &spot);

				assert_true(fabs(m.x - 500.3 - 0.6 * radius_px * shift) < 0.005);
				assert_true(fabs(m.y - 400.6 - radius_px * shift) < 0.005);
				assert_true(fabs(m.sum / spot_light(&spot) - 1) <
					    0.02); /* faint halo */
			}
}

static void defocus_spreads_light_and_keeps_it(void **state)
{
	(void)state;
	for (int kind = 0; kind < KINDS; kind++) {
		double last = 1e9;

		for (double defocus = 0; defocus <= 4; defocus += 0.7) {
			struct spot spot = {.centre_px = {500.2, 400.7},
					    .axes_px = {{1.5, 0}, {0, 1.5}},
					    .brightness = 200,
					    .defocus_px = defocus};
			struct moments m = draw(kind, &spot);

			assert_true(m.peak < last);
			assert_true(fabs(m.sum / spot_light(&spot) - 1) < 0.02); /* faint halo */
			assert_true(hypot(m.x - 500.2, m.y - 400.7) < 0.005);
			last = m.peak;
		}
	}
}

/* Share of a point's light farther than 5 px away. */
static double light_outside(int kind)
{
	struct spot spot = {
		.centre_px = {500, 400}, .axes_px = {{0.5, 0}, {0, 0.5}}, .brightness = 1e5};
	struct pixel_window w = optics_window(&optics[kind], &spot);
	double outside = 0, sum = draw(kind, &spot).sum;
	const float *pixel = light;

	for (int y = w.y0; y < w.y1; y++)
		for (int x = w.x0; x < w.x1; x++, pixel++)
			outside += hypot(x - 500, y - 400) > 5 ? (double)*pixel : 0;
	return outside / sum;
}

static double peak_at(int kind, double x_px, double y_px)
{
	struct spot spot = {
		.centre_px = {x_px, y_px}, .axes_px = {{1, 0}, {0, 1}}, .brightness = 200};

	return draw(kind, &spot).peak;
}

static void one_model_loses_sharpness_towards_the_corners(void **state)
{
	const double middle = peak_at(SIM_OPTICS_TAILED, 640, 512);

	(void)state;
	assert_true(peak_at(SIM_OPTICS_TAILED, 1240, 980) < 0.93 * middle);
	assert_true(peak_at(SIM_OPTICS_TAILED, 900, 700) < middle);
	assert_true(fabs(peak_at(SIM_OPTICS_GAUSSIAN, 1240, 980) /
				 peak_at(SIM_OPTICS_GAUSSIAN, 640, 512) -
			 1) < 1e-3);
}

static void one_model_has_wide_tails_and_the_other_none(void **state)
{
	(void)state;
	assert_true(light_outside(SIM_OPTICS_GAUSSIAN) < 1e-4);
	assert_true(light_outside(SIM_OPTICS_TAILED) > 0.01);
	assert_true(light_outside(SIM_OPTICS_TAILED) < 0.10);
}

#define SIDE 256
#define SHOTS 24

/* Mean and variance over pixels and pictures, and of the pixels' means over pictures. */
struct statistics {
	double mean, variance, pattern;
};

static struct statistics measure(int kind, uint32_t frame_count, double ambient, float lit)
{
	static double sums[SIDE * SIDE];
	struct canvas_plan plan = {.width_px = SIDE,
				   .height_px = SIDE,
				   .frame_count = frame_count,
				   .optics = kind,
				   .black_grey = 10,
				   .ambient_grey = ambient};
	struct statistics s = {0, 0, 0};
	struct canvas canvas;
	struct rng rng;

	memset(sums, 0, sizeof(sums));
	rng_init(&rng, 77, 1);
	assert_int_equal(canvas_init(&canvas, &plan, &rng), 0);
	for (int shot = 0; shot < SHOTS; shot++) {
		canvas_clear(&canvas, &rng);
		if (lit > 0) {
			float *pixels =
				canvas_add_window(&canvas, (struct pixel_window){0, 0, SIDE, SIDE});

			for (int i = 0; i < SIDE * SIDE; i++)
				pixels[i] = lit;
		}
		const uint8_t *image = canvas_expose(&canvas, &rng);

		for (int i = 0; i < SIDE * SIDE; i++) {
			sums[i] += image[i];
			s.mean += image[i];
			s.variance += (double)image[i] * image[i];
		}
	}
	s.mean /= (double)SHOTS * SIDE * SIDE;
	s.variance = s.variance / ((double)SHOTS * SIDE * SIDE) - s.mean * s.mean;
	for (int i = 0; i < SIDE * SIDE; i++)
		s.pattern += pow(sums[i] / SHOTS - s.mean, 2) / (SIDE * SIDE);
	canvas_finish(&canvas);
	return s;
}

/* Within a picture: what does not change with time included. */
static double stated_variance(int kind, double ambient, double lit)
{
	double rounding = 1 / 12.0;

	if (kind == SIM_OPTICS_GAUSSIAN)
		return pow(SENSOR_READ_GREY, 2) + (10 + ambient + lit) / SENSOR_ELECTRONS_PER_GREY +
		       rounding;
	return pow(PATTERNED_READ_GREY, 2) + pow(PATTERNED_ROW_GREY, 2) +
	       pow(PATTERNED_OFFSET_GREY, 2) + rounding +
	       (ambient + lit) / PATTERNED_ELECTRONS_PER_GREY + pow(PATTERNED_GAIN * lit, 2);
}

static void noise_has_the_stated_variance_at_every_grey_level(void **state)
{
	static const double ambients[] = {0, 3, 40};
	static const float lights[] = {0, 0.2f, 20, 90, 200};

	(void)state;
	for (int kind = 0; kind < KINDS; kind++)
		for (uint32_t frames = 1; frames <= 8; frames += 7)
			for (int i = 0; i < 15; i++) {
				double ambient = ambients[i % 3];
				float lit = lights[i / 3];

				if (10 + ambient + (double)lit > 225)
					continue; /* what would be clipped */
				double stated = stated_variance(kind, ambient, (double)lit);
				struct statistics s = measure(kind, frames, ambient, lit);

				if (!(fabs(s.variance / stated - 1) < 0.02))
					print_message("# %d %u %g %g: %g for %g\n", kind, frames,
						      ambient, (double)lit, s.variance, stated);
				assert_true(fabs(s.mean - 10 - ambient - (double)lit) < 0.05);
				assert_true(fabs(s.variance / stated - 1) < 0.02);
			}
}

static void patterns_stay_where_they_are_in_one_model_only(void **state)
{
	(void)state;
	for (uint32_t frames = 1; frames <= 8; frames += 7) {
		double even = measure(SIM_OPTICS_GAUSSIAN, 1, 0, 0).pattern;
		double fixed = measure(SIM_OPTICS_TAILED, frames, 0, 0).pattern;

		assert_true(even < 2 * stated_variance(SIM_OPTICS_GAUSSIAN, 0, 0) / SHOTS);
		assert_true(fixed > 0.9 * pow(PATTERNED_OFFSET_GREY, 2));
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(discs_balance_on_their_projected_centre),
		cmocka_unit_test(perspective_shifts_large_discs_by_as_much_as_is_said),
		cmocka_unit_test(hemispheres_lean_to_their_near_side),
		cmocka_unit_test(defocus_spreads_light_and_keeps_it),
		cmocka_unit_test(one_model_loses_sharpness_towards_the_corners),
		cmocka_unit_test(one_model_has_wide_tails_and_the_other_none),
		cmocka_unit_test(noise_has_the_stated_variance_at_every_grey_level),
		cmocka_unit_test(patterns_stay_where_they_are_in_one_model_only),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, make, unmake);
}
