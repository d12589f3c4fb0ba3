/*
 * Lips and lids that meet: an upper marker and the one across below it, whose light runs into one
 * spot in most cameras. From one to the other it is as far for all of them, so that their spots
 * together tell it, where each one's is too short to be told from a disc seen obliquely. Whether a
 * spot is both or one of them is weighed by how its spread fits either, and what the camera saw
 * before.
 */
#include "track/match/match_pressed_parts.h"

#define NEAR_M 0.006      /* so far apart at most are they expected */
#define CAMERA_LEAST 2    /* that tell */
#define KNEW_SHARE 0.5f   /* a camera that saw both in so many of the last shots still does ... */
#define KNEW_ODDS 1.5     /* ... so that one spot is both by this, in squared sigmas ... */
#define NEW_ODDS (-2.5)   /* ... and of another camera it is not */
#define ALONE_ODDS (-4.0) /* with less it is surely one marker alone */
#define PLAIN_GAIN 3.0    /* the spot itself says that it is both */
#define APART_ODDS 3.0    /* a spot for each says that both are there */
#define ODDS_LEAST 2.0    /* of all cameras together, for the two to be there */
#define VAGUE_SHARE 0.5   /* of the line: a spot that may be either one or both */

/* When the two were last told apart. */
static bool knew_both(const struct matcher *m, uint32_t c, const struct tracker_state *state,
		      const struct pressed *pressed)
{
	int upper = m->seeds[pressed->seed[0]].label, lower = m->seeds[pressed->seed[1]].label;

	return state->looks[upper].sees[c] > KNEW_SHARE && state->looks[lower].sees[c] > KNEW_SHARE;
}

/* By how many squared sigmas, what the camera saw before counted in, its spot is rather both than
 * one of them. */
static double odds_of_both(const struct matcher *m, uint32_t c, const struct tracker_state *state,
			   const struct pressed *pressed, const struct pressed_spot *spot)
{
	return pressed_gain(m, c, pressed, spot) +
	       (knew_both(m, c, state, pressed) ? KNEW_ODDS : NEW_ODDS);
}

/* Leaves out the cameras that see but one of the two. */
static void drop_single(const struct matcher *m, const struct tracker_state *state,
			const struct pressed *pressed, struct pressed_spots *spots)
{
	int kept = 0;

	for (int i = 0; i < spots->count; i++)
		if (odds_of_both(m, spots->camera[i], state, pressed, &spots->spot[i]) > 0) {
			spots->camera[kept] = spots->camera[i];
			spots->spot[kept++] = spots->spot[i];
		}
	spots->count = kept;
}

/* Whether both are there: a camera that did not see both before says no word against it, as one of
 * the two may well be hidden from it. */
static bool are_two(const struct matcher *m, const struct tracker_state *state,
		    const struct pressed *pressed, const struct pressed_spots *spots)
{
	double odds =
		APART_ODDS * __builtin_popcount(spots->apart_mask) - pressed_surprise(pressed);

	for (int i = 0; i < spots->count; i++) {
		double gain = pressed_gain(m, spots->camera[i], pressed, &spots->spot[i]);

		odds += knew_both(m, spots->camera[i], state, pressed) ? gain : fmax(gain, 0);
	}
	return odds > ODDS_LEAST;
}

/* How far apart the two are; false when no spot is both, or it is one alone. */
static bool find_apart(const struct matcher *m, const struct tracker_state *state,
		       struct pressed *pressed)
{
	struct pressed_spots spots = {.count = 0};

	pressed_find_spots(m, state, pressed, &spots);
	pressed_find_ways(m, state, pressed, &spots);
	if (spots.count == 0 || spots.count + __builtin_popcount(spots.apart_mask) < CAMERA_LEAST)
		return false;
	if (!pressed_fit(m, &spots, pressed))
		return false;
	pressed_drop_ways(m, pressed, &spots);
	if (!are_two(m, state, pressed, &spots))
		return false;
	drop_single(m, state, pressed, &spots);
	if (spots.count == 0 || !pressed_fit(m, &spots, pressed))
		return false;
	pressed_share(m, &spots, pressed);
	return true;
}

int pressed_find(const struct matcher *m, const struct tracker_state *state, struct pressed *out)
{
	int count = 0;

	for (int i = 0; i < m->seed_count && count < PRESSED_MAX; i++) {
		int label = m->seeds[i].label;
		int below = label == LABEL_NONE ? LABEL_NONE : state->labels[label].below;
		int other = below == LABEL_NONE ? -1 : m->seed_of_label[below];

		if (other < 0 || !state->labels[label].confirmed || !state->labels[below].confirmed)
			continue;
		struct vec3 apart_m = vec3_sub(m->seed_stage_m[other], m->seed_stage_m[i]);
		out[count] = (struct pressed){.seed = {(int16_t)i, (int16_t)other},
					      .apart_m = apart_m,
					      .expected_m = apart_m};
		count += vec3_norm(apart_m) < NEAR_M && find_apart(m, state, &out[count]);
	}
	return count;
}

enum merge pressed_part(const struct matcher *m, uint32_t c, const struct tracker_state *state,
			const struct pressed *pressed, int *blob, struct parting *out)
{
	struct pressed_spot spot;

	if (!pressed_find_spot(m, c, state, pressed, &spot))
		return MERGE_NONE;
	*blob = spot.blob;
	out->sigma_px = VAGUE_SHARE * spot.line_px;
	for (int i = 0; i < 2; i++)
		out->label[i] = m->seeds[pressed->seed[i]].label;
	double odds = odds_of_both(m, c, state, pressed, &spot);

	out->kind = pressed_gain(m, c, pressed, &spot) > PLAIN_GAIN ? HALF_PLAIN : HALF_LIKELY;
	if (odds < ALONE_ODDS)
		return MERGE_NONE;
	if (odds < 0 || !pressed_spot_tells(&spot))
		return MERGE_VAGUE;
	double along[2] = {spot.line[0] / spot.line_px, spot.line[1] / spot.line_px};
	double share = pressed->share[c] > 0 ? pressed->share[c] : spot.share;
	merged_place(&m->cameras[c].blobs[spot.blob], along, spot.line_px, share, out);
	out->sigma_px = merged_sigma_px(spot.share_known);
	return MERGE_PARTED;
}
