/*
 * GPIO chips that are files: they take the place of drivers/gpio_lines_v*.c. What happens on their
 * lines is recorded, their input's edges and their faults are written by the test, from the same
 * process or from another one. A request holds a lock of the file, as the kernel holds a line:
 * until the last process that has the descriptor is gone.
 */
#pragma once

#include <stdatomic.h>
#include <stdint.h>

#define FAKE_GPIO_DIR_ENV "FAKE_GPIO_DIR" /* its gpiochip* are the chips that there are */
#define FAKE_GPIO_LINES 6
#define FAKE_GPIO_CHANGES 65536
#define FAKE_GPIO_EDGES 4096
#define FAKE_GPIO_NAME_BYTES 32

struct fake_gpio_change {
	int64_t time_ns;
	uint32_t levels;
	uint32_t pid; /* of the process that made it */
};

struct fake_gpio {
	char label[FAKE_GPIO_NAME_BYTES];
	struct {
		char name[FAKE_GPIO_NAME_BYTES];
		char user[FAKE_GPIO_NAME_BYTES]; /* of somebody else; "": free */
	} lines[FAKE_GPIO_LINES];
	_Atomic uint32_t gone; /* every call fails with ENODEV */

	_Atomic uint32_t levels; /* bit: a line by its offset */
	_Atomic uint32_t change_count;
	struct fake_gpio_change changes[FAKE_GPIO_CHANGES];

	_Atomic uint32_t edge_count, edges_read;
	int64_t edges_ns[FAKE_GPIO_EDGES]; /* of the one input, as they come */

	/* the setting that makes change number N takes so long to begin, and to return */
	_Atomic uint32_t slow_change;
	int64_t slow_before_ns, slow_after_ns;
};

/* DIR/gpiochip0 with the lines IR_TRIG, STROBE, HD_TRIG, EXPOSURE, SYNC_IN and one without a name.
 * It is mapped, for good. */
struct fake_gpio *fake_gpio_create(const char *dir, const char *chip);

/* From now on the file says in one digit what levels this process has set: 0 to 7. */
void fake_gpio_show_levels(const char *path);
