/*
 * A table of rules in an order in which each takes what those before have left.
 */
#include "calib/actor/actor_points.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define MIDDLE_M 0.004 /* a marker nearer to the symmetry plane is in the middle */

enum side { LEFT = 1, MIDDLE = 0, RIGHT = -1 }; /* the subject's */

struct rule {
	const char *point, *group;
	enum side side;
	double toward[3];    /* of the group's markers on this side, the farthest that way ... */
	const char *between; /* ... or, not NULL, the nearest to the middle of these two points */
	int count_min;       /* markers of group and side, for the point to be one of them */
};

static const struct rule RULES[] = {
	{"8.1", "lip_upper", MIDDLE, {0, -1, 0}, NULL, 1},
	{"8.2", "lip_lower", MIDDLE, {0, -1, 0}, NULL, 1},
	{"8.3", "lip_corner", LEFT, {1, 0, 0}, NULL, 1},
	{"8.4", "lip_corner", RIGHT, {-1, 0, 0}, NULL, 1},
	{"8.10", "lip_upper", LEFT, {-1, -1, 0}, NULL, 2},
	{"8.9", "lip_upper", RIGHT, {1, -1, 0}, NULL, 2},
	{"8.5", "lip_upper", LEFT, {0}, "8.1 8.3", 1},
	{"8.6", "lip_upper", RIGHT, {0}, "8.1 8.4", 1},
	{"8.7", "lip_lower", LEFT, {0}, "8.2 8.3", 1},
	{"8.8", "lip_lower", RIGHT, {0}, "8.2 8.4", 1},
	{"4.1", "brow", LEFT, {-1, 0, 0}, NULL, 2},
	{"4.2", "brow", RIGHT, {1, 0, 0}, NULL, 2},
	{"4.5", "brow", LEFT, {1, 0, 0}, NULL, 2},
	{"4.6", "brow", RIGHT, {-1, 0, 0}, NULL, 2},
	{"4.3", "brow", LEFT, {0, 1, 0}, NULL, 3},
	{"4.4", "brow", RIGHT, {0, 1, 0}, NULL, 3},
	{"3.9", "lid", LEFT, {0, -1, 0}, NULL, 2},
	{"3.10", "lid", RIGHT, {0, -1, 0}, NULL, 2},
	{"9.3", "nose", MIDDLE, {0, 0, 1}, NULL, 1},
	{"9.1", "nose", LEFT, {0, -1, 0}, NULL, 1},
	{"9.2", "nose", RIGHT, {0, -1, 0}, NULL, 1},
	{"2.10", "chin", MIDDLE, {0, 0, 1}, NULL, 1},
	{"2.1", "chin", MIDDLE, {0, -1, 0}, NULL, 2},
	{"2.13", "jaw", LEFT, {1, 0, 0}, NULL, 2},
	{"2.14", "jaw", RIGHT, {-1, 0, 0}, NULL, 2},
	{"2.11", "jaw", LEFT, {-1, 0, 0}, NULL, 2},
	{"2.12", "jaw", RIGHT, {1, 0, 0}, NULL, 2},
	{"5.3", "cheek", LEFT, {0.5, 1, 0}, NULL, 3},
	{"5.4", "cheek", RIGHT, {-0.5, 1, 0}, NULL, 3},
	{"5.1", "cheek", LEFT, {0}, "5.3 8.3", 2},
	{"5.2", "cheek", RIGHT, {0}, "5.4 8.4", 2},
};

static enum side side_of(const struct layout_marker *marker)
{
	double x_m = marker->neutral_m.x;

	return fabs(x_m) < MIDDLE_M ? MIDDLE : x_m > 0 ? LEFT : RIGHT;
}

static bool find_point(const struct layout *layout, const char *point, struct vec3 *p_m)
{
	for (uint32_t i = 0; i < layout->marker_count; i++)
		if (strcmp(layout->markers[i].mpeg4, point) == 0) {
			*p_m = layout->markers[i].neutral_m;
			return true;
		}
	return false;
}

/* The middle of two points that are named already. */
static bool find_middle(const struct layout *layout, const char *between, struct vec3 *middle_m)
{
	char a[MPEG4_BYTES], b[MPEG4_BYTES];
	struct vec3 a_m, b_m;

	if (sscanf(between, "%5s %5s", a, b) != 2 || !find_point(layout, a, &a_m) ||
	    !find_point(layout, b, &b_m))
		return false;
	*middle_m = vec3_scale(vec3_add(a_m, b_m), 0.5);
	return true;
}

static double score_of(const struct rule *rule, struct vec3 p_m, struct vec3 middle_m)
{
	const struct vec3 toward = {rule->toward[0], rule->toward[1], rule->toward[2]};

	return rule->between ? -vec3_distance(p_m, middle_m) : vec3_dot(toward, p_m);
}

static bool apply(const struct rule *rule, struct layout *layout)
{
	struct vec3 middle_m = {0, 0, 0}, taken_m;
	struct layout_marker *best = NULL;
	int count = 0;

	if (find_point(layout, rule->point, &taken_m) ||
	    (rule->between && !find_middle(layout, rule->between, &middle_m)))
		return false;
	for (uint32_t i = 0; i < layout->marker_count; i++) {
		struct layout_marker *marker = &layout->markers[i];

		if (strcmp(marker->group, rule->group) != 0 || side_of(marker) != rule->side)
			continue;
		count++;
		if (!marker->mpeg4[0] &&
		    (!best || score_of(rule, marker->neutral_m, middle_m) >
				      score_of(rule, best->neutral_m, middle_m)))
			best = marker;
	}
	if (!best || count < rule->count_min)
		return false;
	snprintf(best->mpeg4, sizeof(best->mpeg4), "%s", rule->point);
	return true;
}

int actor_points_name(struct layout *layout)
{
	int named = 0;

	for (size_t r = 0; r < sizeof(RULES) / sizeof(RULES[0]); r++)
		named += apply(&RULES[r], layout);
	return named;
}
