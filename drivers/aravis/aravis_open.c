/*
 * Finding and opening a device, and saying why not: unreachable, not a camera, or busy.
 */
#include <arpa/inet.h>
#include <errno.h>
#include <ifaddrs.h>
#include <poll.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#include "drivers/aravis/aravis_device.h"

#define GVCP_PORT 3956
#define PROBE_TRIES 3
#define PROBE_WAIT_MS 300

static const char *remedy(const GError *error)
{
	if (!error || error->domain != ARV_DEVICE_ERROR)
		return "start it anew, or leave this to the camera";
	switch (error->code) {
	case ARV_DEVICE_ERROR_TIMEOUT:
		return "it does not answer: check power and cable";
	case ARV_DEVICE_ERROR_NOT_CONNECTED:
	case ARV_DEVICE_ERROR_NOT_CONTROLLER:
	case ARV_DEVICE_ERROR_PROTOCOL_ERROR_ACCESS_DENIED:
	case ARV_DEVICE_ERROR_PROTOCOL_ERROR_BUSY:
		return "another program took it, or it was started anew: end that program";
	case ARV_DEVICE_ERROR_GENICAM_NOT_FOUND:
		return "it does not describe itself: start it anew, or update its firmware";
	default:
		return "start it anew";
	}
}

/* Nobody answers any more. */
static bool is_gone(const GError *error)
{
	return error && error->domain == ARV_DEVICE_ERROR &&
	       (error->code == ARV_DEVICE_ERROR_TIMEOUT ||
		error->code == ARV_DEVICE_ERROR_NOT_CONNECTED ||
		error->code == ARV_DEVICE_ERROR_NOT_FOUND);
}

int aravis_fail(GError **error, int error_number, const char *address, const char *doing,
		struct diag *diag)
{
	diag_add(diag, "%s: %s: %s; %s", address, doing,
		 *error ? (*error)->message : "Aravis gives no reason", remedy(*error));
	if (is_gone(*error))
		error_number = -ENODEV;
	g_clear_error(error);
	return error_number;
}

static void fill_info(struct camera_info *info, unsigned int i)
{
	const char *protocol = arv_get_device_protocol(i);
	const char *address = arv_get_device_address(i);
	bool by_ip = protocol && address && strcmp(protocol, "GigEVision") == 0;

	*info = (struct camera_info){0};
	snprintf(info->address, sizeof(info->address), "aravis:%s",
		 by_ip ? address : arv_get_device_id(i));
	snprintf(info->model, sizeof(info->model), "%s %s",
		 arv_get_device_vendor(i) ? arv_get_device_vendor(i) : "unknown",
		 arv_get_device_model(i) ? arv_get_device_model(i) : "");
	snprintf(info->serial, sizeof(info->serial), "%s",
		 arv_get_device_serial_nbr(i) ? arv_get_device_serial_nbr(i) : "");
}

int aravis_list(camera_found_fn *found, void *user, struct diag *diag)
{
	(void)diag;
	arv_update_device_list();
	for (unsigned int i = 0; i < arv_get_n_devices(); i++) {
		struct camera_info info;

		fill_info(&info, i);
		found(&info, user);
	}
	return 0;
}

/* Asks for a GigE Vision discovery acknowledge; waits for it. 0, or a negative errno:
 * -ECONNREFUSED: a machine without a camera, -ETIMEDOUT: nobody, others: no way there. */
static int ask_once(int fd)
{
	static const uint8_t discovery_command[8] = {0x42, 0x01, 0x00, 0x02, 0, 0, 0, 1};
	struct pollfd answer = {.fd = fd, .events = POLLIN};
	uint8_t reply[512];

	if (send(fd, discovery_command, sizeof(discovery_command), 0) < 0)
		return -errno;
	if (poll(&answer, 1, PROBE_WAIT_MS) <= 0)
		return -ETIMEDOUT;
	return recv(fd, reply, sizeof(reply), 0) < 0 ? -errno : 0;
}

int aravis_probe(struct in_addr ip)
{
	struct sockaddr_in camera = {
		.sin_family = AF_INET, .sin_port = htons(GVCP_PORT), .sin_addr = ip};
	int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
	int error = fd < 0 ? -errno : -ETIMEDOUT;

	if (fd >= 0 && connect(fd, (struct sockaddr *)&camera, sizeof(camera)))
		error = -errno;
	for (int i = 0; i < PROBE_TRIES && error == -ETIMEDOUT; i++)
		error = ask_once(fd);
	if (fd >= 0)
		close(fd);
	return error;
}

/* "lo 127.0.0.1/8, eth0 192.168.1.5/24"; whether one of them holds the address. */
static bool in_own_network(struct in_addr ip, char *list, size_t size)
{
	struct ifaddrs *all = NULL;
	bool found = false;

	*list = '\0';
	if (getifaddrs(&all))
		return true; /* nothing is known */
	for (const struct ifaddrs *one = all; one; one = one->ifa_next) {
		const struct sockaddr_in *own = (const struct sockaddr_in *)one->ifa_addr;
		const struct sockaddr_in *mask = (const struct sockaddr_in *)one->ifa_netmask;
		char text[INET_ADDRSTRLEN];
		size_t used = strlen(list);

		if (!own || !mask || own->sin_family != AF_INET)
			continue;
		found |= !((own->sin_addr.s_addr ^ ip.s_addr) & mask->sin_addr.s_addr);
		inet_ntop(AF_INET, &own->sin_addr, text, sizeof(text));
		snprintf(list + used, size - used, "%s%s %s/%d", used ? ", " : "", one->ifa_name,
			 text, __builtin_popcount(mask->sin_addr.s_addr));
	}
	freeifaddrs(all);
	return found;
}

static const char *const no_way =
	"give the network port of the cameras an address in the camera's network, or the camera "
	"one in the port's";

static int report_probe(int error, const char *address, struct in_addr ip, struct diag *diag)
{
	char networks[300];
	bool near = in_own_network(ip, networks, sizeof(networks));

	if (error == -ECONNREFUSED)
		diag_add(diag,
			 "%s: no camera here: the machine at this address does not speak GigE "
			 "Vision (UDP port %d is closed); check the address with 'stagectl camera "
			 "list'",
			 address, GVCP_PORT);
	else if (error == -EACCES || error == -EPERM)
		diag_add(diag,
			 "%s: permission denied: a broadcast address, or a firewall of this "
			 "machine forbids UDP port %d; address one camera, or allow the port",
			 address, GVCP_PORT);
	else if (error == -ETIMEDOUT && near)
		diag_add(diag,
			 "%s: unreachable: no answer on UDP port %d; check power, cable and the "
			 "camera's address with 'stagectl camera list'",
			 address, GVCP_PORT);
	else
		diag_add(diag, "%s: unreachable: %s%s; this machine's networks are %s: %s", address,
			 error == -ETIMEDOUT ? "no answer" : strerror(-error),
			 near ? "" : ", and another network", *networks ? networks : "none",
			 no_way);
	return error == -ECONNREFUSED                ? -ENODEV
	       : error == -EACCES || error == -EPERM ? -EACCES
						     : -EHOSTUNREACH;
}

static bool same(const char *a, const char *b)
{
	return a && b && strcmp(a, b) == 0;
}

/* The device id that Aravis opens, for an id or a serial number; NULL when there is none such. */
static const char *find_listed(const char *rest)
{
	arv_update_device_list();
	for (unsigned int i = 0; i < arv_get_n_devices(); i++)
		if (same(arv_get_device_id(i), rest) || same(arv_get_device_serial_nbr(i), rest) ||
		    same(arv_get_device_physical_id(i), rest))
			return arv_get_device_id(i);
	return NULL;
}

/* What Aravis is to open; `rest` itself when it is an IP address at which a camera answers. */
static int resolve(const char **id, const char *address, const char *rest, struct diag *diag)
{
	struct in_addr ip;

	if (inet_pton(AF_INET, rest, &ip) == 1) {
		int error = aravis_probe(ip);

		*id = rest;
		return error ? report_probe(error, address, ip, diag) : 0;
	}
	*id = find_listed(rest);
	if (*id)
		return 0;
	diag_add(diag,
		 "%s: no such camera: none with this id or serial number answers; 'stagectl camera "
		 "list' shows those that do (%u now), an IP address always works, and a USB camera "
		 "shows to the group stage-operator only",
		 address, arv_get_n_devices());
	return -ENODEV;
}

static bool in_control(ArvCamera *device)
{
	return !arv_camera_is_gv_device(device) ||
	       arv_gv_device_is_controller(ARV_GV_DEVICE(arv_camera_get_device(device)));
}

int aravis_open_device(ArvCamera **out, const char *address, const char *rest, struct diag *diag)
{
	const char *id;
	GError *error = NULL;
	int result = resolve(&id, address, rest, diag);

	if (result)
		return result;
	ArvCamera *device = arv_camera_new(id, &error);

	if (!device)
		return aravis_fail(&error, -EIO, address, "answers, but cannot be used as a camera",
				   diag);
	if (!in_control(device)) {
		diag_add(diag,
			 "%s: busy: another program controls this camera; end it (after a crash "
			 "the camera lets go within a few seconds), and look whether the config "
			 "has this camera twice",
			 address);
		g_object_unref(device);
		return -EBUSY;
	}
	*out = device;
	return 0;
}
