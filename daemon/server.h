/*
 * The stream socket: accepts subscribers, describes the station to each, and sends every marker set
 * to all of them. Nothing blocks; a slow subscriber loses whole marker sets and delays nobody.
 * All calls on the control thread, which runs the event loop.
 */
#pragma once

#include <sys/types.h>
#include <systemd/sd-event.h>

#include "base/diag.h"
#include "protocol/encode.h"

#define SUBSCRIBER_MAX 32
#define SUBSCRIBER_QUEUE_BYTES (1u << 20) /* on top of what the kernel's socket buffer holds */

struct server;

/* Listens on `socket_path` (mode 0660). A socket that nobody listens on any more is replaced. The
 * event loop and what the description points to are borrowed until server_destroy().
 * Returns 0, -EADDRINUSE when a live station has the socket, or another negative errno; each with
 * a message in `diag`. */
int server_create(struct server **out, sd_event *event, const char *socket_path,
		  const struct stream_description *description, struct diag *diag);
void server_destroy(struct server *server); /* accepts NULL; removes the socket */

/* What the description says has changed: every subscriber gets it before its next marker set. */
void server_redescribe(struct server *server);

/* Sends one marker set to every subscriber, or counts it as lost for those whose queue is full. */
void server_publish(struct server *server, const struct marker_set *set);

/* Whether sets are queued that a subscriber has not taken yet. */
bool server_has_backlog(const struct server *server);

/* To every subscriber whose queue has room: the next one follows in a second. */
void server_publish_statistics(struct server *server, const struct stream_statistics *statistics);

struct subscriber_stats {
	pid_t pid;
	int64_t connected_ns;  /* CLOCK_MONOTONIC */
	uint64_t sets_queued;  /* handed to the subscriber's queue so far */
	uint64_t sets_lost;    /* not: its queue was full */
	uint32_t queued_bytes; /* waiting now */
};

struct server_stats {
	uint64_t sets_published;
	uint64_t accepted_count, refused_count; /* connections */
	uint64_t cut_off_count; /* clients that sent something where nothing may be sent */
	uint64_t sets_lost;     /* over all subscribers there ever were */
	uint32_t subscriber_count;
	struct subscriber_stats subscribers[SUBSCRIBER_MAX];
};

void server_stats(const struct server *server, struct server_stats *out);
