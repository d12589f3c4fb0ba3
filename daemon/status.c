/*
 * GetStatus: everything an operator or a test wants to know, losses by cause.
 */
#include <string.h>

#include "base/clock.h"
#include "daemon/control_methods.h"
#include "daemon/watchdog.h"
#include "sim/world.h"

static void set_count(json_t *object, const char *key, const _Atomic uint64_t *counter)
{
	json_object_set_new(object, key, json_integer((json_int_t)atomic_load(counter)));
}

static json_t *losses_json(const struct capture_counters *counters)
{
	json_t *losses = json_object();

	set_count(losses, "damaged", &counters->damaged);
	set_count(losses, "wrong_size", &counters->wrong_size);
	set_count(losses, "wrong_time", &counters->wrong_time);
	set_count(losses, "device_gaps", &counters->device_gaps);
	set_count(losses, "refused", &counters->refused);
	set_count(losses, "before_start", &counters->before_start);
	set_count(losses, "stale", &counters->stale);
	set_count(losses, "timeouts", &counters->timeouts);
	set_count(losses, "blobs_lost", &counters->blobs_lost);
	return losses;
}

/* Every event that the pulse ledger names, then what holds now, and the last event. */
static json_t *ledger_json(const struct camera_events *events)
{
	bool any = atomic_load(&events->total) != 0;
	uint32_t last = atomic_load(&events->last_event);
	json_t *counts = json_object();

	for (int e = 0; e < LEDGER_EVENT_COUNT; e++)
		set_count(counts, ledger_event_name((enum ledger_event)e), &events->counts[e]);
	return json_pack(
		"{s:o, s:b, s:b, s:b, s:f, s:o, s:o}", "events", counts, "slower_than_trigger",
		atomic_load(&events->slower), "out_of_step", atomic_load(&events->out_of_step),
		"dark", atomic_load(&events->dark), "after_edge_us",
		(double)atomic_load(&events->after_edge_ns) / NS_PER_US, "last_event",
		any ? json_string(ledger_event_name(last)) : json_null(), "last_event_shot",
		any ? json_integer((json_int_t)atomic_load(&events->last_shot)) : json_null());
}

/* Of the newest frame whose shot is known: null before. */
static json_t *hd_json(const struct station *station, const struct capture *capture)
{
	const struct hd_capture *hd = &capture->hd;
	uint64_t divider = (uint64_t)station->stage.config.plan.hd_divider;
	uint64_t shot = atomic_load(&hd->last_shot);
	bool known = shot != SHOT_UNKNOWN;
	json_t *json =
		json_pack("{s:i, s:o, s:o, s:o}", "slots", (int)hd->pool.slot_count, "shot",
			  known ? json_integer((json_int_t)shot) : json_null(), "index",
			  known ? json_integer((json_int_t)(shot / divider)) : json_null(), "phase",
			  known ? json_integer((json_int_t)(shot % divider)) : json_null());

	set_count(json, "off_phase", &hd->off_phase);
	return json;
}

static json_t *camera_json(const struct station *station, uint32_t index)
{
	const struct config_camera *named = &station->stage.config.cameras[index];
	const struct capture *capture = &station->captures[index];
	const struct camera_mode *granted = &capture->device.granted;
	const struct camera_rate *rate = &station->statistics.cameras[index];
	json_t *camera =
		json_pack("{s:s, s:s, s:s, s:s, s:i, s:i, s:f, s:f, s:o}", "name", capture->name,
			  "address", named->address, "role", capture->role == ROLE_IR ? "ir" : "hd",
			  "state", capture_state_name(atomic_load(&capture->state)), "width_px",
			  granted->width_px, "height_px", granted->height_px, "frames_per_s",
			  rate->frames_per_s, "blobs_per_frame", rate->blobs_per_frame, "losses",
			  losses_json(&capture->counters));

	set_count(camera, "frames", &capture->counters.frames);
	set_count(camera, "missing", &capture->counters.missing);
	if (capture->role == ROLE_HD)
		json_object_set_new(camera, "hd", hd_json(station, capture));
	json_object_set_new(camera, "ledger", ledger_json(&station->solver.book.cameras[index]));
	set_count(camera, "reopened", &capture->counters.reopened);
	json_object_set_new(camera, "fifo", json_boolean(capture->thread.fifo_granted));
	return camera;
}

static json_t *cameras_json(const struct station *station)
{
	json_t *cameras = json_array();

	for (uint32_t c = 0; c < station->stage.config.camera_count; c++)
		json_array_append_new(cameras, camera_json(station, c));
	return cameras;
}

static json_t *shots_json(const struct station *station)
{
	json_t *shots = json_pack("{s:f}", "per_s", station->statistics.shots_per_s);

	set_count(shots, "solved", &station->solver.shots);
	set_count(shots, "incomplete", &station->solver.incomplete);
	set_count(shots, "lost", &station->solver.lost);
	set_count(shots, "edges", &station->pulses.edges_count);
	set_count(shots, "edges_refused", &station->pulses.edges_refused);
	return shots;
}

static json_t *subscribers_json(const struct server_stats *stats, int64_t now_ns)
{
	json_t *subscribers = json_array();

	for (uint32_t s = 0; s < stats->subscriber_count; s++) {
		const struct subscriber_stats *one = &stats->subscribers[s];

		json_array_append_new(subscribers,
				      json_pack("{s:i, s:f, s:I, s:I, s:i}", "pid", (int)one->pid,
						"connected_s",
						(double)(now_ns - one->connected_ns) / NS_PER_S,
						"sets_queued", (json_int_t)one->sets_queued,
						"sets_lost", (json_int_t)one->sets_lost,
						"queued_bytes", (int)one->queued_bytes));
	}
	return subscribers;
}

static json_t *stream_json(const struct server *server, int64_t now_ns)
{
	struct server_stats stats = {0};

	if (server)
		server_stats(server, &stats);
	return json_pack("{s:I, s:I, s:I, s:I, s:I, s:o}", "sets_published",
			 (json_int_t)stats.sets_published, "sets_lost", (json_int_t)stats.sets_lost,
			 "accepted", (json_int_t)stats.accepted_count, "refused",
			 (json_int_t)stats.refused_count, "cut_off",
			 (json_int_t)stats.cut_off_count, "subscribers",
			 subscribers_json(&stats, now_ns));
}

static uint64_t sim_late_count(const struct station *station)
{
	uint64_t late = 0;

	if (!station->world_open)
		return 0;
	uint32_t count =
		sim_scene_camera_count(sim_world_scene()) + sim_scene_hd_count(sim_world_scene());

	for (uint32_t c = 0; c < count; c++)
		late += sim_world_late_count(c);
	return late;
}

static double uptime_s(const struct station *station, int64_t now_ns)
{
	bool captures = station_state_captures(station->state);

	return captures ? (double)(now_ns - station->started_ns) / NS_PER_S : 0;
}

json_t *station_status_json(const struct control_context *context)
{
	const struct station *station = context->station;
	const struct control_stats *control = context->stats;
	int64_t now_ns = clock_now_ns();

	json_t *status = json_pack(
		"{s:s, s:s, s:f, s:s, s:s, s:s, s:b, s:b, s:o, s:I, s:{s:f, s:f}, s:o, s:o, "
		"s:{s:I, s:I, s:I}}",
		"state", station_state_name(station->state), "version", STAGE_VERSION, "uptime_s",
		uptime_s(station, now_ns), "config", station->stage.config.path, "rig_revision",
		rig_swap_revision(&station->rig_swap, station->rig_swap.current->serial), "trigger",
		station->stage.config.trigger, "fifo", station_is_realtime(station),
		"memory_locked", station->memory_locked, "shots", shots_json(station), "sim_late",
		(json_int_t)sim_late_count(station), "latency_ms", "p50",
		(double)statistics_latency_ns(&station->statistics, 0.5) / NS_PER_MS, "p99",
		(double)statistics_latency_ns(&station->statistics, 0.99) / NS_PER_MS, "cameras",
		cameras_json(station), "stream", stream_json(context->server, now_ns), "control",
		"accepted", (json_int_t)control->accepted_count, "refused",
		(json_int_t)control->refused_count, "cut_off", (json_int_t)control->cut_off_count);
	json_object_set_new(status, "stalled", stalled_json(context->station));
	return status;
}
