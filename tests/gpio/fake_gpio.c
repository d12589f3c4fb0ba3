/*
 * drivers/gpio/gpio_lines.h on a shared file.
 */
#include "tests/gpio/fake_gpio.h"

#include <errno.h>
#include <fcntl.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

#include "base/clock.h"
#include "drivers/gpio/gpio_lines.h"

_Static_assert(offsetof(struct fake_gpio, gone) == 416 &&
		       offsetof(struct fake_gpio, changes) == 432 &&
		       offsetof(struct fake_gpio, edge_count) ==
			       432 + sizeof(struct fake_gpio_change) * FAKE_GPIO_CHANGES,
	       "tests/system/fake_chip.py reads it at other places");

#define LOOK_NS (100 * NS_PER_US) /* how often a waiting input looks */
#define COUNT_MAX 8

struct gpio_chip {
	char path[200];
	struct fake_gpio *fake;
};

/* What a request has of the file, at its beginning for the guard to find. */
struct gpio_outputs {
	int fd;
	struct fake_gpio *fake;
	uint32_t offsets[COUNT_MAX], count;
};

struct gpio_input {
	int fd;
	struct fake_gpio *fake;
};

static int shown_fd = -1;

static void show(uint32_t levels)
{
	const char digit = (char)('0' + (levels & 7));

	if (shown_fd >= 0 && pwrite(shown_fd, &digit, 1, 0) != 1)
		abort();
}

void fake_gpio_show_levels(const char *path)
{
	shown_fd = open(path, O_RDWR | O_CREAT | O_CLOEXEC, 0600);
	show(0);
}

static struct fake_gpio *map(int fd)
{
	void *mapped =
		mmap(NULL, sizeof(struct fake_gpio), PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);

	return mapped == MAP_FAILED ? NULL : mapped;
}

struct fake_gpio *fake_gpio_create(const char *dir, const char *chip)
{
	static const char *const names[FAKE_GPIO_LINES] = {"IR_TRIG",  "STROBE",  "HD_TRIG",
							   "EXPOSURE", "SYNC_IN", ""};
	char path[200];

	snprintf(path, sizeof(path), "%s/%s", dir, chip);
	int fd = open(path, O_RDWR | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
	if (fd < 0 || ftruncate(fd, sizeof(struct fake_gpio)) < 0)
		abort();
	struct fake_gpio *fake = map(fd);
	close(fd);
	snprintf(fake->label, sizeof(fake->label), "fake-%s", chip);
	for (int l = 0; l < FAKE_GPIO_LINES; l++)
		strcpy(fake->lines[l].name, names[l]);
	return fake;
}

const char *gpio_chip_pattern(void)
{
	static char pattern[200];
	const char *dir = getenv(FAKE_GPIO_DIR_ENV);

	snprintf(pattern, sizeof(pattern), "%s/gpiochip*", dir ? dir : "/nonexistent");
	return pattern;
}

int gpio_chip_open(struct gpio_chip **out, const char *path)
{
	int fd = open(path, O_RDWR | O_CLOEXEC);

	if (fd < 0)
		return -errno;
	struct fake_gpio *fake = map(fd);
	close(fd);
	if (!fake || fake->gone)
		return -ENODEV;
	struct gpio_chip *chip = calloc(1, sizeof(*chip));
	snprintf(chip->path, sizeof(chip->path), "%s", path);
	chip->fake = fake;
	*out = chip;
	return 0;
}

void gpio_chip_close(struct gpio_chip *chip)
{
	munmap(chip->fake, sizeof(*chip->fake));
	free(chip);
}

const char *gpio_chip_label(struct gpio_chip *chip)
{
	return chip->fake->label;
}

uint32_t gpio_chip_line_count(struct gpio_chip *chip)
{
	(void)chip;
	return FAKE_GPIO_LINES;
}

static struct flock lock_of(uint32_t offset, short type)
{
	return (struct flock){.l_type = type, .l_whence = SEEK_SET, .l_start = offset, .l_len = 1};
}

int gpio_chip_line(struct gpio_chip *chip, uint32_t offset, struct gpio_line_info *out)
{
	struct flock lock = lock_of(offset, F_WRLCK);
	int fd = open(chip->path, O_RDWR | O_CLOEXEC);

	if (fd < 0 || fcntl(fd, F_OFD_GETLK, &lock) < 0)
		return -errno;
	close(fd);
	snprintf(out->name, sizeof(out->name), "%s", chip->fake->lines[offset].name);
	snprintf(out->user, sizeof(out->user), "%s",
		 lock.l_type != F_UNLCK ? "stage trigger" : chip->fake->lines[offset].user);
	out->used = *out->user;
	return 0;
}

static int take_lines(const char *path, const uint32_t *offsets, uint32_t count)
{
	int fd = open(path, O_RDWR | O_CLOEXEC);

	for (uint32_t i = 0; i < count && fd >= 0; i++) {
		struct flock lock = lock_of(offsets[i], F_WRLCK);

		if (fcntl(fd, F_OFD_SETLK, &lock) < 0) {
			close(fd);
			return -EBUSY;
		}
	}
	return fd < 0 ? -errno : fd;
}

/* Bits by line become bits by offset. */
static void record(struct fake_gpio *fake, const uint32_t *offsets, uint32_t count, uint32_t levels)
{
	uint32_t all = atomic_load(&fake->levels);

	for (uint32_t i = 0; i < count; i++) {
		all &= ~(UINT32_C(1) << offsets[i]);
		all |= (levels >> i & 1) << offsets[i];
	}
	uint32_t change = atomic_load(&fake->change_count);
	bool slow = change + 1 == atomic_load(&fake->slow_change);

	if (slow && fake->slow_before_ns)
		clock_sleep_until(clock_now_ns() + fake->slow_before_ns);
	fake->changes[change % FAKE_GPIO_CHANGES] =
		(struct fake_gpio_change){clock_now_ns(), all, (uint32_t)getpid()};
	atomic_store(&fake->levels, all);
	show(all);
	atomic_store(&fake->change_count, change + 1);
	if (slow && fake->slow_after_ns)
		clock_sleep_until(clock_now_ns() + fake->slow_after_ns);
}

int gpio_line_level(struct gpio_chip *chip, uint32_t offset, const char *consumer)
{
	int fd = take_lines(chip->path, &offset, 1);

	(void)consumer;
	if (fd < 0)
		return fd;
	close(fd);
	return atomic_load(&chip->fake->levels) >> offset & 1;
}

int gpio_outputs_request(struct gpio_outputs **out, struct gpio_chip *chip, const char *consumer,
			 const uint32_t *offsets, uint32_t count, uint32_t levels)
{
	int fd = take_lines(chip->path, offsets, count);
	struct gpio_outputs *outputs;

	(void)consumer;
	if (fd < 0)
		return fd;
	outputs = calloc(1, sizeof(*outputs));
	outputs->fd = fd;
	outputs->fake = map(fd);
	outputs->count = count;
	memcpy(outputs->offsets, offsets, count * sizeof(*offsets));
	record(outputs->fake, offsets, count, levels);
	*out = outputs;
	return 0;
}

void gpio_outputs_release(struct gpio_outputs *outputs)
{
	if (!outputs)
		return;
	munmap(outputs->fake, sizeof(*outputs->fake));
	close(outputs->fd);
	free(outputs);
}

int gpio_outputs_set(struct gpio_outputs *outputs, uint32_t levels)
{
	if (atomic_load(&outputs->fake->gone))
		return -ENODEV;
	record(outputs->fake, outputs->offsets, outputs->count, levels);
	return 0;
}

int gpio_outputs_fd(const struct gpio_outputs *outputs)
{
	return outputs->fd;
}

/* The guard: the lines are the first ones of the chip, in order. */
int gpio_fd_set(int fd, uint32_t count, uint32_t levels)
{
	static const uint32_t offsets[] = {0, 1, 2, 3};
	struct fake_gpio *fake = map(fd); /* which holds the file's locks too */

	if (!fake)
		return -ENODEV;
	bool gone = atomic_load(&fake->gone);
	if (!gone)
		record(fake, offsets, count, levels);
	munmap(fake, sizeof(*fake));
	return gone ? -ENODEV : 0;
}

int gpio_input_request(struct gpio_input **out, struct gpio_chip *chip, const char *consumer,
		       uint32_t offset, bool falling)
{
	int fd = take_lines(chip->path, &offset, 1);
	struct gpio_input *input;

	(void)consumer, (void)falling;
	if (fd < 0)
		return fd;
	input = calloc(1, sizeof(*input));
	input->fd = fd;
	input->fake = map(fd);
	*out = input;
	return 0;
}

void gpio_input_release(struct gpio_input *input)
{
	if (!input)
		return;
	munmap(input->fake, sizeof(*input->fake));
	close(input->fd);
	free(input);
}

/* An edge is there from its time on. */
static bool has_edge(const struct fake_gpio *fake)
{
	uint32_t next = atomic_load(&fake->edges_read);

	return next < atomic_load(&fake->edge_count) &&
	       fake->edges_ns[next % FAKE_GPIO_EDGES] <= clock_now_ns();
}

int gpio_input_wait(struct gpio_input *input, int64_t until_ns)
{
	for (;;) {
		int64_t now_ns = clock_now_ns();

		if (atomic_load(&input->fake->gone))
			return -ENODEV;
		if (has_edge(input->fake))
			return 0;
		if (now_ns >= until_ns)
			return -ETIMEDOUT;
		clock_sleep_until(now_ns + LOOK_NS < until_ns ? now_ns + LOOK_NS : until_ns);
	}
}

int gpio_input_read(struct gpio_input *input, int64_t *edges_ns, int max)
{
	int count = 0;

	if (atomic_load(&input->fake->gone))
		return -ENODEV;
	for (; count < max && has_edge(input->fake); count++)
		edges_ns[count] =
			input->fake->edges_ns[atomic_fetch_add(&input->fake->edges_read, 1) %
					      FAKE_GPIO_EDGES];
	return count;
}
