/*
 * The control socket: varlink messages (JSON objects, each ended by a NUL) from operators' tools.
 * A client that sends garbage, or stalls, is cut off and counted; the station runs on. All on the
 * control thread.
 */
#pragma once

#include <stdint.h>
#include <systemd/sd-event.h>

#include "base/diag.h"
#include "daemon/control/peer.h"
#include "daemon/server.h"
#include "daemon/station.h"

#define CONTROL_CLIENT_MAX 16
#define CONTROL_FOLLOWER_MAX 12     /* of those; the others' places are for who commands */
#define CONTROL_MESSAGE_BYTES 65536 /* a longer request is garbage */

struct control;

struct control_stats {
	uint64_t accepted_count;
	uint64_t refused_count; /* that many were there already */
	uint64_t cut_off_count;
	int follower_count; /* at present */
};

/* Listens on `path`; event loop and station are borrowed. Errors as listen_unix(). `rules` say who
 * may do what. */
int control_create(struct control **out, sd_event *event, const char *path, struct station *station,
		   const struct peer_rules *rules, struct diag *diag);
void control_destroy(struct control *control); /* accepts NULL; removes the socket */

/* Whose figures GetStatus shows; before the loop runs. Borrowed. */
void control_set_server(struct control *control, const struct server *server);

/* After the station's wake_fd was written: answers those who wait for an image or a rig. */
void control_answer_waiting(struct control *control);

/* Once a second: the status for those who follow it; cuts off those who stall, answers previews
 * that never came. */
void control_tick(struct control *control);
