/*
 * It holds 1024 samples, and takes a packet when there is room for it. Writes are taken in the
 * caller's ft232h_handle(): there is no thread.
 */
#include "tests/usb/fake_ft232h.h"

#include <errno.h>
#include <fcntl.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

#include "base/clock.h"
#include "drivers/usb/ft232h.h"

#define PACKET_BYTES 512
#define FIFO_BYTES 1024
#define QUEUE_MAX 1024

struct ft232h {
	struct ft232h_write *queue[QUEUE_MAX];
	int64_t submitted_ns[QUEUE_MAX];
	uint64_t first, end;
	uint32_t sent; /* bytes of the first */
	bool cancelled;
	uint32_t divisor;
	uint8_t mask, last;
	int64_t taken, begin_sample, begin_ns;
};

static struct fake_ft232h own;
struct fake_ft232h *fake_ft232h = &own;

/* Before main(): where a file is named, what is in it is there from the start. */
__attribute__((constructor)) static void map_file(void)
{
	const char *path = getenv(FAKE_FT232H_ENV);
	int fd = path ? open(path, O_RDWR | O_CLOEXEC) : -1;

	if (fd < 0 || ftruncate(fd, sizeof(*fake_ft232h)))
		return;
	void *memory = mmap(NULL, sizeof(*fake_ft232h), PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);

	close(fd);
	if (memory != MAP_FAILED)
		fake_ft232h = memory;
}

void fake_ft232h_reset(void)
{
	memset(fake_ft232h, 0, sizeof(*fake_ft232h));
}

static int64_t time_of(const struct ft232h *adapter, int64_t sample)
{
	double sample_ns = (double)adapter->divisor * 50 / 3 / (1 + fake_ft232h->ppm * 1e-6);

	return adapter->begin_ns + (int64_t)((double)(sample - adapter->begin_sample) * sample_ns);
}

static void show(uint8_t levels)
{
	FILE *file = fake_ft232h->levels_path ? fopen(fake_ft232h->levels_path, "w") : NULL;

	if (!file)
		return;
	fprintf(file, "%d\n", levels != 0);
	fclose(file);
}

static uint32_t packet_of(const struct ft232h *adapter)
{
	uint32_t left = adapter->queue[adapter->first % QUEUE_MAX]->length - adapter->sent;

	return left < PACKET_BYTES ? left : PACKET_BYTES;
}

/* When the next packet is taken. */
static int64_t next_ns(const struct ft232h *adapter)
{
	int64_t room_ns = time_of(adapter, adapter->taken + packet_of(adapter) - FIFO_BYTES);
	int64_t submitted_ns = adapter->submitted_ns[adapter->first % QUEUE_MAX];

	return adapter->taken == adapter->begin_sample || submitted_ns > room_ns ? submitted_ns
										 : room_ns;
}

static void play(struct ft232h *adapter, const uint8_t *bytes, uint32_t count, int64_t now_ns)
{
	if (now_ns >= time_of(adapter, adapter->taken)) {
		adapter->begin_ns = now_ns;
		adapter->begin_sample = adapter->taken;
		fake_ft232h->gap_count++;
	}
	for (uint32_t i = 0; i < count; i++) {
		uint8_t levels = bytes[i] & adapter->mask;

		if (levels != adapter->last && fake_ft232h->change_count < FAKE_FT232H_CHANGES)
			fake_ft232h->changes[fake_ft232h->change_count++] =
				(struct fake_ft232h_change){adapter->taken + i,
							    time_of(adapter, adapter->taken + i),
							    levels};
		adapter->last = levels;
	}
	adapter->taken += count;
	fake_ft232h->lit_count += adapter->last != 0;
	show(adapter->last);
}

static void finish_first(struct ft232h *adapter, int err)
{
	struct ft232h_write *write = adapter->queue[adapter->first % QUEUE_MAX];

	adapter->first++;
	adapter->sent = 0;
	write->taken(write, err);
}

static int error_of(const struct ft232h *adapter)
{
	return fake_ft232h->gone ? -ENODEV : adapter->cancelled ? -ECANCELED : 0;
}

/* All packets that were taken by now. */
static bool take(struct ft232h *adapter, int64_t now_ns)
{
	bool any = false;

	while (adapter->first < adapter->end && error_of(adapter)) {
		finish_first(adapter, error_of(adapter));
		any = true;
	}
	while (adapter->first < adapter->end && next_ns(adapter) <= now_ns) {
		struct ft232h_write *write = adapter->queue[adapter->first % QUEUE_MAX];
		uint32_t count = packet_of(adapter);

		play(adapter, write->bytes + adapter->sent, count, next_ns(adapter));
		adapter->sent += count;
		if (adapter->sent == write->length) {
			finish_first(adapter, 0);
			any = true;
		}
	}
	if (adapter->first == adapter->end)
		adapter->cancelled = false;
	return any;
}

int ft232h_handle(struct ft232h *adapter, int64_t timeout_ns)
{
	int64_t give_up_ns = clock_now_ns() + timeout_ns;

	clock_sleep_until(fake_ft232h->deaf_until_ns);
	while (!take(adapter, clock_now_ns()) && clock_now_ns() < give_up_ns) {
		int64_t wake_ns = adapter->first < adapter->end ? next_ns(adapter) : give_up_ns;

		clock_sleep_until(wake_ns < give_up_ns ? wake_ns : give_up_ns);
	}
	return 0;
}

int ft232h_submit(struct ft232h_write *write)
{
	struct ft232h *adapter = write->adapter;

	if (fake_ft232h->gone)
		return -ENODEV;
	if (adapter->end - adapter->first == QUEUE_MAX)
		return -ENOMEM;
	adapter->submitted_ns[adapter->end % QUEUE_MAX] = clock_now_ns();
	adapter->queue[adapter->end++ % QUEUE_MAX] = write;
	return 0;
}

void ft232h_cancel(struct ft232h_write *write)
{
	write->adapter->cancelled = true;
}

int ft232h_write_init(struct ft232h *adapter, struct ft232h_write *write, uint32_t capacity)
{
	write->adapter = adapter;
	write->bytes = calloc(1, capacity);
	return write->bytes ? 0 : -ENOMEM;
}

void ft232h_write_finish(struct ft232h_write *write)
{
	free(write->bytes);
	memset(write, 0, sizeof(*write));
}

uint32_t ft232h_packet_bytes(const struct ft232h *adapter)
{
	(void)adapter;
	return PACKET_BYTES;
}

int ft232h_set_outputs(struct ft232h *adapter, uint8_t mask)
{
	adapter->mask = mask;
	show(0);
	return fake_ft232h->gone ? -ENODEV : 0;
}

int ft232h_set_divisor(struct ft232h *adapter, uint32_t divisor)
{
	adapter->divisor = divisor;
	return fake_ft232h->gone ? -ENODEV : 0;
}

int ft232h_list(void (*found)(const struct ft232h_info *info, void *user), void *user,
		const char *who, struct diag *diag)
{
	const struct ft232h_info info = {.port = "1-1", .serial = "FAKE"};

	(void)who;
	(void)diag;
	if (!fake_ft232h->gone)
		found(&info, user);
	return 0;
}

int ft232h_open(struct ft232h **out, const char *wanted, const char *who, struct diag *diag)
{
	struct ft232h *adapter;

	if (fake_ft232h->gone || (*wanted && strcmp(wanted, "FAKE") != 0)) {
		diag_add(diag, "%s: no such adapter; there is FAKE", who);
		return -ENODEV;
	}
	adapter = calloc(1, sizeof(*adapter));
	if (!adapter)
		return -ENOMEM;
	adapter->divisor = 1;
	*out = adapter;
	return 0;
}

void ft232h_close(struct ft232h *adapter)
{
	free(adapter);
}
