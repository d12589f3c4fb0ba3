/*
 * Whether the config's USB devices are plugged in, where they belong, and whether cameras that
 * share a bus or a hub fit through it together.
 */
#include "ctl/doctor/doctor_usb.h"

#include <inttypes.h>
#include <string.h>

#include "ctl/doctor/doctor_tree.h"
#include "drivers/usb/trigger_usb.h"

#define SHARE_NOTE 0.8
#define USBFS_PER_CAMERA_MB 64
#define SUPER_MBIT 5000
#define VERSION_SUPER 0x0210 /* what a USB 3 device says of itself on a USB 2 link */

struct plugged {
	uint32_t device[CAMERA_MAX]; /* by the config's cameras; or USB_NONE */
	uint32_t camera_count, vision_count;
};

/* What is left for pictures of a link, once the protocol has its share. */
static double carries_bytes_per_s(int speed_mbit)
{
	static const struct {
		int mbit;
		double bytes_per_s;
	} links[] = {{20000, 1800e6}, {10000, 900e6}, {5000, 400e6}, {480, 40e6}, {12, 1e6}};

	for (size_t i = 0; i < sizeof(links) / sizeof(links[0]); i++)
		if (speed_mbit >= links[i].mbit)
			return links[i].bytes_per_s;
	return 0;
}

/* Nodes may hang on other buses than USB, and ids may be those of network cameras. */
static void find_unplugged(struct doctor *doctor, uint32_t c)
{
	const struct config_camera *camera = &doctor->config->cameras[c];
	bool is_usb = strncmp(camera->address, "v4l2:serial=", 12) == 0;
	struct finding *finding;

	if (strncmp(camera->address, "v4l2:", 5) == 0 && !is_usb &&
	    tree_exists(doctor, camera->address + 5))
		return;
	finding = doctor_find(doctor, is_usb ? FINDING_PROBLEM : FINDING_NOTE, "%s, %s",
			      camera->name, camera->address);
	doctor_say(finding->measured, "is on no USB bus");
	doctor_say(finding->remedy, "%s",
		   strncmp(camera->address, "aravis:", 7) == 0
			   ? "plug it in; of a network camera write the IP address, so that its "
			     "network can be looked at"
			   : "plug it in; 'stagectl camera list' shows those that there are");
}

static void check_link(struct doctor *doctor, const char *name, const char *address,
		       const struct usb_device *device)
{
	bool slow = device->speed_mbit && device->speed_mbit < SUPER_MBIT;
	bool waits = slow && (device->is_vision || device->version >= VERSION_SUPER);
	enum finding_level level = waits && device->is_vision ? FINDING_PROBLEM
				   : waits                    ? FINDING_NOTE
							      : FINDING_OK;
	struct finding *finding = doctor_find(doctor, level, "%s, %s", name, address);

	doctor_say(finding->measured, "%d Mbit/s at %s", device->speed_mbit, device->name);
	if (waits) {
		doctor_say(finding->limit, "a USB 3 device: %d Mbit/s", SUPER_MBIT);
		doctor_say(finding->remedy,
			   "plug it into a USB 3 port with a USB 3 cable, or look at both");
	}
}

static void find_cameras(struct doctor *doctor, struct plugged *plugged)
{
	const struct config *config = doctor->config;

	for (uint32_t c = 0; c < config->camera_count; c++) {
		const char *address = config->cameras[c].address;

		plugged->device[c] = usb_of_camera(doctor, c);
		if (plugged->device[c] == USB_NONE) {
			if (usb_may_be_camera(address))
				find_unplugged(doctor, c);
			continue;
		}
		const struct usb_device *device = &doctor->facts.usb->devices[plugged->device[c]];

		plugged->camera_count++;
		plugged->vision_count += device->is_vision;
		check_link(doctor, config->cameras[c].name, address, device);
	}
}

/* The way up from a device: its own link, those of the hubs above it, its bus. */
static void check_share(struct doctor *doctor, const struct plugged *plugged,
			const struct usb_device *link)
{
	double sum = 0, carries = carries_bytes_per_s(link->speed_mbit);
	bool is_bus = strncmp(link->name, "usb", 3) == 0;
	uint32_t count = 0, unknown = 0;

	for (uint32_t c = 0; c < doctor->config->camera_count; c++) {
		uint32_t d = plugged->device[c];

		if (d == USB_NONE || !usb_is_below(doctor->facts.usb->devices[d].name, link->name))
			continue;
		count++;
		sum += doctor->loads[c].bytes_per_s;
		unknown += !doctor->loads[c].frame_bytes;
	}
	double share = carries > 0 ? sum / carries : 0;

	if (count == 0 || carries <= 0 || (!is_bus && count < 2 && share <= 1))
		return;
	enum finding_level level = share > 1                       ? FINDING_PROBLEM
				   : share > SHARE_NOTE || unknown ? FINDING_NOTE
								   : FINDING_OK;
	struct finding *finding =
		doctor_find(doctor, level, "%s %s", is_bus ? "bus" : "link", link->name);

	doctor_say(finding->measured, "%.0f MB/s of %u cameras", sum / 1e6, count);
	doctor_say(finding->limit, "carries %.0f MB/s at %d Mbit/s", carries / 1e6,
		   link->speed_mbit);
	if (share > SHARE_NOTE)
		doctor_say(finding->remedy, "give cameras a controller of their own (lsusb -t "
					    "shows them), or a lower rate, size or format");
	else if (unknown)
		doctor_say(finding->remedy,
			   "images of %u of them are of unknown size and not counted: write width "
			   "and height",
			   unknown);
}

/* Transfers of USB3 Vision go through memory of the kernel that has a limit for all. */
static void check_memory(struct doctor *doctor, const struct plugged *plugged)
{
	int64_t have_mb, needed_mb = USBFS_PER_CAMERA_MB * (int64_t)plugged->vision_count;

	if (!plugged->vision_count ||
	    !tree_number(doctor, &have_mb, "/sys/module/usbcore/parameters/usbfs_memory_mb"))
		return;
	bool enough = have_mb == 0 || have_mb >= needed_mb;
	struct finding *finding =
		doctor_find(doctor, enough ? FINDING_OK : FINDING_PROBLEM, "usbfs_memory_mb");

	doctor_say(finding->measured, "%" PRId64, have_mb);
	doctor_say(finding->limit, "at least %" PRId64 " for %u USB3 Vision cameras", needed_mb,
		   plugged->vision_count);
	if (!enough)
		doctor_say(finding->remedy,
			   "transfers fail: boot with usbcore.usbfs_memory_mb=1000, and until then "
			   "echo 1000 > /sys/module/usbcore/parameters/usbfs_memory_mb");
}

static void check_trigger(struct doctor *doctor, const char *rest)
{
	uint32_t d = usb_of_trigger(doctor, rest);
	struct finding *finding;

	if (d != USB_NONE) {
		check_link(doctor, "trigger", doctor->config->trigger,
			   &doctor->facts.usb->devices[d]);
		return;
	}
	finding = doctor_find(doctor, FINDING_PROBLEM, "trigger, %s", doctor->config->trigger);
	doctor_say(finding->measured, "no such adapter is on any USB bus");
	doctor_say(finding->remedy, "plug it in; lsusb -d 0403:6014 shows those that there are");
}

static void find_no_usb(struct doctor *doctor, bool needed)
{
	struct finding *finding =
		doctor_find(doctor, needed ? FINDING_PROBLEM : FINDING_NOTE, "USB");

	doctor_say(finding->measured, "cannot be looked at: %s", doctor->facts.usb->error);
	doctor_say(finding->remedy, "the kernel needs USB, and /sys and /dev/bus/usb be mounted");
}

void doctor_check_usb(struct doctor *doctor)
{
	const struct usb_topology *usb = doctor->facts.usb;
	const char *rest;
	bool has_trigger = doctor_trigger(doctor, &rest) == &usb_trigger_driver;
	struct plugged plugged = {0};

	if (*usb->error) {
		find_no_usb(doctor, has_trigger || doctor_uses(doctor, "v4l2"));
		return;
	}
	if (!doctor->config)
		return;
	find_cameras(doctor, &plugged);
	if (has_trigger)
		check_trigger(doctor, rest);
	for (uint32_t d = 0; d < usb->count; d++)
		check_share(doctor, &plugged, &usb->devices[d]);
	check_memory(doctor, &plugged);
}
