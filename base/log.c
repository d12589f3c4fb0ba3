/*
 * One write per line, so that lines of several threads do not mix.
 */
#include "base/log.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>

#define LINE_BYTES 1024

static log_sink_fn *log_sink;

bool log_stderr_is_journal(void)
{
	const char *stream = getenv("JOURNAL_STREAM");
	unsigned long long device, inode;
	struct stat st;

	return stream && sscanf(stream, "%llu:%llu", &device, &inode) == 2 &&
	       fstat(STDERR_FILENO, &st) == 0 && st.st_dev == device && st.st_ino == inode;
}

void log_set_sink(log_sink_fn *sink)
{
	log_sink = sink;
}

static void print_line(enum log_level level, const char *text)
{
	char line[LINE_BYTES + 8];
	int length = log_stderr_is_journal()
			     ? snprintf(line, sizeof(line), "<%d>%s\n", (int)level, text)
			     : snprintf(line, sizeof(line), "%s\n", text);

	if (write(STDERR_FILENO, line, (size_t)length) < 0)
		return; /* nowhere left to say it */
}

static __attribute__((format(printf, 3, 0))) void
log_args(enum log_level level, const struct log_fields *fields, const char *format, va_list args)
{
	char text[LINE_BYTES]; /* what is longer is cut */

	if (vsnprintf(text, sizeof(text), format, args) < 0)
		return;
	if (!log_sink || !log_sink(level, fields, text))
		print_line(level, text);
}

void log_line(enum log_level level, const char *format, ...)
{
	const struct log_fields nothing = {.shot = LOG_NO_SHOT};
	va_list args;

	va_start(args, format);
	log_args(level, &nothing, format, args);
	va_end(args);
}

void log_about(enum log_level level, const struct log_fields *fields, const char *format, ...)
{
	va_list args;

	va_start(args, format);
	log_args(level, fields, format, args);
	va_end(args);
}
