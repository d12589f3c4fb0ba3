/*
 * The control socket: who comes and goes, and who waits for what.
 */
#include "daemon/control/control.h"

#include <errno.h>
#include <limits.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/log.h"
#include "daemon/control/control_client.h"
#include "daemon/listen.h"

#define STALL_NS (5 * NS_PER_S) /* for the rest of a request, or for reading a reply */
#define PREVIEW_WAIT_NS (2 * NS_PER_S)

struct control {
	struct control_context context;
	struct peer_rules rules;
	struct control_stats stats;
	sd_event *event;
	sd_event_source *source;
	int fd;
	char path[PATH_MAX];
	struct control_client clients[CONTROL_CLIENT_MAX];
};

/* When all places are taken, the client that has been silent longest makes room. */
static struct control_client *free_place(struct control *control)
{
	struct control_client *silent = NULL;

	for (int i = 0; i < CONTROL_CLIENT_MAX; i++) {
		struct control_client *client = &control->clients[i];

		if (client->fd < 0)
			return client;
		if (!silent || client->progress_ns < silent->progress_ns)
			silent = client;
	}
	if (clock_real_now_ns() - silent->progress_ns < STALL_NS)
		return NULL;
	control_client_cut_off(silent);
	return silent;
}

/* It is told before it has asked. */
static void turn_away(struct control *control, int client_fd)
{
	json_t *reply = too_many(CONTROL_CLIENT_MAX);
	char *text = json_dumps(reply, JSON_COMPACT);

	if (text)
		send(client_fd, text, strlen(text) + 1, MSG_NOSIGNAL | MSG_DONTWAIT);
	free(text);
	json_decref(reply);
	close(client_fd);
	control->stats.refused_count++;
}

static int on_connect(sd_event_source *source, int fd, uint32_t events, void *user)
{
	struct control *control = user;
	int client_fd = accept4(fd, NULL, NULL, SOCK_NONBLOCK | SOCK_CLOEXEC);

	(void)source;
	(void)events;
	if (client_fd < 0)
		return 0;
	struct control_client *client = free_place(control);
	char *in = client ? malloc(CONTROL_MESSAGE_BYTES) : NULL;
	if (!in || sd_event_add_io(control->event, &client->source, client_fd, EPOLLIN,
				   control_client_event, client) < 0) {
		free(in);
		turn_away(control, client_fd);
		return 0;
	}
	client->context = &control->context;
	client->stats = &control->stats;
	client->fd = client_fd;
	client->in = in;
	client->permission = peer_permission_of_socket(&control->rules, client_fd);
	client->progress_ns = clock_real_now_ns();
	control->stats.accepted_count++;
	return 0;
}

int control_create(struct control **out, sd_event *event, const char *path, struct station *station,
		   const struct peer_rules *rules, struct diag *diag)
{
	struct control *control = calloc(1, sizeof(*control));

	if (!control)
		return -ENOMEM;
	control->context = (struct control_context){.station = station, .stats = &control->stats};
	control->event = event;
	control->rules = *rules;
	for (int i = 0; i < CONTROL_CLIENT_MAX; i++)
		control->clients[i] = (struct control_client){.fd = -1, .out_fd = -1};
	int err = listen_unix(&control->fd, path, diag);
	if (err) {
		free(control);
		return err;
	}
	strncpy(control->path, path, sizeof(control->path) - 1);
	err = sd_event_add_io(event, &control->source, control->fd, EPOLLIN, on_connect, control);
	if (err < 0) {
		diag_add(diag, "%s: cannot watch: %s", path, strerror(-err));
		control_destroy(control);
		return err;
	}
	*out = control;
	return 0;
}

void control_destroy(struct control *control)
{
	if (!control)
		return;
	for (int i = 0; i < CONTROL_CLIENT_MAX; i++)
		if (control->clients[i].fd >= 0)
			control_client_close(&control->clients[i]);
	sd_event_source_disable_unref(control->source);
	close(control->fd);
	unlink(control->path);
	free(control);
}

void control_set_server(struct control *control, const struct server *server)
{
	control->context.server = server;
}

static void answer_preview(struct control_client *client, bool ready)
{
	char *reply = preview_reply(client->context->station, client->wait.camera, ready);

	client->wait = (struct wait){0};
	if (control_client_reply_text(client, reply))
		control_client_work(client);
}

static void log_swap(const struct rig_swap *swap, enum rig_swap_state state)
{
	if (state == RIG_SWAP_DONE)
		log_info("rig %s in use", rig_swap_revision(swap, swap->current->serial));
	else
		log_warning("the rig was not reloaded: %s",
			    swap->diag.text ? swap->diag.text : strerror(-swap->error));
}

static void answer_rig(struct control *control)
{
	struct station *station = control->context.station;
	enum rig_swap_state state =
		rig_swap_poll(&station->rig_swap, station->solver.thread.joinable);

	if (state != RIG_SWAP_DONE && state != RIG_SWAP_FAILED)
		return;
	log_swap(&station->rig_swap, state);
	for (int i = 0; i < CONTROL_CLIENT_MAX; i++) {
		struct control_client *client = &control->clients[i];

		if (client->fd < 0 || client->wait.kind != WAIT_RIG)
			continue;
		client->wait = (struct wait){0};
		if (control_client_reply(client, rig_reply(station, state)))
			control_client_work(client);
	}
}

static void answer_previews(struct control *control)
{
	bool ready[CAMERA_MAX];

	/* looked up first: answering one client may ask for the next image */
	for (uint32_t c = 0; c < CAMERA_MAX; c++)
		ready[c] =
			atomic_load_explicit(&control->context.station->captures[c].preview.state,
					     memory_order_acquire) == PREVIEW_READY;
	for (int i = 0; i < CONTROL_CLIENT_MAX; i++) {
		struct control_client *client = &control->clients[i];

		if (client->fd >= 0 && client->wait.kind == WAIT_PREVIEW &&
		    ready[client->wait.camera])
			answer_preview(client, true);
	}
}

static void answer_observer(struct control_client *client, bool ready)
{
	json_t *reply = observe_reply(client->context->station, ready);

	client->wait = (struct wait){0};
	if (control_client_reply(client, reply))
		control_client_work(client);
}

static void answer_observers(struct control *control)
{
	struct shot_copy *copy = &control->context.station->shot_copy;
	bool waits[CONTROL_CLIENT_MAX];

	if (!shot_copy_ready(copy))
		return;
	/* looked up first: answering one client may ask for the next shot */
	for (int i = 0; i < CONTROL_CLIENT_MAX; i++)
		waits[i] =
			control->clients[i].fd >= 0 && control->clients[i].wait.kind == WAIT_SHOT;
	for (int i = 0; i < CONTROL_CLIENT_MAX; i++)
		if (waits[i])
			answer_observer(&control->clients[i], true);
	shot_copy_done(copy);
	for (int i = 0; i < CONTROL_CLIENT_MAX; i++)
		if (control->clients[i].fd >= 0 && control->clients[i].wait.kind == WAIT_SHOT)
			shot_copy_request(copy);
}

void control_answer_waiting(struct control *control)
{
	answer_rig(control);
	answer_observers(control);
	answer_previews(control);
}

/* One that has not yet read the status before waits for a later one. */
static void answer_follower(struct control_client *client)
{
	if (client->out)
		return;
	if (control_client_reply(client, status_reply(client->context, true)))
		control_client_listen(client);
}

/* It may be silent for as long as it takes. */
static void answer_holder(struct control_client *client, int64_t now_ns)
{
	json_t *reply = calibrated_reply(client->context->station, client->wait.run);

	client->progress_ns = now_ns;
	if (!reply)
		return;
	client->wait = (struct wait){0};
	if (control_client_reply(client, reply))
		control_client_work(client);
}

static void client_tick(struct control_client *client, int64_t now_ns)
{
	int64_t still_ns = now_ns - client->progress_ns;
	bool inside_request = client->in_bytes > 0 && !client->wait.kind;

	if ((client->out || inside_request) && still_ns > STALL_NS)
		control_client_cut_off(client);
	else if (client->wait.kind == WAIT_PREVIEW && still_ns > PREVIEW_WAIT_NS)
		answer_preview(client, false);
	else if (client->wait.kind == WAIT_SHOT && still_ns > PREVIEW_WAIT_NS)
		answer_observer(client, false);
	else if (client->wait.kind == WAIT_STATUS)
		answer_follower(client);
	else if (client->wait.kind == WAIT_HOLD)
		answer_holder(client, now_ns);
}

void control_tick(struct control *control)
{
	int64_t now_ns = clock_real_now_ns();

	answer_rig(control);
	for (int i = 0; i < CONTROL_CLIENT_MAX; i++)
		if (control->clients[i].fd >= 0)
			client_tick(&control->clients[i], now_ns);
}
