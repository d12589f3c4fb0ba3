/*
 * Muscles as Gaussian pulls on the skin around a place; the jaw turns about its hinge.
 */
#include "sim/face/face_basis.h"

#include <stdbool.h>

#include "sim/face/face_shape.h"

#define MM 1e-3
#define RAD (M_PI / 180.0)
#define JAW_ANGLE_RAD (8.8 * RAD)

static const struct vec3 JAW_HINGE_M = {0, -12 * MM, 8 * MM};

/* Which skin a pull reaches: the lips part what is a few millimetres apart. */
enum part { BOTH, UPPER, LOWER };

static const struct {
	enum face_basis basis;
	enum part part;
	int side; /* 0 = both, 1 = left, -1 = right */
	double azimuth_deg, elevation_deg, sigma_deg;
	double x_mm, y_mm, z_mm; /* of the left side */
} PULLS[] = {
	{BASIS_SMILE_L, BOTH, 1, 16, -35, 7, 6, 6, -3},
	{BASIS_SMILE_L, BOTH, 1, 30, -17, 11, 1, 5, 2},
	{BASIS_SMILE_R, BOTH, -1, 16, -35, 7, 6, 6, -3},
	{BASIS_SMILE_R, BOTH, -1, 30, -17, 11, 1, 5, 2},
	{BASIS_STRETCH, BOTH, 0, 15, -36, 8, 6, -2, -2},
	{BASIS_PUCKER, BOTH, 0, 15, -35, 6, -6, 0, 4},
	{BASIS_PUCKER, BOTH, 0, 0, -35, 6, 0, 0, 6},
	{BASIS_FUNNEL, BOTH, 0, 15, -35, 5, -3, 0, 3},
	{BASIS_FUNNEL, UPPER, 0, 0, -32, 7, 0, 2.5, 5},
	{BASIS_FUNNEL, LOWER, 0, 0, -39, 7, 0, -3, 5},
	{BASIS_LIP_DROP, LOWER, 0, 0, -39, 7, 0, -9, 1},
	{BASIS_LIP_RAISE, UPPER, 0, 0, -31, 8, 0, 5, 0.5},
	{BASIS_CORNERS_DOWN, BOTH, 0, 16, -36, 6, 2, -6, -1},
	{BASIS_PUFF, BOTH, 0, 30, -28, 11, 6, 0, 6},
	{BASIS_PUFF, BOTH, 0, 11, -34, 5, 0, 0, 2.5},
	{BASIS_CHIN_RAISE, LOWER, 0, 0, -49, 7, 0, 4, 2},
	{BASIS_CHIN_RAISE, LOWER, 0, 0, -39, 6, 0, 0, 3},
	{BASIS_SNARL_L, UPPER, 1, 9, -18, 6, 1.5, 4, -1},
	{BASIS_SNARL_L, UPPER, 1, 7, -30, 5, 0, 3, 0},
	{BASIS_SNARL_R, UPPER, -1, 9, -18, 6, 1.5, 4, -1},
	{BASIS_SNARL_R, UPPER, -1, 7, -30, 5, 0, 3, 0},
	{BASIS_BLINK_L, BOTH, 1, 19, 10, 5, 0, -9, -1},
	{BASIS_BLINK_R, BOTH, -1, 19, 10, 5, 0, -9, -1},
	{BASIS_SQUINT, BOTH, 0, 20, -4, 5, 0, 2.5, 0},
	{BASIS_SQUINT, BOTH, 0, 28, -10, 8, 0, 2, 1},
	{BASIS_BROW_L, BOTH, 1, 22, 20, 12, 0, 8, 0.5},
	{BASIS_BROW_L, BOTH, 1, 18, 34, 10, 0, 3, 0},
	{BASIS_BROW_R, BOTH, -1, 22, 20, 12, 0, 8, 0.5},
	{BASIS_BROW_R, BOTH, -1, 18, 34, 10, 0, 3, 0},
	{BASIS_FROWN, BOTH, 0, 10, 18, 8, -3, -4, 1},
};

#define PULL_COUNT ((int)(sizeof(PULLS) / sizeof(PULLS[0])))

double face_jaw_share(double azimuth_deg, double elevation_deg)
{
	double below_mouth = 1.0 / (1.0 + exp((elevation_deg + 35.0) / 1.6));
	double towards_ear = 1.0 / (1.0 + exp((fabs(azimuth_deg) - 62.0) / 8.0));

	return below_mouth * towards_ear;
}

double face_jaw_turn_rad(const struct face_site *site)
{
	return site->jaw_share * JAW_ANGLE_RAD;
}

/* A pull beside the middle has its mirror image on the other side. */
static void add_pull(const struct face_site *site, int index, int side, struct vec3 *shift_m)
{
	double share = PULLS[index].part == UPPER   ? 1.0 - site->jaw_share
		       : PULLS[index].part == LOWER ? site->jaw_share
						    : 1.0;
	double w = MM * share *
		   face_lobe(site->azimuth_deg - side * PULLS[index].azimuth_deg,
			     site->elevation_deg - PULLS[index].elevation_deg,
			     PULLS[index].sigma_deg, PULLS[index].sigma_deg);
	struct vec3 pull = {side * PULLS[index].x_mm * w, PULLS[index].y_mm * w,
			    PULLS[index].z_mm * w};

	*shift_m = vec3_add(*shift_m, pull);
}

void face_shift(const struct face_site *site, struct vec3 shift_m[BASIS_COUNT])
{
	struct vec3 turn_rad = {face_jaw_turn_rad(site), 0, 0};

	for (int i = 0; i < PULL_COUNT; i++)
		for (int side = 1; side >= -1; side -= 2) {
			bool middle = PULLS[i].azimuth_deg == 0;
			bool wanted = PULLS[i].side == 0 || PULLS[i].side == side;

			if (wanted && !(middle && side < 0))
				add_pull(site, i, side, &shift_m[PULLS[i].basis]);
		}
	shift_m[BASIS_JAW_OPEN] = vec3_cross(turn_rad, vec3_sub(site->p_m, JAW_HINGE_M));
	shift_m[BASIS_JAW_SIDE] = (struct vec3){9 * MM * site->jaw_share, 0, 0};
	shift_m[BASIS_JAW_FORWARD] = (struct vec3){0, 0, 6 * MM * site->jaw_share};
}
