/*
 * What the aravis driver costs beyond receiving packets: `bench-ingest [--json] [--rounds N]`.
 *
 * Rounds of: the driver's threads until a frame is acquired and released again, untouched; then
 * packet_loop.c on the same packets of the same simulated camera; then the driver again on a packet
 * socket, where that is permitted. CPU times per frame of threads,
 * one after the other within one run, so that load on the machine meets both sides.
 */
#include <errno.h>
#include <jansson.h>
#include <pthread.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/sort.h"
#include "drivers/aravis/aravis.h"
#include "tests/bench/cpu_time.h"
#include "tests/bench/figures.h"
#include "tests/bench/packet_loop.h"
#include "tests/bench/rounds.h"
#include "tests/contract/gige_child.h"

#define PACKET_BYTES 16000 /* what the driver takes on loopback */
#define WARM_UP 30
#define FRAMES 60
#define BUFFERS 20 /* as the driver has at 60 frames a second */
#define ROUNDS_MAX 64

struct capture {
	struct camera *camera;
	int64_t cpu_ns, late_ns;
	uint64_t whole, damaged;
	int error;
};

struct results {
	int rounds;
	double ratio[ROUNDS_MAX], driver_us[ROUNDS_MAX], loop_us[ROUNDS_MAX];
	double late_us[ROUNDS_MAX];
	double packets_us[ROUNDS_MAX], packets_late_us[ROUNDS_MAX];
	bool has_packets;
	double calls_per_frame;
	uint64_t damaged, loop_damaged;
};

static void *capture(void *user)
{
	struct capture *c = user;
	const struct camera_driver *driver = c->camera->driver;
	struct frame frame;

	for (uint64_t n = 0; n < WARM_UP + FRAMES && !c->error; n++) {
		int error = driver->acquire(c->camera, 2 * NS_PER_S, &frame);

		if (n == WARM_UP)
			c->cpu_ns = -side_threads_cpu_ns(getpid());
		if (error == -EBADMSG) {
			c->damaged++;
			continue;
		}
		c->error = error;
		if (error)
			break;
		c->whole++;
		if (n >= WARM_UP)
			c->late_ns += (frame.arrival_ns - frame.mid_exposure_ns) / FRAMES;
		driver->release(c->camera, &frame);
	}
	c->cpu_ns += side_threads_cpu_ns(getpid());
	return NULL;
}

static int run_driver(struct results *r, const char *ip, enum camera_receive receive)
{
	const struct camera_driver *driver = &aravis_camera_driver;
	struct camera_mode mode = {.triggered = true, .receive = receive};
	bool packets = receive == CAMERA_RECEIVE_PACKETS;
	struct capture c = {0};
	struct diag diag = {0};
	pthread_t thread;
	int error = driver->open(&c.camera, ip, NULL, &diag);

	if (!error)
		error = driver->configure(c.camera, &mode, &mode, &diag);
	if (!error)
		error = driver->start(c.camera, &diag);
	if (!error)
		error = -pthread_create(&thread, NULL, capture, &c);
	if (!error) {
		pthread_join(thread, NULL);
		error = c.error;
		driver->stop(c.camera);
	}
	driver->close(c.camera);
	diag_print(&diag, stderr);
	diag_finish(&diag);
	r->has_packets |= mode.receive == CAMERA_RECEIVE_PACKETS;
	(packets ? r->packets_us : r->driver_us)[r->rounds] = (double)c.cpu_ns * 1e-3 / FRAMES;
	(packets ? r->packets_late_us : r->late_us)[r->rounds] = (double)c.late_ns * 1e-3;
	r->damaged += c.damaged;
	return error;
}

static int run_loop(struct results *r, const char *ip)
{
	struct packet_loop_result loop;
	int error = packet_loop_run(&loop, ip, PACKET_BYTES, BUFFERS, WARM_UP, FRAMES);

	if (error)
		return error;
	r->loop_us[r->rounds] = (double)loop.cpu_ns * 1e-3 / FRAMES;
	r->calls_per_frame = (double)loop.calls / FRAMES;
	r->loop_damaged += loop.damaged;
	return 0;
}

static int run_round(struct results *r, const char *ip)
{
	int error = run_driver(r, ip, CAMERA_RECEIVE_SOCKET);

	if (!error)
		error = run_loop(r, ip);
	if (!error)
		error = run_driver(r, ip, CAMERA_RECEIVE_PACKETS);
	if (error)
		return error;
	r->ratio[r->rounds] = r->driver_us[r->rounds] / r->loop_us[r->rounds];
	r->rounds++;
	return 0;
}

static double median(double *values, int count)
{
	sort_doubles(values, (size_t)count);
	return values[count / 2];
}

static void report(struct results *r, bool json)
{
	double ratio = median(r->ratio, r->rounds);

	json_t *figures = json_pack(
		"{s:f, s:f, s:f, s:f, s:f, s:f, s:f, s:I, s:I}", "gige_cpu_over_recv", ratio,
		"gige_cpu_over_recv_low", r->ratio[0], "gige_cpu_over_recv_high",
		r->ratio[r->rounds - 1], "gige_driver_us_per_frame",
		median(r->driver_us, r->rounds), "gige_recv_us_per_frame",
		median(r->loop_us, r->rounds), "gige_recv_calls_per_frame", r->calls_per_frame,
		"gige_driver_arrival_us", median(r->late_us, r->rounds), "gige_driver_damaged",
		(json_int_t)r->damaged, "gige_recv_damaged", (json_int_t)r->loop_damaged);

	if (r->has_packets) {
		json_object_set_new(figures, "gige_packets_us_per_frame",
				    json_real(median(r->packets_us, r->rounds)));
		json_object_set_new(figures, "gige_packets_arrival_us",
				    json_real(median(r->packets_late_us, r->rounds)));
	}
	print_figures(figures, json);
}

static int run(struct results *r, int rounds, const char *program)
{
	static const char *const extra[] = {"--rate", "60", NULL};
	struct gige_child child;
	char ip[16];
	int error = 0;

	if (gige_child_start(&child, program, 0, extra, "/dev/null"))
		return -EIO;
	gige_child_address(&child, 0, ip);
	for (int i = 0; i < rounds && !error; i++) {
		fprintf(stderr, "round %d of %d\n", i + 1, rounds);
		error = run_round(r, ip);
	}
	gige_child_end(&child, SIGTERM);
	return error;
}

int main(int argc, char **argv)
{
	static struct results results;
	struct bench_rounds rounds = {.count = 8};
	int status = parse_rounds(argc, argv, "bench-ingest", ROUNDS_MAX, &rounds);

	if (status >= 0)
		return status;
	int error = run(&results, rounds.count, SIM_GIGE);

	if (error)
		fprintf(stderr, "bench-ingest: %s\n", strerror(-error));
	else
		report(&results, rounds.json);
	return error ? 1 : 0;
}
