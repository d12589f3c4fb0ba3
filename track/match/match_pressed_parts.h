/*
 * Between the files of pressed lips: match_pressed_spots.c looks for the spots, match_pressed_fit.c
 * fits the way from one marker to the other to them, match_pressed_shares.c the light that either
 * has of each, and match_pressed.c says what is both.
 */
#pragma once

#include "track/match/match_parts.h"

/* One camera's spot of the two. */
struct pressed_spot {
	int blob;
	bool share_known;
	double share;
	double line[2], line_px; /* from the first to the second */
	bool alone_known;        /* how wide either is alone: else the last of these is not */
	double longer_px2[3];    /* xx - yy, 2 xy and xx + yy of what its spread says of the line */
};

struct pressed_spots {
	int count;
	uint32_t camera[CAMERA_MAX];
	struct pressed_spot spot[CAMERA_MAX];
	uint32_t apart_mask; /* cameras that have a spot for each */
	double apart_px[CAMERA_MAX][2], apart_sigma_px[CAMERA_MAX];
};

/* The camera's spot of the two. False when it does not have both in one, or no spread of it. */
bool pressed_find_spot(const struct matcher *matcher, uint32_t c, const struct tracker_state *state,
		       const struct pressed *pressed, struct pressed_spot *out);

/* They are far enough apart in the image for the spot's spread to tell. */
bool pressed_spot_tells(const struct pressed_spot *spot);

/* All cameras' spots that tell. */
void pressed_find_spots(const struct matcher *matcher, const struct tracker_state *state,
			const struct pressed *pressed, struct pressed_spots *spots);

/* The cameras that have a spot for each: from one to the other is the way. */
void pressed_find_ways(const struct matcher *matcher, const struct tracker_state *state,
		       const struct pressed *pressed, struct pressed_spots *spots);

/* Fits the way from one marker to the other, leaning on where it was expected. */
bool pressed_fit(const struct matcher *matcher, const struct pressed_spots *spots,
		 struct pressed *pressed);

/* Leaves out the cameras that tell a way far from the fitted one: theirs are others' spots. */
void pressed_drop_ways(const struct matcher *matcher, const struct pressed *pressed,
		       struct pressed_spots *spots);

/* By how many squared sigmas the way is not the expected one. */
double pressed_surprise(const struct pressed *pressed);

/* One equation more of least squares: by so much is the linear form with this slope off. */
void pressed_add_equation(double normal[6], struct vec3 *right, double error, struct vec3 slope,
			  double weight);

/* Fills the shares of the cameras whose spots these are, along their lines as they were when the
 * spots were found: shares along a way that was fitted wrongly would make it fit. */
void pressed_share(const struct matcher *matcher, const struct pressed_spots *spots,
		   struct pressed *pressed);

/* By how many squared sigmas two markers explain the camera's spot better than one. */
double pressed_gain(const struct matcher *matcher, uint32_t c, const struct pressed *pressed,
		    const struct pressed_spot *spot);
