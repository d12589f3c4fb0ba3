/*
 * What the station costs beyond what cannot be saved: `bench-station [--json] [--rounds N]`.
 *
 * Rounds of: reading the frames alone (CPU per frame), the floor (floor.c), the station on pool:
 * cameras. All within one run, so that the ratios do not depend on the machine's mood. Two
 * yardsticks of CPU: the floor's threads, which read the same frames at the same instants as the
 * station's, and one thread alone; where cores share the memory's bandwidth the first is the
 * dearer.
 */
#include <errno.h>
#include <jansson.h>
#include <poll.h>
#include <sched.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/sort.h"
#include "protocol/stage_client.h"
#include "sim/world/scene.h"
#include "tests/bench/cpu_time.h"
#include "tests/bench/figures.h"
#include "tests/bench/floor.h"
#include "tests/bench/frame_pool.h"
#include "tests/bench/rounds.h"

#define ROUND_NS (3 * NS_PER_S)
#define ROUNDS_MAX 1000
#define WARM_UP_NS NS_PER_S
#define SAMPLES_MAX 100000
#define FRAMES_PER_S (POOL_CAMERAS * (double)NS_PER_S / (double)POOL_PERIOD_NS)

struct samples {
	int count;
	double us[SAMPLES_MAX];
};

struct results {
	double read_us_per_frame; /* on one thread that has the memory for itself */
	double read_cpu_share;    /* of the floor's threads, which read at the same instants */
	double station_cpu_share;
	double rounds;
	struct samples floor, station;
	struct samples solve; /* the last spots found until the set is solved */
};

static struct results results;
static char directory[] = "/tmp/stage-bench-XXXXXX", program_dir[3000];

static void add_sample(struct samples *samples, int64_t from_ns, int64_t to_ns)
{
	if (samples->count < SAMPLES_MAX)
		samples->us[samples->count++] = (double)(to_ns - from_ns) * 1e-3;
}

static double percentile(const struct samples *samples, double share)
{
	return samples->count ? samples->us[(int)(share * (samples->count - 1))] : 0;
}

/* CPU per plainly read frame, microseconds, cold: the pool is larger than the cache. */
static double read_us(struct frame_pool *pools)
{
	static volatile uint64_t sum;
	struct timespec begin, end;
	int frames = 0;

	clock_gettime(CLOCK_THREAD_CPUTIME_ID, &begin);
	for (uint64_t f = 0; f < 60; f++)
		for (int c = 0; c < POOL_CAMERAS; c++, frames++)
			sum += frame_pool_sum(&pools[c], f);
	clock_gettime(CLOCK_THREAD_CPUTIME_ID, &end);
	return ((double)(end.tv_sec - begin.tv_sec) * 1e9 + (double)(end.tv_nsec - begin.tv_nsec)) *
	       1e-3 / frames;
}

static pid_t spawn(const char *program, const char *argument, const char *value)
{
	char path[3200];
	pid_t parent = getpid(), pid;

	snprintf(path, sizeof(path), "%s/%s", program_dir, program);
	pid = fork();
	if (pid == 0) {
		if (getppid() == parent)
			execl(path, path, argument, value, (char *)NULL);
		_exit(127);
	}
	return pid;
}

static void end(pid_t pid)
{
	kill(pid, SIGTERM);
	waitpid(pid, NULL, 0);
}

static int run_floor(void)
{
	unsigned char message[FLOOR_MESSAGE_BYTES];
	int sockets[2];
	char fd[16];
	int64_t start_ns = 0, from_ns = 0, cpu_ns = 0, due_ns;

	if (socketpair(AF_UNIX, SOCK_STREAM, 0, sockets))
		return -errno;
	snprintf(fd, sizeof(fd), "%d", sockets[1]);
	pid_t pid = spawn("bench-floor", fd, NULL);
	close(sockets[1]);
	while (recv(sockets[0], message, sizeof(message), MSG_WAITALL) == sizeof(message)) {
		int64_t now_ns = clock_now_ns();

		start_ns = start_ns ? start_ns : now_ns;
		memcpy(&due_ns, message, sizeof(due_ns));
		if (now_ns < start_ns + WARM_UP_NS)
			continue;
		if (!from_ns) {
			from_ns = now_ns;
			cpu_ns = side_threads_cpu_ns(pid);
		}
		add_sample(&results.floor, due_ns, now_ns);
		if (now_ns < from_ns + ROUND_NS)
			continue;
		results.read_cpu_share +=
			(double)(side_threads_cpu_ns(pid) - cpu_ns) / (double)(now_ns - from_ns);
		break;
	}
	end(pid);
	close(sockets[0]);
	return results.floor.count ? 0 : -EIO;
}

static struct stage_client *subscribe(void)
{
	struct stage_client *client = NULL;
	char path[64];

	snprintf(path, sizeof(path), "%s/stream.sock", directory);
	for (int i = 0; i < 200 && stage_client_open(&client, path); i++)
		clock_sleep_until(clock_now_ns() + 50 * NS_PER_MS);
	return client;
}

/* The next event and when its bytes had come: what the subscriber makes of them is its own time. */
static int next_event(struct stage_client *client, struct stage_event *event, int64_t *came_ns)
{
	struct pollfd readable = {.fd = stage_client_fd(client), .events = POLLIN};
	int err = stage_client_next(client, 0, event);

	*came_ns = clock_now_ns();
	if (err != -ETIMEDOUT)
		return err;
	if (poll(&readable, 1, 5000) != 1)
		return -ETIMEDOUT;
	*came_ns = clock_now_ns();
	return stage_client_next(client, 1000, event);
}

/* Samples of one round; the station's CPU share over it. */
static int listen_to_station(struct stage_client *client, pid_t pid)
{
	int64_t start_ns = 0, from_ns = 0, cpu_ns = 0;
	struct stage_event event;

	int64_t now_ns;

	while (next_event(client, &event, &now_ns) == 0) {
		if (event.kind != STAGE_MARKERS)
			continue;
		start_ns = start_ns ? start_ns : now_ns;
		if (now_ns < start_ns + WARM_UP_NS)
			continue;
		if (!from_ns) {
			from_ns = now_ns;
			cpu_ns = process_cpu_ns(pid);
		}
		add_sample(&results.station, event.markers->arrival_ns, now_ns);
		add_sample(&results.solve, event.markers->found_ns, event.markers->solved_ns);
		if (now_ns < from_ns + ROUND_NS)
			continue;
		results.station_cpu_share +=
			(double)(process_cpu_ns(pid) - cpu_ns) / (double)(now_ns - from_ns);
		return 0;
	}
	return -EIO;
}

static int run_station(void)
{
	char config[64];

	snprintf(config, sizeof(config), "%s/stage.yaml", directory);
	pid_t pid = spawn("bench-staged", "--config", config);
	struct stage_client *client = subscribe();
	int err = client ? listen_to_station(client, pid) : -EIO;

	stage_client_close(client);
	end(pid);
	return err;
}

static int write_stage(void)
{
	struct sim_options options = {.seed = 1, .camera_count = POOL_CAMERAS, .rate_hz = 120};
	const char *addresses[POOL_CAMERAS] = {"pool:0", "pool:1", "pool:2", "pool:3",
					       "pool:4", "pool:5", "pool:6", "pool:7"};
	struct sim_scene *scene;
	struct diag diag = {0};
	char extra[128];

	if (!mkdtemp(directory))
		return -errno;
	snprintf(extra, sizeof(extra), "socket_dir: \"%s\"\n", directory);
	int err = sim_scene_create(&scene, &options, &diag);
	if (!err) {
		err = sim_scene_write_stage(scene, directory, addresses, extra, &diag);
		sim_scene_destroy(scene);
	}
	diag_print(&diag, stderr);
	diag_finish(&diag);
	return err;
}

static void remove_stage(void)
{
	pid_t pid = fork();

	if (pid == 0) {
		execlp("rm", "rm", "-rf", directory, (char *)NULL);
		_exit(127);
	}
	waitpid(pid, NULL, 0);
}

static int run_rounds(int rounds)
{
	static struct frame_pool pools[POOL_CAMERAS];
	int err = 0;

	for (uint32_t c = 0; c < POOL_CAMERAS && !err; c++)
		err = frame_pool_init(&pools[c], 1, c);
	for (int r = 0; r < rounds && !err; r++) {
		fprintf(stderr, "round %d of %d\n", r + 1, rounds);
		results.read_us_per_frame += read_us(pools);
		err = run_floor();
		if (!err)
			err = run_station();
	}
	results.read_us_per_frame /= rounds;
	results.read_cpu_share /= rounds;
	results.station_cpu_share /= rounds;
	sort_doubles(results.floor.us, (size_t)results.floor.count);
	sort_doubles(results.solve.us, (size_t)results.solve.count);
	sort_doubles(results.station.us, (size_t)results.station.count);
	for (int c = 0; c < POOL_CAMERAS; c++)
		frame_pool_finish(&pools[c]);
	return err;
}

static void report(bool json, bool realtime)
{
	double single_share = results.read_us_per_frame * FRAMES_PER_S * 1e-6;
	double floor_p50 = percentile(&results.floor, 0.5),
	       floor_p99 = percentile(&results.floor, 0.99);
	double p50 = percentile(&results.station, 0.5), p99 = percentile(&results.station, 0.99);
	json_t *out = json_pack(
		"{s:f, s:f, s:f, s:f, s:f, s:f, s:f, s:f, s:f, s:f, s:f, s:f, s:b}",
		"station_cpu_over_read", results.station_cpu_share / results.read_cpu_share,
		"station_cpu_over_single_read", results.station_cpu_share / single_share,
		"latency_over_floor_p50", p50 / floor_p50, "latency_over_floor_p99",
		p99 / floor_p99, "read_us_per_frame", results.read_us_per_frame, "read_cpu_share",
		results.read_cpu_share, "station_cpu_share", results.station_cpu_share,
		"floor_p50_us", floor_p50, "floor_p99_us", floor_p99, "station_p50_us", p50,
		"station_p99_us", p99, "station_solve_p50_us", percentile(&results.solve, 0.5),
		"sched_fifo", realtime);

	print_figures(out, json);
}

int main(int argc, char **argv)
{
	struct sched_param param = {.sched_priority = 10};
	struct bench_rounds rounds = {.count = 4};
	int status = parse_rounds(argc, argv, "bench-station", ROUNDS_MAX, &rounds);

	if (status >= 0)
		return status;
	ssize_t length = readlink("/proc/self/exe", program_dir, sizeof(program_dir) - 1);
	if (length < 0)
		return 2;
	*strrchr(program_dir, '/') = '\0';
	int err = write_stage();
	bool realtime = sched_setscheduler(0, SCHED_FIFO | SCHED_RESET_ON_FORK, &param) == 0;
	if (!err)
		err = run_rounds(rounds.count);
	remove_stage();
	if (err)
		fprintf(stderr, "bench-station: %s\n", strerror(-err));
	else
		report(rounds.json, realtime);
	return err ? 1 : 0;
}
