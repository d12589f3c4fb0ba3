/*
 * How fast the disk takes a stream, as recordings write it: O_DIRECT, one large write after the
 * other. The file has no name, so nothing stays, however this ends.
 */
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include "base/clock.h"
#include "ctl/doctor/doctor_gather.h"

#define BLOCK_BYTES (4u << 20)
#define BLOCK_MAX 16
#define PATIENCE_NS (NS_PER_S / 2)
#define SPARE_BYTES (1u << 30) /* of a disk nearly full nothing is taken */

/* Past the page cache where the file system can. */
static int open_nameless(const char *dir)
{
	int fd = open(dir, O_TMPFILE | O_WRONLY | O_DIRECT | O_CLOEXEC, 0600);

	if (fd < 0 && errno == EINVAL)
		fd = open(dir, O_TMPFILE | O_WRONLY | O_CLOEXEC, 0600);
	return fd < 0 ? -errno : fd;
}

static int write_block(int fd, const char *block)
{
	for (size_t done = 0; done < BLOCK_BYTES;) {
		ssize_t n = write(fd, block + done, BLOCK_BYTES - done);

		if (n < 0 && errno == EINTR)
			continue;
		if (n < 0)
			return -errno;
		done += (size_t)n;
	}
	return 0;
}

/* 0 or a negative errno. */
static int measure(int fd, const char *block, double *bytes_per_s)
{
	int64_t begin_ns = clock_real_now_ns(), now_ns = begin_ns;
	double bytes = 0;
	int err = 0;

	for (int b = 0; b < BLOCK_MAX && now_ns - begin_ns < PATIENCE_NS && !err; b++) {
		err = write_block(fd, block);
		bytes += BLOCK_BYTES;
		now_ns = clock_real_now_ns();
	}
	if (!err && fdatasync(fd) < 0)
		err = -errno;
	if (!err)
		*bytes_per_s = bytes * NS_PER_S / (double)(clock_real_now_ns() - begin_ns);
	return err;
}

static int probe(struct doctor_facts *facts)
{
	struct statvfs disk;
	char *block = NULL;
	int fd = -1, err = 0;

	if (statvfs(facts->recordings_dir, &disk) < 0)
		return -errno;
	facts->disk_free_bytes = (uint64_t)disk.f_bavail * disk.f_frsize;
	if (facts->disk_free_bytes < SPARE_BYTES)
		return -ENOSPC;
	fd = open_nameless(facts->recordings_dir);
	if (fd < 0)
		return fd;
	block = aligned_alloc(4096, BLOCK_BYTES);
	if (block)
		memset(block, 0x5a, BLOCK_BYTES);
	err = block ? measure(fd, block, &facts->disk_bytes_per_s) : -ENOMEM;
	free(block);
	close(fd);
	return err;
}

void doctor_probe_disk(struct doctor_facts *facts)
{
	facts->disk_error = -probe(facts);
}
