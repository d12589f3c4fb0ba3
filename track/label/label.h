/*
 * Names for points: the labels of all actors at once by optimal assignment around their
 * predictions, corrected by what the neighbours do, and no name at all where two readings are
 * nearly as good. Pure and real-time safe.
 */
#pragma once

#include <stdbool.h>

#include "track/label/assign.h"
#include "track/label/expression.h"
#include "track/label/expression_search.h"
#include "track/match/match.h"
#include "track/match/nearby.h"
#include "track/match/point_size.h"
#include "track/predict.h"
#include "track/tracker_state.h"

struct labelling {
	/* filled before: own motion, and the frames found in this shot */
	struct predictions motion;
	int64_t now_ns; /* of the shot: filled by label_points() */
	bool found[FRAME_MAX];
	struct pose rt_stage_frame[FRAME_MAX], rt_frame_stage[FRAME_MAX];

	struct point_size sizes[POINT_MAX]; /* filled before: of the points' lights */
	bool is_strained[POINT_MAX];        /* ... see point_is_strained() */
	bool is_ghost[POINT_MAX];           /* filled before: a light is known to stand there */
	bool merged[POINT_MAX]; /* filled before: most views of the point show two markers as one */

	struct assign assign;                     /* rows are labels, columns points */
	struct expression_search laid[ACTOR_MAX]; /* where shots are far apart, else not known */
	struct expression expressions[ACTOR_MAX]; /* by those with a name a moment ago */
	bool tells[LABEL_MAX];                    /* these */
	struct told told[LABEL_MAX];              /* and what that says of the others */
	struct predictions predictions;           /* with the neighbours' word */
	struct vec3 expected_m[LABEL_MAX]; /* the same in the stage, where the frame is found */
	struct nearby nearby; /* the points that may have a name: three or more views */
	int16_t point_of_label[LABEL_MAX]; /* or -1; every one of them is sure enough to follow */
	bool doubtful[LABEL_MAX];          /* a point was near, but it may be another's */
	float margin[LABEL_MAX]; /* of the reading over the next best, in squared sigmas */
	bool seen[LABEL_MAX];
	struct vec3 seen_m[LABEL_MAX]; /* coordinates of the label's frame, where seen */
};

/* Assigns points to the labels of the found frames and fills all that is not filled before. */
void label_points(struct labelling *labelling, const struct tracker_state *state,
		  const struct point *points, uint32_t point_count, int64_t now_ns);

/* Whether its neighbours agree with the place of a label that has no name yet. */
bool label_is_clear(const struct labelling *labelling, const struct tracker_state *state,
		    uint32_t label);

/* Whether a label's point is the only one that it could mean, not far from where it is expected. */
bool label_is_plain(const struct labelling *labelling, const struct tracker_state *state,
		    uint32_t label);

/* No unexplained point nearby says that the whole neighbourhood may be read wrongly. */
bool label_is_alone(const struct labelling *labelling, const struct tracker_state *state,
		    uint32_t label);

/* Names that have held for a while place it, those of its neighbours or the whole face, and no
 * label without a name could mean its point (label_anchor.c). */
bool label_is_anchored(const struct labelling *labelling, const struct tracker_state *state,
		       uint32_t label);

/* A label without a point could be meant by this one's. */
bool label_has_rival(const struct labelling *labelling, const struct tracker_state *state,
		     uint32_t label);

/* Whether the rest of the face tells so surely where a label is that its point needs no other
 * proof.
 */
bool label_is_told(const struct labelling *labelling, const struct tracker_state *state,
		   uint32_t label);

#define LABEL_HELD_S 0.3 /* so long a name that was read one marker aside does not last */

/* It is seen, was a moment ago, and has held its name: others may lean on it. */
static inline bool label_holds_name(const struct labelling *labelling,
				    const struct tracker_state *state, int label)
{
	return labelling->seen[label] && labelling->motion.labels[label].recent &&
	       state->labels[label].named_s > LABEL_HELD_S;
}

/* Of a lower lip's or lid's marker and the one across on the upper, the upper lies higher in the
 * head: points that were given the other way round are exchanged. Strained ones are nobody's then:
 * they are not where either was expected. */
void label_put_in_order(struct labelling *labelling, const struct tracker_state *state,
			const struct point *points);

/* While the two are hidden, their motion may have them pass through each other: expects the upper
 * one higher again, by its diameter. */
void label_expect_in_order(const struct tracker_state *state, struct predictions *predictions);

/* Gives a label without a point one of no label not far off, if no other label could mean it. */
void label_pair_left_over(struct labelling *labelling, const struct tracker_state *state);

/* The two are across the lips or the lids: their order tells them apart. */
bool label_order_tells(const struct tracker_state *state, int row, int other_row);

/* Doubts a point that either of two such markers may be, or both. */
void label_doubt_pressed(struct labelling *labelling, const struct tracker_state *state);

/* After two cameras were asked: takes away the names of points that a label still without one may
 * be in, or could claim nearly as well. */
void label_doubt_lonely(struct labelling *labelling, const struct tracker_state *state);

/* The face as a whole, where it was laid on the points, has another point for the label or none. */
bool label_is_laid_elsewhere(const struct labelling *labelling, const struct tracker_state *state,
			     int label);

/* Takes away the names that could as well be another's, or elsewhere; fills the margins. */
void label_abstain(struct labelling *labelling, const struct tracker_state *state);
