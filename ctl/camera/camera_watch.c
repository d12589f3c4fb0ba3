/*
 * udev says when a device came or went, and the drivers are asked what it was. Network cameras tell
 * nobody: they are looked for every two seconds. One answer may get lost, so that a camera is gone
 * when it is missing twice.
 */
#include "ctl/camera/camera_watch.h"

#include <errno.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <systemd/sd-device.h>
#include <systemd/sd-event.h>
#include <time.h>
#include <unistd.h>

#include "base/exit_codes.h"
#include "ctl/camera/camera_inventory.h"
#include "ctl/print_json.h"

#define LOOK_US UINT64_C(2000000)
#define LOOK_SOON_US UINT64_C(200000) /* a device comes with several nodes */
#define MISSING_MAX 2

struct watched {
	struct camera_info info;
	int missing; /* times in a row */
};

struct watch {
	bool json;
	int code;
	sd_event *event;
	sd_event_source *timer;
	sd_device_monitor *monitor; /* NULL without udev */
	uint32_t count;
	struct watched cameras[INVENTORY_MAX];
	struct inventory now;
};

static int tell(struct watch *watch, const char *event, const struct camera_info *info)
{
	char clock[16];
	time_t now = time(NULL);
	struct tm local;

	strftime(clock, sizeof(clock), "%H:%M:%S", localtime_r(&now, &local));
	if (watch->json) {
		json_t *object = inventory_camera_json(info);

		json_object_set_new(object, "event", json_string(event));
		print_json(object);
	} else {
		printf("%s  %-9s %-32s %-28s %s\n", clock, event, info->address, info->model,
		       info->serial);
	}
	if (fflush(stdout) == 0)
		return 0;
	fprintf(stderr, "stagectl: standard output: %s\n", strerror(errno));
	watch->code = EXIT_CODE_INTERNAL;
	return sd_event_exit(watch->event, 0);
}

static bool is_watched(const struct watch *watch, const char *address)
{
	for (uint32_t c = 0; c < watch->count; c++)
		if (strcmp(watch->cameras[c].info.address, address) == 0)
			return true;
	return false;
}

static void add_arrivals(struct watch *watch, const char *event)
{
	for (uint32_t c = 0; c < watch->now.count && watch->count < INVENTORY_MAX; c++) {
		if (is_watched(watch, watch->now.cameras[c].address))
			continue;
		watch->cameras[watch->count++] = (struct watched){watch->now.cameras[c], 0};
		tell(watch, event, &watch->now.cameras[c]);
	}
}

/* True while one is missing and not yet told of. */
static bool drop_departures(struct watch *watch)
{
	bool in_doubt = false;
	uint32_t kept = 0;

	for (uint32_t c = 0; c < watch->count; c++) {
		struct watched *camera = &watch->cameras[c];

		if (inventory_find(&watch->now, camera->info.address))
			camera->missing = 0;
		else
			camera->missing++;
		if (camera->missing >= MISSING_MAX) {
			tell(watch, "departed", &camera->info);
			continue;
		}
		in_doubt |= camera->missing > 0;
		watch->cameras[kept++] = *camera;
	}
	watch->count = kept;
	return in_doubt;
}

static void look_in(struct watch *watch, uint64_t delay_us)
{
	sd_event_source_set_time_relative(watch->timer, delay_us);
	sd_event_source_set_enabled(watch->timer, SD_EVENT_ONESHOT);
}

/* What a driver complains of was said at the first look. */
static int look(sd_event_source *source, uint64_t time_us, void *user)
{
	struct watch *watch = user;

	(void)source;
	(void)time_us;
	inventory_take(&watch->now, NULL);
	bool in_doubt = drop_departures(watch);

	add_arrivals(watch, "arrived");
	look_in(watch, in_doubt ? LOOK_SOON_US : LOOK_US);
	return 0;
}

static int device_changed(sd_device_monitor *monitor, sd_device *device, void *user)
{
	(void)monitor;
	(void)device;
	look_in(user, LOOK_SOON_US);
	return 0;
}

static int begin(struct watch *watch)
{
	struct diag diag = {0};
	int err = inventory_take(&watch->now, &diag);

	diag_print(&diag, stderr);
	diag_finish(&diag);
	add_arrivals(watch, "present");
	if (!watch->count && !watch->json) {
		puts("no camera is there now");
		fflush(stdout);
	}
	return err;
}

/* 0, or a negative errno where no udev runs. */
static int open_monitor(struct watch *watch)
{
	static const char *const subsystems[] = {"video4linux", "media", "usb"};
	int err = access("/run/udev/control", F_OK) < 0 ? -ENOENT
							: sd_device_monitor_new(&watch->monitor);

	for (size_t s = 0; s < sizeof(subsystems) / sizeof(subsystems[0]) && err >= 0; s++)
		err = sd_device_monitor_filter_add_match_subsystem_devtype(watch->monitor,
									   subsystems[s], NULL);
	if (err >= 0)
		err = sd_device_monitor_attach_event(watch->monitor, watch->event);
	if (err >= 0)
		err = sd_device_monitor_start(watch->monitor, device_changed, watch);
	return err < 0 ? err : 0;
}

static void note_no_udev(int err)
{
	fprintf(stderr,
		"stagectl: no udev: %s: cameras are looked for every %u s, instead of being told "
		"of; start it: systemctl start systemd-udevd\n",
		strerror(-err), (unsigned int)(LOOK_US / 1000000));
}

static int open_events(struct watch *watch, uint64_t seconds)
{
	sigset_t ends;
	int err = sd_event_new(&watch->event);

	sigemptyset(&ends);
	sigaddset(&ends, SIGINT);
	sigaddset(&ends, SIGTERM);
	sigprocmask(SIG_BLOCK, &ends, NULL);
	if (err >= 0)
		err = sd_event_add_signal(watch->event, NULL, SIGINT, NULL, NULL);
	if (err >= 0)
		err = sd_event_add_signal(watch->event, NULL, SIGTERM, NULL, NULL);
	if (err >= 0)
		err = sd_event_add_time_relative(watch->event, &watch->timer, CLOCK_MONOTONIC,
						 LOOK_US, 0, look, watch);
	if (err >= 0 && seconds)
		err = sd_event_add_time_relative(watch->event, NULL, CLOCK_MONOTONIC,
						 seconds * 1000000, 0, NULL, NULL);
	return err < 0 ? err : 0;
}

static int run(struct watch *watch, uint64_t seconds)
{
	int err = open_events(watch, seconds);
	int no_udev = err ? 0 : open_monitor(watch);

	if (no_udev)
		note_no_udev(no_udev);
	if (!err) {
		begin(watch);
		err = sd_event_loop(watch->event);
	}
	if (err < 0)
		fprintf(stderr, "stagectl: cannot watch: %s\n", strerror(-err));
	return err < 0 ? EXIT_CODE_INTERNAL : watch->code;
}

int camera_watch(bool json, uint64_t seconds)
{
	struct watch *watch = calloc(1, sizeof(*watch));

	if (!watch)
		return EXIT_CODE_INTERNAL;
	watch->json = json;
	int code = run(watch, seconds);

	sd_device_monitor_unref(watch->monitor);
	sd_event_source_unref(watch->timer);
	sd_event_unref(watch->event);
	free(watch);
	return code;
}
