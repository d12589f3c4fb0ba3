/*
 * GetStatus: everything an operator or a test wants to know, losses by cause.
 */
#include <limits.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "daemon/accounts.h"
#include "daemon/control/control_methods.h"
#include "protocol/mask_json.h"

static void set_count(json_t *object, const char *key, const _Atomic uint64_t *counter)
{
	json_object_set_new(object, key, json_integer((json_int_t)atomic_load(counter)));
}

static json_t *counts_json(const struct stream_count *counts, uint32_t count)
{
	json_t *object = json_object();

	for (uint32_t i = 0; i < count; i++)
		json_object_set_new(object, counts[i].cause,
				    json_integer((json_int_t)counts[i].count));
	return object;
}

static json_t *queue_json(const struct stream_queue *queue)
{
	return json_pack("{s:i, s:i, s:i}", "filled", (int)queue->filled, "filled_max",
			 (int)queue->filled_max, "capacity", (int)queue->capacity);
}

static double in_ms(int64_t time_ns)
{
	return (double)time_ns / NS_PER_MS;
}

static json_t *percentiles_json(const struct stream_percentiles *of)
{
	return json_pack("{s:I, s:f, s:f, s:f, s:f}", "count", (json_int_t)of->count, "p50_ms",
			 in_ms(of->p50_ns), "p90_ms", in_ms(of->p90_ns), "p99_ms",
			 in_ms(of->p99_ns), "max_ms", in_ms(of->max_ns));
}

static json_t *latencies_json(const struct stream_statistics *accounts)
{
	json_t *latencies = json_array();

	for (uint32_t s = 0; s < accounts->latency_count; s++) {
		const struct stream_latency *one = &accounts->latencies[s];

		json_array_append_new(latencies,
				      json_pack("{s:s, s:o, s:o}", "stage", one->stage, "run",
						percentiles_json(&one->run), "recent",
						percentiles_json(&one->recent)));
	}
	return latencies;
}

/* null unless it is lost. */
static json_t *lost_json(const struct capture *capture, int64_t now_ns)
{
	if (atomic_load(&capture->state) != CAPTURE_LOST || !capture->lost_since_ns)
		return json_null();
	json_t *why = json_string(capture->lost_why);

	return json_pack("{s:f, s:o}", "since_s",
			 (double)(now_ns - capture->lost_since_ns) / NS_PER_S, "why",
			 why ? why : json_string("(not UTF-8)"));
}

/* Every event that the pulse ledger names, then what holds now, and the last event. */
static json_t *ledger_json(const struct camera_events *events,
			   const struct stream_camera_statistics *accounts)
{
	bool any = atomic_load(&events->total) != 0;
	uint32_t last = atomic_load(&events->last_event);

	return json_pack(
		"{s:o, s:b, s:b, s:b, s:b, s:b, s:f, s:f, s:f, s:o, s:o}", "events",
		counts_json(accounts->events, accounts->event_count), "slower_than_trigger",
		atomic_load(&events->slower), "out_of_step", atomic_load(&events->out_of_step),
		"dark", atomic_load(&events->dark), "overexposed",
		atomic_load(&events->overexposed), "moved", atomic_load(&events->moved), "moved_px",
		accounts->moved_px, "moved_mrad", accounts->moved_mrad, "after_edge_us",
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

/* What the device said that it will do. */
static json_t *granted_json(const struct camera_mode *granted)
{
	return json_pack("{s:s, s:i, s:f, s:f}", "format", pixel_format_name(granted->format),
			 "bits", granted->bits ? granted->bits : 8, "rate_hz",
			 granted->period_ns > 0 ? (double)NS_PER_S / (double)granted->period_ns
						: 0.0,
			 "exposure_us", (double)granted->exposure_ns / NS_PER_US);
}

/* Empty where the driver says nothing of itself, or the device is lost; `short_of` gets the names
 * of those that are less than what the config asks for. */
static json_t *facts_json(const struct open_camera *device, json_t *short_of)
{
	struct camera_fact facts[CAMERA_FACT_MAX];
	json_t *json = json_object();
	int count = device->camera && device->driver->facts
			    ? device->driver->facts(device->camera, facts)
			    : 0;

	for (int i = 0; i < count; i++) {
		json_object_set_new(json, facts[i].name, json_string(facts[i].text));
		if (facts[i].falls_short)
			json_array_append_new(short_of, json_string(facts[i].name));
	}
	return json;
}

/* Empty where the driver counts nothing of its own, or the device is lost. */
static json_t *device_json(const struct open_camera *device)
{
	struct camera_count counts[CAMERA_COUNT_MAX];
	json_t *json = json_object();
	int count = device->camera && device->driver->counts
			    ? device->driver->counts(device->camera, counts)
			    : 0;

	for (int i = 0; i < count; i++)
		json_object_set_new(json, counts[i].name,
				    json_integer((json_int_t)counts[i].count));
	return json;
}

static json_t *camera_json(const struct station *station, uint32_t index,
			   const struct stream_camera_statistics *accounts)
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
			  counts_json(accounts->losses, accounts->loss_count));

	json_object_set_new(camera, "granted", granted_json(granted));
	json_object_set_new(camera, "device", device_json(&capture->device));
	json_t *short_of = json_array();

	json_object_set_new(camera, "facts", facts_json(&capture->device, short_of));
	json_object_set_new(camera, "facts_short", short_of);
	set_count(camera, "frames", &capture->counters.frames);
	set_count(camera, "missing", &capture->counters.missing);
	if (capture->role == ROLE_HD)
		json_object_set_new(camera, "hd", hd_json(station, capture));
	json_object_set_new(camera, "ledger",
			    ledger_json(&station->solver.book.cameras[index], accounts));
	set_count(camera, "blobs_masked", &capture->counters.blobs_masked);
	json_object_set_new(camera, "mask", mask_to_json(capture->mask));
	json_object_set_new(camera, "queue", queue_json(&accounts->queue));
	json_object_set_new(camera, "lost", lost_json(capture, clock_now_ns()));
	set_count(camera, "reopened", &capture->counters.reopened);
	json_object_set_new(camera, "fifo", json_boolean(capture->thread.fifo_granted));
	return camera;
}

static json_t *cameras_json(const struct station *station, const struct stream_statistics *accounts)
{
	json_t *cameras = json_array();

	for (uint32_t c = 0; c < station->stage.config.camera_count; c++)
		json_array_append_new(cameras, camera_json(station, c, &accounts->cameras[c]));
	return cameras;
}

static json_t *shots_json(const struct station *station, const struct stream_statistics *accounts)
{
	json_t *shots = json_pack("{s:f}", "per_s", station->statistics.shots_per_s);

	set_count(shots, "solved", &station->solver.shots);
	set_count(shots, "incomplete", &station->solver.incomplete);
	set_count(shots, "lost", &station->solver.lost);
	set_count(shots, "edges", &station->pulses.edges_count);
	set_count(shots, "edges_refused", &station->pulses.edges_refused);
	json_object_set_new(shots, "edges_queue", queue_json(&accounts->edges));
	json_object_set_new(shots, "sets_queue", queue_json(&accounts->sets));
	return shots;
}

/* null where no trigger reports its pulses. */
static json_t *pulses_json(const struct station *station, const struct stream_statistics *accounts)
{
	const struct pulse_accounts *of = &station->pulses.accounts;
	const struct stream_pulses *pulses = &accounts->pulses;
	uint64_t any = 0;

	if (!accounts->has_pulses)
		return json_null();
	for (uint32_t e = 0; e < pulses->event_count; e++)
		any += pulses->events[e].count;
	json_t *lost = pulses->lost ? json_string(station->pulses.lost_why) : json_null();
	return json_pack(
		"{s:o, s:I, s:o, s:o, s:o, s:o, s:o, s:I, s:o, s:i}", "lateness",
		percentiles_json(&pulses->late), "missed", (json_int_t)pulses->missed,
		"last_missed_shot",
		pulses->missed ? json_integer((json_int_t)of->missed_shot) : json_null(), "events",
		counts_json(pulses->events, pulses->event_count), "last_event",
		any ? json_string(pulse_event_name((enum pulse_event)of->event)) : json_null(),
		"last_event_shot", any ? json_integer((json_int_t)of->event_shot) : json_null(),
		"lost_why", lost ? lost : json_string("(not UTF-8)"), "reopened",
		(json_int_t)pulses->reopened, "lost_for_s",
		pulses->lost ? json_real((double)(clock_now_ns() - station->pulses.lost_since_ns) /
					 NS_PER_S)
			     : json_null(),
		"quiet_s", (int)of->quiet_s);
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

static double uptime_s(const struct station *station, int64_t now_ns)
{
	bool captures = station_state_captures(station->state);

	return captures ? (double)(now_ns - station->started_ns) / NS_PER_S : 0;
}

/* As programs with another working directory find it. */
static json_t *config_json(const struct station *station)
{
	const char *path = station->stage.config.path;
	char whole[PATH_MAX];

	return json_string(realpath(path, whole) ? whole : path);
}

/* "solver: no heartbeat for 2.1 s" for each that stands still. */
static json_t *stalled_json(const struct stream_statistics *accounts)
{
	json_t *stalled = json_array();

	for (uint32_t i = 0; i < accounts->stall_count; i++)
		json_array_append_new(
			stalled,
			json_sprintf("%s: no heartbeat for %.1f s", accounts->stalls[i].thread,
				     (double)accounts->stalls[i].still_ns / NS_PER_S));
	return stalled;
}

/* null while what the cameras see has names. */
static json_t *unnamed_json(const struct station *station, const struct stream_statistics *accounts)
{
	const struct stream_unnamed *unnamed = &accounts->unnamed;

	if (!accounts->has_unnamed)
		return json_null();
	return json_pack("{s:f, s:f, s:f, s:f, s:i, s:s}", "seconds", unnamed->seconds, "spots",
			 unnamed->spots, "points", unnamed->points, "named", unnamed->named,
			 "markers", (int)station->stage.layout.marker_count, "remedy",
			 unnamed->remedy);
}

json_t *station_status_json(const struct control_context *context)
{
	struct station *station = context->station;
	const struct control_stats *control = context->stats;
	int64_t now_ns = clock_now_ns();

	struct stream_statistics accounts;
	const struct stream_percentiles *own = &accounts.latencies[LATENCY_ARRIVAL_TO_SENT].recent;

	station_accounts(station, &accounts);
	json_t *status = json_pack(
		"{s:s, s:s, s:f, s:o, s:s, s:s, s:b, s:b, s:o, s:I, s:{s:f, s:f}, s:o, s:o, "
		"s:{s:I, s:I, s:I}}",
		"state", station_state_name(station->state), "version", STAGE_VERSION, "uptime_s",
		uptime_s(station, now_ns), "config", config_json(station), "rig_revision",
		rig_swap_revision(&station->rig_swap, station->rig_swap.current->serial), "trigger",
		station->stage.config.trigger, "fifo", station_is_realtime(station),
		"memory_locked", station->memory_locked, "shots", shots_json(station, &accounts),
		"sim_late", (json_int_t)accounts.sim_late, "latency_ms", "p50", in_ms(own->p50_ns),
		"p99", in_ms(own->p99_ns), "cameras", cameras_json(station, &accounts), "stream",
		stream_json(context->server, now_ns), "control", "accepted",
		(json_int_t)control->accepted_count, "refused", (json_int_t)control->refused_count,
		"cut_off", (json_int_t)control->cut_off_count);
	json_object_set_new(status, "trigger_lost",
			    json_boolean(atomic_load(&station->pulses.lost)));
	json_object_set_new(status, "pulses", pulses_json(station, &accounts));
	json_object_set_new(status, "run", json_integer(station->run));
	json_object_set_new(status, "rig_number",
			    json_integer(rig_swap_number(&station->rig_swap)));
	json_object_set_new(status, "rig_serial", json_integer(station->rig_swap.current->serial));
	json_object_set_new(status, "latency", latencies_json(&accounts));
	json_object_set_new(status, "unnamed", unnamed_json(station, &accounts));
	json_object_set_new(status, "stalled", stalled_json(&accounts));
	return status;
}
