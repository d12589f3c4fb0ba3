/*
 * Subscribers and their queues. A queue is a byte ring that takes whole frames or nothing, so that
 * a subscriber never sees a part of a message; what does not fit is counted as lost.
 */
#include "daemon/server.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <sys/uio.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/log.h"
#include "daemon/listen.h"

#define ACCEPTS_PER_S 200 /* a flood of connections must not keep the control thread busy */

struct subscriber {
	struct server *server;
	uint32_t slot;
	int fd;
	sd_event_source *source;
	pid_t pid;
	int64_t connected_ns;
	uint64_t sets_queued, sets_lost;
	uint32_t described;   /* the version of the description that it has */
	uint32_t start, used; /* of the queue, in bytes */
	uint8_t queue[SUBSCRIBER_QUEUE_BYTES];
};

struct server {
	sd_event *event; /* borrowed */
	const struct stream_description *description;
	char *path;
	int fd;
	sd_event_source *source;
	struct encoder *encoder;
	uint32_t description_version;
	uint64_t sets_published, accepted_count, refused_count, cut_off_count, sets_lost;
	struct subscriber *subscribers[SUBSCRIBER_MAX];
};

static void subscriber_destroy(struct subscriber *s)
{
	if (!s)
		return;
	s->server->subscribers[s->slot] = NULL;
	sd_event_source_disable_unref(s->source);
	close(s->fd);
	free(s);
}

static bool queue_add(struct subscriber *s, const uint8_t *frame, size_t size_bytes)
{
	if (size_bytes > SUBSCRIBER_QUEUE_BYTES - s->used)
		return false;
	uint32_t end = (s->start + s->used) % SUBSCRIBER_QUEUE_BYTES;
	size_t until_wrap = SUBSCRIBER_QUEUE_BYTES - end;
	size_t first = size_bytes < until_wrap ? size_bytes : until_wrap;

	memcpy(s->queue + end, frame, first);
	memcpy(s->queue, frame + first, size_bytes - first);
	s->used += (uint32_t)size_bytes;
	return true;
}

static ssize_t queue_send(struct subscriber *s)
{
	uint32_t until_wrap = SUBSCRIBER_QUEUE_BYTES - s->start;
	uint32_t first = s->used < until_wrap ? s->used : until_wrap;
	struct iovec parts[2] = {{s->queue + s->start, first}, {s->queue, s->used - first}};
	struct msghdr message = {.msg_iov = parts, .msg_iovlen = 2};

	return sendmsg(s->fd, &message, MSG_NOSIGNAL | MSG_DONTWAIT);
}

/* Sends what the socket takes and asks to be woken for the rest. A negative errno: it is gone. */
static int subscriber_flush(struct subscriber *s)
{
	while (s->used > 0) {
		ssize_t sent = queue_send(s);

		if (sent < 0 && errno == EINTR)
			continue;
		if (sent < 0 && errno == EAGAIN)
			return sd_event_source_set_io_events(s->source, EPOLLIN | EPOLLOUT);
		if (sent < 0)
			return -errno;
		s->start = (uint32_t)((s->start + (size_t)sent) % SUBSCRIBER_QUEUE_BYTES);
		s->used -= (uint32_t)sent;
	}
	return sd_event_source_set_io_events(s->source, EPOLLIN);
}

/* Last words; whether they arrive does not matter, the connection ends here. */
static void send_notice(int fd, enum notice_kind kind, const char *text)
{
	uint8_t *frame;
	size_t size_bytes;

	if (encode_notice(kind, text, &frame, &size_bytes) < 0)
		return;
	if (send(fd, frame, size_bytes, MSG_NOSIGNAL | MSG_DONTWAIT) < 0)
		log_warning("stream: a notice did not reach its client: %s", strerror(errno));
	free(frame);
}

static void cut_off(struct subscriber *s)
{
	s->server->cut_off_count++;
	log_warning("stream: cut off process %d, which sent bytes: subscribers must send nothing",
		    (int)s->pid);
	if (s->used == 0)
		send_notice(s->fd, NOTICE_PROTOCOL, "a subscriber must send nothing");
	subscriber_destroy(s);
}

/* Nothing may come from a subscriber but the end of its connection. */
static int on_subscriber(sd_event_source *source, int fd, uint32_t events, void *user)
{
	struct subscriber *s = user;
	uint8_t bytes[64];

	(void)source;
	if (events & (EPOLLIN | EPOLLHUP | EPOLLERR)) {
		ssize_t got = recv(fd, bytes, sizeof(bytes), MSG_DONTWAIT);

		if (got > 0) {
			cut_off(s);
			return 0;
		}
		if (got == 0 || (errno != EAGAIN && errno != EINTR)) {
			subscriber_destroy(s);
			return 0;
		}
	}
	if (events & EPOLLOUT && subscriber_flush(s) < 0)
		subscriber_destroy(s);
	return 0;
}

/* Takes over `fd`. The queue is as large as the whole struct: most of it is never touched. */
static int subscriber_create(struct server *server, uint32_t slot, int fd)
{
	struct ucred peer = {0};
	socklen_t peer_bytes = sizeof(peer);
	struct subscriber *s = calloc(1, sizeof(*s));

	if (!s)
		return -ENOMEM;
	getsockopt(fd, SOL_SOCKET, SO_PEERCRED, &peer, &peer_bytes);
	s->server = server;
	s->slot = slot;
	s->fd = fd;
	s->pid = peer.pid;
	s->connected_ns = clock_now_ns();
	int r = sd_event_add_io(server->event, &s->source, fd, EPOLLIN, on_subscriber, s);
	if (r < 0) {
		free(s);
		return r;
	}
	server->subscribers[slot] = s;
	return 0;
}

/* The description is made anew for each subscriber: its clock offset is of this moment. */
static int describe(struct subscriber *s)
{
	uint8_t *frame;
	size_t size_bytes;
	int r = encode_description(s->server->description, &frame, &size_bytes);

	if (r < 0)
		return r;
	bool fits = queue_add(s, frame, size_bytes);
	free(frame);
	if (!fits)
		return -EMSGSIZE;
	s->described = s->server->description_version;
	return subscriber_flush(s);
}

static uint32_t free_slot(const struct server *server)
{
	uint32_t slot = 0;

	while (slot < SUBSCRIBER_MAX && server->subscribers[slot])
		slot++;
	return slot;
}

static void refuse(struct server *server, int fd, const char *reason)
{
	server->refused_count++;
	log_warning("stream: refused a subscriber: %s", reason);
	send_notice(fd, NOTICE_REFUSED, reason);
	close(fd);
}

static int on_connection(sd_event_source *source, int listen_fd, uint32_t events, void *user)
{
	struct server *server = user;
	int fd = accept4(listen_fd, NULL, NULL, SOCK_NONBLOCK | SOCK_CLOEXEC);

	(void)source;
	(void)events;
	if (fd < 0) {
		if (errno != EAGAIN && errno != EINTR && errno != ECONNABORTED)
			log_error("stream: cannot accept a subscriber: %s", strerror(errno));
		return 0;
	}
	uint32_t slot = free_slot(server);
	if (slot == SUBSCRIBER_MAX) {
		refuse(server, fd, "the station has as many subscribers as it serves");
		return 0;
	}
	if (subscriber_create(server, slot, fd) < 0) {
		refuse(server, fd, "the station is out of memory");
		return 0;
	}
	server->accepted_count++;
	if (describe(server->subscribers[slot]) < 0)
		subscriber_destroy(server->subscribers[slot]);
	return 0;
}

int server_create(struct server **out, sd_event *event, const char *socket_path,
		  const struct stream_description *description, struct diag *diag)
{
	int r = -ENOMEM;
	struct server *server = calloc(1, sizeof(*server));

	if (!server)
		goto fail;
	server->event = event;
	server->description = description;
	server->fd = -1;
	server->path = strdup(socket_path);
	if (!server->path || encoder_create(&server->encoder) < 0)
		goto fail;
	r = listen_unix(&server->fd, socket_path, diag);
	if (r < 0) {
		server_destroy(server);
		return r;
	}
	r = sd_event_add_io(event, &server->source, server->fd, EPOLLIN, on_connection, server);
	if (r >= 0)
		r = sd_event_source_set_ratelimit(server->source, 1000 * 1000, ACCEPTS_PER_S);
	if (r < 0)
		goto fail;
	*out = server;
	return 0;
fail:
	diag_add(diag, "%s: cannot serve the stream: %s", socket_path, strerror(-r));
	server_destroy(server);
	return r;
}

void server_destroy(struct server *server)
{
	if (!server)
		return;
	for (uint32_t i = 0; i < SUBSCRIBER_MAX; i++)
		subscriber_destroy(server->subscribers[i]);
	sd_event_source_disable_unref(server->source);
	if (server->fd >= 0) {
		unlink(server->path);
		close(server->fd);
	}
	encoder_destroy(server->encoder);
	free(server->path);
	free(server);
}

void server_redescribe(struct server *server)
{
	server->description_version++;
}

/* False when the set may not follow: the subscriber is gone, or has no room for the description
 * that must come before it. */
static bool is_described(struct subscriber *s)
{
	int r = s->described == s->server->description_version ? 0 : describe(s);

	if (r == -EMSGSIZE) {
		s->sets_lost++;
		s->server->sets_lost++;
	} else if (r < 0) {
		subscriber_destroy(s);
	}
	return r >= 0;
}

/* A queue that holds something waits for its socket: only an empty one is sent at once. */
static void publish_to(struct subscriber *s, uint8_t *frame, size_t size_bytes)
{
	if (!is_described(s))
		return;
	bool was_empty = s->used == 0;
	size_t own_bytes = frame_set_sets_lost(frame, size_bytes, s->sets_lost);

	if (!queue_add(s, frame, own_bytes)) {
		s->sets_lost++;
		s->server->sets_lost++;
		return;
	}
	s->sets_queued++;
	if (was_empty && subscriber_flush(s) < 0)
		subscriber_destroy(s);
}

void server_publish(struct server *server, const struct marker_set *set)
{
	size_t size_bytes;
	uint8_t *frame = encode_marker_set(server->encoder, set, clock_now_ns(), &size_bytes);

	server->sets_published++;
	for (uint32_t i = 0; i < SUBSCRIBER_MAX; i++)
		if (server->subscribers[i])
			publish_to(server->subscribers[i], frame, size_bytes);
}

bool server_has_backlog(const struct server *server)
{
	for (uint32_t i = 0; i < SUBSCRIBER_MAX; i++)
		if (server->subscribers[i] && server->subscribers[i]->used > 0)
			return true;
	return false;
}

void server_publish_statistics(struct server *server, const struct stream_statistics *statistics)
{
	uint8_t *frame;
	size_t size_bytes;

	if (encode_statistics(statistics, &frame, &size_bytes) < 0)
		return;
	for (uint32_t i = 0; i < SUBSCRIBER_MAX; i++) {
		struct subscriber *s = server->subscribers[i];

		if (s && queue_add(s, frame, size_bytes) && subscriber_flush(s) < 0)
			subscriber_destroy(s);
	}
	free(frame);
}

void server_stats(const struct server *server, struct server_stats *out)
{
	*out = (struct server_stats){.sets_published = server->sets_published,
				     .accepted_count = server->accepted_count,
				     .refused_count = server->refused_count,
				     .cut_off_count = server->cut_off_count,
				     .sets_lost = server->sets_lost};
	for (uint32_t i = 0; i < SUBSCRIBER_MAX; i++) {
		const struct subscriber *s = server->subscribers[i];

		if (!s)
			continue;
		out->subscribers[out->subscriber_count++] =
			(struct subscriber_stats){.pid = s->pid,
						  .connected_ns = s->connected_ns,
						  .sets_queued = s->sets_queued,
						  .sets_lost = s->sets_lost,
						  .queued_bytes = s->used};
	}
}
