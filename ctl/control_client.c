/*
 * One varlink call over a Unix socket: a JSON object and a NUL each way.
 */
#include "ctl/control_client.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <sys/un.h>
#include <unistd.h>

#include "base/exit_codes.h"

#define REPLY_MAX_BYTES (64u << 20) /* an image of a large camera */
#define REPLY_TIMEOUT_S 10

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
		fprintf(stderr,
			"stagectl: %s: no station answers: %s; is staged running, with this "
			"--socket-dir?\n",
			address.sun_path, strerror(errno));
		if (fd >= 0)
			close(fd);
		return EXIT_CODE_CONNECTION;
	}
	setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &timeout, sizeof(timeout));
	setsockopt(fd, SOL_SOCKET, SO_SNDTIMEO, &timeout, sizeof(timeout));
	*out_fd = fd;
	return 0;
}

static int send_call(int fd, const char *method, json_t *parameters)
{
	json_t *call = json_pack("{s:s, s:o}", "method", method, "parameters",
				 parameters ? parameters : json_object());
	char *text = json_dumps(call, JSON_COMPACT);
	int err = text ? 0 : -ENOMEM;

	json_decref(call);
	for (size_t sent = 0, size = text ? strlen(text) + 1 : 0; sent < size;) {
		ssize_t more = send(fd, text + sent, size - sent, MSG_NOSIGNAL);

		if (more <= 0) {
			err = -errno;
			break;
		}
		sent += (size_t)more;
	}
	free(text);
	return err;
}

/* `*out` is the caller's, also on failure (may be NULL). */
static int receive_reply(int fd, char **out)
{
	size_t size = 0, room = 0;

	for (;;) {
		if (size == room) {
			room = room ? 2 * room : 65536;
			char *bigger = room <= REPLY_MAX_BYTES ? realloc(*out, room) : NULL;
			if (!bigger)
				return -ENOMEM;
			*out = bigger;
		}
		ssize_t got = recv(fd, *out + size, room - size, 0);
		if (got <= 0)
			return got < 0 ? -errno : -ECONNRESET;
		size += (size_t)got;
		if ((*out)[size - 1] == '\0')
			return 0;
	}
}

/* The reply's parameters, or a message for its error. */
static int unpack_reply(json_t **out, const char *text)
{
	json_t *reply = json_loads(text, 0, NULL);
	const char *error = json_string_value(json_object_get(reply, "error"));
	json_t *parameters = json_object_get(reply, "parameters");
	int code = EXIT_CODE_OK;

	if (error) {
		char *details = json_dumps(parameters, JSON_COMPACT);

		fprintf(stderr, "stagectl: the station refused: %s %s\n", error,
			details ? details : "");
		free(details);
		code = EXIT_CODE_DEVICE;
	} else if (!json_is_object(parameters)) {
		fputs("stagectl: what answers is no station: it sends no JSON reply\n", stderr);
		code = EXIT_CODE_CONNECTION;
	} else {
		*out = json_incref(parameters);
	}
	json_decref(reply);
	return code;
}

int control_ask(json_t **out, const char *socket_dir, const char *method, json_t *parameters)
{
	char *text = NULL;
	int fd;
	int code = connect_station(&fd, socket_dir);

	if (code) {
		json_decref(parameters);
		return code;
	}
	int err = send_call(fd, method, parameters);
	if (!err)
		err = receive_reply(fd, &text);
	close(fd);
	if (err) {
		fprintf(stderr, "stagectl: %s: the station stopped answering: %s\n", socket_dir,
			strerror(-err));
		free(text);
		return EXIT_CODE_CONNECTION;
	}
	code = unpack_reply(out, text);
	free(text);
	return code;
}
