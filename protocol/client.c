/*
 * The subscriber's end of the socket: collects bytes until a message is whole, then decodes it.
 */
#include <errno.h>
#include <poll.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include "base/clock.h"
#include "protocol/decode.h"

#define HEADER_BYTES 4
#define BUFFER_BYTES (64u << 10) /* to begin with; grows up to the largest message */

struct stage_client {
	int fd;
	struct decoder *decoder;
	uint8_t *buffer; /* owned; received and not yet decoded bytes lie in [start, end) */
	size_t start, end, capacity;
};

static int connect_to(const char *path)
{
	struct sockaddr_un address = {.sun_family = AF_UNIX};

	if (strlen(path) >= sizeof(address.sun_path))
		return -ENAMETOOLONG;
	strcpy(address.sun_path, path);
	int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
	if (fd < 0)
		return -errno;
	if (connect(fd, (const struct sockaddr *)&address, sizeof(address)) < 0) {
		int r = -errno;

		close(fd);
		return r;
	}
	return fd;
}

int stage_client_open(struct stage_client **out, const char *socket_path)
{
	int r = -ENOMEM;
	struct stage_client *client = calloc(1, sizeof(*client));

	if (!client)
		return -ENOMEM;
	client->fd = -1;
	client->capacity = BUFFER_BYTES;
	client->buffer = malloc(client->capacity);
	if (!client->buffer || decoder_create(&client->decoder) < 0)
		goto fail;
	r = client->fd = connect_to(socket_path);
	if (r < 0)
		goto fail;
	*out = client;
	return 0;
fail:
	stage_client_close(client);
	return r;
}

void stage_client_close(struct stage_client *client)
{
	if (!client)
		return;
	if (client->fd >= 0)
		close(client->fd);
	decoder_destroy(client->decoder);
	free(client->buffer);
	free(client);
}

int stage_client_fd(const struct stage_client *client)
{
	return client->fd;
}

/* Bytes that the first frame takes, header included, as far as they tell. */
static size_t wanted_bytes(const struct stage_client *client)
{
	const uint8_t *header = client->buffer + client->start;

	if (client->end - client->start < HEADER_BYTES)
		return HEADER_BYTES;
	return HEADER_BYTES + ((size_t)header[0] | (size_t)header[1] << 8 |
			       (size_t)header[2] << 16 | (size_t)header[3] << 24);
}

/* Moves what there is to the front and makes room for a frame of `wanted` bytes. */
static int make_room(struct stage_client *client, size_t wanted)
{
	memmove(client->buffer, client->buffer + client->start, client->end - client->start);
	client->end -= client->start;
	client->start = 0;
	if (wanted <= client->capacity)
		return 0;
	uint8_t *buffer = realloc(client->buffer, wanted);
	if (!buffer)
		return -ENOMEM;
	client->buffer = buffer;
	client->capacity = wanted;
	return 0;
}

static int receive(struct stage_client *client)
{
	ssize_t got = recv(client->fd, client->buffer + client->end, client->capacity - client->end,
			   MSG_DONTWAIT);

	if (got < 0)
		return -errno;
	if (got == 0)
		return -ENODATA;
	client->end += (size_t)got;
	return 0;
}

/* `deadline_ns` < 0: waits for ever. */
static int wait_readable(const struct stage_client *client, int64_t deadline_ns)
{
	struct pollfd poll_fd = {.fd = client->fd, .events = POLLIN};
	struct timespec timeout;
	int64_t left_ns = deadline_ns - clock_now_ns();

	left_ns = left_ns > 0 ? left_ns : 0;
	timeout = (struct timespec){.tv_sec = left_ns / NS_PER_S, .tv_nsec = left_ns % NS_PER_S};
	int ready = ppoll(&poll_fd, 1, deadline_ns < 0 ? NULL : &timeout, NULL);
	if (ready < 0)
		return -errno;
	return ready == 0 ? -ETIMEDOUT : 0;
}

/* Until [start, end) begins with a whole frame. */
static int collect_frame(struct stage_client *client, int64_t deadline_ns)
{
	size_t wanted;

	while (wanted = wanted_bytes(client), client->end - client->start < wanted) {
		if (wanted > HEADER_BYTES + MESSAGE_BYTES_MAX)
			return -EPROTO;
		int r = make_room(client, wanted);
		if (r < 0)
			return r;
		r = receive(client);
		if (r == -EAGAIN)
			r = wait_readable(client, deadline_ns);
		if (r < 0)
			return r;
	}
	return 0;
}

/* An error leaves the frame where it is, so that the next call says the same. */
int stage_client_next(struct stage_client *client, int timeout_ms, struct stage_event *event)
{
	int64_t deadline_ns = timeout_ms < 0 ? -1 : clock_now_ns() + timeout_ms * NS_PER_MS;
	int r = collect_frame(client, deadline_ns);

	if (r < 0)
		return r;
	size_t size_bytes = wanted_bytes(client);
	r = decode_message(client->decoder, client->buffer + client->start + HEADER_BYTES,
			   size_bytes - HEADER_BYTES, event);
	if (r < 0)
		return r;
	client->start += size_bytes;
	return 0;
}
