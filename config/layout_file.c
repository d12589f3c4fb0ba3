/*
 * The keys of a layout file and what makes a set of markers usable.
 */
#include "config/layout_file.h"

#include <errno.h>
#include <stddef.h>
#include <string.h>

#include "config/layout_learned.h"
#include "config/yaml.h"

#define LAYOUT_SIZE_MAX (1 << 20)
#define MARKERS_MIN 4   /* a rigid pose needs three; one may be hidden */
#define HEAD_MIN 3      /* a body is found from its head */
#define REACH_MAX_M 2.0 /* of a marker from the head's origin, feet included */
#define APART_MIN_M 0.0005
#define DIAMETER_M 0.0015 /* what faces usually wear */

/* What is read into: the layout, and where each marker stands. */
struct reading {
	struct layout layout;
	int version;
	char calibrated[NAME_BYTES]; /* when: for people */
	struct yaml_place names[LABEL_MAX];
	struct yaml_place neutrals[LABEL_MAX];
	struct learned_names neighbours[LABEL_MAX];
};

/* ... and one marker of it. */
struct reading_marker {
	struct layout_marker marker;
	struct learned_names neighbours;
};

static const struct yaml_key coordinate = {"neutral_m", YAML_DOUBLE, .min = -1e6, .max = 1e6,
					   .unit = "metres"};

static void read_neutral(struct yaml *yaml, const struct yaml_value *value, void *target)
{
	struct layout_marker *marker = &((struct reading_marker *)target)->marker;
	double numbers[3];

	if (!yaml_read_numbers(yaml, value, &coordinate, numbers, 3))
		return;
	marker->neutral_m = (struct vec3){numbers[0], numbers[1], numbers[2]};
	if (vec3_norm(marker->neutral_m) > REACH_MAX_M)
		yaml_complain(yaml, value->place, value->field,
			      "%.4g m away from the head; coordinates are in metres, are these "
			      "millimetres?",
			      vec3_norm(marker->neutral_m));
}

static void read_learned(struct yaml *yaml, const struct yaml_value *value, void *target)
{
	struct reading_marker *reading = target;

	learned_read(yaml, value, &reading->marker.learned, &reading->neighbours);
}

static void read_mpeg4(struct yaml *yaml, const struct yaml_value *value, void *target)
{
	static const struct yaml_key text = {"mpeg4", YAML_TEXT, .size = MPEG4_BYTES};
	struct layout_marker *marker = &((struct reading_marker *)target)->marker;
	unsigned int group, point;
	int length = 0;

	yaml_read_scalar(yaml, value, &text, marker->mpeg4);
	if (!marker->mpeg4[0])
		return;
	if (sscanf(marker->mpeg4, "%2u.%2u%n", &group, &point, &length) != 2 ||
	    marker->mpeg4[length] || group < 2 || group > 11 || point < 1 || point > 15)
		yaml_complain(yaml, value->place, value->field,
			      "'%s' is no feature point of MPEG-4: those are 2.1 to 11.6",
			      marker->mpeg4);
}

#define AT(member) offsetof(struct reading_marker, marker.member)

static const struct yaml_key marker_keys[] = {
	{"name", YAML_NAME, AT(name), true, .size = NAME_BYTES},
	{"neutral_m", YAML_CUSTOM, .required = true, .read = read_neutral},
	{"group", YAML_NAME, AT(group), .size = NAME_BYTES},
	{"rigid", YAML_BOOL, .offset = AT(rigid)},
	{"diameter_m", YAML_DOUBLE, AT(diameter_m), .min = 0.0002, .max = 0.1, .unit = "metres"},
	{"segment", YAML_NAME, AT(segment), .size = NAME_BYTES},
	{"mpeg4", YAML_CUSTOM, .read = read_mpeg4},
	{"learned", YAML_CUSTOM, .read = read_learned},
	{0},
};

enum {
	MARKER_NAME,
	MARKER_NEUTRAL,
	MARKER_RIGID = 3,
	MARKER_KEY_COUNT = 8,
};

/* Compares marker `index` with those before it. */
static void check_alone(struct yaml *yaml, const struct reading *r, uint32_t index)
{
	const struct layout_marker *marker = &r->layout.markers[index];
	char field[YAML_FIELD_BYTES];

	for (uint32_t i = 0; i < index; i++) {
		const struct layout_marker *other = &r->layout.markers[i];

		if (r->names[i].line && strcmp(marker->name, other->name) == 0 && *marker->name) {
			snprintf(field, sizeof(field), "markers[%u].name", index);
			yaml_complain(yaml, r->names[index], field,
				      "'%s' is already the name of the marker in line %d",
				      marker->name, r->names[i].line);
		}
		if (r->neutrals[index].line && r->neutrals[i].line &&
		    vec3_distance(marker->neutral_m, other->neutral_m) < APART_MIN_M) {
			snprintf(field, sizeof(field), "markers[%u].neutral_m", index);
			yaml_complain(yaml, r->neutrals[index], field,
				      "less than 0.5 mm from marker '%s' in line %d", other->name,
				      r->neutrals[i].line);
		}
	}
}

/* The skull is the head's, and a segment has its own stiffness. */
static void check_segment(struct yaml *yaml, const struct reading *r, uint32_t index,
			  const struct yaml_place *places)
{
	const struct layout_marker *marker = &r->layout.markers[index];
	char field[YAML_FIELD_BYTES];

	if (!marker->rigid || !marker->segment[0])
		return;
	snprintf(field, sizeof(field), "markers[%u].rigid", index);
	yaml_complain(yaml, places[MARKER_RIGID], field,
		      "rigid is of markers on the skull; this one is of segment '%s', which is "
		      "rigid anyway: leave it out",
		      marker->segment);
}

static void read_marker(struct yaml *yaml, const struct yaml_value *value, struct reading *r)
{
	uint32_t index = r->layout.marker_count;
	struct yaml_place places[MARKER_KEY_COUNT + 1];
	struct reading_marker reading = {.marker.diameter_m = DIAMETER_M};
	bool failed_before = yaml->failed;

	memset(places, 0, sizeof(places));
	yaml->failed = false;
	yaml_read_mapping(yaml, value, marker_keys, &reading, places);
	r->layout.markers[index] = reading.marker;
	r->neighbours[index] = reading.neighbours;
	r->names[index] = places[MARKER_NAME];
	if (!yaml->failed) /* else the place may not be what the file meant */
		r->neutrals[index] = places[MARKER_NEUTRAL];
	yaml->failed |= failed_before;
	check_alone(yaml, r, index);
	check_segment(yaml, r, index, places);
	r->layout.marker_count++;
}

/* A segment's first marker is where a later one finds its name. */
static uint32_t count_segments(const struct layout *layout)
{
	uint32_t count = 0;

	for (uint32_t i = 0; i < layout->marker_count; i++) {
		const char *segment = layout->markers[i].segment;
		uint32_t k = 0;

		while (k < i && strcmp(layout->markers[k].segment, segment) != 0)
			k++;
		count += *segment && k == i;
	}
	return count;
}

static uint32_t count_on_head(const struct layout *layout)
{
	uint32_t count = 0;

	for (uint32_t i = 0; i < layout->marker_count; i++)
		count += !layout->markers[i].segment[0];
	return count;
}

static void read_markers(struct yaml *yaml, const struct yaml_value *value, void *target)
{
	struct reading *r = target;
	struct yaml_value item;
	char field[YAML_FIELD_BYTES];
	void *iterator = NULL;
	int index = -1;

	while (yaml_next_item(yaml, value, &iterator, &index, &item, field)) {
		if (index == LABEL_MAX) {
			yaml_complain(yaml, item.place, item.field, "more than %d markers",
				      LABEL_MAX);
			return;
		}
		read_marker(yaml, &item, r);
	}
	for (uint32_t i = 0; i < r->layout.marker_count; i++)
		learned_resolve(yaml, &r->layout, i, &r->neighbours[i]);
	if (fy_node_is_sequence(value->node) && index + 1 < MARKERS_MIN)
		yaml_complain(yaml, value->place, value->field,
			      "%d markers, but a head needs at least %d", index + 1, MARKERS_MIN);
	else if (fy_node_is_sequence(value->node) && count_on_head(&r->layout) < HEAD_MIN)
		yaml_complain(yaml, value->place, value->field,
			      "%u markers on the head, which carries the body: it needs at least "
			      "%d; put some on a head band, with rigid: true and without segment",
			      count_on_head(&r->layout), HEAD_MIN);
	if (count_segments(&r->layout) > SEGMENT_MAX)
		yaml_complain(yaml, value->place, value->field,
			      "%u segments, but a body may have at most %d",
			      count_segments(&r->layout), SEGMENT_MAX);
}

static const struct yaml_key keys[] = {
	{"version", YAML_INT, offsetof(struct reading, version), .min = 1, .max = 1},
	{"calibrated", YAML_TEXT, offsetof(struct reading, calibrated), .size = NAME_BYTES},
	{"markers", YAML_CUSTOM, .required = true, .read = read_markers},
	{"actor", YAML_NAME, offsetof(struct reading, layout.actors[0].name), .size = NAME_BYTES},
	{0},
};

int layout_load(struct layout *layout, const char *path, struct diag *diag)
{
	static struct reading reading; /* control thread only; too large for its stack */
	struct yaml yaml;
	int err = yaml_open(&yaml, path, LAYOUT_SIZE_MAX, diag);

	if (err)
		return err;
	struct yaml_value root = yaml_root(&yaml);

	memset(&reading, 0, sizeof(reading));
	yaml_read_mapping(&yaml, &root, keys, &reading, NULL);
	err = yaml.failed ? -EINVAL : 0;
	yaml_close(&yaml);
	reading.layout.actor_count = 1;
	reading.layout.actors[0].count = reading.layout.marker_count;
	if (!err)
		*layout = reading.layout;
	return err;
}

/* Why an actor cannot join the others, or NULL. */
static const char *cannot_join(const struct layout *all, const struct layout *one)
{
	if (all->actor_count == ACTOR_MAX)
		return "too many actors";
	if (all->marker_count + one->marker_count > LABEL_MAX)
		return "too many markers of all actors together";
	if (all->actor_count > 0 && !(one->actors[0].name[0] && all->actors[0].name[0]))
		return "actor: missing here or in the first layout; each of several names its own";
	for (uint32_t a = 0; a < all->actor_count; a++)
		if (strcmp(all->actors[a].name, one->actors[0].name) == 0)
			return "actor: an earlier layout has this name";
	return NULL;
}

int layout_join(struct layout *all, const struct layout *one, const char *path, struct diag *diag)
{
	const char *why = cannot_join(all, one);

	if (why) {
		diag_add(diag, "%s: %s", path, why);
		return -EINVAL;
	}
	struct layout_actor *actor = &all->actors[all->actor_count++];
	*actor = one->actors[0];
	actor->first = all->marker_count;
	memcpy(all->markers + all->marker_count, one->markers,
	       one->marker_count * sizeof(one->markers[0]));
	all->marker_count += one->marker_count;
	return 0;
}
