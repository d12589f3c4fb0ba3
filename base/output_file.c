/*
 * Temporary file in the same directory, then rename. SIGINT, SIGTERM and SIGHUP remove it on the
 * way out.
 */
#include "base/output_file.h"

#include <errno.h>
#include <fcntl.h>
#include <pthread.h>
#include <signal.h>
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

/* The one file that a signal must not leave behind; read by the handler. */
static const char *volatile unfinished;

static void remove_unfinished(int number)
{
	if (unfinished)
		unlink(unfinished); /* when it was just renamed: there is none */
	raise(number);              /* the default again: SA_RESETHAND */
}

/* One that the caller ignores, as under nohup, stays ignored. */
static void remove_on_signal(int number)
{
	struct sigaction action = {.sa_handler = remove_unfinished, .sa_flags = SA_RESETHAND};
	struct sigaction before;

	if (sigaction(number, NULL, &before) == 0 && before.sa_handler == SIG_DFL)
		sigaction(number, &action, NULL);
}

/* No signal comes between the file and the word that it is there. */
static int make_temporary(struct output_file *file)
{
	sigset_t all, before;

	sigfillset(&all);
	pthread_sigmask(SIG_BLOCK, &all, &before);
	int fd = mkostemp(file->temporary, O_CLOEXEC);
	int err = fd < 0 ? -errno : 0;
	unfinished = err ? NULL : file->temporary;
	pthread_sigmask(SIG_SETMASK, &before, NULL);
	return err ? err : fd;
}

static int open_temporary(struct output_file *file)
{
	int length = snprintf(file->temporary, sizeof(file->temporary), "%s.XXXXXX", file->path);

	if (length >= (int)sizeof(file->temporary))
		return -ENAMETOOLONG;
	remove_on_signal(SIGINT);
	remove_on_signal(SIGTERM);
	remove_on_signal(SIGHUP);
	int fd = make_temporary(file);
	if (fd < 0) {
		file->temporary[0] = '\0';
		return fd;
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

static int fail(const struct output_file *file, int err, struct diag *diag)
{
	diag_add(diag, "%s: cannot write: %s", file->path[0] ? file->path : "standard output",
		 strerror(-err));
	return err;
}

/* A file gets its name only when it would outlast a power cut. */
static int flush(struct output_file *file)
{
	if (fflush(file->stream) != 0)
		return -errno;
	if (ferror(file->stream))
		return -EIO;
	return file->temporary[0] && fsync(fileno(file->stream)) < 0 ? -errno : 0;
}

int output_file_commit(struct output_file *file, struct diag *diag)
{
	int err = flush(file);

	if (file->stream != stdout && fclose(file->stream) != 0 && !err)
		err = -errno;
	file->stream = NULL;
	if (!err && file->temporary[0] && rename(file->temporary, file->path) < 0)
		err = -errno;
	if (!err)
		file->temporary[0] = '\0';
	else
		fail(file, err, diag);
	output_file_discard(file);
	return err;
}

int output_file_end(struct output_file *file, int err, struct diag *diag)
{
	if (!err)
		return output_file_commit(file, diag);
	output_file_discard(file);
	return fail(file, err, diag);
}

void output_file_discard(struct output_file *file)
{
	if (file->stream && file->stream != stdout)
		fclose(file->stream);
	file->stream = NULL;
	if (file->temporary[0])
		unlink(file->temporary);
	if (unfinished == file->temporary)
		unfinished = NULL;
	file->temporary[0] = '\0';
}
