/*
 * One entry per line.
 */
#define SD_JOURNAL_SUPPRESS_LOCATION /* log.c logs for all: its place says nothing */
#include "daemon/journal.h"

#include <inttypes.h>
#include <stdio.h>
#include <sys/uio.h>
#include <systemd/sd-journal.h>

#include "base/log.h"

#define FIELD_MAX 4
#define FIELD_BYTES 1100

struct entry {
	int field_count;
	char texts[FIELD_MAX][FIELD_BYTES];
	struct iovec fields[FIELD_MAX];
};

static __attribute__((format(printf, 2, 3))) void add_field(struct entry *entry, const char *format,
							    ...)
{
	char *text = entry->texts[entry->field_count];
	va_list args;

	va_start(args, format);
	int length = vsnprintf(text, FIELD_BYTES, format, args);
	va_end(args);
	if (length > 0 && length < FIELD_BYTES)
		entry->fields[entry->field_count++] = (struct iovec){text, (size_t)length};
}

static bool send_entry(enum log_level level, const struct log_fields *about, const char *text)
{
	struct entry entry = {0};

	add_field(&entry, "MESSAGE=%s", text);
	add_field(&entry, "PRIORITY=%d", (int)level);
	if (about->camera)
		add_field(&entry, "STAGE_CAMERA=%s", about->camera);
	if (about->shot != LOG_NO_SHOT)
		add_field(&entry, "STAGE_SHOT=%" PRIu64, about->shot);
	return sd_journal_sendv(entry.fields, entry.field_count) == 0;
}

void journal_begin(void)
{
	log_set_sink(log_stderr_is_journal() ? send_entry : NULL);
}
