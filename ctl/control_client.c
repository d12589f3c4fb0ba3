/*
 * Varlink calls over a Unix socket: a JSON object and a NUL each way.
 */
#include "ctl/control_client.h"

#include <errno.h>
#include <grp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/time.h>
#include <sys/un.h>
#include <unistd.h>

#include "base/exit_codes.h"
#include "ctl/control_reply.h"

#define REPLY_MAX_BYTES (64u << 20) /* an image of a large camera */
#define REPLY_TIMEOUT_S 10

bool control_listens(const char *socket_dir)
{
	struct sockaddr_un address = {.sun_family = AF_UNIX};
	int length =
		snprintf(address.sun_path, sizeof(address.sun_path), "%s/control.sock", socket_dir);
	int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
	bool listens = length < (int)sizeof(address.sun_path) &&
		       connect(fd, (struct sockaddr *)&address, sizeof(address)) == 0;

	if (fd >= 0)
		close(fd);
	return listens;
}

/* The group of the socket, or of the nearest directory that can be looked at. */
static const char *group_of(const struct sockaddr_un *address)
{
	char path[sizeof(address->sun_path)];
	struct stat st;

	memcpy(path, address->sun_path, sizeof(path));
	for (char *slash; stat(path, &st) < 0 && (slash = strrchr(path, '/')); *slash = '\0')
		if (slash == path)
			return NULL;
	const struct group *group = path[0] ? getgrgid(st.st_gid) : NULL;
	return group ? group->gr_name : NULL;
}

static int report_unreachable(const struct sockaddr_un *address, int err)
{
	if (err == EACCES || err == EPERM) {
		const char *group = group_of(address);

		fprintf(stderr,
			"stagectl: %s: not permitted: it takes the group %s, and stage-operator "
			"for whoever commands; add yourself to both and log in again\n",
			address->sun_path, group ? group : "stage");
		return EXIT_CODE_PERMISSION;
	}
	fprintf(stderr,
		"stagectl: %s: no station answers: %s; is staged running, with this "
		"--socket-dir?\n",
		address->sun_path, strerror(err));
	return EXIT_CODE_CONNECTION;
}

static int connect_station(int *out_fd, const char *socket_dir)
{
	struct sockaddr_un address = {.sun_family = AF_UNIX};
	struct timeval timeout = {.tv_sec = REPLY_TIMEOUT_S};
	int length =
		snprintf(address.sun_path, sizeof(address.sun_path), "%s/control.sock", socket_dir);

	if (length >= (int)sizeof(address.sun_path)) {
		fprintf(stderr, "stagectl: %s: path too long for a socket\n", socket_dir);
		return EXIT_CODE_CONNECTION;
	}
	int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
	if (fd < 0 || connect(fd, (struct sockaddr *)&address, sizeof(address)) < 0) {
		int code = report_unreachable(&address, errno);

		if (fd >= 0)
			close(fd);
		return code;
	}
	setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &timeout, sizeof(timeout));
	setsockopt(fd, SOL_SOCKET, SO_SNDTIMEO, &timeout, sizeof(timeout));
	*out_fd = fd;
	return 0;
}

struct connection {
	int fd;
	char *bytes; /* owned; received and not yet used */
	size_t size, room;
	int with_fd; /* owned; -1: none came */
};

static int send_call(int fd, const char *method, json_t *parameters, bool more)
{
	json_t *call = json_pack("{s:s, s:o, s:b}", "method", method, "parameters",
				 parameters ? parameters : json_object(), "more", more);
	char *text = json_dumps(call, JSON_COMPACT);
	int err = text ? 0 : -ENOMEM;

	json_decref(call);
	for (size_t sent = 0, size = text ? strlen(text) + 1 : 0; sent < size;) {
		ssize_t sent_now = send(fd, text + sent, size - sent, MSG_NOSIGNAL);

		if (sent_now <= 0) {
			/* one that is turned away has been told why */
			err = errno == EPIPE ? 0 : -errno;
			break;
		}
		sent += (size_t)sent_now;
	}
	free(text);
	return err;
}

static void keep_fd(struct connection *connection, struct msghdr *message)
{
	for (struct cmsghdr *c = CMSG_FIRSTHDR(message); c; c = CMSG_NXTHDR(message, c)) {
		if (c->cmsg_level != SOL_SOCKET || c->cmsg_type != SCM_RIGHTS)
			continue;
		if (connection->with_fd >= 0)
			close(connection->with_fd);
		memcpy(&connection->with_fd, CMSG_DATA(c), sizeof(int));
	}
}

static ssize_t receive_some(struct connection *connection)
{
	char room[CMSG_SPACE(sizeof(int))] __attribute__((aligned(sizeof(struct cmsghdr))));
	struct iovec bytes = {connection->bytes + connection->size,
			      connection->room - connection->size};
	struct msghdr message = {.msg_iov = &bytes,
				 .msg_iovlen = 1,
				 .msg_control = room,
				 .msg_controllen = sizeof(room)};
	ssize_t got = recvmsg(connection->fd, &message, MSG_CMSG_CLOEXEC);

	if (got > 0)
		keep_fd(connection, &message);
	return got;
}

static int receive_more(struct connection *connection)
{
	if (connection->size == connection->room) {
		size_t room = connection->room ? 2 * connection->room : 65536;
		char *bigger = room <= REPLY_MAX_BYTES ? realloc(connection->bytes, room) : NULL;

		if (!bigger)
			return -ENOMEM;
		connection->bytes = bigger;
		connection->room = room;
	}
	ssize_t got = receive_some(connection);

	if (got <= 0)
		return got < 0 ? -errno : -ECONNRESET;
	connection->size += (size_t)got;
	return 0;
}

/* Until a whole reply is at the front of the bytes; *size_bytes includes its NUL. */
static int receive_reply(struct connection *connection, size_t *size_bytes)
{
	size_t seen = 0;

	for (;;) {
		char *from = connection->bytes ? connection->bytes + seen : NULL;
		char *end = from ? memchr(from, '\0', connection->size - seen) : NULL;

		if (end) {
			*size_bytes = (size_t)(end - connection->bytes) + 1;
			return 0;
		}
		seen = connection->size;
		int err = receive_more(connection);
		if (err)
			return err;
	}
}

static int next_reply(json_t **out, bool *continues, struct connection *connection,
		      const char *socket_dir)
{
	size_t size_bytes;
	int err = receive_reply(connection, &size_bytes);

	if (err == -EAGAIN) {
		fprintf(stderr,
			"stagectl: %s: the station gives no answer for %d s: it hangs, or was "
			"stopped, or its machine is overloaded\n",
			socket_dir, REPLY_TIMEOUT_S);
		return EXIT_CODE_CONNECTION;
	}
	if (err) {
		fprintf(stderr, "stagectl: %s: the station stopped answering: %s\n", socket_dir,
			strerror(-err));
		return EXIT_CODE_CONNECTION;
	}
	int code = control_reply_unpack(out, continues, connection->bytes);
	connection->size -= size_bytes;
	memmove(connection->bytes, connection->bytes + size_bytes, connection->size);
	return code;
}

static int begin_call(struct connection *connection, const char *socket_dir, const char *method,
		      json_t *parameters, bool more)
{
	*connection = (struct connection){.fd = -1, .with_fd = -1};
	int code = connect_station(&connection->fd, socket_dir);

	if (code) {
		json_decref(parameters);
		return code;
	}
	int err = send_call(connection->fd, method, parameters, more);
	if (!err)
		return EXIT_CODE_OK;
	fprintf(stderr, "stagectl: %s: the station does not listen: %s\n", socket_dir,
		strerror(-err));
	return EXIT_CODE_CONNECTION;
}

static void end_call(struct connection *connection)
{
	if (connection->fd >= 0)
		close(connection->fd);
	if (connection->with_fd >= 0)
		close(connection->with_fd);
	free(connection->bytes);
}

int control_ask(json_t **out, const char *socket_dir, const char *method, json_t *parameters)
{
	struct connection connection;
	bool continues;
	int code = begin_call(&connection, socket_dir, method, parameters, false);

	if (code == EXIT_CODE_OK)
		code = next_reply(out, &continues, &connection, socket_dir);
	end_call(&connection);
	return code;
}

int control_ask_fd(json_t **out, int *fd, const char *socket_dir, const char *method)
{
	struct connection connection;
	bool continues;
	int code = begin_call(&connection, socket_dir, method, NULL, false);

	if (code == EXIT_CODE_OK)
		code = next_reply(out, &continues, &connection, socket_dir);
	if (code == EXIT_CODE_OK) {
		*fd = connection.with_fd;
		connection.with_fd = -1;
	}
	end_call(&connection);
	return code;
}

int control_hold(int *fd, const char *socket_dir, const char *method)
{
	struct connection connection;
	bool continues;
	json_t *reply;
	int code = begin_call(&connection, socket_dir, method, NULL, true);

	if (code == EXIT_CODE_OK)
		code = next_reply(&reply, &continues, &connection, socket_dir);
	if (code == EXIT_CODE_OK) {
		json_decref(reply);
		*fd = connection.fd;
		connection.fd = -1;
	}
	end_call(&connection);
	return code;
}

int control_follow(const char *socket_dir, const char *method, control_reply_fn *take, void *user)
{
	struct connection connection;
	bool continues = true;
	int code = begin_call(&connection, socket_dir, method, NULL, true);

	while (code == EXIT_CODE_OK && continues) {
		json_t *parameters;

		code = next_reply(&parameters, &continues, &connection, socket_dir);
		if (code == EXIT_CODE_OK) {
			continues &= take(parameters, user);
			json_decref(parameters);
		}
	}
	end_call(&connection);
	return code;
}
