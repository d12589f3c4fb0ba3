/*
 * Fires the config's trigger with and without strobes, and lets its cameras look.
 */
#include "ctl/doctor/doctor_light.h"

#include <errno.h>
#include <math.h>
#include <pthread.h>
#include <stdatomic.h>
#include <string.h>
#include <unistd.h>

#include "base/clock.h"
#include "ctl/control_client.h"
#include "ctl/program_drivers.h"
#include "drivers/open_cameras.h"
#include "sim/world/world.h"
#include "sim/world/world_config.h"

#define LEAK_GREY 1.0   /* what is more in both rounds is no noise */
#define STRAY_SPOTS 0.2 /* a picture: lamps that HD cameras fire are in every fourth */
#define NEXT_NS (100 * NS_PER_MS)
#define FIRING_PRIORITY 60 /* as in the station, where it is granted */

struct firing {
	struct trigger *trigger;
	pthread_t thread;
	_Atomic bool stop;
};

static double least(double a, double b)
{
	return a < b ? a : b;
}

static void judge_hd(struct doctor *doctor, const char *name, const struct light_seen *seen)
{
	double more = least(seen->lit[0].mean_grey - seen->dark[0].mean_grey,
			    seen->lit[1].mean_grey - seen->dark[1].mean_grey);
	bool leaks = more > LEAK_GREY;

	if (fabs(more) < 0.05)
		more = 0; /* no "-0.0" */
	struct finding *finding = doctor_find(doctor, leaks ? FINDING_PROBLEM : FINDING_OK,
					      "IR strobes in the picture of %s", name);

	doctor_say(finding->measured, "%+.1f grey values with the strobes of %s", more,
		   doctor->config->trigger);
	doctor_say(finding->limit, "at most %.1f", LEAK_GREY);
	if (leaks)
		doctor_say(finding->remedy, "an IR-cut filter before its lens, or hd.delay_us so "
					    "that it exposes when they are dark");
}

static void judge_ir(struct doctor *doctor, const char *name, const struct light_seen *seen)
{
	double spots = least(seen->dark[0].spots, seen->dark[1].spots);
	bool stray = spots > STRAY_SPOTS;
	struct finding *finding = doctor_find(doctor, stray ? FINDING_PROBLEM : FINDING_OK,
					      "other lights in the picture of %s", name);

	doctor_say(finding->measured, "%.1f spots with dark strobes, mean %.0f grey values", spots,
		   least(seen->dark[0].mean_grey, seen->dark[1].mean_grey));
	doctor_say(finding->limit, "none");
	if (stray)
		doctor_say(finding->remedy,
			   "ring lights of HD cameras, lamps or windows: turn or screen them, a "
			   "band-pass filter, or stagectl camera mask %s --auto",
			   name);
}

void doctor_judge_light(struct doctor *doctor, uint32_t c, const struct light_seen *seen)
{
	const struct config_camera *camera = &doctor->config->cameras[c];

	(camera->role == ROLE_HD ? judge_hd : judge_ir)(doctor, camera->name, seen);
}

static void note_unmeasured(struct doctor *doctor, const char *what, const char *why,
			    const char *remedy)
{
	struct finding *finding = doctor_find(doctor, FINDING_NOTE, "%s", what);

	doctor_say(finding->measured, "not measured: %.*s", (int)strcspn(why, "\n"), why);
	doctor_say(finding->remedy, "%s", remedy);
}

static void *fire(void *argument)
{
	struct firing *firing = argument;
	struct edge edge;
	int err = 0;

	while (!firing->stop && (err == 0 || err == -ETIMEDOUT))
		err = firing->trigger->driver->next(firing->trigger, NEXT_NS, &edge);
	return NULL;
}

static int begin_firing(struct firing *firing, const struct trigger_plan *plan, bool lit,
			struct diag *diag)
{
	const struct sched_param param = {.sched_priority = FIRING_PRIORITY};
	struct trigger_plan own = *plan;

	if (!lit)
		own.strobe_width_ns = 0;
	int err = firing->trigger->driver->arm(firing->trigger, &own, diag);

	if (err)
		return err;
	firing->stop = false;
	err = -pthread_create(&firing->thread, NULL, fire, firing);
	if (err)
		firing->trigger->driver->disarm(firing->trigger);
	else
		pthread_setschedparam(firing->thread, SCHED_FIFO, &param); /* where that may be */
	return err;
}

static void end_firing(struct firing *firing)
{
	firing->stop = true;
	pthread_join(firing->thread, NULL);
	firing->trigger->driver->disarm(firing->trigger);
}

static int look(struct light_level *out, struct firing *firing, const struct stage *stage,
		uint32_t c, struct camera *camera, bool lit, struct diag *diag)
{
	int err = begin_firing(firing, &stage->config.plan, lit, diag);

	if (err)
		return err;
	err = light_measure(out, stage, c, camera, diag);
	end_firing(firing);
	return err;
}

static int look_in_turn(struct light_seen *seen, struct firing *firing, const struct stage *stage,
			uint32_t c, struct camera *camera, struct diag *diag)
{
	int err = camera->driver->start(camera, diag);

	if (err)
		return err;
	for (int round = 0; round < LIGHT_ROUNDS && !err; round++) {
		err = look(&seen->lit[round], firing, stage, c, camera, true, diag);
		if (!err)
			err = look(&seen->dark[round], firing, stage, c, camera, false, diag);
	}
	camera->driver->stop(camera);
	return err;
}

static void measure_camera(struct doctor *doctor, struct firing *firing, const struct stage *stage,
			   uint32_t c)
{
	struct open_camera opened;
	struct light_seen seen;
	struct diag diag = {0};
	uint32_t fires = trigger_fires(live_triggers, stage->config.trigger);
	int err = open_camera_by_config(&opened, stage, c, live_drivers, fires, &diag);

	if (!err) {
		err = look_in_turn(&seen, firing, stage, c, opened.camera, &diag);
		opened.driver->close(opened.camera);
	}
	if (err)
		note_unmeasured(doctor, stage->config.cameras[c].name,
				diag.text ? diag.text : strerror(-err),
				"mend that, and ask again with the trigger connected");
	else
		doctor_judge_light(doctor, c, &seen);
	diag_finish(&diag);
}

static void measure_cameras(struct doctor *doctor, const struct stage *stage)
{
	struct firing firing = {0};
	struct diag diag = {0};
	const char *rest;
	const struct trigger_driver *driver =
		trigger_driver_find(live_triggers, stage->config.trigger, &rest, &diag);
	int err = driver ? driver->open(&firing.trigger, rest, &diag) : -EINVAL;

	for (uint32_t c = 0; c < stage->config.camera_count && !err; c++) {
		if (isatty(STDERR_FILENO))
			fprintf(stderr, "\rlight in %s ... ", stage->config.cameras[c].name);
		measure_camera(doctor, &firing, stage, c);
	}
	if (!err && isatty(STDERR_FILENO))
		fputs("\r\x1b[K", stderr);
	if (err)
		note_unmeasured(doctor, "cross-light", diag.text ? diag.text : strerror(-err),
				"mend that, and ask again");
	else
		driver->close(firing.trigger);
	diag_finish(&diag);
}

static void measure_in_world(struct doctor *doctor, const struct stage *stage)
{
	struct sim_options options = sim_config_options(&stage->config, &stage->config.plan);
	struct diag diag = {0};
	int err = 0;

	if (sim_config_wants_world(&stage->config))
		err = sim_world_open(&options, 0, &diag);
	if (err)
		note_unmeasured(doctor, "cross-light", diag.text ? diag.text : strerror(-err),
				"stagectl config check");
	else
		measure_cameras(doctor, stage);
	sim_world_close();
	diag_finish(&diag);
}

void doctor_measure_light(struct doctor *doctor, const struct stage *stage)
{
	const struct config *config = &stage->config;
	bool fires = trigger_fires(live_triggers, config->trigger) & TRIGGER_FIRES_STROBE;

	if (!fires || config->plan.strobe_width_ns <= 0)
		note_unmeasured(doctor, "cross-light", "this machine fires no strobe",
				"compare pictures by eye, with strobes on and off: stagectl camera "
				"preview");
	else if (control_listens(config->socket_dir))
		note_unmeasured(doctor, "cross-light", "a station has the cameras",
				"end it, and ask again: systemctl stop staged");
	else
		measure_in_world(doctor, stage);
}
