/*
 * What changes while the station runs: the rig as a whole, and each camera's mask.
 */
#include <errno.h>
#include <string.h>

#include "base/log.h"
#include "daemon/control/control_methods.h"

#define AREA_END_MAX_PX 16384

static json_t *busy(void)
{
	return varlink_error("org.stage.Control.Busy", json_object());
}

json_t *control_reload_rig(struct call *call)
{
	struct station *station = call->context->station;

	if (station->state == STATION_IDLE)
		return wrong_state(call);
	int err = rig_swap_begin(&station->rig_swap);
	if (err == -EBUSY)
		return busy();
	if (err) {
		struct diag diag = {0};

		diag_add(&diag, "cannot start a thread: %s", strerror(-err));
		json_t *reply = failed_reply(EXIT_CODE_INTERNAL, &diag);
		diag_finish(&diag);
		return reply;
	}
	call->wait->kind = WAIT_RIG;
	return NULL;
}

json_t *rig_reply(const struct station *station, enum rig_swap_state state)
{
	const struct rig_swap *swap = &station->rig_swap;
	uint32_t serial = swap->current->serial;

	if (state == RIG_SWAP_FAILED)
		return failed_reply(exit_code_of(swap->error, EXIT_CODE_BAD_INPUT), &swap->diag);
	return varlink_result(json_pack("{s:s, s:i}", "rig_revision",
					rig_swap_revision(swap, serial), "rig_serial",
					(int)serial));
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

static bool read_mask(const json_t *areas, struct mask *mask)
{
	if (!json_is_array(areas) || json_array_size(areas) > MASK_AREA_MAX)
		return false;
	*mask = (struct mask){.area_count = (uint32_t)json_array_size(areas)};
	for (uint32_t a = 0; a < mask->area_count; a++) {
		const json_t *from = json_array_get(areas, a);
		struct mask_area *to = &mask->areas[a];

		if (!read_px(from, "x", 0, AREA_END_MAX_PX - 1, &to->x_px) ||
		    !read_px(from, "y", 0, AREA_END_MAX_PX - 1, &to->y_px) ||
		    !read_px(from, "width", 1, AREA_END_MAX_PX, &to->width_px) ||
		    !read_px(from, "height", 1, AREA_END_MAX_PX, &to->height_px))
			return false;
	}
	return true;
}

json_t *control_set_mask(struct call *call)
{
	const char *name = json_string_value(json_object_get(call->parameters, "camera"));
	struct station *station = call->context->station;
	struct mask mask;
	int index;

	if (!name)
		return varlink_invalid_parameter("camera");
	struct capture *capture = find_camera(station, name, &index);
	if (!capture)
		return no_such_camera(station, name);
	if (capture->role != ROLE_IR)
		return varlink_invalid_parameter("camera");
	if (!read_mask(json_object_get(call->parameters, "areas"), &mask))
		return varlink_invalid_parameter("areas");
	if (capture_set_mask(capture, &mask) < 0)
		return busy();
	log_info("camera %s: %u masked areas", capture->name, mask.area_count);
	return varlink_result(json_object());
}
