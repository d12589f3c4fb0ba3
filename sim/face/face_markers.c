/*
 * Puts the markers on a face.
 */
#include <stdio.h>
#include <string.h>

#include "sim/face/face_build.h"
#include "sim/face/face_spots.h"

#define MM 1e-3
#define RAD (M_PI / 180.0)
#define PRESSED_M 2.4e-3 /* between the middles of markers on pressed lips */

struct place {
	double azimuth_deg, elevation_deg;
};

struct face_table {
	const struct face_row *rows;
	size_t row_count;
	double jitter_deg, diameter_m;
};

static struct face_table table_of(int marker_count)
{
	if (marker_count == 35)
		return (struct face_table){
			FACE_ROWS_35, sizeof(FACE_ROWS_35) / sizeof(*FACE_ROWS_35), 0.7, 1.5 * MM};
	if (marker_count == 182)
		return (struct face_table){FACE_ROWS_182,
					   sizeof(FACE_ROWS_182) / sizeof(*FACE_ROWS_182), 0.35,
					   3.2 * MM};
	return (struct face_table){FACE_ROWS_70, sizeof(FACE_ROWS_70) / sizeof(*FACE_ROWS_70), 0.7,
				   1.5 * MM};
}

static double spread(struct rng *rng, double half_width)
{
	return half_width * (2.0 * rng_uniform(rng) - 1.0);
}

static struct place row_place(const struct face_row *row, int i)
{
	double u = row->count > 1 ? (double)i / (row->count - 1) : 0;

	return (struct place){row->azimuth[0] + u * (row->azimuth[1] - row->azimuth[0]),
			      row->elevation[0] + u * (row->elevation[1] - row->elevation[0]) +
				      row->bow * 4 * u * (1 - u)};
}

/* Numbers count up in the order of the table, for each side of each region alone. */
static void name_marker(struct face *face, struct layout_marker *marker, const char *region,
			int side)
{
	char stem[NAME_BYTES - 8];
	int number = 1;

	snprintf(stem, sizeof(stem), "%s_%s", region, side > 0 ? "l_" : side < 0 ? "r_" : "");
	for (uint32_t m = 0; m < face->marker_count; m++) {
		const char *name = face->markers[m].wanted.name;

		if (strncmp(name, stem, strlen(stem)) == 0 && !strchr(name + strlen(stem), '_'))
			number++;
	}
	snprintf(marker->name, sizeof(marker->name), "%s%d", stem, number);
}

/* Next day's fingers miss by some millimetres, along the skin. */
static struct place put_today(struct face_maker *maker, struct place wanted, double radius_m)
{
	double off_deg = maker->options->reapplied_m / radius_m / RAD;
	double across = rng_normal(&maker->today_rng), up = rng_normal(&maker->today_rng);

	return (struct place){wanted.azimuth_deg +
				      across * off_deg / cos(wanted.elevation_deg * RAD),
			      wanted.elevation_deg + up * off_deg};
}

static void settle(struct face_maker *maker, struct face_marker *marker, struct place at)
{
	struct face_site site = {.azimuth_deg = at.azimuth_deg, .elevation_deg = at.elevation_deg};

	site.p_m = face_surface(&maker->shape, at.azimuth_deg, at.elevation_deg);
	site.jaw_share = face_jaw_share(at.azimuth_deg, at.elevation_deg);
	marker->neutral_m = site.p_m;
	marker->normal = face_surface_normal(&maker->shape, at.azimuth_deg, at.elevation_deg);
	marker->jaw_turn_rad = face_jaw_turn_rad(&site);
	face_shift(&site, marker->shift_m);
}

static void add_skin_marker(struct face_maker *maker, const struct face_table *table,
			    const struct face_row *row, struct place at, int side)
{
	struct face_marker *marker = &maker->face->markers[maker->face->marker_count];
	double jitter_deg = strncmp(row->group, "lip", 3) == 0 ? 0.2 : table->jitter_deg;
	struct place wanted = {side * at.azimuth_deg + spread(&maker->rng, jitter_deg),
			       at.elevation_deg + spread(&maker->rng, jitter_deg)};

	name_marker(maker->face, &marker->wanted, row->region, side);
	snprintf(marker->wanted.group, sizeof(marker->wanted.group), "%s", row->group);
	marker->wanted.neutral_m =
		face_surface(&maker->shape, wanted.azimuth_deg, wanted.elevation_deg);
	marker->wanted.diameter_m =
		maker->options->diameter_m > 0 ? maker->options->diameter_m : table->diameter_m;
	marker->reflectivity = 1.0 + spread(&maker->rng, 0.12);
	marker->on_nose = strcmp(row->group, "nose") == 0;
	settle(maker, marker, put_today(maker, wanted, vec3_norm(marker->wanted.neutral_m)));
	maker->face->marker_count++;
}

void face_add_skin(struct face_maker *maker)
{
	struct face_table table = table_of(maker->options->marker_count);

	for (size_t r = 0; r < table.row_count; r++)
		for (int i = 0; i < table.rows[r].count; i++) {
			struct place at = row_place(&table.rows[r], i);

			if (at.azimuth_deg == 0) {
				add_skin_marker(maker, &table, &table.rows[r], at, 0);
				continue;
			}
			add_skin_marker(maker, &table, &table.rows[r], at, 1);
			add_skin_marker(maker, &table, &table.rows[r], at, -1);
		}
}

static void add_band_marker(struct face_maker *maker, int i)
{
	const struct face_band_spot *spot = &FACE_BAND[i];
	struct face_marker *marker = &maker->face->markers[maker->face->marker_count++];
	double azimuth = spot->azimuth_deg + spread(&maker->rng, 1.0);
	double elevation = spot->elevation_deg + spread(&maker->rng, 1.0);
	double tilt = spot->tilt_deg * RAD, turn = azimuth * RAD;
	struct vec3 skin = face_surface(&maker->shape, azimuth, elevation);

	snprintf(marker->wanted.name, sizeof(marker->wanted.name), "head_%d", i + 1);
	snprintf(marker->wanted.group, sizeof(marker->wanted.group), "head");
	marker->wanted.rigid = true;
	marker->wanted.diameter_m = spot->diameter_mm * MM;
	marker->neutral_m = vec3_add(skin, vec3_scale(vec3_unit(skin), spot->stand_off_mm * MM));
	marker->wanted.neutral_m = marker->neutral_m;
	marker->normal = (struct vec3){sin(turn) * cos(tilt), sin(tilt), cos(turn) * cos(tilt)};
	marker->reflectivity = 1.0 + spread(&maker->rng, 0.05);
	marker->tucks[0] = marker->tucks[1] = BASIS_COUNT;
}

void face_add_band(struct face_maker *maker)
{
	for (size_t i = 0; i < sizeof(FACE_BAND) / sizeof(FACE_BAND[0]); i++)
		add_band_marker(maker, (int)i);
}

static bool in_region(const struct face_marker *marker, const char *region)
{
	return strncmp(marker->wanted.name, region, strlen(region)) == 0;
}

/* The lower lip's marker below one of the upper lip. */
static struct face_marker *partner_of(struct face *face, const struct face_marker *upper)
{
	struct face_marker *best = NULL;

	for (uint32_t m = 0; m < face->marker_count; m++) {
		struct face_marker *lower = &face->markers[m];

		if (in_region(lower, "lip_d") &&
		    (!best || fabs(lower->neutral_m.x - upper->neutral_m.x) <
				      fabs(best->neutral_m.x - upper->neutral_m.x)))
			best = lower;
	}
	return best;
}

void face_join_lips(struct face *face)
{
	for (uint32_t m = 0; m < face->marker_count; m++) {
		struct face_marker *upper = &face->markers[m];
		struct face_marker *lower =
			in_region(upper, "lip_u") ? partner_of(face, upper) : NULL;

		if (!lower)
			continue;
		struct vec3 middle = vec3_scale(vec3_add(upper->neutral_m, lower->neutral_m), 0.5);
		struct vec3 half = {0, 0.5 * PRESSED_M, 0};

		upper->shift_m[BASIS_LIP_PRESS] =
			vec3_sub(vec3_add(middle, half), upper->neutral_m);
		lower->shift_m[BASIS_LIP_PRESS] =
			vec3_sub(vec3_sub(middle, half), lower->neutral_m);
	}
}

/* The cheek's marker that lies in the fold beside the mouth. */
static struct face_marker *fold_marker(struct face *face, int side)
{
	const struct vec3 fold_m = {side * 34 * MM, -44 * MM, 90 * MM};
	struct face_marker *best = NULL;

	for (uint32_t m = 0; m < face->marker_count; m++)
		if (in_region(&face->markers[m], "cheek") &&
		    (!best || vec3_distance(face->markers[m].neutral_m, fold_m) <
				      vec3_distance(best->neutral_m, fold_m)))
			best = &face->markers[m];
	return best;
}

void face_set_tucks(struct face *face)
{
	for (uint32_t m = 0; m < face->marker_count; m++) {
		struct face_marker *marker = &face->markers[m];
		bool upper_lid = in_region(marker, "lid") && marker->wanted.neutral_m.y > 6 * MM;

		marker->tucks[0] = marker->tucks[1] = BASIS_COUNT;
		if (upper_lid)
			marker->tucks[0] =
				marker->wanted.neutral_m.x > 0 ? BASIS_BLINK_L : BASIS_BLINK_R;
	}
	for (int side = 1; side >= -1; side -= 2) {
		struct face_marker *marker = fold_marker(face, side);

		if (!marker)
			continue;
		marker->tucks[0] = side > 0 ? BASIS_SMILE_L : BASIS_SMILE_R;
		marker->tucks[1] = side > 0 ? BASIS_SNARL_L : BASIS_SNARL_R;
	}
}

void face_add_teeth(struct face_maker *maker)
{
	static const double across_mm[] = {-12.5, -4.3, 4.3, 12.5};
	struct face *face = maker->face;
	struct vec3 mouth = face_surface(&maker->shape, 0, -34);

	for (int i = 0; i < 4; i++) {
		double arch_mm = across_mm[i] * across_mm[i] / 45;

		face->ghosts[face->ghost_count++] = (struct face_ghost){
			.kind = GLOSS_TOOTH,
			.centre_m = {across_mm[i] * MM, mouth.y + spread(&maker->rng, 1 * MM),
				     mouth.z - (18 + arch_mm) * MM},
			.axis = vec3_unit((struct vec3){across_mm[i] / 30, -0.1, 1}),
			.radius_m = 9 * MM,
			.cos_limit = cos(38 * RAD),
			.brightness = 0.35 + 0.3 * rng_uniform(&maker->rng)};
	}
}

void face_add_eyes(struct face_maker *maker)
{
	struct face *face = maker->face;

	for (int side = 1; side >= -1; side -= 2) {
		struct vec3 lids = face_surface(&maker->shape, side * 18, 4);

		face->ghosts[face->ghost_count++] =
			(struct face_ghost){.kind = side > 0 ? GLOSS_EYE_L : GLOSS_EYE_R,
					    .centre_m = {lids.x, lids.y, lids.z - 11 * MM},
					    .axis = {0, 0, 1},
					    .radius_m = 7.8 * MM,
					    .cos_limit = cos(45 * RAD),
					    .brightness = 0.5 + 0.3 * rng_uniform(&maker->rng)};
	}
}
