/*
 * Reads a whole file with a bound on its size. Pipes and devices are refused: they may never end.
 */
#include "base/file.h"

#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

/* The bound holds for a file that grows while it is read, too. */
static int read_all(int fd, char *buffer, size_t size_max, size_t *size)
{
	size_t done = 0;

	while (done < size_max) {
		ssize_t n = read(fd, buffer + done, size_max - done);

		if (n < 0 && errno == EINTR)
			continue;
		if (n < 0)
			return -errno;
		if (n == 0)
			break;
		done += (size_t)n;
	}
	*size = done;
	return 0;
}

static int check_kind(int fd, size_t size_max, size_t *size)
{
	struct stat st;

	if (fstat(fd, &st) < 0)
		return -errno;
	if (S_ISDIR(st.st_mode))
		return -EISDIR;
	if (!S_ISREG(st.st_mode))
		return -ENOTSUP;
	if ((size_t)st.st_size > size_max)
		return -EFBIG;
	*size = (size_t)st.st_size;
	return 0;
}

static void explain(const char *path, int err, size_t size_max, struct diag *diag)
{
	if (err == -EFBIG)
		diag_add(diag, "%s: larger than the %zu bytes that such a file may have", path,
			 size_max);
	else if (err == -ENOTSUP)
		diag_add(diag, "%s: not a regular file", path);
	else
		diag_add(diag, "%s: %s", path, strerror(-err));
}

int file_read(char **text, size_t *size, const char *path, size_t size_max, struct diag *diag)
{
	char *buffer = NULL;
	size_t bytes = 0;
	int err;
	int fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);

	if (fd < 0) {
		err = -errno;
		goto fail;
	}
	err = check_kind(fd, size_max, &bytes);
	if (err)
		goto fail;
	buffer = malloc(bytes + 1);
	err = buffer ? read_all(fd, buffer, bytes, &bytes) : -ENOMEM;
	if (err)
		goto fail;
	buffer[bytes] = '\0';
	close(fd);
	*text = buffer;
	*size = bytes;
	return 0;
fail:
	explain(path, err, size_max, diag);
	free(buffer);
	if (fd >= 0)
		close(fd);
	return err;
}
