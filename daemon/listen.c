/*
 * Listening Unix sockets. A station that was killed leaves its socket behind: connecting to it
 * tells such a stale one from that of a live station.
 */
#include "daemon/listen.h"

#include <errno.h>
#include <stdbool.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#define BACKLOG 16
#define SOCKET_MODE 0660

static int fill_address(struct sockaddr_un *address, const char *path, struct diag *diag)
{
	*address = (struct sockaddr_un){.sun_family = AF_UNIX};
	if (strlen(path) >= sizeof(address->sun_path)) {
		diag_add(diag,
			 "%s: a socket path is at most %zu characters: choose a shorter socket_dir",
			 path, sizeof(address->sun_path) - 1);
		return -ENAMETOOLONG;
	}
	strcpy(address->sun_path, path);
	return 0;
}

static int new_socket(void)
{
	return socket(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
}

/* True unless the kernel says that nobody listens: when in doubt, leave the socket alone. */
static bool is_live(const struct sockaddr_un *address)
{
	int fd = new_socket();

	if (fd < 0)
		return true;
	bool refused = connect(fd, (const struct sockaddr *)address, sizeof(*address)) < 0 &&
		       errno == ECONNREFUSED;
	close(fd);
	return !refused;
}

/* 0 when nobody listens there, whether a socket is left or not. */
static int check_place(const struct sockaddr_un *address, struct diag *diag)
{
	struct stat st;

	if (lstat(address->sun_path, &st) < 0)
		return errno == ENOENT ? 0 : -errno;
	if (!S_ISSOCK(st.st_mode)) {
		diag_add(diag,
			 "%s: exists and is not a socket: remove it or choose another socket_dir",
			 address->sun_path);
		return -EEXIST;
	}
	if (is_live(address)) {
		diag_add(diag,
			 "%s: another station is listening here: stop it or choose another "
			 "socket_dir",
			 address->sun_path);
		return -EADDRINUSE;
	}
	return 0;
}

static int remove_stale(const struct sockaddr_un *address, struct diag *diag)
{
	int err = check_place(address, diag);

	if (err)
		return err;
	return unlink(address->sun_path) < 0 && errno != ENOENT ? -errno : 0;
}

/* fchmod before bind, so that the path never has wider rights; chmod after, because the umask may
 * have taken the group's away. */
static int bind_and_listen(int fd, const struct sockaddr_un *address)
{
	if (fchmod(fd, SOCKET_MODE) < 0 ||
	    bind(fd, (const struct sockaddr *)address, sizeof(*address)) < 0)
		return -errno;
	if (chmod(address->sun_path, SOCKET_MODE) < 0 || listen(fd, BACKLOG) < 0) {
		int r = -errno;

		unlink(address->sun_path);
		return r;
	}
	return 0;
}

int listen_check(const char *path, struct diag *diag)
{
	struct sockaddr_un address;
	int err = fill_address(&address, path, diag);

	if (err)
		return err;
	err = check_place(&address, diag);
	return err == -EADDRINUSE || err == -EEXIST ? err : 0;
}

int listen_unix(int *out_fd, const char *path, struct diag *diag)
{
	struct sockaddr_un address;
	int fd = -1;
	int r = fill_address(&address, path, diag);

	if (r < 0)
		return r;
	r = remove_stale(&address, diag);
	if (r == -EADDRINUSE || r == -EEXIST)
		return r;
	if (r < 0)
		goto fail;
	fd = new_socket();
	r = fd < 0 ? -errno : bind_and_listen(fd, &address);
	if (r < 0)
		goto fail;
	*out_fd = fd;
	return 0;
fail:
	diag_add(diag, "%s: cannot listen: %s: does its directory exist, writable for this user?",
		 path, strerror(-r));
	if (fd >= 0)
		close(fd);
	return r;
}
