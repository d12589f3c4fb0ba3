/*
 * A client of the control socket, for control.c. Control thread.
 */
#pragma once

#include <jansson.h>
#include <systemd/sd-event.h>

#include "daemon/control/control.h"
#include "daemon/control/control_methods.h"

struct control_client {
	const struct control_context *context; /* borrowed, as the next */
	struct control_stats *stats;
	int fd; /* -1: this place is free */
	sd_event_source *source;
	char *in; /* CONTROL_MESSAGE_BYTES, owned */
	size_t in_bytes;
	char *out; /* reply under way, owned */
	size_t out_bytes, out_sent;
	int out_fd;                 /* goes with its first byte; the station's; -1: none */
	int64_t progress_ns;        /* when a byte last moved */
	enum permission permission; /* when it connected */
	struct wait wait;
	bool oneway; /* the request under way wants no reply */
};

void control_client_close(struct control_client *client);
void control_client_cut_off(struct control_client *client); /* and counts it */

/* For what the client is to do next: read, write, or wait. */
void control_client_listen(struct control_client *client);

/* They take the reply over. False when the client is gone. */
bool control_client_reply_text(struct control_client *client, char *text);
bool control_client_reply(struct control_client *client, json_t *reply);

/* Answers the whole requests that have come, one after the other. */
void control_client_work(struct control_client *client);

/* When its socket can be read or written; `user` is the client. */
int control_client_event(sd_event_source *source, int fd, uint32_t events, void *user);
