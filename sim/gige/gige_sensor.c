/*
 * A fake camera's fill callback is its sensor: it renders the coming shot, waits for the shot's
 * pulse and hands the picture over. Aravis runs one thread per camera, and asks for the next frame
 * as soon as it has sent the last, so that rendering happens in the time between two pulses.
 */
#include <pthread.h>
#include <string.h>

#include "base/clock.h"
#include "sim/gige/gige_genicam.h"
#include "sim/gige/gige_parts.h"

#define LATE_NS NS_PER_MS
#define NAP_NS (20 * NS_PER_MS) /* between looks at `stopping` */
#define PULSE_PRIORITY 10       /* below every thread of the station */

static int64_t mid_exposure_ns(const struct gige_stage *stage, uint64_t shot)
{
	return stage->epoch_ns + sim_scene_mid_exposure_ns(stage->scene, shot);
}

/* The first shot whose pulse is not over. */
static uint64_t shot_after(const struct gige_stage *stage, int64_t now_ns)
{
	int64_t since_ns = now_ns - mid_exposure_ns(stage, 0);

	return since_ns <= 0 ? 0 : (uint64_t)(since_ns / sim_scene_period_ns(stage->scene)) + 1;
}

/* A buffer is new when a receiver has just started the camera: nothing was skipped before that. */
static bool first_use(ArvBuffer *buffer)
{
	static const char key[] = "stage-used";

	if (g_object_get_data(G_OBJECT(buffer), key))
		return false;
	g_object_set_data(G_OBJECT(buffer), key, (void *)key);
	return true;
}

static uint64_t claim_shot(struct gige_camera *camera, bool first)
{
	const struct gige_stage *stage = camera->stage;
	int64_t now_ns = clock_now_ns();
	int64_t half_period_ns = sim_scene_period_ns(stage->scene) / 2;
	uint64_t shot = camera->next_shot;

	if (first || mid_exposure_ns(stage, shot) + half_period_ns < now_ns) {
		shot = shot_after(stage, now_ns);
		if (!first)
			camera->skipped += shot - camera->next_shot;
	}
	camera->next_shot = shot + 1;
	return shot;
}

/* On time for the pulse and the sending, as hardware would be; not for the rendering, which would
 * hold up the station on the same machine. Only where the user may. */
static void set_urgent(bool urgent)
{
	struct sched_param param = {.sched_priority = urgent ? PULSE_PRIORITY : 0};

	pthread_setschedparam(pthread_self(), urgent ? SCHED_FIFO : SCHED_OTHER, &param);
}

static void wait_for_pulse(const struct gige_stage *stage, int64_t pulse_ns)
{
	for (int64_t now_ns = clock_now_ns(); now_ns < pulse_ns && !stage->stopping;
	     now_ns = clock_now_ns())
		clock_sleep_until(now_ns + NAP_NS < pulse_ns ? now_ns + NAP_NS : pulse_ns);
}

/* Only a picture of the promised size fits the buffer: a receiver may have written registers. */
static bool picture_fits(const struct gige_stage *stage, ArvBuffer *buffer, ArvPixelFormat format)
{
	return format == ARV_PIXEL_FORMAT_MONO_8 &&
	       arv_buffer_get_image_width(buffer) == stage->width_px &&
	       arv_buffer_get_image_height(buffer) == stage->height_px;
}

int64_t gige_device_ns(const struct gige_camera *camera, int64_t at_ns)
{
	guint32 follows = 0;

	arv_fake_camera_read_register(camera->registers, GIGE_REGISTER_PTP_ENABLE, &follows);
	return at_ns + (follows ? camera->stage->master_ahead_ns : 0);
}

void gige_expose(ArvBuffer *buffer, void *user, guint32 exposure_us, guint32 gain,
		 ArvPixelFormat format)
{
	struct gige_camera *camera = user;
	struct gige_stage *stage = camera->stage;
	uint64_t shot = claim_shot(camera, first_use(buffer));
	int64_t pulse_ns = mid_exposure_ns(stage, shot);
	int width_px, height_px;

	(void)exposure_us;
	(void)gain;
	set_urgent(false);
	if (picture_fits(stage, buffer, format)) {
		const uint8_t *image = sim_render(camera->renderer, shot, &width_px, &height_px);

		memcpy((void *)arv_buffer_get_data(buffer, NULL), image,
		       (size_t)width_px * height_px);
	}
	set_urgent(true);
	wait_for_pulse(stage, pulse_ns);
	camera->sent++;
	camera->late += clock_now_ns() > pulse_ns + LATE_NS;
	arv_buffer_set_timestamp(buffer, (guint64)gige_device_ns(camera, pulse_ns));
	arv_fake_camera_write_register(camera->registers, ARV_FAKE_CAMERA_REGISTER_TRIGGER_SOFTWARE,
				       1);
}
