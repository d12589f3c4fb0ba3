/*
 * A fake camera as a device: its address, its registers and its description.
 */
#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/clock.h"
#include "sim/gige/gige_genicam.h"
#include "sim/gige/gige_parts.h"

#define GVCP_PORT 3956
#define EXPOSURE_US 500.0 /* what the cameras say of themselves */
#define POLL_RATE_HZ 1e6  /* of Aravis for a trigger: at once, ours is the wait */

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

int gige_write_genicam(const struct gige_stage *stage, char path[], struct diag *diag)
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
	arv_fake_camera_set_fill_pattern(r, gige_expose, camera);
}

int gige_start_camera(struct gige_camera *camera, const char *xml_path, struct diag *diag)
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
	packet_ns = gige_device_ns(camera, packet_ns);
	arv_fake_camera_write_register(camera->registers, REGISTER_TIMESTAMP_HIGH,
				       (guint32)(packet_ns >> 32));
	arv_fake_camera_write_register(camera->registers, REGISTER_TIMESTAMP_LOW,
				       (guint32)packet_ns);
	arv_fake_camera_write_register(camera->registers, REGISTER_TIMESTAMP_CONTROL, 0);
}
