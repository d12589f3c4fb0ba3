/*
 * GigE Vision stream protocol with 16-bit frame ids: a packet has a header of eight bytes, of which
 * the last three are its number in the frame. Packet 0 is the leader, the last the trailer.
 */
#include "tests/bench/packet_loop.h"

#include <arpa/inet.h>
#include <errno.h>
#include <pthread.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include <arv.h>

#define HEADER_BYTES 8
#define PROTOCOL_BYTES (20 + 8 + HEADER_BYTES) /* IP, UDP, GVSP: part of a packet's size */
#define BATCH 16                               /* as Aravis receives them */
#define SCRATCH_BYTES 256                      /* of a leader or a trailer */
#define SOCKET_BYTES (8 << 20)
#define PAGE_BYTES 4096
#define RECEIVE_PRIORITY 55 /* that of the driver's receive thread */

/* Bootstrap registers of stream channel 0. */
enum {
	REGISTER_PORT = 0x0d00,
	REGISTER_DESTINATION = 0x0d18,
};

struct packet_loop {
	int fd;
	uint8_t *memory;
	size_t frame_bytes, data_bytes, buffer_bytes;
	uint32_t buffers, packets; /* per frame, leader and trailer among them */
	uint64_t warm_up, frames;
	struct packet_loop_result result;
	int error;

	/* owned by the thread */
	uint64_t frame;
	uint32_t next; /* packet that is expected */
	bool damaged;
	uint8_t headers[BATCH][HEADER_BYTES], scratch[BATCH][SCRATCH_BYTES];
	struct iovec parts[BATCH][2];
	struct mmsghdr messages[BATCH];
};

/* Where the packet k after the next one goes, if none is lost. */
static void aim(struct packet_loop *l, uint32_t k)
{
	uint32_t packet = (l->next + k) % l->packets;
	uint64_t frame = l->frame + (l->next + k) / l->packets;
	uint8_t *buffer = l->memory + frame % l->buffers * l->buffer_bytes;
	bool pixels = packet > 0 && packet < l->packets - 1;

	l->parts[k][0] = (struct iovec){l->headers[k], HEADER_BYTES};
	l->parts[k][1] = (struct iovec){
		pixels ? buffer + (packet - 1) * l->data_bytes : l->scratch[k],
		pixels ? l->data_bytes : SCRATCH_BYTES,
	};
	l->messages[k].msg_hdr = (struct msghdr){.msg_iov = l->parts[k], .msg_iovlen = 2};
}

static int64_t thread_cpu_ns(void)
{
	struct timespec cpu;

	clock_gettime(CLOCK_THREAD_CPUTIME_ID, &cpu);
	return (int64_t)cpu.tv_sec * 1000000000 + cpu.tv_nsec;
}

static void end_frame(struct packet_loop *l)
{
	l->next = 0;
	if (l->frame >= l->warm_up)
		*(l->damaged ? &l->result.damaged : &l->result.whole) += 1;
	l->damaged = false;
	if (++l->frame == l->warm_up)
		l->result.cpu_ns = -thread_cpu_ns();
}

static void take_packet(struct packet_loop *l, const uint8_t header[HEADER_BYTES])
{
	uint32_t packet = (uint32_t)header[5] << 16 | (uint32_t)header[6] << 8 | header[7];

	if (packet != l->next)
		l->damaged = true;
	l->next = packet + 1;
	if (l->next >= l->packets)
		end_frame(l);
}

static void *receive(void *user)
{
	struct packet_loop *l = user;
	struct sched_param param = {.sched_priority = RECEIVE_PRIORITY};

	pthread_setschedparam(pthread_self(), SCHED_FIFO, &param);
	while (l->frame < l->warm_up + l->frames) {
		for (uint32_t k = 0; k < BATCH; k++)
			aim(l, k);
		int count = recvmmsg(l->fd, l->messages, BATCH, MSG_WAITFORONE, NULL);

		if (count <= 0) {
			l->error = count < 0 ? -errno : -EIO;
			return NULL;
		}
		l->result.calls += l->frame >= l->warm_up;
		for (int i = 0; i < count; i++)
			take_packet(l, l->headers[i]);
	}
	l->result.cpu_ns += thread_cpu_ns();
	return NULL;
}

static int open_socket(struct packet_loop *l, struct sockaddr_in *at)
{
	struct timeval patience = {.tv_sec = 2};
	socklen_t size = sizeof(*at);
	int wanted = SOCKET_BYTES;

	*at = (struct sockaddr_in){.sin_family = AF_INET,
				   .sin_addr.s_addr = htonl(INADDR_LOOPBACK)};
	l->fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
	if (l->fd < 0 || bind(l->fd, (struct sockaddr *)at, size) ||
	    getsockname(l->fd, (struct sockaddr *)at, &size))
		return -errno;
	if (setsockopt(l->fd, SOL_SOCKET, SO_RCVBUFFORCE, &wanted, sizeof(wanted)))
		setsockopt(l->fd, SOL_SOCKET, SO_RCVBUF, &wanted, sizeof(wanted));
	setsockopt(l->fd, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof(patience));
	return 0;
}

/* Every page is touched before frames come. */
static int create_buffers(struct packet_loop *l, uint32_t buffers, unsigned int packet_bytes)
{
	l->data_bytes = packet_bytes - PROTOCOL_BYTES;
	l->packets = (uint32_t)((l->frame_bytes + l->data_bytes - 1) / l->data_bytes) + 2;
	l->buffers = buffers;
	l->buffer_bytes = (l->frame_bytes + l->data_bytes) / PAGE_BYTES * PAGE_BYTES + PAGE_BYTES;
	l->memory = aligned_alloc(PAGE_BYTES, l->buffer_bytes * buffers);
	if (!l->memory)
		return -ENOMEM;
	memset(l->memory, 0, l->buffer_bytes * buffers);
	return 0;
}

static int stream(struct packet_loop *l, ArvCamera *camera, const struct sockaddr_in *at)
{
	ArvDevice *device = arv_camera_get_device(camera);
	GError *error = NULL;
	pthread_t thread;

	arv_device_write_register(device, REGISTER_DESTINATION, ntohl(at->sin_addr.s_addr), NULL);
	arv_device_write_register(device, REGISTER_PORT, ntohs(at->sin_port), NULL);
	if (pthread_create(&thread, NULL, receive, l))
		return -EAGAIN;
	arv_camera_start_acquisition(camera, &error);
	pthread_join(thread, NULL);
	arv_camera_stop_acquisition(camera, NULL);
	arv_device_write_register(device, REGISTER_PORT, 0, NULL);
	g_clear_error(&error);
	return l->error;
}

static int run(struct packet_loop *l, ArvCamera *camera, uint32_t buffers,
	       unsigned int packet_bytes)
{
	struct sockaddr_in at;

	arv_camera_set_trigger(camera, "Line0", NULL);
	arv_camera_gv_set_packet_size(camera, (gint)packet_bytes, NULL);
	l->frame_bytes = arv_camera_get_payload(camera, NULL);
	int error = create_buffers(l, buffers, packet_bytes);

	if (!error)
		error = open_socket(l, &at);
	return error ? error : stream(l, camera, &at);
}

int packet_loop_run(struct packet_loop_result *out, const char *ip, unsigned int packet_bytes,
		    uint32_t buffers, uint64_t warm_up, uint64_t frames)
{
	struct packet_loop *l = calloc(1, sizeof(*l));
	ArvCamera *camera = arv_camera_new(ip, NULL);
	int error = l && camera ? 0 : -ENODEV;

	if (!error) {
		*l = (struct packet_loop){.fd = -1, .warm_up = warm_up, .frames = frames};
		error = run(l, camera, buffers, packet_bytes);
	}
	if (!error)
		*out = l->result;
	if (l) {
		if (l->fd >= 0)
			close(l->fd);
		free(l->memory);
	}
	free(l);
	g_clear_object(&camera);
	return error;
}
