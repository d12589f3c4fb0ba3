/*
 * Sums over all captured shots. Neighbours are chosen by how alike they moved, not by distance
 * alone.
 */
#include "calib/actor/actor_learn.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/sort.h"
#include "track/predict.h"

#define OUTLIER_SHARE 5.0  /* of the median distance from the median */
#define OUTLIER_MIN_M 5e-5 /* where there is nearly no noise */
#define SHOTS_MIN 15       /* to tell what a marker does */
#define SHARED_SHOTS_MIN 15
#define SPEED_GAP_S 0.1
#define NEIGHBOUR_DISTANCE_M 0.06
#define SPREAD_MIN_M 5e-5

static double median_of(double *values, uint32_t count)
{
	sort_doubles(values, count);
	return count % 2 ? values[count / 2] : 0.5 * (values[count / 2 - 1] + values[count / 2]);
}

static struct vec3 place(const struct actor_part *part, uint32_t shot, uint32_t marker)
{
	return part->p_m[(size_t)shot * part->marker_count + marker];
}

static bool is_seen(struct vec3 p_m)
{
	return !isnan(p_m.x);
}

static struct vec3 median_place(const struct actor_part *part, uint32_t marker, double *room)
{
	double axis[3] = {0};

	for (int k = 0; k < 3; k++) {
		uint32_t count = 0;

		for (uint32_t n = 0; n < part->shot_count; n++) {
			struct vec3 p = place(part, n, marker);

			if (is_seen(p))
				room[count++] = k == 0 ? p.x : k == 1 ? p.y : p.z;
		}
		axis[k] = count ? median_of(room, count) : 0;
	}
	return (struct vec3){axis[0], axis[1], axis[2]};
}

static double median_distance_m(const struct actor_part *part, uint32_t marker,
				struct vec3 middle_m, double *room)
{
	uint32_t count = 0;

	for (uint32_t n = 0; n < part->shot_count; n++)
		if (is_seen(place(part, n, marker)))
			room[count++] = vec3_distance(place(part, n, marker), middle_m);
	return count ? median_of(room, count) : 0;
}

static void learn_neutral_of(const struct actor_part *part, uint32_t marker, double *room,
			     struct actor_neutral *out)
{
	struct vec3 middle_m = median_place(part, marker, room), sum = {0, 0, 0};
	double limit_m = fmax(OUTLIER_SHARE * median_distance_m(part, marker, middle_m, room),
			      OUTLIER_MIN_M);
	double sum2_m2 = 0;
	uint32_t count = 0;

	for (uint32_t n = 0; n < part->shot_count; n++) {
		struct vec3 off = vec3_sub(place(part, n, marker), middle_m);

		if (!is_seen(off) || vec3_norm(off) > limit_m)
			continue;
		sum = vec3_add(sum, off);
		sum2_m2 += vec3_dot(off, off);
		count++;
	}
	out->shots[marker] = count;
	if (!count)
		return;
	struct vec3 mean = vec3_scale(sum, 1.0 / count);
	out->mean_m[marker] = vec3_add(middle_m, mean);
	out->sd_m[marker] = sqrt(fmax(sum2_m2 / count - vec3_dot(mean, mean), 0) / 3);
}

int actor_neutral_learn(const struct actor_part *part, struct actor_neutral *out)
{
	double *room = malloc((part->shot_count + 1) * sizeof(*room));

	if (!room)
		return -ENOMEM;
	memset(out, 0, sizeof(*out));
	out->count = part->marker_count;
	for (uint32_t i = 0; i < part->marker_count; i++)
		learn_neutral_of(part, i, room, out);
	free(room);
	return 0;
}

/* What is summed up of one marker. */
struct motion_sums {
	uint32_t count;
	struct vec3 min_m, max_m;
	struct vec3 sum_m;
	double sum2_m2[6];
	double speed_m_s;
};

static void add_displacement(struct motion_sums *s, struct vec3 d)
{
	const double d2[6] = {d.x * d.x, d.x * d.y, d.x * d.z, d.y * d.y, d.y * d.z, d.z * d.z};

	s->count++;
	s->min_m =
		(struct vec3){fmin(s->min_m.x, d.x), fmin(s->min_m.y, d.y), fmin(s->min_m.z, d.z)};
	s->max_m =
		(struct vec3){fmax(s->max_m.x, d.x), fmax(s->max_m.y, d.y), fmax(s->max_m.z, d.z)};
	s->sum_m = vec3_add(s->sum_m, d);
	for (int k = 0; k < 6; k++)
		s->sum2_m2[k] += d2[k];
}

static void add_part(struct motion_sums *s, const struct actor_part *part, uint32_t marker,
		     struct vec3 neutral_m)
{
	for (uint32_t n = 0; n < part->shot_count; n++) {
		struct vec3 p = place(part, n, marker);

		if (!is_seen(p))
			continue;
		add_displacement(s, vec3_sub(p, neutral_m));
		if (n == 0 || !is_seen(place(part, n - 1, marker)))
			continue;
		double gap_s = (double)(part->time_ns[n] - part->time_ns[n - 1]) / NS_PER_S;
		if (gap_s > 0 && gap_s < SPEED_GAP_S)
			s->speed_m_s = fmax(s->speed_m_s,
					    vec3_distance(p, place(part, n - 1, marker)) / gap_s);
	}
}

static void learn_motion(struct layout_marker *marker, const struct motion_sums *s,
			 double rest_sd_m)
{
	struct layout_learned *l = &marker->learned;
	struct vec3 mean = vec3_scale(s->sum_m, 1.0 / s->count);
	const double mean2[6] = {mean.x * mean.x, mean.x * mean.y, mean.x * mean.z,
				 mean.y * mean.y, mean.y * mean.z, mean.z * mean.z};

	l->known = true;
	l->range_min_m = s->min_m;
	l->range_max_m = s->max_m;
	l->speed_max_m_s = s->speed_m_s;
	l->rest_sd_m = rest_sd_m;
	for (int k = 0; k < 6; k++)
		l->cov_m2[k] = s->sum2_m2[k] / s->count - mean2[k];
}

static bool on_face(const struct layout_marker *marker)
{
	return !marker->rigid && !marker->segment[0];
}

/* Rms difference of two displacements, or -1 when they were seldom seen together. */
static double spread_of(const struct actor_neutral *neutral, const struct actor_part *parts,
			uint32_t part_count, uint32_t a, uint32_t b)
{
	struct vec3 apart_m = vec3_sub(neutral->mean_m[a], neutral->mean_m[b]);
	double sum2_m2 = 0;
	uint32_t count = 0;

	for (uint32_t k = 0; k < part_count; k++)
		for (uint32_t n = 0; n < parts[k].shot_count; n++) {
			struct vec3 d = vec3_sub(place(&parts[k], n, a), place(&parts[k], n, b));

			if (!is_seen(d))
				continue;
			d = vec3_sub(d, apart_m);
			sum2_m2 += vec3_dot(d, d);
			count++;
		}
	return count < SHARED_SHOTS_MIN ? -1 : fmax(sqrt(sum2_m2 / count), SPREAD_MIN_M);
}

static void insert_neighbour(struct layout_learned *l, struct layout_neighbour neighbour)
{
	int at = l->neighbour_count;

	while (at > 0 && l->neighbours[at - 1].spread_m > neighbour.spread_m)
		at--;
	if (at == LEARNED_NEIGHBOUR_MAX)
		return;
	if (l->neighbour_count < LEARNED_NEIGHBOUR_MAX)
		l->neighbour_count++;
	for (int k = l->neighbour_count - 1; k > at; k--)
		l->neighbours[k] = l->neighbours[k - 1];
	l->neighbours[at] = neighbour;
}

static void learn_neighbours(struct layout *layout, uint32_t marker,
			     const struct actor_neutral *neutral, const struct actor_part *parts,
			     uint32_t part_count)
{
	struct layout_marker *own = &layout->markers[marker];

	own->learned.neighbour_count = 0;
	for (uint32_t i = 0; i < layout->marker_count; i++) {
		const struct layout_marker *other = &layout->markers[i];

		if (i == marker || !on_face(other) || !neutral->shots[i] ||
		    predict_opposes(own->group, other->group) ||
		    vec3_distance(own->neutral_m, other->neutral_m) > NEIGHBOUR_DISTANCE_M)
			continue;
		double spread_m = spread_of(neutral, parts, part_count, marker, i);
		if (spread_m > 0)
			insert_neighbour(&own->learned,
					 (struct layout_neighbour){(int16_t)i, spread_m});
	}
}

void actor_learn(struct layout *layout, const struct actor_neutral *neutral,
		 const struct actor_part *parts, uint32_t part_count)
{
	for (uint32_t i = 0; i < layout->marker_count; i++)
		if (neutral->shots[i] && !layout->markers[i].segment[0])
			layout->markers[i].neutral_m = neutral->mean_m[i];
	for (uint32_t i = 0; i < layout->marker_count; i++) {
		struct layout_marker *marker = &layout->markers[i];
		struct motion_sums sums = {0};

		marker->learned = (struct layout_learned){0};
		if (!neutral->shots[i] || !on_face(marker))
			continue;
		for (uint32_t k = 0; k < part_count; k++)
			add_part(&sums, &parts[k], i, neutral->mean_m[i]);
		if (sums.count < SHOTS_MIN)
			continue;
		learn_motion(marker, &sums, neutral->sd_m[i]);
		learn_neighbours(layout, i, neutral, parts, part_count);
	}
}
