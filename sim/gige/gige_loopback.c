/*
 * The dynamic linker takes a program's own functions before those of GLib and libc.
 */
#include "sim/gige/gige_loopback.h"

#include "sim/gige/gige_losses.h"

#include <arpa/inet.h>
#include <dlfcn.h>
#include <errno.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <gio/gio.h>

#include "base/clock.h"

#define GVCP_PORT 3956
#define NS_PER_BYTE 3.2                 /* of a 2.5 Gbit/s link */
#define PACE_SLACK_NS (200 * NS_PER_US) /* sent ahead of the link before the sender waits */
#define PIXEL_PACKET_BYTES 576u         /* larger packets carry pixels */

static struct ifaddrs offered[CAMERA_MAX];
static struct sockaddr_in addresses[CAMERA_MAX], netmask;
static char interface_name[] = "lo";

void gige_loopback_offer(const char *first_address, uint32_t count)
{
	struct in_addr first;

	if (inet_pton(AF_INET, first_address, &first) != 1)
		return;
	netmask = (struct sockaddr_in){.sin_family = AF_INET};
	netmask.sin_addr.s_addr = htonl(0xff000000);
	for (uint32_t i = 0; i < count && i < CAMERA_MAX; i++) {
		addresses[i] = (struct sockaddr_in){.sin_family = AF_INET};
		addresses[i].sin_addr.s_addr = htonl(ntohl(first.s_addr) + i);
		offered[i] = (struct ifaddrs){
			.ifa_next = i + 1 < count && i + 1 < CAMERA_MAX ? &offered[i + 1] : NULL,
			.ifa_name = interface_name,
			.ifa_flags = IFF_UP | IFF_LOOPBACK | IFF_RUNNING,
			.ifa_addr = (struct sockaddr *)&addresses[i],
			.ifa_netmask = (struct sockaddr *)&netmask,
			.ifa_broadaddr = (struct sockaddr *)&addresses[i],
		};
	}
}

__attribute__((visibility("default"))) int getifaddrs(struct ifaddrs **list)
{
	*list = offered;
	return 0;
}

__attribute__((visibility("default"))) void freeifaddrs(struct ifaddrs *list)
{
	(void)list;
}

static _Thread_local int control_fd = -1; /* of the camera whose thread this is */
static gige_answered_fn *watcher;
static void *watcher_user;

void gige_loopback_watch(gige_answered_fn *answered, void *user)
{
	watcher = answered;
	watcher_user = user;
}

/* A fake camera that wakes after its time computes a negative wait as unsigned and sleeps 100 ms.
 * It asks again after every timeout, so a short one costs it nothing. Its control port comes first,
 * and packets are dealt with when it polls again. */
__attribute__((visibility("default"))) gint g_poll(GPollFD *fds, guint count, gint timeout_ms)
{
	static _Thread_local int64_t packet_ns;

	control_fd = count ? fds[0].fd : -1;
	if (packet_ns && watcher && count)
		watcher(watcher_user, fds[0].fd, packet_ns);
	int ready = poll((struct pollfd *)fds, count, timeout_ms == 0 ? 0 : 1);

	packet_ns = ready > 0 ? clock_now_ns() : 0;
	return ready;
}

/* Aravis hears discovery on 255.255.255.255: from the loopback interface only, not from the net. */
__attribute__((visibility("default"))) int bind(int fd, __CONST_SOCKADDR_ARG address,
						socklen_t length)
{
	const struct sockaddr_in *inet = address.__sockaddr_in__;

	if (inet->sin_family == AF_INET && inet->sin_addr.s_addr == htonl(INADDR_BROADCAST) &&
	    setsockopt(fd, SOL_SOCKET, SO_BINDTODEVICE, interface_name, sizeof(interface_name)))
		return -1;
	return (int)syscall(SYS_bind, fd, inet, length);
}

/* Loopback has no wire that slows a sender down, and a socket that ordinary users may open holds a
 * third of a picture: without a pace the rest is lost whenever the receiver waits its turn. */
static void pace(gsize size_bytes)
{
	static _Thread_local int64_t link_free_ns;
	int64_t now_ns = clock_now_ns();

	if (link_free_ns < now_ns - PACE_SLACK_NS)
		link_free_ns = now_ns;
	link_free_ns += (int64_t)((double)size_bytes * NS_PER_BYTE);
	if (link_free_ns > now_ns + PACE_SLACK_NS)
		clock_sleep_until(link_free_ns);
}

/* Pictures leave from a socket of their own. */
static bool is_stream(int fd)
{
	static _Thread_local int last_fd = -1;
	static _Thread_local bool last;
	struct sockaddr_in local = {0};
	socklen_t size = sizeof(local);

	if (fd != last_fd) {
		getsockname(fd, (struct sockaddr *)&local, &size);
		last = ntohs(local.sin_port) != GVCP_PORT;
		last_fd = fd;
	}
	return last;
}

typedef gssize receive_message_fn(GSocket *, GSocketAddress **, GInputVector *, gint,
				  GSocketControlMessage ***, gint *, gint *, GCancellable *,
				  GError **);

/* The fake camera reads one command a picture: those that ask for lost packets, of which it knows
 * nothing, are answered here, and the next one is read in their place. */
__attribute__((visibility("default"))) gssize
g_socket_receive_message(GSocket *socket, GSocketAddress **from, GInputVector *vectors, gint count,
			 GSocketControlMessage ***messages, gint *message_count, gint *flags,
			 GCancellable *cancellable, GError **error)
{
	static receive_message_fn *next;
	gssize size;

	if (!next)
		*(void **)&next = dlsym(RTLD_NEXT, "g_socket_receive_message");
	for (;;) {
		size = next(socket, from, vectors, count, messages, message_count, flags,
			    cancellable, error);
		if (size <= 0 || !gige_losses_asked(vectors[0].buffer, (size_t)size))
			return size;
		if (from)
			g_clear_object(from);
	}
}

__attribute__((visibility("default"))) gssize
g_socket_send_to(GSocket *socket, GSocketAddress *address, const gchar *bytes, gsize size_bytes,
		 GCancellable *cancellable, GError **error)
{
	struct sockaddr_in to;
	ssize_t sent = -1;

	(void)cancellable;
	if (g_socket_address_to_native(address, &to, sizeof(to), error)) {
		int fd = g_socket_get_fd(socket);

		if (is_stream(fd) && gige_losses_take(control_fd, fd, &to, bytes, size_bytes))
			return (gssize)size_bytes;
		sent = sendto(fd, bytes, size_bytes, 0, (struct sockaddr *)&to, sizeof(to));
		if (sent < 0)
			g_set_error_literal(error, G_IO_ERROR, g_io_error_from_errno(errno),
					    g_strerror(errno));
	}
	if (size_bytes > PIXEL_PACKET_BYTES)
		pace(size_bytes);
	return sent;
}
