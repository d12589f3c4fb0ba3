/*
 * Finding a device by node, serial number or name, and saying why not: not there, not permitted,
 * not a camera. The kernel's own tree in /sys tells, so nothing like udev need run.
 */
#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include "drivers/v4l2/v4l2_device.h"

#define CLASS_DIR "/sys/class/video4linux"
#define NODE_BYTES 32
#define MATCHES_MAX 8
#define LISTED_MAX 64

/* What an address asks for; "" = anything. */
struct wish {
	char serial[64], card[64];
};

struct search {
	struct wish wish;
	int count;
	char nodes[MATCHES_MAX][NODE_BYTES]; /* "/dev/video0" */
	char all[400];                       /* "/dev/video0 (name, serial 1), ..." for messages */
};

int v4l2_ask(int fd, unsigned long request, void *argument)
{
	int result;

	do
		result = ioctl(fd, request, argument);
	while (result < 0 && errno == EINTR);
	return result < 0 ? -errno : 0;
}

/* The first line of a file of the kernel's; "" when there is none. */
static void read_line(const char *path, char *line, size_t size)
{
	int fd = open(path, O_RDONLY | O_CLOEXEC);
	ssize_t length = fd < 0 ? 0 : read(fd, line, size - 1);

	if (fd >= 0)
		close(fd);
	line[length > 0 ? length : 0] = '\0';
	line[strcspn(line, "\n")] = '\0';
}

/* Of the USB device, whose interface the node's `device` is. */
static void read_serial(const char *name, char *serial, size_t size)
{
	char path[sizeof(CLASS_DIR) + NODE_BYTES + 32];

	snprintf(path, sizeof(path), CLASS_DIR "/%.31s/device/../serial", name);
	read_line(path, serial, size);
}

static uint32_t capabilities(const struct v4l2_capability *about)
{
	return about->capabilities & V4L2_CAP_DEVICE_CAPS ? about->device_caps
							  : about->capabilities;
}

/* 0, or a negative errno; -ENOTTY for what is no camera: a metadata or output node, another file.
 */
static int open_node(const char *node, int *fd, struct v4l2_capability *about)
{
	int made = open(node, O_RDWR | O_NONBLOCK | O_CLOEXEC);
	int error = made < 0 ? -errno : 0;

	if (!error && v4l2_ask(made, VIDIOC_QUERYCAP, about))
		error = -ENOTTY;
	if (!error &&
	    !(capabilities(about) & (V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_VIDEO_CAPTURE_MPLANE)))
		error = -ENOTTY;
	if (!error) {
		*fd = made;
		return 0;
	}
	if (made >= 0)
		close(made);
	return error;
}

typedef void found_node_fn(const char *node, const char *card, const char *serial, void *user);

static int by_number(const struct dirent **a, const struct dirent **b)
{
	return strverscmp((*a)->d_name, (*b)->d_name);
}

static int is_video(const struct dirent *entry)
{
	return strncmp(entry->d_name, "video", 5) == 0 && strlen(entry->d_name) < NODE_BYTES - 5;
}

/* Tells a camera's node; one that may not be opened bears the name that the kernel gives it. */
static void look_at(const char *name, found_node_fn *found, void *user)
{
	struct v4l2_capability about;
	char node[NODE_BYTES + 5], serial[64], card[64], path[sizeof(CLASS_DIR) + NODE_BYTES + 8];
	int fd, error;

	snprintf(node, sizeof(node), "/dev/%.26s", name);
	error = open_node(node, &fd, &about);
	if (error && error != -EACCES)
		return;
	read_serial(name, serial, sizeof(serial));
	if (!error) {
		snprintf(card, sizeof(card), "%.32s", (const char *)about.card);
		close(fd);
	} else {
		snprintf(path, sizeof(path), CLASS_DIR "/%.31s/name", name);
		read_line(path, card, 40);
		strcat(card, " (permission denied)");
	}
	found(node, card, serial, user);
}

/* Calls `found` for every camera, in the order of their numbers; false without V4L2. */
static bool walk(found_node_fn *found, void *user)
{
	struct dirent **entries;
	int count = scandir(CLASS_DIR, &entries, is_video, by_number);

	if (count < 0)
		return false;
	for (int i = 0; i < count; i++) {
		look_at(entries[i]->d_name, found, user);
		free(entries[i]);
	}
	free(entries);
	return true;
}

struct listing {
	int count;
	struct camera_info infos[LISTED_MAX];
};

static void collect(const char *node, const char *card, const char *serial, void *user)
{
	struct listing *listing = user;
	struct camera_info *info = &listing->infos[listing->count];

	if (listing->count == LISTED_MAX)
		return;
	listing->count++;
	*info = (struct camera_info){0};
	snprintf(info->address, sizeof(info->address), "v4l2:%s", node);
	snprintf(info->model, sizeof(info->model), "%.48s (%.10s)", card, node + 5);
	snprintf(info->serial, sizeof(info->serial), "%s", serial);
}

static bool has_own_serial(const struct listing *listing, const struct camera_info *info)
{
	int same = 0;

	for (int i = 0; i < listing->count; i++)
		same += strcmp(listing->infos[i].serial, info->serial) == 0;
	return *info->serial && same == 1;
}

/* By the serial number where one camera alone has it, so that it survives another socket. */
int v4l2_list(camera_found_fn *found, void *user, struct diag *diag)
{
	struct listing listing = {0};

	(void)diag;
	walk(collect, &listing);
	for (int i = 0; i < listing.count; i++) {
		struct camera_info info = listing.infos[i];

		if (has_own_serial(&listing, &info))
			snprintf(info.address, sizeof(info.address), "v4l2:serial=%s", info.serial);
		found(&info, user);
	}
	return 0;
}

static void match(const char *node, const char *card, const char *serial, void *user)
{
	struct search *search = user;
	const struct wish *wish = &search->wish;
	size_t used = strlen(search->all);

	snprintf(search->all + used, sizeof(search->all) - used, "%s%s (%s%s%s)", used ? ", " : "",
		 node, card, *serial ? ", serial " : "", serial);
	if ((*wish->serial && strcmp(serial, wish->serial) != 0) ||
	    (*wish->card && strcmp(card, wish->card) != 0) || search->count == MATCHES_MAX)
		return;
	snprintf(search->nodes[search->count++], NODE_BYTES, "%s", node);
}

/* "serial=A", "card=B" or "serial=A,card=B"; false for a node's name. */
static bool read_wish(struct wish *wish, const char *rest)
{
	*wish = (struct wish){0};
	if (strncmp(rest, "serial=", 7) == 0) {
		const char *end = strstr(rest, ",card=");
		int length = end ? (int)(end - rest) - 7 : (int)strlen(rest + 7);

		snprintf(wish->serial, sizeof(wish->serial), "%.*s", length, rest + 7);
		rest = end ? end + 1 : "";
		if (!end)
			return *wish->serial;
	}
	if (strncmp(rest, "card=", 5) == 0)
		snprintf(wish->card, sizeof(wish->card), "%s", rest + 5);
	return *wish->card;
}

static int report_missing(const struct v4l2_device *device, const struct search *search,
			  bool has_v4l2, struct diag *diag)
{
	if (!has_v4l2)
		diag_add(diag,
			 "%s: no such device: the kernel runs without V4L2 (" CLASS_DIR
			 " is missing); plug the camera in, or load its driver: modprobe uvcvideo",
			 device->address);
	else
		diag_add(diag, "%s: no such device; there %s%s", device->address,
			 *search->all ? "are " : "is no V4L2 camera: plug it in", search->all);
	return -ENODEV;
}

/* The node that the address means. */
static int resolve(const struct v4l2_device *device, const char *rest, char *node, size_t size,
		   struct diag *diag)
{
	struct search search = {0};

	if (!read_wish(&search.wish, rest)) {
		snprintf(node, size, "%s", rest);
		return 0;
	}
	bool has_v4l2 = walk(match, &search);

	if (search.count == 0)
		return report_missing(device, &search, has_v4l2, diag);
	if (search.count > 1) {
		diag_add(diag,
			 "%s: several devices match: name one by its node, or as "
			 "serial=...,card=...: %s",
			 device->address, search.all);
		return -EINVAL;
	}
	snprintf(node, size, "%s", search.nodes[0]);
	return 0;
}

static int report_open(const struct v4l2_device *device, int error, struct diag *diag)
{
	struct search search = {0};

	switch (error) {
	case -ENOENT:
	case -ENXIO:
	case -ENODEV:
		return report_missing(device, &search, walk(match, &search), diag);
	case -ENOTTY:
		diag_add(diag,
			 "%s: not a camera (a metadata or output node, or another file): 'stagectl "
			 "camera list' shows the cameras",
			 device->address);
		return -ENOTSUP;
	default:
		return v4l2_fail(device, error, "open", diag);
	}
}

int v4l2_fail(const struct v4l2_device *device, int error, const char *doing, struct diag *diag)
{
	const char *remedy = "look at the kernel's messages (dmesg), plug it in anew";

	if (error == -EACCES || error == -EPERM)
		remedy = "join the device's group: usermod -aG video USER (stage-operator where "
			 "stage "
			 "is installed)";
	else if (error == -EBUSY)
		remedy = "another program uses it: end that (fuser -v on the device names it), and "
			 "look whether the config has this camera twice";
	else if (error == -ENOSPC)
		remedy = "no bandwidth left on its bus: another USB controller, or a lower rate, "
			 "size or format";
	else if (error == -ENODEV)
		remedy = "it is gone: plug it in again";
	diag_add(diag, "%s: %s: %s; %s", device->address, doing, strerror(-error), remedy);
	return error;
}

int v4l2_open_device(struct v4l2_device *out, const char *rest, struct diag *diag)
{
	struct v4l2_device device = {.fd = -1};
	char node[128] = "";
	int error;

	snprintf(device.address, sizeof(device.address), "v4l2:%s", rest);
	error = resolve(&device, rest, node, sizeof(node), diag);
	if (error)
		return error;
	error = open_node(node, &device.fd, &device.about);
	if (error)
		return report_open(&device, error, diag);
	if (!(capabilities(&device.about) & V4L2_CAP_STREAMING)) {
		diag_add(diag, "%s: the camera cannot stream into memory: another one is needed",
			 device.address);
		close(device.fd);
		return -ENOTSUP;
	}
	device.type = capabilities(&device.about) & V4L2_CAP_VIDEO_CAPTURE
			      ? V4L2_BUF_TYPE_VIDEO_CAPTURE
			      : V4L2_BUF_TYPE_VIDEO_CAPTURE_MPLANE;
	if (strcmp(node, rest) != 0)
		snprintf(device.address, sizeof(device.address), "v4l2:%.100s (%.40s)", rest, node);
	*out = device;
	return 0;
}

/* uvcvideo is right when it was told to convert the camera's own stamps. */
bool v4l2_stamps_first_bytes(const struct v4l2_device *device)
{
	char answer[8];

	if (strcmp((const char *)device->about.driver, "uvcvideo") != 0)
		return false;
	read_line("/sys/module/uvcvideo/parameters/hwtimestamps", answer, sizeof(answer));
	return *answer != 'Y' && *answer != '1';
}
