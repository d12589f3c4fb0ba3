/*
 * Devices get their light when they start; here is what they will get.
 */
#include "daemon/station_light.h"

#include "sim/world/world.h"
#include "sim/world/world_config.h"

int station_open_world(struct station *station, struct diag *diag)
{
	struct sim_options options = sim_config_options(&station->stage.config, station->plan);

	if (!sim_config_wants_world(&station->stage.config))
		return 0;
	int err = sim_world_open(&options, station->stage.config.sim_epoch_ns, diag);
	station->world_open = !err;
	return err;
}

struct camera_mode station_wanted(const struct station *station, uint32_t index)
{
	const struct config_camera *camera = &station->stage.config.cameras[index];
	const struct capture *capture = &station->captures[index];
	struct camera_mode wanted = camera->wanted;

	if (station->plan == &station->stage.config.calibration_plan) {
		bool is_hd = camera->role == ROLE_HD;

		wanted.period_ns =
			station->plan->period_ns * (is_hd ? station->plan->hd_divider : 1);
		wanted.exposure_ns =
			is_hd ? station->plan->hd_exposure_ns : station->plan->ir_exposure_ns;
	} else if (!wanted.exposure_ns && capture->device.wanted.exposure_ns) {
		wanted.exposure_ns = capture->own_exposure_ns;
	}
	return wanted;
}

static int offer_pictures(struct station *station, struct diag *diag)
{
	struct pictured_camera cameras[CAMERA_MAX] = {0};
	uint32_t count = station->stage.config.camera_count;

	for (uint32_t c = 0; c < count; c++)
		cameras[c] = (struct pictured_camera){station->captures[c].name,
						      station->captures[c].role == ROLE_HD,
						      station->captures[c].device.granted};
	int err = pictures_share_open(&station->pictures, cameras, count, station->plan->period_ns,
				      diag);
	for (uint32_t c = 0; c < count && !err; c++) {
		station->captures[c].pictures = station->pictures.memory;
		station->captures[c].index = c;
	}
	return err;
}

int station_begin_light(struct station *station, bool calibrating, struct diag *diag)
{
	const struct config *config = &station->stage.config;
	int err = 0;

	station->plan = calibrating ? &config->calibration_plan : &config->plan;
	station->pulses.plan = *station->plan;
	if (calibrating && station->world_open) {
		struct sim_options options = sim_config_options(config, station->plan);

		err = sim_world_wave(&options, diag);
	}
	if (calibrating && !err)
		err = offer_pictures(station, diag);
	if (err)
		station_end_light(station);
	return err;
}

void station_end_light(struct station *station)
{
	station->plan = &station->stage.config.plan;
	for (uint32_t c = 0; c < station->stage.config.camera_count; c++)
		station->captures[c].pictures = NULL;
	pictures_share_close(&station->pictures);
	if (station->world_open)
		sim_world_resume();
}
