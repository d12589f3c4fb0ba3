/*
 * A growing list of messages. Control threads only: it allocates.
 */
#include "base/diag.h"

#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

void diag_finish(struct diag *diag)
{
	free(diag->text);
	memset(diag, 0, sizeof(*diag));
}

static void append_line(struct diag *diag, const char *line)
{
	size_t length = strlen(line);
	char *text = realloc(diag->text, diag->size_bytes + length + 2);

	if (!text)
		return;
	memcpy(text + diag->size_bytes, line, length);
	memcpy(text + diag->size_bytes + length, "\n", 2);
	diag->text = text;
	diag->size_bytes += length + 1;
}

void diag_add(struct diag *diag, const char *format, ...)
{
	char *line;
	va_list args;

	if (!diag || ++diag->count > DIAG_MAX)
		return;
	va_start(args, format);
	int length = vasprintf(&line, format, args);
	va_end(args);
	if (length < 0)
		return;
	append_line(diag, line);
	free(line);
}

void diag_print(const struct diag *diag, FILE *out)
{
	if (diag->text)
		fputs(diag->text, out);
	if (diag->count > DIAG_MAX)
		fprintf(out, "... and %d more\n", diag->count - DIAG_MAX);
}
