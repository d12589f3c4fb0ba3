/*
 * The keys of `learned`.
 */
#include "config/layout_learned.h"

#include <math.h>
#include <stddef.h>
#include <string.h>

#define RANGE_MAX_M 0.2 /* no skin moves farther */

struct neighbour_entry {
	char name[NAME_BYTES];
	double spread_m;
};

static const struct yaml_key neighbour_keys[] = {
	{"name", YAML_NAME, offsetof(struct neighbour_entry, name), true, .size = NAME_BYTES},
	{"spread_m", YAML_DOUBLE, offsetof(struct neighbour_entry, spread_m), true, .min = 1e-6,
	 .max = RANGE_MAX_M, .unit = "metres"},
	{0},
};

/* What is read into. */
struct learned_reading {
	struct layout_learned learned;
	struct learned_names names;
};

static void read_corner(struct yaml *yaml, const struct yaml_value *value, struct vec3 *out)
{
	static const struct yaml_key coordinate = {"range", YAML_DOUBLE, .min = -RANGE_MAX_M,
						   .max = RANGE_MAX_M, .unit = "metres"};
	double numbers[3];

	if (yaml_read_numbers(yaml, value, &coordinate, numbers, 3))
		*out = (struct vec3){numbers[0], numbers[1], numbers[2]};
}

static void read_range_min(struct yaml *yaml, const struct yaml_value *value, void *target)
{
	read_corner(yaml, value, &((struct learned_reading *)target)->learned.range_min_m);
}

static void read_range_max(struct yaml *yaml, const struct yaml_value *value, void *target)
{
	struct layout_learned *l = &((struct learned_reading *)target)->learned;

	read_corner(yaml, value, &l->range_max_m);
	if (l->range_min_m.x > l->range_max_m.x || l->range_min_m.y > l->range_max_m.y ||
	    l->range_min_m.z > l->range_max_m.z)
		yaml_complain(yaml, value->place, value->field, "below range_min_m");
}

static void read_covariance(struct yaml *yaml, const struct yaml_value *value, void *target)
{
	static const struct yaml_key entry = {
		"cov_m2", YAML_DOUBLE, .min = -RANGE_MAX_M * RANGE_MAX_M,
		.max = RANGE_MAX_M * RANGE_MAX_M, .unit = "square metres"};
	struct layout_learned *l = &((struct learned_reading *)target)->learned;
	double c[6];

	if (!yaml_read_numbers(yaml, value, &entry, c, 6))
		return;
	if (c[0] < 0 || c[3] < 0 || c[5] < 0)
		yaml_complain(yaml, value->place, value->field,
			      "a variance is negative; the order is xx, xy, xz, yy, yz, zz");
	memcpy(l->cov_m2, c, sizeof(c));
}

static void read_neighbour(struct yaml *yaml, const struct yaml_value *value, void *target)
{
	struct learned_reading *r = target;
	struct neighbour_entry entry = {0};
	struct yaml_place places[2] = {0};
	int index = r->learned.neighbour_count;

	yaml_read_mapping(yaml, value, neighbour_keys, &entry, places);
	memcpy(r->names.names[index], entry.name, sizeof(entry.name));
	r->names.places[index] = places[0];
	r->learned.neighbours[index].spread_m = entry.spread_m;
	r->learned.neighbour_count = r->names.count = index + 1;
}

static void read_neighbours(struct yaml *yaml, const struct yaml_value *value, void *target)
{
	yaml_read_list(yaml, value, LEARNED_NEIGHBOUR_MAX, "neighbours", read_neighbour, target);
}

#define AT(member) offsetof(struct learned_reading, learned.member)

static const struct yaml_key keys[] = {
	{"range_min_m", YAML_CUSTOM, .required = true, .read = read_range_min},
	{"range_max_m", YAML_CUSTOM, .required = true, .read = read_range_max},
	{"speed_max_m_s", YAML_DOUBLE, AT(speed_max_m_s), true, .min = 0, .max = 100,
	 .unit = "metres per second"},
	{"rest_sd_m", YAML_DOUBLE, AT(rest_sd_m), true, .min = 0, .max = 0.01, .unit = "metres"},
	{"cov_m2", YAML_CUSTOM, .required = true, .read = read_covariance},
	{"neighbours", YAML_CUSTOM, .read = read_neighbours},
	{0},
};

void learned_read(struct yaml *yaml, const struct yaml_value *value, struct layout_learned *out,
		  struct learned_names *names)
{
	struct learned_reading reading = {0};

	yaml_read_mapping(yaml, value, keys, &reading, NULL);
	reading.learned.known = true;
	*out = reading.learned;
	*names = reading.names;
}

static int16_t find_marker(const struct layout *layout, const char *name)
{
	for (uint32_t i = 0; i < layout->marker_count; i++)
		if (strcmp(layout->markers[i].name, name) == 0)
			return (int16_t)i;
	return LABEL_NONE;
}

void learned_resolve(struct yaml *yaml, struct layout *layout, uint32_t index,
		     const struct learned_names *names)
{
	struct layout_learned *learned = &layout->markers[index].learned;
	char field[YAML_FIELD_BYTES];

	for (int k = 0; k < names->count; k++) {
		int16_t other = find_marker(layout, names->names[k]);

		learned->neighbours[k].marker = other;
		if (!names->names[k][0] || (other != LABEL_NONE && other != (int)index))
			continue;
		snprintf(field, sizeof(field), "markers[%u].learned.neighbours[%d].name", index, k);
		yaml_complain(yaml, names->places[k], field,
			      other == LABEL_NONE ? "'%s' is no marker of this file"
						  : "'%s' is this very marker",
			      names->names[k]);
	}
}
