/*
 * A shot's blobs and seeds, and points of one blob per camera.
 */
#include "track/match/match.h"

#include <stdbool.h>
#include <stddef.h>

#include "track/match/match_parts.h"
#include "track/match/sight_index.h"

#define PART_FROM_PX 0.2 /* the sigma of a part */

double match_sigma_px(const struct matcher *m, uint32_t camera, const struct blob *blob)
{
	return sqrt((double)blob->sigma_px * blob->sigma_px + m->camera_variance_px2[camera]);
}

/* Among parts of merged spots the only plain one is no surer than they are: it may be another's,
 * and nothing else is exact enough to tell. */
static void level_among_parts(struct sighting *sightings, int count)
{
	int plain = -1, part_count = 0;
	double sigma_px = INFINITY;

	for (int i = 0; i < count; i++)
		if (sightings[i].flags & BLOB_MERGED && sightings[i].sigma_px > PART_FROM_PX) {
			part_count++;
			sigma_px = fmin(sigma_px, sightings[i].sigma_px);
		} else {
			plain = i;
		}
	if (part_count >= 3 && part_count == count - 1)
		sightings[plain].sigma_px = sigma_px;
}

static int sightings_of(const struct matcher *m, const struct choice *choice,
			struct sighting out[CAMERA_MAX], int camera_of[CAMERA_MAX])
{
	int count = 0;

	for (uint32_t c = 0; c < m->camera_count; c++) {
		if (choice->blob[c] == BLOB_NONE)
			continue;
		const struct blob *b = &m->cameras[c].blobs[choice->blob[c]];
		out[count] =
			(struct sighting){m->cameras[c].view,
					  {b->x_px, b->y_px},
					  match_sigma_px(m, c, b),
					  b->flags,
					  choice->outvoted_mask >> c & 1,
					  choice->seed >= 0 ? &m->seen[c][choice->seed] : NULL};
		camera_of[count++] = (int)c;
	}
	level_among_parts(out, count);
	return count;
}

bool point_from_choice(const struct matcher *m, const struct choice *choice, struct point *out)
{
	struct sighting sightings[CAMERA_MAX];
	int camera_of[CAMERA_MAX], count = sightings_of(m, choice, sightings, camera_of);
	struct fix fix;

	if (count < 2 || triangulate(sightings, count, &choice->guess_stage_m, &fix))
		return false;
	out->fix = fix;
	out->fix.used_mask = 0;
	out->claimed_mask = 0;
	out->label = LABEL_NONE;
	out->outvoted_mask = choice->outvoted_mask;
	out->is_pressed = false;
	for (int i = 0; i < count; i++) {
		if (fix.used_mask & (1u << i))
			out->fix.used_mask |= 1u << camera_of[i];
		out->claimed_mask |= 1u << camera_of[i];
		out->blob[camera_of[i]] = choice->blob[camera_of[i]];
	}
	return true;
}

bool point_in_range(const struct matcher *m, struct vec3 p, uint32_t camera_mask)
{
	for (uint32_t c = 0; c < m->camera_count; c++) {
		if (!(camera_mask & (1u << c)))
			continue;
		double range_m = vec3_distance(p, m->cameras[c].view->centre_stage_m);
		if (range_m < m->settings->range_min_m || range_m > m->settings->range_max_m)
			return false;
	}
	return true;
}

/* Three views agree by chance more easily than four: they must agree better. */
bool point_confirmed(const struct matcher *m, const struct point *point, int least_views)
{
	double gate_px = m->settings->match_gate_px;

	if (point->fix.used_count < least_views)
		return false;
	if (point->fix.used_count <= 3)
		gate_px = fmax(0.5 * gate_px, fmin(gate_px, 4 * sqrt(m->view_variance_px2)));
	return point->fix.residual_px <= gate_px &&
	       point_in_range(m, point->fix.p_stage_m, point->fix.used_mask);
}

void add_candidate(struct matcher *m, const struct point *point)
{
	if (m->candidate_count < CANDIDATE_MAX)
		m->candidates[m->candidate_count++] = *point;
}

void match_begin(struct matcher *m, const struct tracker_rig *rig, const struct view_excess *excess,
		 const struct shot *shot)
{
	double calibration_px = rig->settings.calibration_sigma_px;

	m->settings = &rig->settings;
	m->view_variance_px2 = fmax(calibration_px * calibration_px, excess->all_px2);
	m->camera_count = rig->camera_count;
	m->point_count = 0;
	m->candidate_count = 0;
	for (uint32_t c = 0; c < rig->camera_count; c++) {
		m->cameras[c].view = NULL;
		m->camera_variance_px2[c] = m->view_variance_px2 + excess->camera_px2[c];
		if (rig->views[c] && shot->sets[c])
			sight_index_build(&m->cameras[c], rig->views[c], shot->sets[c]->blobs,
					  (int)shot->sets[c]->blob_count);
	}
}

void match_prepare(struct matcher *m, const struct tracker_rig *rig, const struct seed *seeds,
		   int count)
{
	m->seed_count = count < SEED_MAX ? count : SEED_MAX;
	m->camera_count = rig->camera_count;
	for (uint32_t i = 0; i < LABEL_MAX && i < rig->layout->marker_count; i++)
		m->seed_of_label[i] = -1;
	for (int i = 0; i < m->seed_count; i++) {
		m->seeds[i] = seeds[i];
		m->seed_stage_m[i] = seeds[i].p_stage_m;
		if (seeds[i].label != LABEL_NONE)
			m->seed_of_label[seeds[i].label] = (int16_t)i;
	}
	for (uint32_t c = 0; c < m->camera_count; c++)
		if (rig->views[c])
			view_project_many(rig->views[c], m->seed_stage_m, m->seed_count, m->seen[c],
					  m->in_sight[c]);
}

static void carry_on(const struct projection *q, struct vec3 d, double pixel[2])
{
	for (int k = 0; k < 2; k++)
		pixel[k] = q->pixel[k] + q->slopes[k][0] * d.x + q->slopes[k][1] * d.y +
			   q->slopes[k][2] * d.z;
}

bool project_near(const struct matcher *m, uint32_t c, struct vec3 p, int index, double pixel[2])
{
	const struct view *view = m->cameras[c].view;

	if (index >= 0) {
		struct vec3 d = vec3_sub(p, m->seeds[index].p_stage_m);

		if (vec3_dot(d, d) < SLOPES_REACH_M * SLOPES_REACH_M) {
			carry_on(&m->seen[c][index], d, pixel);
			return m->in_sight[c][index];
		}
	}
	return view_project(view, p, pixel, NULL);
}
