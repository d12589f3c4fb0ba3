/*
 * Time goes on in steps; between them all that came is taken and the station ticks.
 */
#include "virtual_station.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include "base/clock_virtual.h"
#include "sim/world/world.h"

#define START_NS (1000 * NS_PER_S)
#define STEP_NS (20 * NS_PER_MS)
#define CAMERA_COUNT 4

static char dir[] = "/tmp/stage-test-XXXXXX";

static void write_stage(const char *scene_name, uint32_t hd_count, const char *extra_yaml)
{
	const char *addresses[] = {"sim:ir0", "sim:ir1", "sim:ir2", "sim:ir3", "sim:hd0"};
	struct sim_options options = {
		.scene = scene_name, .camera_count = CAMERA_COUNT, .hd_camera_count = hd_count};
	struct sim_scene *scene;
	struct diag diag = {0};

	strcpy(dir + sizeof(dir) - 7, "XXXXXX");
	assert_non_null(mkdtemp(dir));
	assert_int_equal(sim_scene_create(&scene, &options, &diag), 0);
	assert_int_equal(sim_scene_write_stage(scene, dir, addresses, extra_yaml, &diag), 0);
	sim_scene_destroy(scene);
}

static void take_away(const char *name)
{
	char command[96];

	snprintf(command, sizeof(command), "rm -r %s/%s", dir, name);
	assert_int_equal(system(command), 0);
}

struct station *virtual_station_configure(const char *scene, uint32_t hd_count,
					  const char *extra_yaml, const char *remove)
{
	struct station *station = calloc(1, sizeof(*station));
	struct diag diag = {0};
	char path[64];

	write_stage(scene, hd_count, extra_yaml);
	if (remove)
		take_away(remove);
	snprintf(path, sizeof(path), "%s/stage.yaml", dir);
	clock_virtual_begin(START_NS, START_NS);
	enum exit_code code = station_load(station, path, &diag);
	if (code == EXIT_CODE_OK)
		code = station_configure(station, &diag);
	if (code != EXIT_CODE_OK)
		diag_print(&diag, stderr);
	assert_int_equal(code, EXIT_CODE_OK);
	return station;
}

struct station *virtual_station_start(const char *scene, uint32_t hd_count, const char *extra_yaml)
{
	struct station *station = virtual_station_configure(scene, hd_count, extra_yaml, NULL);

	assert_int_equal(station_start(station, STATION_START, NULL), EXIT_CODE_OK);
	return station;
}

static void take_sets(struct station *station)
{
	while (station_next_set(station))
		station_pop_set(station);
}

void virtual_station_run_to(struct station *station, double time_s)
{
	int64_t end_ns = sim_world_epoch_ns() + (int64_t)(time_s * NS_PER_S);

	for (int64_t limit_ns = clock_virtual_limit() + STEP_NS; limit_ns < end_ns;
	     limit_ns += STEP_NS) {
		clock_virtual_set_limit(limit_ns);
		while (!clock_virtual_at_limit()) {
			take_sets(station);
			usleep(50);
		}
		take_sets(station);
		station_tick(station);
	}
}

void virtual_station_end(struct station *station)
{
	char command[64];

	station_finish(station);
	clock_virtual_end();
	free(station);
	snprintf(command, sizeof(command), "rm -r %s", dir);
	assert_int_equal(system(command), 0);
}

uint64_t virtual_station_events(const struct station *station, uint32_t camera,
				enum ledger_event event)
{
	return atomic_load(&station->solver.book.cameras[camera].counts[event]);
}
