/*
 * Temporary file in the same directory, then rename.
 */
#include "ctl/output_file.h"

#include <errno.h>
#include <fcntl.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

/* Pipes, terminals and /dev/null are written in place: there is nothing to rename. */
static bool written_in_place(const char *path)
{
	struct stat st;

	return stat(path, &st) == 0 && !S_ISREG(st.st_mode);
}

static int open_temporary(struct output_file *file)
{
	int length = snprintf(file->temporary, sizeof(file->temporary), "%s.XXXXXX", file->path);

	if (length >= (int)sizeof(file->temporary))
		return -ENAMETOOLONG;
	int fd = mkostemp(file->temporary, O_CLOEXEC);
	if (fd < 0) {
		file->temporary[0] = '\0';
		return -errno;
	}
	mode_t mask = umask(0);
	umask(mask);
	fchmod(fd, 0666 & ~mask); /* as any other new file, not mkstemp's 0600 */
	file->stream = fdopen(fd, "w");
	return file->stream ? 0 : -ENOMEM;
}

int output_file_open(struct output_file *file, const char *path, struct diag *diag)
{
	int err = 0;

	memset(file, 0, sizeof(*file));
	if (!path) {
		file->stream = stdout;
		return 0;
	}
	if (strlen(path) >= sizeof(file->path)) {
		diag_add(diag, "%s: path too long", path);
		return -ENAMETOOLONG;
	}
	strcpy(file->path, path);
	if (written_in_place(path)) {
		file->stream = fopen(path, "we");
		err = file->stream ? 0 : -errno;
	} else {
		err = open_temporary(file);
	}
	if (err)
		diag_add(diag, "%s: cannot write: %s", path, strerror(-err));
	return err;
}

int output_file_commit(struct output_file *file, struct diag *diag)
{
	int err = fflush(file->stream) != 0 ? -errno : ferror(file->stream) ? -EIO : 0;

	if (file->stream != stdout && fclose(file->stream) != 0 && !err)
		err = -errno;
	file->stream = NULL;
	if (!err && file->temporary[0] && rename(file->temporary, file->path) < 0)
		err = -errno;
	if (!err)
		file->temporary[0] = '\0';
	else
		diag_add(diag, "%s: cannot write: %s",
			 file->path[0] ? file->path : "standard output", strerror(-err));
	output_file_discard(file);
	return err;
}

void output_file_discard(struct output_file *file)
{
	if (file->stream && file->stream != stdout)
		fclose(file->stream);
	file->stream = NULL;
	if (file->temporary[0])
		unlink(file->temporary);
	file->temporary[0] = '\0';
}
