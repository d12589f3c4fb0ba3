/*
 * A face at a moment: linear in the weights of its bases.
 */
#include "sim/face/face.h"

#include <string.h>

#include "sim/face/face_build.h"

#define MM 1e-3

bool face_count_known(int marker_count)
{
	return marker_count == 0 || marker_count == 35 || marker_count == 70 || marker_count == 182;
}

void face_init(struct face *face, const struct face_options *options, uint64_t seed)
{
	struct face_maker maker = {.face = face, .options = options};

	memset(face, 0, sizeof(*face));
	rng_init(&maker.rng, seed, 1);
	rng_init(&maker.today_rng, seed, 5);
	maker.shape = face_shape_make(&maker.rng);
	face->skull = (struct ellipsoid){.axes_m = vec3_scale(maker.shape.axes_m, 0.97)};
	struct vec3 nose = face_surface(&maker.shape, 0, -14);
	face->nose = (struct ellipsoid){.centre_m = {0, nose.y, nose.z - 14 * MM},
					.axes_m = {10 * MM, 22 * MM, 13 * MM}};
	if (options->marker_count)
		face_add_skin(&maker);
	face_join_lips(face);
	face_set_tucks(face);
	if (options->marker_count)
		face_add_band(&maker);
	if (options->teeth)
		face_add_teeth(&maker);
	if (options->eyes)
		face_add_eyes(&maker);
}

struct vec3 face_marker_place(const struct face *face, uint32_t index,
			      const double weights[BASIS_COUNT], struct vec3 *normal)
{
	const struct face_marker *marker = &face->markers[index];
	struct vec3 p = marker->neutral_m;
	struct vec3 turn = {weights[BASIS_JAW_OPEN] * marker->jaw_turn_rad, 0, 0};

	for (int b = 0; b < BASIS_COUNT; b++)
		if (weights[b] != 0)
			p = vec3_add(p, vec3_scale(marker->shift_m[b], weights[b]));
	*normal = marker->normal;
	if (turn.x != 0)
		*normal = vec3_unit(vec3_add(*normal, vec3_cross(turn, *normal)));
	return p;
}

bool face_marker_tucked(const struct face *face, uint32_t index, const double weights[BASIS_COUNT])
{
	const struct face_marker *marker = &face->markers[index];
	double sum = 0;

	for (int i = 0; i < 2; i++)
		if (marker->tucks[i] != BASIS_COUNT)
			sum += weights[marker->tucks[i]];
	return sum > FACE_TUCK;
}

static double ramp(double value, double low, double high)
{
	return fmin(fmax((value - low) / (high - low), 0.0), 1.0);
}

double face_lips_parted_m(const double weights[BASIS_COUNT])
{
	double parted_mm = 18 * weights[BASIS_JAW_OPEN] + 9 * weights[BASIS_LIP_DROP] +
			   5 * weights[BASIS_LIP_RAISE] - 6 * weights[BASIS_LIP_PRESS];

	return 1e-3 * fmax(parted_mm, 0);
}

double face_lid_closed(enum face_basis blink, const double weights[BASIS_COUNT])
{
	return fmin(fmax(weights[blink] + 0.3 * weights[BASIS_SQUINT], 0), 1);
}

double face_ghost_brightness(const struct face_ghost *ghost, const double weights[BASIS_COUNT])
{
	enum face_basis lid = ghost->kind == GLOSS_EYE_L ? BASIS_BLINK_L : BASIS_BLINK_R;

	if (ghost->kind == GLOSS_TOOTH)
		return ghost->brightness * ramp(face_lips_parted_m(weights), 5e-3, 9e-3);
	return ghost->brightness * (1 - ramp(face_lid_closed(lid, weights), 0.3, 0.6));
}
