/*
 * What the aravis driver tells of a camera that runs: in numbers, and in words.
 */
#include <stdio.h>
#include <string.h>

#include "drivers/aravis/aravis_stream.h"

/* Aravis' own counts, which it keeps for a stream while that is there. */
int aravis_counts(const struct camera *base, struct camera_count out[CAMERA_COUNT_MAX])
{
	static const char *const names[] = {
		"n_completed_buffers", "n_failures",         "n_underruns",
		"n_missing_frames",    "n_received_packets", "n_missing_packets",
		"n_resend_requests",   "n_resent_packets",   "n_ignored_packets",
	};
	const struct aravis_camera *camera = (const struct aravis_camera *)base;
	int count = 0;

	for (guint i = 0; camera->stream && i < arv_stream_get_n_infos(camera->stream); i++)
		for (size_t n = 0; n < sizeof(names) / sizeof(names[0]); n++)
			if (strcmp(names[n], arv_stream_get_info_name(camera->stream, i)) == 0)
				out[count++] = (struct camera_count){
					names[n] + strlen("n_"),
					arv_stream_get_info_uint64(camera->stream, i)};
	return count;
}

int aravis_facts(const struct camera *base, struct camera_fact out[CAMERA_FACT_MAX])
{
	static const char *const receives[] = {
		[CAMERA_RECEIVE_SOCKET] = "from a plain socket",
		[CAMERA_RECEIVE_PACKETS] = "from a packet socket",
	};
	const struct aravis_camera *camera = (const struct aravis_camera *)base;
	bool falls_short = camera->wanted_receive != camera->mode.receive;

	if (!arv_camera_is_gv_device(camera->device))
		return 0;
	aravis_ptp_tell(&camera->ptp, &out[0]);
	out[1] = (struct camera_fact){.name = "receive", .falls_short = falls_short};
	snprintf(out[1].text, sizeof(out[1].text), "%s%s", receives[camera->mode.receive],
		 falls_short ? ": a packet socket is not permitted here (CAP_NET_RAW)" : "");
	out[2] = (struct camera_fact){.name = "resend"};
	snprintf(out[2].text, sizeof(out[2].text), "%s",
		 camera->resends ? "on" : "off: the camera cannot send packets again");
	return 3;
}
