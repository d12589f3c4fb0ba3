/*
 * Areas from JSON are from outside: whole numbers within an image.
 */
#include "protocol/mask_json.h"

#define AREA_END_MAX_PX 16384

json_t *mask_to_json(const struct mask *mask)
{
	json_t *areas = json_array();

	for (uint32_t a = 0; a < mask->area_count; a++)
		json_array_append_new(
			areas, json_pack("{s:i, s:i, s:i, s:i}", "x", mask->areas[a].x_px, "y",
					 mask->areas[a].y_px, "width", mask->areas[a].width_px,
					 "height", mask->areas[a].height_px));
	return areas;
}

/* A whole number in [low, high], or false. */
static bool read_px(const json_t *area, const char *key, int low, int high, int *out)
{
	const json_t *value = json_object_get(area, key);

	if (!json_is_integer(value) || json_integer_value(value) < low ||
	    json_integer_value(value) > high)
		return false;
	*out = (int)json_integer_value(value);
	return true;
}

bool mask_from_json(struct mask *out, const json_t *areas)
{
	struct mask mask = {.area_count = (uint32_t)json_array_size(areas)};

	if (!json_is_array(areas) || json_array_size(areas) > MASK_AREA_MAX)
		return false;
	for (uint32_t a = 0; a < mask.area_count; a++) {
		const json_t *from = json_array_get(areas, a);
		struct mask_area *to = &mask.areas[a];

		if (!read_px(from, "x", 0, AREA_END_MAX_PX - 1, &to->x_px) ||
		    !read_px(from, "y", 0, AREA_END_MAX_PX - 1, &to->y_px) ||
		    !read_px(from, "width", 1, AREA_END_MAX_PX, &to->width_px) ||
		    !read_px(from, "height", 1, AREA_END_MAX_PX, &to->height_px))
			return false;
	}
	*out = mask;
	return true;
}
