/*
 * A solved shot over the control socket: what every camera saw and what was made of it.
 */
#include "daemon/control/control_methods.h"

json_t *control_observe(struct call *call)
{
	struct station *station = call->context->station;

	if (station->state != STATION_RUNNING)
		return wrong_state(call);
	shot_copy_request(&station->shot_copy);
	call->wait->kind = WAIT_SHOT;
	return NULL;
}

static json_t *spots_json(const struct blob_set *set)
{
	json_t *spots = json_array();

	for (uint32_t b = 0; b < set->blob_count; b++) {
		const struct blob *blob = &set->blobs[b];

		json_array_append_new(spots, json_pack("[f, f, f, i]", (double)blob->x_px,
						       (double)blob->y_px, (double)blob->sigma_px,
						       (int)blob->flags));
	}
	return spots;
}

static json_t *markers_json(const struct marker_set *set)
{
	json_t *markers = json_array();

	for (uint32_t m = 0; m < set->marker_count; m++) {
		const struct marker *marker = &set->markers[m];

		if (marker->status >= MARKER_TWO_CAMERA)
			json_array_append_new(markers,
					      json_pack("[i, i, I, f, f, f]", (int)marker->label,
							(int)marker->status,
							(json_int_t)marker->camera_mask,
							marker->p_stage_m.x, marker->p_stage_m.y,
							marker->p_stage_m.z));
	}
	return markers;
}

json_t *observe_reply(const struct station *station, bool ready)
{
	const struct shot_copy *copy = &station->shot_copy;
	json_t *cameras = json_array();

	if (!ready) {
		json_decref(cameras);
		return varlink_error("org.stage.Control.NoShot", json_object());
	}
	for (uint32_t c = 0; c < station->stage.config.camera_count; c++)
		json_array_append_new(cameras, copy->present_mask >> c & 1
						       ? spots_json(&copy->sets[c])
						       : json_null());
	return varlink_result(json_pack(
		"{s:I, s:I, s:i, s:o, s:o}", "shot", (json_int_t)copy->set.shot, "mid_exposure_ns",
		(json_int_t)copy->set.mid_exposure_ns, "rig_serial", (int)copy->set.rig_serial,
		"cameras", cameras, "markers", markers_json(&copy->set)));
}
