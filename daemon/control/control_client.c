/*
 * One client of the control socket: bytes in, messages out of them, replies back.
 */
#include "daemon/control/control_client.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <unistd.h>

#include "base/clock.h"

void control_client_close(struct control_client *client)
{
	struct wait wait = client->wait;
	struct station *station = client->context->station;

	client->stats->follower_count -= wait.kind == WAIT_STATUS;
	sd_event_source_disable_unref(client->source);
	close(client->fd);
	free(client->in);
	free(client->out);
	*client = (struct control_client){.fd = -1, .out_fd = -1};
	if (wait.kind == WAIT_HOLD)
		calibrated_by_nobody(station, wait.run);
}

void control_client_cut_off(struct control_client *client)
{
	client->stats->cut_off_count++;
	control_client_close(client);
}

void control_client_listen(struct control_client *client)
{
	/* while a reply is under way nothing more is read: a client cannot pile up requests */
	sd_event_source_set_io_events(client->source, client->out         ? EPOLLOUT
						      : client->wait.kind ? EPOLLHUP
									  : EPOLLIN);
}

/* Of the reply, with its descriptor when there is one. */
static ssize_t send_some(struct control_client *client)
{
	char room[CMSG_SPACE(sizeof(int))] __attribute__((aligned(sizeof(struct cmsghdr)))) = {0};
	struct iovec bytes = {client->out + client->out_sent, client->out_bytes - client->out_sent};
	struct msghdr message = {.msg_iov = &bytes, .msg_iovlen = 1};

	if (client->out_fd >= 0) {
		message.msg_control = room;
		message.msg_controllen = sizeof(room);
		struct cmsghdr *with = CMSG_FIRSTHDR(&message);
		*with = (struct cmsghdr){CMSG_LEN(sizeof(int)), SOL_SOCKET, SCM_RIGHTS};
		memcpy(CMSG_DATA(with), &client->out_fd, sizeof(int));
	}
	ssize_t sent = sendmsg(client->fd, &message, MSG_NOSIGNAL | MSG_DONTWAIT);

	if (sent > 0)
		client->out_fd = -1;
	return sent;
}

/* False when the client is gone. */
static bool client_send(struct control_client *client)
{
	while (client->out_sent < client->out_bytes) {
		ssize_t sent = send_some(client);

		if (sent < 0 && errno == EAGAIN)
			return true;
		if (sent < 0) {
			control_client_close(client);
			return false;
		}
		client->out_sent += (size_t)sent;
		client->progress_ns = clock_real_now_ns();
	}
	free(client->out);
	client->out = NULL;
	return true;
}

bool control_client_reply_text(struct control_client *client, char *text)
{
	bool oneway = client->oneway;

	client->oneway = false;
	client->progress_ns = clock_real_now_ns();
	if (oneway)
		free(text);
	else
		client->out = text;
	if (oneway)
		return true;
	if (!client->out) {
		control_client_cut_off(client);
		return false;
	}
	client->out_bytes = strlen(client->out) + 1;
	client->out_sent = 0;
	return client_send(client);
}

bool control_client_reply(struct control_client *client, json_t *reply)
{
	char *text = json_dumps(reply, JSON_COMPACT);

	json_decref(reply);
	return control_client_reply_text(client, text);
}

/* One request, in[0 .. size_bytes). False when the client is gone. */
static bool client_request(struct control_client *client, size_t size_bytes)
{
	json_t *request = json_loadb(client->in, size_bytes, 0, NULL);

	if (!json_is_object(request) || !json_is_string(json_object_get(request, "method"))) {
		json_decref(request);
		control_client_cut_off(client);
		return false;
	}
	client->oneway = json_is_true(json_object_get(request, "oneway"));
	client->out_fd = -1;
	json_t *reply = control_call(client->context, client->permission, request, &client->wait,
				     &client->out_fd);
	json_decref(request);
	client->stats->follower_count += client->wait.kind == WAIT_STATUS;
	if (!reply) {
		client->progress_ns = clock_real_now_ns();
		return true;
	}
	return control_client_reply(client, reply);
}

void control_client_work(struct control_client *client)
{
	while (!client->out && !client->wait.kind) {
		char *end = memchr(client->in, '\0', client->in_bytes);

		if (!end)
			break;
		size_t size_bytes = (size_t)(end - client->in);
		if (!client_request(client, size_bytes))
			return;
		client->in_bytes -= size_bytes + 1;
		memmove(client->in, end + 1, client->in_bytes);
	}
	if (client->in_bytes == CONTROL_MESSAGE_BYTES && !client->out && !client->wait.kind) {
		control_client_cut_off(client);
		return;
	}
	control_client_listen(client);
}

static void client_receive(struct control_client *client)
{
	ssize_t got = recv(client->fd, client->in + client->in_bytes,
			   CONTROL_MESSAGE_BYTES - client->in_bytes, MSG_DONTWAIT);

	if (got < 0 && (errno == EAGAIN || errno == EINTR))
		return;
	if (got <= 0) {
		if (client->in_bytes > 0)
			control_client_cut_off(client); /* went away inside a request */
		else
			control_client_close(client);
		return;
	}
	client->in_bytes += (size_t)got;
	client->progress_ns = clock_real_now_ns();
	control_client_work(client);
}

int control_client_event(sd_event_source *source, int fd, uint32_t events, void *user)
{
	struct control_client *client = user;

	(void)source;
	(void)fd;
	if (events & EPOLLOUT) {
		if (client_send(client))
			control_client_work(client);
	} else if (events & EPOLLIN) {
		client_receive(client);
	} else {
		control_client_close(client);
	}
	return 0;
}
