/*
 * A bad network between the simulated cameras and their receivers: packets of pictures get lost on
 * the way, and cameras may send them again when they are asked (GigE Vision, PACKETRESEND_CMD).
 */
#pragma once

#include <stdbool.h>
#include <stddef.h>

#include <netinet/in.h>

/* Before the cameras start. Returns 0 or -ENOMEM. `ratio` of all packets of pictures gets lost. */
int gige_losses_begin(double ratio, bool resend);
void gige_losses_end(void); /* after they have stopped */

/* On a camera's thread, before it sends a packet of a picture from `stream_fd`. True: it is lost.
 * Packets that were asked for on `control_fd` meanwhile are sent again. */
bool gige_losses_take(int control_fd, int stream_fd, const struct sockaddr_in *to,
		      const void *packet, size_t size_bytes);

/* On a camera's thread: a control packet came. True when it asked for packets, which were sent. */
bool gige_losses_asked(const void *command, size_t size_bytes);
