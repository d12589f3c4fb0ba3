/*
 * Takes from GetStatus what a demonstration shows; what is not there counts as 0.
 */
#include "demo/report.h"

#include <jansson.h>
#include <stdio.h>
#include <string.h>

#include "ctl/control_client.h"

static uint64_t count_of(const json_t *object, const char *key)
{
	return (uint64_t)json_integer_value(json_object_get(object, key));
}

static void read_hd(struct hd_report *to, const json_t *camera)
{
	const json_t *losses = json_object_get(camera, "losses");
	const json_t *hd = json_object_get(camera, "hd");

	snprintf(to->name, sizeof(to->name), "%s",
		 json_string_value(json_object_get(camera, "name")));
	to->frames = count_of(camera, "frames");
	to->lost = count_of(losses, "damaged") + count_of(losses, "wrong_size") +
		   count_of(losses, "wrong_time") + count_of(losses, "device_gaps") +
		   count_of(losses, "refused");
	to->off_phase = count_of(hd, "off_phase");
	to->phase_known = json_is_integer(json_object_get(hd, "phase"));
	to->phase = (uint32_t)count_of(hd, "phase");
}

static void read_cameras(struct station_report *report, const json_t *cameras)
{
	for (size_t c = 0; c < json_array_size(cameras); c++) {
		const json_t *camera = json_array_get(cameras, c);
		const char *role = json_string_value(json_object_get(camera, "role"));

		if (role && strcmp(role, "hd") == 0 && report->hd_count < REPORT_HD_MAX)
			read_hd(&report->hd[report->hd_count++], camera);
	}
}

void report_ask(struct station_report *report, const char *socket_dir)
{
	json_t *reply;

	memset(report, 0, sizeof(*report));
	if (control_ask(&reply, socket_dir, "org.stage.Control.GetStatus", NULL) != 0)
		return;
	const json_t *status = json_object_get(reply, "status");

	report->known = true;
	report->sim_late = count_of(status, "sim_late");
	read_cameras(report, json_object_get(status, "cameras"));
	json_decref(reply);
}
