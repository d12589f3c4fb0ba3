/*
 * Aravis keeps its stream socket to itself and asks for no more than net.core.rmem_max, whose
 * default holds a third of a frame; the socket is found by its port.
 */
#include <dirent.h>
#include <netinet/in.h>
#include <stdlib.h>
#include <sys/socket.h>
#include <unistd.h>

#include "base/log.h"
#include "drivers/aravis/aravis_device.h"

#define SOCKET_BYTES (8 << 20)

static bool has_port(int fd, guint16 port)
{
	struct sockaddr_in local;
	socklen_t size = sizeof(local);

	return getsockname(fd, (struct sockaddr *)&local, &size) == 0 &&
	       local.sin_family == AF_INET && ntohs(local.sin_port) == port;
}

/* -1 when there is none. */
static int find_socket(guint16 port)
{
	DIR *open_files = opendir("/proc/self/fd");
	int found = -1;

	for (struct dirent *entry; open_files && found < 0 && (entry = readdir(open_files));) {
		int fd = atoi(entry->d_name); /* "." and ".." become 0, which is no UDP socket */

		if (has_port(fd, port))
			found = fd;
	}
	if (open_files)
		closedir(open_files);
	return found;
}

/* For no protocol, so that nothing comes. */
bool aravis_may_have_packets(void)
{
	int fd = socket(AF_PACKET, SOCK_RAW | SOCK_CLOEXEC, 0);

	if (fd >= 0)
		close(fd);
	return fd >= 0;
}

void aravis_widen_socket(ArvStream *stream, const char *address, size_t payload_bytes)
{
	int fd = find_socket(arv_gv_stream_get_port(ARV_GV_STREAM(stream)));
	int wanted = SOCKET_BYTES, granted = 0;
	socklen_t size = sizeof(granted);

	if (fd < 0)
		return;
	if (setsockopt(fd, SOL_SOCKET, SO_RCVBUFFORCE, &wanted, sizeof(wanted)))
		setsockopt(fd, SOL_SOCKET, SO_RCVBUF, &wanted, sizeof(wanted));
	getsockopt(fd, SOL_SOCKET, SO_RCVBUF, &granted, &size);
	if ((size_t)granted / 2 < 2 * payload_bytes)
		log_warning(
			"%s: the kernel lets this socket hold %d bytes, a frame has %zu: frames "
			"may come damaged; 'sysctl net.core.rmem_max=%d' cures it",
			address, granted / 2, payload_bytes, wanted);
}
