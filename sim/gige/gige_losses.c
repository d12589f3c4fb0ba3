/*
 * Each camera's thread keeps the packets that it sent last.
 */
#include "sim/gige/gige_losses.h"

#include <arpa/inet.h>
#include <errno.h>
#include <stdatomic.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>

#include "track/observe.h"

#define KEPT 256 /* packets: two pictures and more */
#define PACKET_BYTES 16384
#define COMMAND_KEY 0x42
#define COMMAND_RESEND 0x0040
#define STATUS_RESENT 0x0100 /* of a packet that is sent again */
#define ID_MASK 0xffffffu

/* As they stand on the wire. */
struct stream_header {
	uint16_t status, frame_id;
	uint32_t type_and_id;
};

struct resend_command {
	uint8_t key, flags;
	uint16_t command, length, request_id;
	uint16_t channel, frame_id;
	uint32_t first, last;
};

struct kept_packet {
	size_t size_bytes;
	union {
		struct stream_header header;
		uint8_t bytes[PACKET_BYTES];
	};
};

/* Of one camera; its thread's own. */
struct store {
	int stream_fd;
	struct sockaddr_in to;
	uint64_t random;
	uint32_t next;
	struct kept_packet *packets;
};

static double lost_ratio;
static bool resends;
static struct store stores[CAMERA_MAX];
static atomic_uint store_count;
static _Thread_local struct store *mine;

int gige_losses_begin(double ratio, bool resend)
{
	lost_ratio = ratio;
	resends = resend;
	for (uint32_t i = 0; i < CAMERA_MAX && resend; i++) {
		stores[i].packets = calloc(KEPT, sizeof(*stores[i].packets));
		if (!stores[i].packets)
			return -ENOMEM;
	}
	return 0;
}

void gige_losses_end(void)
{
	for (uint32_t i = 0; i < CAMERA_MAX; i++)
		free(stores[i].packets);
	memset(stores, 0, sizeof(stores));
}

/* NULL when there are more threads than cameras. */
static struct store *own_store(void)
{
	if (!mine) {
		uint32_t index = atomic_fetch_add(&store_count, 1);

		mine = index < CAMERA_MAX ? &stores[index] : NULL;
		if (mine)
			mine->random = index + 1;
	}
	return mine;
}

/* xorshift64*; the same losses every time. */
static bool is_lost(struct store *store)
{
	store->random ^= store->random >> 12;
	store->random ^= store->random << 25;
	store->random ^= store->random >> 27;
	uint64_t random = store->random * UINT64_C(2685821657736338717);

	return (double)(random >> 11) * 0x1p-53 < lost_ratio;
}

static void keep(struct store *store, const void *packet, size_t size_bytes)
{
	struct kept_packet *kept = &store->packets[store->next++ % KEPT];

	kept->size_bytes = size_bytes <= PACKET_BYTES ? size_bytes : 0;
	memcpy(kept->bytes, packet, kept->size_bytes);
}

/* What is sent again may get lost again. */
static void send_again(struct store *store, const struct resend_command *command)
{
	uint32_t first = ntohl(command->first) & ID_MASK, last = ntohl(command->last) & ID_MASK;

	for (uint32_t i = 0; i < KEPT; i++) {
		struct kept_packet *kept = &store->packets[i];
		uint32_t id = ntohl(kept->header.type_and_id) & ID_MASK;

		if (kept->size_bytes < sizeof(kept->header) ||
		    kept->header.frame_id != command->frame_id || id < first || id > last ||
		    is_lost(store))
			continue;
		kept->header.status = htons(STATUS_RESENT);
		sendto(store->stream_fd, kept->bytes, kept->size_bytes, 0,
		       (struct sockaddr *)&store->to, sizeof(store->to));
	}
}

static bool asks_again(const struct resend_command *command, size_t size_bytes)
{
	return size_bytes >= sizeof(*command) && command->key == COMMAND_KEY &&
	       ntohs(command->command) == COMMAND_RESEND;
}

bool gige_losses_asked(const void *command, size_t size_bytes)
{
	struct resend_command copy;

	if (!resends || !own_store() || size_bytes < sizeof(copy))
		return false;
	memcpy(&copy, command, sizeof(copy));
	if (!asks_again(&copy, size_bytes))
		return false;
	send_again(mine, &copy);
	return true;
}

/* Other commands wait until the camera reads them itself. */
static void answer_waiting(int control_fd)
{
	struct resend_command command;

	for (;;) {
		ssize_t size = recv(control_fd, &command, sizeof(command), MSG_PEEK | MSG_DONTWAIT);

		if (size < 0 || !asks_again(&command, (size_t)size))
			return;
		recv(control_fd, &command, sizeof(command), MSG_DONTWAIT);
		send_again(mine, &command);
	}
}

bool gige_losses_take(int control_fd, int stream_fd, const struct sockaddr_in *to,
		      const void *packet, size_t size_bytes)
{
	if (lost_ratio <= 0 || !own_store())
		return false;
	mine->stream_fd = stream_fd;
	mine->to = *to;
	if (resends) {
		keep(mine, packet, size_bytes);
		answer_waiting(control_fd);
	}
	return is_lost(mine);
}
