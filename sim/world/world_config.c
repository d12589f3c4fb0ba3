/*
 * As many cameras as the config has, exposed as its plan says.
 */
#include "sim/world/world_config.h"

#include <string.h>

#include "drivers/trigger_plan.h"
#include "sim/cameras.h"
#include "sim/world/world.h"

static bool is_simulated(const struct config_camera *camera)
{
	return strncmp(camera->address, "sim:", 4) == 0;
}

bool sim_config_wants_world(const struct config *config)
{
	static const struct trigger_driver *const own[] = {&sim_trigger_driver, NULL};
	struct diag unread = {0};
	const char *rest;
	bool wanted = trigger_driver_find(own, config->trigger, &rest, &unread);

	diag_finish(&unread);
	for (uint32_t c = 0; c < config->camera_count; c++)
		wanted |= is_simulated(&config->cameras[c]);
	return wanted;
}

struct sim_options sim_config_options(const struct config *config, const struct trigger_plan *plan)
{
	uint32_t ir_count = 0, hd_count = 0;

	for (uint32_t c = 0; c < config->camera_count; c++) {
		bool is_hd = config->cameras[c].role == ROLE_HD;

		ir_count += !is_hd;
		hd_count += is_hd && is_simulated(&config->cameras[c]);
	}
	return (struct sim_options){
		.scene = config->sim_scene[0] ? config->sim_scene : NULL,
		.seed = config->sim_seed,
		.faults = &config->sim_faults,
		/* a config with fewer looks at the scene's own number */
		.camera_count =
			ir_count >= SIM_CAMERA_MIN && ir_count <= SIM_CAMERA_MAX ? ir_count : 0,
		.rate_hz = 1e9 / (double)plan->period_ns,
		.hd_camera_count = hd_count,
		.hd_divider = (uint32_t)plan->hd_divider,
		.hd_phase = (uint32_t)plan->hd_phase,
		.hd_after_ir_ns = trigger_plan_hd_middle_ns(plan) - trigger_plan_ir_middle_ns(plan),
	};
}
