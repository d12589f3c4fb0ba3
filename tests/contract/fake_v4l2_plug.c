/*
 * Makes and unmakes the files that are fake cameras.
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "tests/contract/fake_v4l2.h"

static char root[64];

/* Below the root; tests have nothing to do without it. */
static void make(const char *directory)
{
	char path[300];

	snprintf(path, sizeof(path), "%s/%s", root, directory);
	if (mkdir(path, 0755) && access(path, F_OK))
		abort();
}

static void write_file(const char *name, const char *text)
{
	char path[300];

	snprintf(path, sizeof(path), "%s/%s", root, name);
	FILE *file = fopen(path, "w");

	if (!file || fputs(text, file) < 0 || fclose(file))
		abort();
}

void fake_v4l2_begin(void)
{
	strcpy(root, "/tmp/stage-fake-v4l2-XXXXXX");
	if (!mkdtemp(root))
		abort();
	setenv("FAKE_V4L2", root, 1);
	make("dev");
	make("sys");
	make("sys/class");
	make("sys/class/video4linux");
	make("sys/devices");
}

void fake_v4l2_end(void)
{
	char command[128];

	snprintf(command, sizeof(command), "rm -r %s", root);
	if (system(command))
		abort();
}

/* As the kernel has it: class/video4linux/videoN/device is a link to the USB interface, in the
 * directory of the USB device. */
void fake_v4l2_plug(int number, const char *serial, const char *settings)
{
	char name[100], target[200];

	snprintf(name, sizeof(name), "sys/class/video4linux/video%d", number);
	make(name);
	snprintf(name, sizeof(name), "sys/devices/usb%d", number);
	make(name);
	if (serial) {
		snprintf(name, sizeof(name), "sys/devices/usb%d/serial", number);
		snprintf(target, sizeof(target), "%s\n", serial);
		write_file(name, target);
	}
	snprintf(name, sizeof(name), "sys/devices/usb%d/interface", number);
	make(name);
	snprintf(target, sizeof(target), "%s/%s", root, name);
	snprintf(name, sizeof(name), "%s/sys/class/video4linux/video%d/device", root, number);
	if (symlink(target, name) && access(name, F_OK))
		abort();
	snprintf(name, sizeof(name), "dev/video%d", number);
	write_file(name, settings);
}

void fake_v4l2_unplug(int number)
{
	char command[600];

	snprintf(command, sizeof(command),
		 "rm -r %s/dev/video%d %s/sys/class/video4linux/video%d %s/sys/devices/usb%d", root,
		 number, root, number, root, number);
	if (system(command))
		abort();
}
