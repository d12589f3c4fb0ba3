/*
 * Fake cameras whose fill callback is the sensor: it renders the coming shot, waits for the shot's
 * pulse and hands the picture over. Aravis runs one thread per camera, and asks for the next frame
 * as soon as it has sent the last, so that rendering happens in the time between two pulses.
 */
#include "sim/gige/gige.h"

#include <arpa/inet.h>
#include <errno.h>
#include <inttypes.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include <arv.h>

#include "base/clock.h"
#include "sim/gige/gige_genicam.h"
#include "sim/render/render.h"

#define GVCP_PORT 3956
#define LATE_NS NS_PER_MS
#define NAP_NS (20 * NS_PER_MS)           /* between looks at `stopping` */
#define EPOCH_AHEAD_MAX_NS (NS_PER_S / 2) /* control waits while a camera waits for its pulse */
#define EXPOSURE_US 500.0                 /* what the cameras say of themselves */
#define PULSE_PRIORITY 10                 /* below every thread of the station */
#define POLL_RATE_HZ 1e6                  /* of Aravis for a trigger: at once, ours is the wait */

/* Registers of the device description block (GigE Vision 2, table "Bootstrap registers"). */
enum {
	REGISTER_VENDOR = 0x48,
	REGISTER_MODEL = 0x68,
	REGISTER_INFO = 0xa8,
	REGISTER_NAME = 0xe8,
	REGISTER_CAPABILITY = 0x0934,
	REGISTER_TIMESTAMP_CONTROL = 0x0944,
	REGISTER_TIMESTAMP_HIGH = 0x0948,
	REGISTER_TIMESTAMP_LOW = 0x094c,
	CAPABILITY_RESEND = 4,
	TIMESTAMP_LATCH = 2,
};

struct gige_camera {
	/* set before the thread starts */
	struct gige_stage *stage;
	uint32_t index;
	char address[INET_ADDRSTRLEN];
	struct sim_renderer *renderer;
	ArvGvFakeCamera *device;
	_Atomic(ArvFakeCamera *)
		registers; /* of the device; its thread starts before this is set */

	/* owned by Aravis' thread of this camera */
	uint64_t next_shot;

	/* atomic, any thread */
	_Atomic uint64_t sent, late, skipped;
};

struct gige_stage {
	const struct sim_scene *scene;
	int64_t epoch_ns;
	int width_px, height_px;
	uint32_t camera_count;
	struct gige_abilities abilities;
	int64_t master_ahead_ns; /* of CLOCK_MONOTONIC: what cameras that follow PTP show */
	atomic_bool stopping;
	struct gige_camera cameras[CAMERA_MAX];
};

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

/* What the camera's clock shows at `at_ns`: CLOCK_MONOTONIC, or its master's TAI. */
static int64_t device_ns(const struct gige_camera *camera, int64_t at_ns)
{
	guint32 follows = 0;

	arv_fake_camera_read_register(camera->registers, GIGE_REGISTER_PTP_ENABLE, &follows);
	return at_ns + (follows ? camera->stage->master_ahead_ns : 0);
}

/* On Aravis' thread of the camera, once per frame, before the frame is sent. */
static void expose(ArvBuffer *buffer, void *user, guint32 exposure_us, guint32 gain,
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
	arv_buffer_set_timestamp(buffer, (guint64)device_ns(camera, pulse_ns));
	arv_fake_camera_write_register(camera->registers, ARV_FAKE_CAMERA_REGISTER_TRIGGER_SOFTWARE,
				       1);
}

static int set_addresses(struct gige_stage *stage, const char *first_address, struct diag *diag)
{
	struct in_addr address;

	if (inet_pton(AF_INET, first_address, &address) != 1) {
		diag_add(diag, "first address '%s': not an IPv4 address, like 127.0.0.11",
			 first_address);
		return -EINVAL;
	}
	uint32_t first = ntohl(address.s_addr);

	if (first >> 24 != 127 || (first + stage->camera_count) >> 24 != 127) {
		diag_add(diag, "first address '%s': simulated cameras live in 127.0.0.0/8 only",
			 first_address);
		return -EINVAL;
	}
	for (uint32_t i = 0; i < stage->camera_count; i++) {
		address.s_addr = htonl(first + i);
		inet_ntop(AF_INET, &address, stage->cameras[i].address, INET_ADDRSTRLEN);
	}
	return 0;
}

static int create_renderers(struct gige_stage *stage)
{
	for (uint32_t i = 0; i < stage->camera_count; i++) {
		struct gige_camera *camera = &stage->cameras[i];
		int error = sim_renderer_create(&camera->renderer, stage->scene, i, SIM_NOISE_FAST);

		if (error)
			return error;
		camera->stage = stage;
		camera->index = i;
	}
	sim_render(stage->cameras[0].renderer, 0, &stage->width_px, &stage->height_px);
	return 0;
}

int gige_stage_create(struct gige_stage **out, const struct sim_scene *scene, int64_t epoch_ns,
		      const char *first_address, struct diag *diag)
{
	struct gige_stage *stage;
	int error = -ENOMEM;

	if (epoch_ns > clock_now_ns() + EPOCH_AHEAD_MAX_NS) {
		diag_add(diag,
			 "epoch %" PRId64 " ns: lies more than half a second ahead; start later, "
			 "or use an epoch in the past",
			 epoch_ns);
		return -EINVAL;
	}
	stage = calloc(1, sizeof(*stage));
	if (!stage)
		return -ENOMEM;
	stage->scene = scene;
	stage->epoch_ns = epoch_ns;
	stage->camera_count = sim_scene_camera_count(scene);
	error = set_addresses(stage, first_address, diag);
	if (!error)
		error = create_renderers(stage);
	if (error)
		goto fail;
	*out = stage;
	return 0;
fail:
	gige_stage_destroy(stage);
	return error;
}

void gige_stage_destroy(struct gige_stage *stage)
{
	if (!stage)
		return;
	gige_stage_stop(stage);
	for (uint32_t i = 0; i < stage->camera_count; i++)
		sim_renderer_destroy(stage->cameras[i].renderer);
	free(stage);
}

/* Aravis would go on without the port and be deaf, so we try it first. */
static int check_port_free(const char *address, struct diag *diag)
{
	struct sockaddr_in control = {.sin_family = AF_INET, .sin_port = htons(GVCP_PORT)};
	int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
	int error = 0;

	inet_pton(AF_INET, address, &control.sin_addr);
	if (fd < 0 || bind(fd, (struct sockaddr *)&control, sizeof(control)))
		error = -errno;
	if (fd >= 0)
		close(fd);
	if (error == -EADDRINUSE)
		diag_add(diag,
			 "%s: UDP port %d is in use: another simulated camera has this address; "
			 "end that program or take another first address",
			 address, GVCP_PORT);
	else if (error)
		diag_add(diag, "%s: UDP port %d: %s", address, GVCP_PORT, strerror(-error));
	return error;
}

/* Aravis reads the description from a file, while the camera is made. */
static int write_genicam(const struct gige_stage *stage, char path[], struct diag *diag)
{
	double rate_hz = (double)NS_PER_S / (double)sim_scene_period_ns(stage->scene);
	char *xml = gige_genicam_xml(rate_hz, EXPOSURE_US, stage->abilities.ptp);
	int fd = mkstemp(path);
	int error = 0;

	if (!xml)
		error = -ENOMEM;
	else if (fd < 0 || write(fd, xml, strlen(xml)) != (ssize_t)strlen(xml))
		error = errno ? -errno : -EIO;
	if (fd >= 0)
		close(fd);
	if (error)
		diag_add(diag, "%s: cannot write the camera description: %s", path,
			 strerror(-error));
	free(xml);
	return error;
}

static void write_string(ArvFakeCamera *registers, guint32 address, guint32 size, const char *text)
{
	char field[64] = "";

	strncpy(field, text, sizeof(field) - 1);
	field[size - 1] = '\0';
	arv_fake_camera_write_memory(registers, address, size, field);
}

static void write_registers(struct gige_camera *camera)
{
	const struct gige_stage *stage = camera->stage;
	ArvFakeCamera *r = camera->registers;
	guint32 width = (guint32)stage->width_px, height = (guint32)stage->height_px;

	write_string(r, REGISTER_VENDOR, 32, "stage");
	write_string(r, REGISTER_MODEL, 32, "sim-gige");
	write_string(r, REGISTER_INFO, 48, "simulated");
	write_string(r, REGISTER_NAME, 16, sim_scene_camera_name(stage->scene, camera->index));
	arv_fake_camera_write_register(r, ARV_FAKE_CAMERA_REGISTER_SENSOR_WIDTH, width);
	arv_fake_camera_write_register(r, ARV_FAKE_CAMERA_REGISTER_SENSOR_HEIGHT, height);
	arv_fake_camera_write_register(r, ARV_FAKE_CAMERA_REGISTER_WIDTH, width);
	arv_fake_camera_write_register(r, ARV_FAKE_CAMERA_REGISTER_HEIGHT, height);
	arv_fake_camera_write_register(r, ARV_FAKE_CAMERA_REGISTER_ACQUISITION_FRAME_PERIOD_US, 1);
	arv_fake_camera_write_register(r, ARV_FAKE_CAMERA_REGISTER_TRIGGER_SOURCE, 1);
	arv_fake_camera_write_register(r, ARV_FAKE_CAMERA_REGISTER_TRIGGER_SOFTWARE, 1);
	if (stage->abilities.resend)
		arv_fake_camera_write_register(r, REGISTER_CAPABILITY, CAPABILITY_RESEND);
	arv_fake_camera_set_trigger_frequency(r, POLL_RATE_HZ);
	arv_fake_camera_set_fill_pattern(r, expose, camera);
}

static int start_camera(struct gige_camera *camera, const char *xml_path, struct diag *diag)
{
	char serial[16]; /* discovery tells devices apart by it */
	int error = check_port_free(camera->address, diag);

	if (error)
		return error;
	snprintf(serial, sizeof(serial), "sim-%08x", inet_network(camera->address));
	camera->device = arv_gv_fake_camera_new_full(camera->address, serial, xml_path);
	if (!arv_gv_fake_camera_is_running(camera->device)) {
		diag_add(diag,
			 "%s: Aravis cannot serve a camera here: no network interface has this "
			 "address; 'ip addr add %s/8 dev lo' gives it one",
			 camera->address, camera->address);
		return -EADDRNOTAVAIL;
	}
	camera->registers = arv_gv_fake_camera_get_fake_camera(camera->device);
	write_registers(camera);
	return 0;
}

/* Of CLOCK_MONOTONIC; by the sharpest of some looks. */
static int64_t tai_ahead_ns(void)
{
	int64_t ahead_ns = 0, sharpest_ns = INT64_MAX;

	for (int i = 0; i < 20; i++) {
		struct timespec tai;
		int64_t before_ns = clock_now_ns();

		clock_gettime(CLOCK_TAI, &tai);
		int64_t took_ns = clock_now_ns() - before_ns;

		if (took_ns < sharpest_ns)
			ahead_ns = tai.tv_sec * NS_PER_S + tai.tv_nsec - before_ns - took_ns / 2;
		sharpest_ns = took_ns < sharpest_ns ? took_ns : sharpest_ns;
	}
	return ahead_ns;
}

int gige_stage_start(struct gige_stage *stage, const struct gige_abilities *abilities,
		     struct diag *diag)
{
	char xml_path[] = "/tmp/stage-sim-gige-XXXXXX";
	int error;

	stage->stopping = false;
	stage->abilities = *abilities;
	stage->master_ahead_ns = tai_ahead_ns() + abilities->master_ahead_ns;
	error = write_genicam(stage, xml_path, diag);
	for (uint32_t i = 0; i < stage->camera_count && !error; i++)
		error = start_camera(&stage->cameras[i], xml_path, diag);
	unlink(xml_path);
	if (error)
		gige_stage_stop(stage);
	return error;
}

void gige_stage_stop(struct gige_stage *stage)
{
	stage->stopping = true;
	for (uint32_t i = 0; i < stage->camera_count; i++) {
		g_clear_object(&stage->cameras[i].device);
		stage->cameras[i].registers = NULL;
	}
}

static struct gige_camera *find_camera(struct gige_stage *stage, int control_fd)
{
	struct sockaddr_in local;
	socklen_t size = sizeof(local);
	char address[INET_ADDRSTRLEN];

	if (getsockname(control_fd, (struct sockaddr *)&local, &size))
		return NULL;
	inet_ntop(AF_INET, &local.sin_addr, address, sizeof(address));
	for (uint32_t i = 0; i < stage->camera_count; i++)
		if (stage->cameras[i].registers && !strcmp(address, stage->cameras[i].address))
			return &stage->cameras[i];
	return NULL;
}

void gige_stage_latch(struct gige_stage *stage, int control_fd, int64_t packet_ns)
{
	struct gige_camera *camera = find_camera(stage, control_fd);
	guint32 control = 0;

	if (!camera)
		return;
	arv_fake_camera_read_register(camera->registers, REGISTER_TIMESTAMP_CONTROL, &control);
	if (control != TIMESTAMP_LATCH)
		return;
	packet_ns = device_ns(camera, packet_ns);
	arv_fake_camera_write_register(camera->registers, REGISTER_TIMESTAMP_HIGH,
				       (guint32)(packet_ns >> 32));
	arv_fake_camera_write_register(camera->registers, REGISTER_TIMESTAMP_LOW,
				       (guint32)packet_ns);
	arv_fake_camera_write_register(camera->registers, REGISTER_TIMESTAMP_CONTROL, 0);
}

struct gige_counts gige_stage_counts(const struct gige_stage *stage)
{
	struct gige_counts counts = {0};

	for (uint32_t i = 0; i < stage->camera_count; i++) {
		counts.sent += stage->cameras[i].sent;
		counts.late += stage->cameras[i].late;
		counts.skipped += stage->cameras[i].skipped;
	}
	return counts;
}

void gige_stage_image_size(const struct gige_stage *stage, int *width_px, int *height_px)
{
	*width_px = stage->width_px;
	*height_px = stage->height_px;
}
