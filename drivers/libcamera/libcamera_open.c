/*
 * Finding a camera by its id or its sensor's model, and saying why not: not there, not permitted,
 * not looked for because udev does not run.
 */
#include <errno.h>
#include <fcntl.h>
#include <glob.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "drivers/libcamera/libcamera_device.h"

#define MODEL_PREFIX "model="
#define HEX "0123456789abcdefABCDEF"

struct search {
	const char *rest;
	int count;
	char id[128];  /* of the last that matches */
	char all[500]; /* "platform/vimc.0 Sensor B (Sensor B), ..." for messages */
};

struct listing {
	camera_found_fn *found;
	void *user;
};

/* Such ids end with the numbers of vendor and product: "...-046d:0825". */
static bool is_usb(const char *id)
{
	const char *end = strrchr(id, '-');

	return end && strlen(end) == 10 && end[5] == ':' && strspn(end + 1, HEX) == 4 &&
	       strspn(end + 6, HEX) == 4;
}

/* Cameras on USB are for the driver v4l2. An id that an address cannot hold could not be opened by
 * it. */
static void tell(const char *id, const char *model, void *user)
{
	const struct listing *listing = user;
	struct camera_info info = {0};

	if (strlen(id) + sizeof("libcamera:") > sizeof(info.address) || is_usb(id))
		return;
	snprintf(info.address, sizeof(info.address), "libcamera:%s", id);
	snprintf(info.model, sizeof(info.model), "%s", model);
	listing->found(&info, listing->user);
}

int libcamera_list(camera_found_fn *found, void *user, struct diag *diag)
{
	struct listing listing = {found, user};

	(void)diag;
	libcamera_shim_list(tell, &listing);
	return 0;
}

static void match(const char *id, const char *model, void *user)
{
	struct search *search = user;
	size_t used = strlen(search->all);
	bool by_model = strncmp(search->rest, MODEL_PREFIX, strlen(MODEL_PREFIX)) == 0;

	snprintf(search->all + used, sizeof(search->all) - used, "%s%s%s%s%s", used ? ", " : "", id,
		 *model ? " (" : "", model, *model ? ")" : "");
	if (strcmp(by_model ? search->rest + strlen(MODEL_PREFIX) : search->rest,
		   by_model ? model : id) != 0 ||
	    strlen(id) >= sizeof(search->id))
		return;
	snprintf(search->id, sizeof(search->id), "%s", id);
	search->count++;
}

/* libcamera passes over media devices that it may not open, and some pipelines over those that
 * another program has locked. */
static int why_unseen(void)
{
	int reason = 0;
	glob_t nodes;

	if (glob("/dev/media[0-9]*", 0, NULL, &nodes))
		return 0;
	for (size_t i = 0; i < nodes.gl_pathc && !reason; i++) {
		int fd = open(nodes.gl_pathv[i], O_RDWR | O_CLOEXEC);

		if (fd < 0)
			reason = errno == EACCES ? -EACCES : 0;
		else if (lockf(fd, F_TEST, 0))
			reason = -EBUSY;
		if (fd >= 0)
			close(fd);
	}
	globfree(&nodes);
	return reason;
}

static int report_missing(const struct libcamera_at *at, const struct search *search,
			  struct diag *diag)
{
	int reason;

	if (*search->all) {
		diag_add(diag, "%s: no such camera; there are %s", at->address, search->all);
		return -ENODEV;
	}
	reason = why_unseen();
	if (reason)
		return libcamera_fail(at, reason, "/dev/media*", diag);
	if (access("/run/udev/control", F_OK)) {
		diag_add(
			diag,
			"%s: udev does not run, and without it libcamera sees no camera: systemctl "
			"start systemd-udevd, then udevadm trigger",
			at->address);
		return -ENODEV;
	}
	diag_add(diag,
		 "%s: no such camera: libcamera sees none; is the sensor's driver loaded (dmesg), "
		 "and libcamera-ipa installed?",
		 at->address);
	return -ENODEV;
}

int libcamera_fail(const struct libcamera_at *at, int error, const char *doing, struct diag *diag)
{
	const char *remedy = "LIBCAMERA_LOG_LEVELS=*:INFO in the environment makes libcamera say "
			     "more, and dmesg the kernel";

	if (error == -EACCES || error == -EPERM)
		remedy = "join the device's group: usermod -aG video USER (stage-operator where "
			 "stage is installed)";
	else if (error == -EBUSY)
		remedy = "another program uses it: end that (fuser -v /dev/media* names it)";
	else if (error == -ENODEV)
		remedy = "it is gone: connect it again";
	else if (error == -ENOMEM || error == -ENOBUFS)
		remedy = "no memory for its buffers: a smaller size, or more contiguous memory "
			 "(cma=256M at boot)";
	diag_add(diag, "%s: %s: %s; %s", at->address, doing, strerror(-error), remedy);
	return error;
}

static int find_and_open(struct libcamera_at *at, const char *rest, struct diag *diag)
{
	struct search search = {.rest = rest};
	int error = libcamera_shim_list(match, &search);

	if (error < 0)
		return libcamera_fail(at, error, "open", diag);
	if (search.count == 0)
		return report_missing(at, &search, diag);
	if (search.count > 1) {
		diag_add(diag, "%s: several cameras match: name one by its id: %s", at->address,
			 search.all);
		return -EINVAL;
	}
	if (is_usb(search.id)) {
		diag_add(diag,
			 "%s: a USB camera: the driver v4l2 takes those; its address is in "
			 "'stagectl camera list'",
			 at->address);
		return -ENOTSUP;
	}
	snprintf(at->id, sizeof(at->id), "%s", search.id);
	error = libcamera_shim_open(&at->device, at->id);
	return error ? libcamera_fail(at, error, "open", diag) : 0;
}

int libcamera_open_device(struct libcamera_at *out, const char *rest, struct diag *diag)
{
	struct libcamera_at at = {0};
	int error;

	snprintf(at.address, sizeof(at.address), "libcamera:%s", rest);
	error = libcamera_shim_hold();
	if (error)
		return libcamera_fail(&at, error, "start libcamera", diag);
	error = find_and_open(&at, rest, diag);
	libcamera_shim_let_go();
	if (error)
		return error;
	libcamera_find_sensor(at.id, at.sensor, sizeof(at.sensor));
	*out = at;
	return 0;
}
