/*
 * Small files of /proc, /sys and /etc.
 */
#include "ctl/doctor/doctor_tree.h"

#include <errno.h>
#include <fcntl.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static void path_of(const struct doctor *doctor, char path[TREE_PATH_BYTES], const char *format,
		    va_list arguments)
{
	int used = snprintf(path, TREE_PATH_BYTES, "%s", doctor->root);

	if (used >= 0 && used < TREE_PATH_BYTES)
		vsnprintf(path + used, (size_t)(TREE_PATH_BYTES - used), format, arguments);
}

void tree_path(const struct doctor *doctor, char path[TREE_PATH_BYTES], const char *format, ...)
{
	va_list arguments;

	va_start(arguments, format);
	path_of(doctor, path, format, arguments);
	va_end(arguments);
}

static bool read_line(const char *path, char *line, size_t size)
{
	int fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
	ssize_t length = fd < 0 ? -1 : read(fd, line, size - 1);

	if (fd >= 0)
		close(fd);
	line[length > 0 ? length : 0] = '\0';
	line[strcspn(line, "\n")] = '\0';
	return length >= 0;
}

bool tree_line(const struct doctor *doctor, char *line, size_t size, const char *format, ...)
{
	char path[TREE_PATH_BYTES];
	va_list arguments;

	va_start(arguments, format);
	path_of(doctor, path, format, arguments);
	va_end(arguments);
	return read_line(path, line, size);
}

bool tree_number(const struct doctor *doctor, int64_t *out, const char *format, ...)
{
	char path[TREE_PATH_BYTES], line[64], *end;
	va_list arguments;

	va_start(arguments, format);
	path_of(doctor, path, format, arguments);
	va_end(arguments);
	if (!read_line(path, line, sizeof(line)))
		return false;
	errno = 0;
	long long value = strtoll(line, &end, 10);

	if (errno || end == line || *end)
		return false;
	*out = value;
	return true;
}

bool tree_exists(const struct doctor *doctor, const char *path)
{
	char whole[TREE_PATH_BYTES];

	tree_path(doctor, whole, "%s", path);
	return access(whole, F_OK) == 0;
}

FILE *tree_open(const struct doctor *doctor, const char *path)
{
	char whole[TREE_PATH_BYTES];

	tree_path(doctor, whole, "%s", path);
	return fopen(whole, "re");
}

void tree_glob(const struct doctor *doctor, const char *pattern, glob_t *out)
{
	char whole[TREE_PATH_BYTES];

	tree_path(doctor, whole, "%s", pattern);
	if (glob(whole, 0, NULL, out) != 0)
		memset(out, 0, sizeof(*out));
}

const char *tree_name(const struct doctor *doctor, const char *path)
{
	size_t length = strlen(doctor->root);

	return strncmp(path, doctor->root, length) == 0 ? path + length : path;
}
