/*
 * Log lines on standard error, or to whom the program hands them (daemon/journal.h). Normal threads
 * only: real-time threads count, and the control thread logs.
 */
#pragma once

#include <stdbool.h>
#include <stdint.h>

enum log_level { LOG_LEVEL_ERROR = 3, LOG_LEVEL_WARNING = 4, LOG_LEVEL_INFO = 6 };

#define LOG_NO_SHOT UINT64_MAX

/* What a line is about, for those who search by it; the line says it in words as well. */
struct log_fields {
	const char *camera; /* name; NULL: none */
	uint64_t shot;      /* LOG_NO_SHOT: none */
};

void log_line(enum log_level level, const char *format, ...) __attribute__((format(printf, 2, 3)));
void log_about(enum log_level level, const struct log_fields *fields, const char *format, ...)
	__attribute__((format(printf, 3, 4)));

#define log_error(...) log_line(LOG_LEVEL_ERROR, __VA_ARGS__)
#define log_warning(...) log_line(LOG_LEVEL_WARNING, __VA_ARGS__)
#define log_info(...) log_line(LOG_LEVEL_INFO, __VA_ARGS__)

/* Whether standard error is a stream to systemd's journal (JOURNAL_STREAM in systemd.exec(5)). Then
 * plain lines begin with the priority prefix of sd-daemon(3). */
bool log_stderr_is_journal(void);

/* Takes a line (without newline) instead of standard error. False: it could not, print it. */
typedef bool log_sink_fn(enum log_level level, const struct log_fields *fields, const char *text);

/* Before any other thread. NULL: standard error again. */
void log_set_sink(log_sink_fn *sink);
