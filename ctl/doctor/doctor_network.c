/*
 * Whether the network between GigE Vision cameras and this machine carries what they send.
 */
#include <arpa/inet.h>
#include <inttypes.h>
#include <string.h>

#include "ctl/doctor/doctor.h"
#include "ctl/doctor/doctor_route.h"
#include "ctl/doctor/doctor_tree.h"

#define SOCKET_WANTED_BYTES (8 << 20) /* what the driver asks for */
#define SOCKET_FRAMES 2
#define JUMBO_MTU 8000
#define SMALL_PACKETS_MAX_BYTES_PER_S 40e6 /* a fifth of the packets cost a fifth of the work */
#define WIRE_SHARE 0.94                    /* headers and gaps */
#define WIRE_NOTE_SHARE 0.9
#define RP_FILTER_STRICT 1

/* A network port with cameras behind it. */
struct port {
	char name[IF_NAMESIZE];
	uint32_t camera_count;
	double bytes_per_s;
	bool doubled;
};

struct ports {
	uint32_t count;
	struct port ports[CAMERA_MAX];
	uint64_t frame_max_bytes;
};

static struct port *port_of(struct ports *ports, const char *name)
{
	for (uint32_t p = 0; p < ports->count; p++)
		if (strcmp(ports->ports[p].name, name) == 0)
			return &ports->ports[p];
	struct port *port = &ports->ports[ports->count++];

	memcpy(port->name, name, sizeof(port->name));
	return port;
}

static void find_no_way(struct doctor *doctor, const struct config_camera *camera,
			const struct route *route)
{
	struct finding *finding = doctor_find(doctor, FINDING_PROBLEM, "way to %s, %s",
					      camera->name, camera->address);

	if (route)
		doctor_say(finding->measured, "through a gateway, by %s", route->interface);
	else
		doctor_say(finding->measured, "there is none");
	doctor_say(finding->limit, "a network port with an address in the camera's network");
	doctor_say(finding->remedy, "give the port of the cameras such an address: ip addr add, "
				    "and for good in /etc/network/interfaces or NetworkManager");
}

static void add_camera(struct doctor *doctor, struct ports *ports, uint32_t c)
{
	const struct config_camera *camera = &doctor->config->cameras[c];
	const struct doctor_load *load = &doctor->loads[c];
	struct in_addr ip;
	struct route route;

	if (strncmp(camera->address, "aravis:", 7) != 0 ||
	    inet_pton(AF_INET, camera->address + 7, &ip) != 1)
		return;
	bool has_way = route_find(doctor, ip, &route);

	if (!has_way || route.by_gateway) {
		find_no_way(doctor, camera, has_way ? &route : NULL);
		return;
	}
	struct port *port = port_of(ports, route.interface);

	port->camera_count++;
	port->bytes_per_s += load->bytes_per_s;
	port->doubled |= route.doubled;
	if (load->frame_bytes > ports->frame_max_bytes)
		ports->frame_max_bytes = load->frame_bytes;
}

static void check_buffers(struct doctor *doctor, const struct ports *ports)
{
	int64_t rmem_max, frames_bytes = SOCKET_FRAMES * (int64_t)ports->frame_max_bytes;

	if (!tree_number(doctor, &rmem_max, "/proc/sys/net/core/rmem_max"))
		return;
	enum finding_level level = ports->count && rmem_max < frames_bytes ? FINDING_PROBLEM
				   : rmem_max < SOCKET_WANTED_BYTES        ? FINDING_NOTE
									   : FINDING_OK;
	struct finding *finding = doctor_find(doctor, level, "net.core.rmem_max");

	doctor_say(finding->measured, "%" PRId64 " bytes", rmem_max);
	doctor_say(finding->limit, "at least %" PRId64 ", of which %d frames are %" PRId64,
		   (int64_t)SOCKET_WANTED_BYTES, SOCKET_FRAMES, frames_bytes);
	if (!ports->frame_max_bytes)
		doctor_say(finding->limit, "at least %d for GigE Vision", SOCKET_WANTED_BYTES);
	if (level != FINDING_OK)
		doctor_say(finding->remedy, "frames of GigE Vision come damaged: sysctl -w "
					    "net.core.rmem_max=33554432, for good by the installed "
					    "60-stage.conf");
}

static void check_state(struct doctor *doctor, const struct port *port)
{
	char state[32];

	if (!tree_line(doctor, state, sizeof(state), "/sys/class/net/%s/operstate", port->name))
		return;
	bool down = strcmp(state, "down") == 0 || strcmp(state, "lowerlayerdown") == 0;
	struct finding *finding =
		doctor_find(doctor, down ? FINDING_PROBLEM : FINDING_OK, "link of %s", port->name);

	doctor_say(finding->measured, "%s, %u cameras behind it", down ? "down" : "up",
		   port->camera_count);
	if (down)
		doctor_say(finding->remedy, "look at cable, switch and power; ip link set %s up",
			   port->name);
}

static void check_mtu(struct doctor *doctor, const struct port *port)
{
	int64_t mtu;

	if (!tree_number(doctor, &mtu, "/sys/class/net/%s/mtu", port->name))
		return;
	enum finding_level level = mtu >= JUMBO_MTU ? FINDING_OK
				   : port->bytes_per_s > SMALL_PACKETS_MAX_BYTES_PER_S
					   ? FINDING_PROBLEM
					   : FINDING_NOTE;
	struct finding *finding = doctor_find(doctor, level, "MTU of %s", port->name);

	doctor_say(finding->measured, "%" PRId64 ", cameras send %.0f MB/s", mtu,
		   port->bytes_per_s / 1e6);
	doctor_say(finding->limit, "jumbo frames: at least %d above %.0f MB/s", JUMBO_MTU,
		   SMALL_PACKETS_MAX_BYTES_PER_S / 1e6);
	if (level != FINDING_OK)
		doctor_say(finding->remedy,
			   "small packets cost five times the work: ip link set %s mtu 9000, and "
			   "the same in switch and cameras",
			   port->name);
}

static void check_speed(struct doctor *doctor, const struct port *port)
{
	int64_t mbit;

	if (!tree_number(doctor, &mbit, "/sys/class/net/%s/speed", port->name) || mbit <= 0)
		return;
	double carries = (double)mbit * 1e6 / 8 * WIRE_SHARE;
	double share = port->bytes_per_s / carries;
	enum finding_level level = share > 1                 ? FINDING_PROBLEM
				   : share > WIRE_NOTE_SHARE ? FINDING_NOTE
							     : FINDING_OK;
	struct finding *finding = doctor_find(doctor, level, "bandwidth of %s", port->name);

	doctor_say(finding->measured, "%.0f MB/s of %u cameras", port->bytes_per_s / 1e6,
		   port->camera_count);
	doctor_say(finding->limit, "%.0f MB/s at %" PRId64 " Mbit/s", carries / 1e6, mbit);
	if (level != FINDING_OK)
		doctor_say(finding->remedy,
			   "spread the cameras over more ports, take a faster one "
			   "(%s), or smaller images or rate",
			   mbit < 1000 ? "1000 is usual: look at the cable" : "2.5 or 10 Gbit/s");
}

static void check_filter(struct doctor *doctor, const struct port *port)
{
	int64_t all = 0, own = 0;

	tree_number(doctor, &all, "/proc/sys/net/ipv4/conf/all/rp_filter");
	if (!tree_number(doctor, &own, "/proc/sys/net/ipv4/conf/%s/rp_filter", port->name))
		return;
	int64_t filter = all > own ? all : own;
	bool drops = port->doubled && filter == RP_FILTER_STRICT;
	enum finding_level level = drops           ? FINDING_PROBLEM
				   : port->doubled ? FINDING_NOTE
						   : FINDING_OK;
	struct finding *finding = doctor_find(doctor, level, "rp_filter of %s", port->name);

	doctor_say(finding->measured, "%" PRId64 "%s", filter,
		   port->doubled ? ", and another port has the same network" : "");
	doctor_say(finding->limit, "not 1 (strict) where two ports have the same network");
	if (level != FINDING_OK)
		doctor_say(
			finding->remedy, "give each port a network of its own%s",
			drops ? ", or sysctl -w net.ipv4.conf.all.rp_filter=2: answers of cameras "
				"are thrown away"
			      : ": what is sent takes one port alone");
}

static void check_losses(struct doctor *doctor, const struct port *port)
{
	static const char *const counters[] = {"rx_missed_errors", "rx_fifo_errors",
					       "rx_crc_errors"};
	int64_t lost = 0, count;

	for (size_t k = 0; k < sizeof(counters) / sizeof(counters[0]); k++)
		if (tree_number(doctor, &count, "/sys/class/net/%s/statistics/%s", port->name,
				counters[k]))
			lost += count;
	struct finding *finding = doctor_find(doctor, lost ? FINDING_NOTE : FINDING_OK,
					      "packets lost by %s", port->name);

	doctor_say(finding->measured, "%" PRId64 " since the machine started", lost);
	if (lost)
		doctor_say(finding->remedy,
			   "when it grows while shooting: a longer receive queue "
			   "(ethtool -G %s rx 4096), better cables",
			   port->name);
}

void doctor_check_network(struct doctor *doctor)
{
	struct ports ports = {0};

	for (uint32_t c = 0; doctor->config && c < doctor->config->camera_count; c++)
		add_camera(doctor, &ports, c);
	check_buffers(doctor, &ports);
	for (uint32_t p = 0; p < ports.count; p++) {
		check_state(doctor, &ports.ports[p]);
		check_mtu(doctor, &ports.ports[p]);
		check_speed(doctor, &ports.ports[p]);
		check_filter(doctor, &ports.ports[p]);
		check_losses(doctor, &ports.ports[p]);
	}
}
