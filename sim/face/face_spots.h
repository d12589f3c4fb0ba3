/*
 * Where the markers of a face are, for face.c alone: rows of evenly spaced ones from one place to
 * another, bulging upwards by `bow`. Angles in degrees from the head's middle; only the left half
 * is listed, what has an azimuth above 0 is mirrored. Numbers count up within region and side.
 */
#pragma once

struct face_row {
	const char *region, *group;
	int count;
	double azimuth[2], elevation[2], bow;
};

static const struct face_row FACE_ROWS_35[] = {
	{"forehead", "forehead", 1, {0}, {34}, 0},
	{"forehead", "forehead", 1, {18}, {32}, 0},
	{"temple", "temple", 1, {40}, {15}, 0},
	{"brow", "brow", 1, {8}, {18.5}, 0},
	{"brow", "brow", 1, {24}, {20}, 0},
	{"lid", "lid", 1, {17.5}, {9.5}, 0},
	{"lid", "lid", 1, {17.5}, {-3}, 0},
	{"nose", "nose", 1, {0}, {-18.5}, 0},
	{"nose", "nose", 1, {10}, {-18}, 0},
	{"cheek", "cheek", 1, {34}, {-3}, 0},
	{"cheek", "cheek", 1, {22}, {-18.5}, 0},
	{"cheek", "cheek", 1, {38}, {-18}, 0},
	{"lip_u", "lip_upper", 1, {0}, {-31.8}, 0},
	{"lip_u", "lip_upper", 1, {8.5}, {-32}, 0},
	{"lip_c", "lip_corner", 1, {17}, {-35}, 0},
	{"lip_d", "lip_lower", 1, {0}, {-38.6}, 0},
	{"lip_d", "lip_lower", 1, {8.5}, {-38.2}, 0},
	{"jaw", "jaw", 1, {28}, {-34}, 0},
	{"jaw", "jaw", 1, {17}, {-46}, 0},
	{"chin", "chin", 1, {0}, {-49}, 0},
};

static const struct face_row FACE_ROWS_70[] = {
	{"forehead", "forehead", 1, {0}, {37}, 0},
	{"forehead", "forehead", 1, {0}, {27.5}, 0},
	{"forehead", "forehead", 1, {12.5}, {36}, 0},
	{"forehead", "forehead", 1, {25}, {33}, 0},
	{"forehead", "forehead", 1, {11}, {27.5}, 0},
	{"temple", "temple", 1, {43}, {10}, 0},
	{"temple", "temple", 1, {40}, {25}, 0},
	{"brow", "brow", 1, {6.5}, {18.5}, 0},
	{"brow", "brow", 1, {15.5}, {20}, 0},
	{"brow", "brow", 1, {24.5}, {20}, 0},
	{"brow", "brow", 1, {33.5}, {16.5}, 0},
	{"lid", "lid", 1, {13}, {9.5}, 0},
	{"lid", "lid", 1, {22}, {9.5}, 0},
	{"lid", "lid", 1, {17.5}, {-3}, 0},
	{"nose", "nose", 1, {0}, {7}, 0},
	{"nose", "nose", 1, {0}, {-2}, 0},
	{"nose", "nose", 1, {0}, {-10.5}, 0},
	{"nose", "nose", 1, {0}, {-18.5}, 0},
	{"nose", "nose", 1, {8.5}, {-9.5}, 0},
	{"nose", "nose", 1, {9.5}, {-20.5}, 0},
	{"cheek", "cheek", 1, {18.5}, {-13}, 0},
	{"cheek", "cheek", 1, {28}, {-4}, 0},
	{"cheek", "cheek", 1, {38}, {-1}, 0},
	{"cheek", "cheek", 1, {28}, {-14.5}, 0},
	{"cheek", "cheek", 1, {39}, {-12}, 0},
	{"cheek", "cheek", 1, {21}, {-24.5}, 0},
	{"cheek", "cheek", 1, {32.5}, {-24.5}, 0},
	{"lip_u", "lip_upper", 1, {0}, {-32}, 0},
	{"lip_u", "lip_upper", 1, {4.9}, {-31.8}, 0},
	{"lip_u", "lip_upper", 1, {9.8}, {-32.6}, 0},
	{"lip_c", "lip_corner", 1, {14.6}, {-35}, 0},
	{"lip_d", "lip_lower", 1, {0}, {-38.2}, 0},
	{"lip_d", "lip_lower", 1, {4.9}, {-38}, 0},
	{"lip_d", "lip_lower", 1, {9.8}, {-37.3}, 0},
	{"jaw", "jaw", 1, {14}, {-44.5}, 0},
	{"jaw", "jaw", 1, {25}, {-37.5}, 0},
	{"jaw", "jaw", 1, {37}, {-35.5}, 0},
	{"jaw", "jaw", 1, {44.5}, {-24}, 0},
	{"chin", "chin", 1, {0}, {-45}, 0},
	{"chin", "chin", 1, {0}, {-51}, 0},
};

static const struct face_row FACE_ROWS_182[] = {
	{"forehead", "forehead", 4, {0, 0}, {42, 26}, 0},
	{"forehead", "forehead", 5, {7, 38}, {41, 34.5}, 0},
	{"forehead", "forehead", 6, {6, 40}, {35.5, 29.5}, 0},
	{"forehead", "forehead", 6, {6, 40}, {30, 24}, 0},
	{"temple", "temple", 3, {43, 45}, {17, 3}, 0},
	{"brow", "brow", 1, {0}, {19.5}, 0},
	{"brow", "brow", 6, {5.5, 35}, {19, 17}, 3},
	{"lid", "lid", 4, {10, 26.5}, {9, 8}, 2.5},
	{"lid", "lid", 4, {10, 26.5}, {0, -0.5}, -3},
	{"nose", "nose", 5, {0, 0}, {9, -20}, 0},
	{"nose", "nose", 3, {6, 7}, {5.5, -7.5}, 0},
	{"nose", "nose", 2, {8, 9.5}, {-13.5, -19.5}, 0},
	{"cheek", "cheek", 5, {14.5, 38}, {-8, -5}, -0.5},
	{"cheek", "cheek", 6, {14, 45}, {-14, -11}, 0},
	{"cheek", "cheek", 6, {15, 45.5}, {-20, -17.5}, 0},
	{"cheek", "cheek", 2, {15.5, 19.5}, {-25.5, -31.5}, 0},
	{"cheek", "cheek", 4, {22.5, 42}, {-25.5, -24}, 0},
	{"philtrum", "lip_upper", 1, {0}, {-27}, 0},
	{"philtrum", "lip_upper", 1, {6.5}, {-27.3}, 0},
	{"lip_u", "lip_upper", 1, {0}, {-32}, 0},
	{"lip_u", "lip_upper", 2, {4.9, 9.8}, {-31.8, -32.6}, 0},
	{"lip_c", "lip_corner", 1, {14.6}, {-35}, 0},
	{"lip_d", "lip_lower", 1, {0}, {-38.2}, 0},
	{"lip_d", "lip_lower", 2, {4.9, 9.8}, {-38, -37.3}, 0},
	{"chin", "chin", 1, {0}, {-43}, 0},
	{"chin", "chin", 2, {5.5, 11.5}, {-43, -42}, 0},
	{"chin", "chin", 2, {0, 0}, {-48, -52.5}, 0},
	{"jaw", "jaw", 4, {19, 37}, {-38.5, -34}, 0},
	{"jaw", "jaw", 5, {6.5, 33}, {-47.5, -42.5}, 0},
	{"jaw", "jaw", 4, {7, 28}, {-52.5, -48.5}, 0},
};

/* The rigid head band: spots on stems, so far from any symmetry that only one fit is close. */
static const struct face_band_spot {
	double azimuth_deg, elevation_deg, tilt_deg, stand_off_mm, diameter_mm;
} FACE_BAND[] = {
	{-54, 40, 8, 10, 4.0},
	{-14, 53, 18, 12, 5.0},
	{26, 57, 18, 32, 4.5},
	{58, 42, 8, 6, 4.0},
};
