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
	{0, -42, 38, 20, 14},     /* the lower face stands forward of the ellipsoid */
	{0, -19, 6.5, 9, 20},     /* nose tip */
	{0, -6, 5.5, 10, 9},      /* nose bridge */
	{14, 18, 12, 5, 3.5},     /* brow ridge */
	{18, 4, 8, 6, -6},        /* eye socket */
	{38, -10, 11, 9, 4},      /* cheek bone */
	{0, -32.5, 11, 2.2, 3.5}, /* upper lip */
	{0, -38, 10, 2.2, 4},     /* lower lip */
	{0, -52, 11, 5, 7},       /* chin */
};

/* Skin markers. */
struct face_spot {
	const char *region;
	int number;
	const char *group;
	double azimuth_deg, elevation_deg;
};

static const struct face_spot FACE_SPOTS[] = {
	{"forehead", 1, "forehead", 0, 41},
	{"forehead", 2, "forehead", 0, 29},
	{"forehead", 1, "forehead", 14, 39},
	{"forehead", 2, "forehead", 28, 36},
	{"forehead", 3, "forehead", 12, 29},
	{"temple", 1, "temple", 49, 13},
	{"temple", 2, "temple", 46, 28},
	{"brow", 1, "brow", 7, 18.5},
	{"brow", 2, "brow", 17, 21},
	{"brow", 3, "brow", 27, 21},
	{"brow", 4, "brow", 37, 17},
	{"lid", 1, "lid", 14, 9},
	{"lid", 2, "lid", 24, 9},
	{"lid", 3, "lid", 19, -3},
	{"nose", 1, "nose", 0, 7},
	{"nose", 2, "nose", 0, -2},
	{"nose", 3, "nose", 0, -11},
	{"nose", 4, "nose", 0, -19},
	{"nose", 1, "nose", 8.5, -8.5},
	{"nose", 2, "nose", 9.5, -20},
	{"cheek", 1, "cheek", 20, -14},
	{"cheek", 2, "cheek", 31, -5},
	{"cheek", 3, "cheek", 43, -2},
	{"cheek", 4, "cheek", 31, -16},
	{"cheek", 5, "cheek", 44, -14},
	{"cheek", 6, "cheek", 23, -26},
	{"cheek", 7, "cheek", 36, -27},
	{"lip_u", 1, "lip_upper", 0, -31.5},
	{"lip_u", 1, "lip_upper", 5, -31.3},
	{"lip_u", 2, "lip_upper", 10, -32.3},
	{"lip_c", 1, "lip_corner", 15, -35},
	{"lip_d", 1, "lip_lower", 0, -38.8},
	{"lip_d", 1, "lip_lower", 5, -38.6},
	{"lip_d", 2, "lip_lower", 10, -37.8},
	{"jaw", 1, "jaw", 15, -46},
	{"jaw", 2, "jaw", 28, -40},
	{"jaw", 3, "jaw", 43, -38},
	{"jaw", 4, "jaw", 54, -26},
	{"chin", 1, "chin", 0, -47},
	{"chin", 2, "chin", 0, -54},
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
	{EXPRESSION_LIP_DROP, 0, 0, -39, 6, 0, -5, 1},
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
