/*
 * One programme of mishaps, each at its part of the time. What the station says of them is asked
 * over its control socket; whether it was right, the stream shows.
 */
#include "demo/stress.h"

#include <math.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/clock.h"
#include "ctl/control_client.h"

#define CAMERA_NAME "ir3"
#define CAMERA_BIT (UINT32_C(1) << 3)
#define UNPLUG_AT 0.25       /* part of the time; all below too */
#define UNPLUG_FOR_MAX_S 5.0 /* short enough for the shortest run */
#define SCENE_AHEAD_S 1.5    /* the scene begins as much earlier than the judging, about */
#define BACK_MAX_S 3.0
#define LOOK_EVERY_NS (250 * NS_PER_MS)
/* A leak of 140 bytes per shot is 1 MB in 60 s; a station at rest moves by a few pages. */
#define RSS_GROWTH_MAX_KB 1024

static double unplug_s(double seconds)
{
	return UNPLUG_AT * seconds + SCENE_AHEAD_S;
}

static double unplug_for_s(double seconds)
{
	return seconds / 5 < UNPLUG_FOR_MAX_S ? seconds / 5 : UNPLUG_FOR_MAX_S;
}

int stress_faults_yaml(char *text, size_t size, double seconds)
{
	return snprintf(text, size,
			", faults: [{camera: " CAMERA_NAME
			", kind: unplug, at_s: %.3f, for_s: %.3f}]",
			unplug_s(seconds), unplug_for_s(seconds));
}

/* A child of this program's own code, which ends with it. */
static pid_t start_child(void (*run)(const struct stress *stress), const struct stress *stress)
{
	pid_t parent = getpid();
	pid_t pid = fork();

	if (pid != 0)
		return pid > 0 ? pid : 0;
	prctl(PR_SET_PDEATHSIG, SIGKILL);
	signal(SIGINT, SIG_IGN);
	signal(SIGTERM, SIG_DFL);
	if (getppid() == parent)
		run(stress);
	_exit(0);
}

static void end_child(pid_t *pid)
{
	if (*pid <= 0)
		return;
	kill(*pid, SIGKILL);
	waitpid(*pid, NULL, 0);
	*pid = 0;
}

static void hog(const struct stress *stress)
{
	(void)stress;
	for (volatile uint64_t i = 0;; i++)
		;
}

static void listen_for_ever(const struct stress *stress)
{
	struct stage_client *client;
	struct stage_event event;

	if (stage_client_open(&client, stress->stand->socket_path) == 0)
		while (stage_client_next(client, -1, &event) == 0)
			;
}

/* True when the station took the connection. */
static bool send_garbage(const struct stress *stress, const char *socket_name)
{
	static const char garbage[] = "\xff\xfe{[garbage";
	struct sockaddr_un address = {.sun_family = AF_UNIX};
	int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
	bool sent = false;

	if (fd < 0 || snprintf(address.sun_path, sizeof(address.sun_path), "%.80s/%s",
			       stress->stand->dir, socket_name) < 0)
		return false;
	if (connect(fd, (struct sockaddr *)&address, sizeof(address)) == 0)
		sent = send(fd, garbage, sizeof(garbage), MSG_NOSIGNAL) == sizeof(garbage);
	if (sent) {
		char ignored[4096];
		struct timeval patience = {.tv_sec = 1};

		setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof(patience));
		while (recv(fd, ignored, sizeof(ignored), 0) > 0)
			; /* until it is cut off */
	}
	close(fd);
	return sent;
}

static long station_rss_kb(const struct stress *stress)
{
	char path[64], line[128];
	long rss_kb = 0;

	snprintf(path, sizeof(path), "/proc/%d/status", (int)stress->stand->station.pid);
	FILE *file = fopen(path, "r");
	while (file && fgets(line, sizeof(line), file))
		if (sscanf(line, "VmRSS: %ld", &rss_kb) == 1)
			break;
	if (file)
		fclose(file);
	return rss_kb;
}

static void start_hogs_and_subscribers(struct stress *stress)
{
	for (int i = 0; i < STRESS_HOGS; i++)
		stress->hogs[i] = start_child(hog, stress);
	stress->stopped = start_child(listen_for_ever, stress);
	stress->killed = start_child(listen_for_ever, stress);
}

/* Before anybody is stopped: a queue that fills is no leak. */
static void stop_subscriber(struct stress *stress)
{
	stress->rss_before_kb = station_rss_kb(stress);
	if (stress->stopped > 0)
		kill(stress->stopped, SIGSTOP);
}

static void kill_subscriber(struct stress *stress)
{
	end_child(&stress->killed);
}

static void be_garbage_clients(struct stress *stress)
{
	for (int i = 0; i < 3; i++) {
		stress->garbage_stream += send_garbage(stress, "stream.sock");
		stress->garbage_control += send_garbage(stress, "control.sock");
	}
}

static void continue_subscriber(struct stress *stress)
{
	if (stress->stopped > 0)
		kill(stress->stopped, SIGCONT);
}

/* Their connections' memory goes with them. */
static void end_subscribers(struct stress *stress)
{
	end_child(&stress->stopped);
}

static void weigh(struct stress *stress)
{
	stress->rss_after_kb = station_rss_kb(stress);
}

static const struct {
	double at;
	void (*run)(struct stress *stress);
} programme[] = {
	{0.02, start_hogs_and_subscribers},
	{0.20, stop_subscriber},
	{0.40, kill_subscriber},
	{0.50, be_garbage_clients},
	{0.60, be_garbage_clients},
	{0.75, continue_subscriber},
	{0.90, end_subscribers},
	{0.97, weigh},
};

void stress_begin(struct stress *stress, const struct stand *stand, double seconds)
{
	*stress = (struct stress){.stand = stand, .seconds = seconds, .begin_ns = clock_now_ns()};
}

static uint64_t count_of(const json_t *object, const char *key)
{
	return (uint64_t)json_integer_value(json_object_get(object, key));
}

static void look_at_cameras(struct stress *stress, const json_t *cameras)
{
	const json_t *camera;
	size_t i;

	json_array_foreach(cameras, i, camera)
	{
		const char *name = json_string_value(json_object_get(camera, "name"));
		const char *state = json_string_value(json_object_get(camera, "state"));

		if (name && state && strcmp(name, CAMERA_NAME) == 0 && strcmp(state, "lost") == 0)
			stress->camera_named = true;
	}
}

static void look_at_stream(struct stress *stress, const json_t *stream)
{
	const json_t *subscribers = json_object_get(stream, "subscribers"), *subscriber;
	size_t i;

	stress->cut_off_stream = count_of(stream, "cut_off");
	json_array_foreach(subscribers, i, subscriber) if (stress->stopped > 0 &&
							   count_of(subscriber, "pid") ==
								   (uint64_t)stress->stopped &&
							   count_of(subscriber, "sets_lost") > 0)
	{
		stress->slow_named = true;
		stress->slow_lost = count_of(subscriber, "sets_lost");
	}
}

static void look(struct stress *stress)
{
	json_t *reply;

	if (control_ask(&reply, stress->stand->dir, "org.stage.Control.GetStatus", NULL) != 0)
		return;
	const json_t *status = json_object_get(reply, "status");
	const json_t *shots = json_object_get(status, "shots");

	stress->fifo = json_is_true(json_object_get(status, "fifo"));
	stress->sim_late = count_of(status, "sim_late");
	stress->lost = count_of(shots, "lost");
	stress->incomplete = count_of(shots, "incomplete");
	stress->cut_off_control = count_of(json_object_get(status, "control"), "cut_off");
	look_at_cameras(stress, json_object_get(status, "cameras"));
	look_at_stream(stress, json_object_get(status, "stream"));
	json_decref(reply);
}

void stress_step(struct stress *stress, int64_t now_ns)
{
	double part = (double)(now_ns - stress->begin_ns) / 1e9 / stress->seconds;
	uint32_t steps = sizeof(programme) / sizeof(programme[0]);

	if (now_ns >= stress->next_look_ns) {
		look(stress);
		stress->next_look_ns = now_ns + LOOK_EVERY_NS;
	}
	if (stress->step < steps && part >= programme[stress->step].at)
		programme[stress->step++].run(stress);
}

static int64_t replug_ns(const struct stress *stress)
{
	return stress->stand->epoch_ns +
	       (int64_t)((unplug_s(stress->seconds) + unplug_for_s(stress->seconds)) * 1e9);
}

void stress_see_set(struct stress *stress, const struct stage_marker_set *set)
{
	if (!stress->back_ns && set->mid_exposure_ns > replug_ns(stress) &&
	    !(set->missing_mask & CAMERA_BIT))
		stress->back_ns = set->mid_exposure_ns;
}

void stress_finish(struct stress *stress)
{
	look(stress);
}

void stress_stop(struct stress *stress)
{
	for (int i = 0; i < STRESS_HOGS; i++)
		end_child(&stress->hogs[i]);
	end_child(&stress->stopped);
	end_child(&stress->killed);
}

static double back_s(const struct stress *stress)
{
	return (double)(stress->back_ns - replug_ns(stress)) / 1e9;
}

enum criterion { PAIRED, NAMED_CAMERA, BACK, NAMED_SLOW, CUT_OFF, FLAT, CRITERIA };

static const char *const criteria[CRITERIA] = {
	[PAIRED] = "nothing_mispaired",    [NAMED_CAMERA] = "lost_camera_named",
	[BACK] = "camera_back_within_3_s", [NAMED_SLOW] = "slow_subscriber_named",
	[CUT_OFF] = "garbage_all_cut_off", [FLAT] = "memory_flat",
};

static bool holds(const struct stress *s, const struct referee *referee, enum criterion which)
{
	switch (which) {
	case PAIRED:
		return referee->wrong_count == 0 && referee->mispaired_count == 0 &&
		       referee->beyond_bound_count == 0 && referee->sets_repeated == 0;
	case NAMED_CAMERA:
		return s->camera_named;
	case BACK:
		return s->back_ns && back_s(s) <= BACK_MAX_S;
	case NAMED_SLOW:
		return s->slow_named;
	case CUT_OFF:
		return s->garbage_stream > 0 && s->garbage_control > 0 &&
		       s->cut_off_stream == s->garbage_stream &&
		       s->cut_off_control == s->garbage_control;
	default:
		return s->rss_before_kb > 0 && s->rss_after_kb > 0 &&
		       s->rss_after_kb - s->rss_before_kb < RSS_GROWTH_MAX_KB;
	}
}

bool stress_has_passed(const struct stress *stress, const struct referee *referee)
{
	bool passed = true;

	for (int c = 0; c < CRITERIA; c++)
		passed &= holds(stress, referee, c);
	return passed;
}

void stress_show(FILE *out, const struct stress *s, const struct referee *referee)
{
	fprintf(out,
		"stress     camera " CAMERA_NAME " %s lost, back %.2f s after it was plugged in\n",
		s->camera_named ? "was" : "was never", s->back_ns ? back_s(s) : NAN);
	fprintf(out,
		"           stopped subscriber lost %llu sets; cut off %llu of %u garbage "
		"subscribers, %llu of %u garbage operators\n",
		(unsigned long long)s->slow_lost, (unsigned long long)s->cut_off_stream,
		s->garbage_stream, (unsigned long long)s->cut_off_control, s->garbage_control);
	fprintf(out,
		"           station: %llu lost, %llu incomplete, %llu frames late by the "
		"simulator; "
		"memory %ld kB, then %ld kB\n",
		(unsigned long long)s->lost, (unsigned long long)s->incomplete,
		(unsigned long long)s->sim_late, s->rss_before_kb, s->rss_after_kb);
	if (!s->fifo)
		fprintf(out, "           without SCHED_FIFO: lost shots and missing names are "
			     "told, not judged\n");
	for (int c = 0; c < CRITERIA; c++)
		if (!holds(s, referee, c))
			fprintf(out, "           NOT %s\n", criteria[c]);
}

json_t *stress_json(const struct stress *s, const struct referee *referee)
{
	json_t *judged = json_object();

	for (int c = 0; c < CRITERIA; c++)
		json_object_set_new(judged, criteria[c], json_boolean(holds(s, referee, c)));
	return json_pack("{sb so so sI sI sI sI sI sI sI sI sI sI}", "fifo", s->fifo, "criteria",
			 judged, "camera_back_s", s->back_ns ? json_real(back_s(s)) : json_null(),
			 "slow_subscriber_lost", (json_int_t)s->slow_lost, "garbage_sent",
			 (json_int_t)(s->garbage_stream + s->garbage_control), "cut_off",
			 (json_int_t)(s->cut_off_stream + s->cut_off_control), "mispaired",
			 (json_int_t)referee->mispaired_count, "wrong",
			 (json_int_t)referee->wrong_count, "lost", (json_int_t)s->lost,
			 "incomplete", (json_int_t)s->incomplete, "sim_late",
			 (json_int_t)s->sim_late, "rss_before_kb", (json_int_t)s->rss_before_kb,
			 "rss_after_kb", (json_int_t)s->rss_after_kb);
}
