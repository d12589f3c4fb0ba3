/*
 * The one scene of this process and its place on the clock.
 */
#include "sim/world/world.h"

#include <errno.h>
#include <stdatomic.h>

#include "base/clock.h"
#include "sim/cameras.h"
#include "sim/world/scene_parts.h"
#include "sim/world/world_parts.h"

#define EPOCH_AHEAD_NS (100 * NS_PER_MS)

struct show {
	struct sim_scene *scene; /* owned */
	int64_t epoch_ns;
};

static struct {
	/* set while no device runs; a device may hold on to either until it starts again */
	struct show stage, board;
	/* the one of the two that is shown */
	const struct sim_scene *scene; /* NULL while closed */
	int64_t epoch_ns;
	uint64_t serial; /* of what is shown */
	/* atomic, any thread */
	_Atomic uint64_t late_count[SIM_DEVICE_MAX];
	_Atomic bool strobes_dark;
} world;

static void show(const struct show *what)
{
	world.scene = what->scene;
	world.epoch_ns = what->epoch_ns;
	world.serial++;
}

int sim_world_open(const struct sim_options *options, int64_t epoch_ns, struct diag *diag)
{
	if (world.scene) {
		diag_add(diag, "sim: a simulated stage is open already: close it first");
		return -EBUSY;
	}
	int err = sim_scene_create(&world.stage.scene, options, diag);

	if (err)
		return err;
	world.stage.epoch_ns = epoch_ns ? epoch_ns : clock_now_ns() + EPOCH_AHEAD_NS;
	show(&world.stage);
	sim_world_light_strobes(true);
	for (int c = 0; c < SIM_DEVICE_MAX; c++)
		atomic_store(&world.late_count[c], 0);
	return 0;
}

void sim_world_close(void)
{
	sim_scene_destroy(world.stage.scene);
	sim_scene_destroy(world.board.scene);
	world.stage = world.board = (struct show){0};
	show(&world.stage);
}

int sim_world_wave(const struct sim_options *options, struct diag *diag)
{
	struct sim_options waved = *options;
	struct sim_scene *scene;

	waved.board = true;
	int err = sim_scene_create(&scene, &waved, diag);
	if (err)
		return err;
	sim_scene_destroy(world.board.scene);
	world.board = (struct show){scene, clock_now_ns() + EPOCH_AHEAD_NS};
	show(&world.board);
	return 0;
}

void sim_world_resume(void)
{
	show(&world.stage);
}

const struct sim_faults *sim_world_faults(void)
{
	return &world.scene->script.faults;
}

const struct sim_scene *sim_world_scene(void)
{
	return world.scene;
}

uint64_t sim_world_serial(void)
{
	return world.serial;
}

int64_t sim_world_epoch_ns(void)
{
	return world.epoch_ns;
}

bool sim_world_strobes_lit(void)
{
	return !atomic_load(&world.strobes_dark);
}

void sim_world_light_strobes(bool lit)
{
	atomic_store(&world.strobes_dark, !lit);
}

uint64_t sim_world_late_count(uint32_t camera)
{
	return camera < SIM_DEVICE_MAX ? atomic_load(&world.late_count[camera]) : 0;
}

void sim_world_count_late(uint32_t camera)
{
	atomic_fetch_add(&world.late_count[camera], 1);
}

int64_t sim_world_mid_exposure_ns(uint64_t shot)
{
	return world.epoch_ns + sim_scene_mid_exposure_ns(world.scene, shot);
}

uint64_t sim_world_shot_after(int64_t time_ns)
{
	int64_t first_ns = sim_world_mid_exposure_ns(0);
	int64_t period_ns = sim_scene_period_ns(world.scene);

	if (time_ns <= first_ns)
		return 0;
	return (uint64_t)((time_ns - first_ns + period_ns - 1) / period_ns);
}
