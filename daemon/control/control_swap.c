/*
 * What changes while the station runs: the rig as a whole, and each camera's mask.
 */
#include <errno.h>
#include <string.h>

#include "base/log.h"
#include "daemon/control/control_methods.h"
#include "protocol/mask_json.h"

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

json_t *control_set_mask(struct call *call)
{
	json_t *refusal;
	struct mask mask;
	struct capture *capture = named_camera(call, &refusal);

	if (!capture)
		return refusal;
	if (capture->role != ROLE_IR)
		return varlink_invalid_parameter("camera");
	if (!mask_from_json(&mask, json_object_get(call->parameters, "areas")))
		return varlink_invalid_parameter("areas");
	if (capture_set_mask(capture, &mask) < 0)
		return busy();
	log_info("camera %s: %u masked areas", capture->name, mask.area_count);
	return varlink_result(json_object());
}
