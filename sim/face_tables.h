/*
 * Anatomy in numbers, for face.c alone. Angles are seen from the head's middle; only the left half
 * is listed, what has an azimuth above 0 is mirrored.
 */
#pragma once

#include "sim/face.h"

/* Bumps and hollows added to the skull's ellipsoid. */
struct face_relief {
	double azimuth_deg, elevation_deg, sigma_azimuth_deg, sigma_elevation_deg, height_mm;
};

static const struct face_relief FACE_RELIEF[] = {
	{0, -50, 42, 19, 19}, /* the lower face stands forward of the ellipsoid */
	{0, -19, 7, 9, 18},   /* nose tip */
	{0, -6, 6, 10, 8},    /* nose bridge */
	{14, 18, 12, 5, 3},   /* brow ridge */
	{18, 4, 8, 6, -5},    /* eye socket */
	{36, -10, 11, 9, 4},  /* cheek bone */
	{0, -34.5, 12, 4, 4}, /* lips */
	{0, -52, 11, 5, 4},   /* chin */
};

/* Skin markers. */
struct face_spot {
	const char *region;
	int number;
	const char *group;
	double azimuth_deg, elevation_deg;
};

static const struct face_spot FACE_SPOTS[] = {
	{"forehead", 1, "forehead", 0, 37},
	{"forehead", 2, "forehead", 0, 27.5},
	{"forehead", 1, "forehead", 12.5, 36},
	{"forehead", 2, "forehead", 25, 33},
	{"forehead", 3, "forehead", 11, 27.5},
	{"temple", 1, "temple", 43, 10},
	{"temple", 2, "temple", 40, 25},
	{"brow", 1, "brow", 6.5, 18.5},
	{"brow", 2, "brow", 15.5, 20},
	{"brow", 3, "brow", 24.5, 20},
	{"brow", 4, "brow", 33.5, 16.5},
	{"lid", 1, "lid", 13, 9.5},
	{"lid", 2, "lid", 22, 9.5},
	{"lid", 3, "lid", 17.5, -3},
	{"nose", 1, "nose", 0, 7},
	{"nose", 2, "nose", 0, -2},
	{"nose", 3, "nose", 0, -10.5},
	{"nose", 4, "nose", 0, -18.5},
	{"nose", 1, "nose", 8.5, -9.5},
	{"nose", 2, "nose", 9.5, -20.5},
	{"cheek", 1, "cheek", 18.5, -13},
	{"cheek", 2, "cheek", 28, -4},
	{"cheek", 3, "cheek", 38, -1},
	{"cheek", 4, "cheek", 28, -14.5},
	{"cheek", 5, "cheek", 39, -12},
	{"cheek", 6, "cheek", 21, -24.5},
	{"cheek", 7, "cheek", 32.5, -24.5},
	{"lip_u", 1, "lip_upper", 0, -32},
	{"lip_u", 1, "lip_upper", 4.9, -31.8},
	{"lip_u", 2, "lip_upper", 9.8, -32.6},
	{"lip_c", 1, "lip_corner", 14.6, -35},
	{"lip_d", 1, "lip_lower", 0, -38.2},
	{"lip_d", 1, "lip_lower", 4.9, -38},
	{"lip_d", 2, "lip_lower", 9.8, -37.3},
	{"jaw", 1, "jaw", 14, -44.5},
	{"jaw", 2, "jaw", 25, -37.5},
	{"jaw", 3, "jaw", 37, -35.5},
	{"jaw", 4, "jaw", 44.5, -24},
	{"chin", 1, "chin", 0, -45},
	{"chin", 2, "chin", 0, -51},
};

/* The rigid head band: spots on stems, so far from any symmetry that only one fit is close. */
struct face_band_spot {
	double azimuth_deg, elevation_deg, tilt_deg, stand_off_mm, diameter_mm;
};

static const struct face_band_spot FACE_BAND[] = {
	{-54, 40, 8, 10, 4.0},
	{-14, 53, 18, 12, 5.0},
	{26, 57, 18, 32, 4.5},
	{58, 42, 8, 6, 4.0},
};

/* What an expression pulls, and how far: a Gaussian lobe around a place. */
struct face_pull {
	enum expression expression;
	int side; /* 0 = both, 1 = left, -1 = right */
	double azimuth_deg, elevation_deg, sigma_deg;
	double x_mm, y_mm, z_mm;
};

static const struct face_pull FACE_PULLS[] = {
	{EXPRESSION_SMILE, 0, 16, -35, 7, 6, 6, -3},
	{EXPRESSION_SMILE, 0, 30, -17, 11, 1, 5, 2},
	{EXPRESSION_STRETCH, 0, 15, -36, 8, 6, -2, -2},
	{EXPRESSION_PUCKER, 0, 15, -35, 6, -6, 0, 4},
	{EXPRESSION_PUCKER, 0, 0, -35, 6, 0, 0, 6},
	{EXPRESSION_LIP_DROP, 0, 0, -39, 6, 0, -10, 1},
	{EXPRESSION_SNARL, 0, 9, -18, 6, 1.5, 4, -1},
	{EXPRESSION_SNARL, 0, 6, -30, 4, 0, 3, 0},
	{EXPRESSION_BLINK, 0, 19, 10, 5, 0, -9, -1},
	{EXPRESSION_BROW_L, 1, 22, 20, 12, 0, 8, 0.5},
	{EXPRESSION_BROW_L, 1, 18, 34, 10, 0, 3, 0},
	{EXPRESSION_BROW_R, -1, 22, 20, 12, 0, 8, 0.5},
	{EXPRESSION_BROW_R, -1, 18, 34, 10, 0, 3, 0},
	{EXPRESSION_FROWN, 0, 10, 18, 8, -3, -4, 1},
};

#define FACE_RELIEF_COUNT ((int)(sizeof(FACE_RELIEF) / sizeof(FACE_RELIEF[0])))
#define FACE_SPOT_COUNT ((int)(sizeof(FACE_SPOTS) / sizeof(FACE_SPOTS[0])))
#define FACE_BAND_COUNT ((int)(sizeof(FACE_BAND) / sizeof(FACE_BAND[0])))
#define FACE_PULL_COUNT ((int)(sizeof(FACE_PULLS) / sizeof(FACE_PULLS[0])))
