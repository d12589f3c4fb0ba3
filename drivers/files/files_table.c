/*
 * A small reader of comma-separated values: no quotes, blanks around values ignored, LF or CRLF.
 */
#include "drivers/files/files_table.h"

#include <errno.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include "base/file.h"

#define TABLE_SIZE_MAX (256 << 20) /* three hours at 120 Hz are 60 MB */
#define COLUMNS_MAX 16
#define FILE_NAME_MAX 1024
#define NUMBER_MAX (INT64_MAX / 2) /* so that sums and differences stay within 64 bits */

enum column { COLUMN_SHOT, COLUMN_TIME, COLUMN_UNCERTAINTY, COLUMN_FILE, COLUMN_COUNT };

static const char *const column_names[COLUMN_COUNT] = {"shot", "mid_exposure_ns", "uncertainty_ns",
						       "file"};

struct parser {
	const char *path;
	struct diag *diag; /* NULL: not to be told */
	bool failed;
	int line;
	int column_at[COLUMN_COUNT]; /* place of each column, -1 = absent */
	char *values[COLUMNS_MAX];
	int value_count;
};

static void complain(struct parser *p, int column, const char *what, const char *value)
{
	diag_add(p->diag, "%s:%d: %s: %s%.40s%s", p->path, p->line, column_names[column],
		 value ? "'" : "", value ? value : "", what);
	p->failed = true;
}

static char *trim(char *text)
{
	char *end;

	text += strspn(text, " \t");
	end = text + strlen(text);
	while (end > text && strchr(" \t\r", end[-1]))
		*--end = '\0';
	return text;
}

/* Cuts one line into p->values. */
static bool split(struct parser *p, char *line)
{
	p->value_count = 0;
	for (char *next = line; next; line = next) {
		if (p->value_count == COLUMNS_MAX) {
			diag_add(p->diag, "%s:%d: more than %d columns", p->path, p->line,
				 COLUMNS_MAX);
			p->failed = true;
			return false;
		}
		next = strchr(line, ',');
		if (next)
			*next++ = '\0';
		p->values[p->value_count++] = trim(line);
	}
	return true;
}

static void read_header(struct parser *p, char *line)
{
	for (int c = 0; c < COLUMN_COUNT; c++)
		p->column_at[c] = -1;
	if (!split(p, line))
		return;
	for (int i = 0; i < p->value_count; i++)
		for (int c = 0; c < COLUMN_COUNT; c++) {
			if (strcmp(p->values[i], column_names[c]) != 0)
				continue;
			if (p->column_at[c] >= 0)
				complain(p, c, "this column is there twice", NULL);
			p->column_at[c] = i;
		}
	if (p->column_at[COLUMN_TIME] < 0)
		complain(p, COLUMN_TIME, "the header has no such column", NULL);
	if (p->column_at[COLUMN_FILE] < 0)
		complain(p, COLUMN_FILE, "the header has no such column", NULL);
}

static uint64_t read_number(struct parser *p, enum column column, uint64_t max)
{
	const char *text = p->values[p->column_at[column]];
	unsigned long long number;

	errno = 0;
	number = strtoull(text, NULL, 10);
	if (!*text || strspn(text, "0123456789") != strlen(text))
		complain(p, column, "' is not a whole number", text);
	else if (errno == ERANGE || number > max)
		complain(p, column, "' is too large", text);
	return number;
}

/* A name inside the recording's directory: a table from outside may not lead out of it. */
static void check_file_name(struct parser *p, const char *name)
{
	const char *wrong = NULL;

	if (!*name)
		wrong = "' is empty";
	else if (strlen(name) > FILE_NAME_MAX)
		wrong = "...' is too long";
	else if (*name == '/')
		wrong = "' is an absolute path, expected one inside the directory";
	for (const char *part = name; !wrong && part; part = strchr(part, '/')) {
		part += *part == '/';
		if (strncmp(part, "..", 2) == 0 && (part[2] == '/' || !part[2]))
			wrong = "' leads out of the directory";
	}
	if (wrong)
		complain(p, COLUMN_FILE, wrong, name);
}

static void check_order(struct parser *p, const struct files_row *row, const struct files_row *last)
{
	if (row->mid_exposure_ns <= last->mid_exposure_ns)
		complain(p, COLUMN_TIME, "not later than in the row before", NULL);
	if (p->column_at[COLUMN_SHOT] >= 0 && row->shot <= last->shot)
		complain(p, COLUMN_SHOT, "not above the shot of the row before", NULL);
}

static void read_row(struct parser *p, struct files_row *row)
{
	*row = (struct files_row){.shot = UINT64_MAX, .line = p->line};
	for (int c = 0; c < COLUMN_COUNT; c++)
		if (p->column_at[c] >= p->value_count) {
			complain(p, c, "missing in this row", NULL);
			return;
		}
	if (p->column_at[COLUMN_SHOT] >= 0)
		row->shot = read_number(p, COLUMN_SHOT, NUMBER_MAX);
	if (p->column_at[COLUMN_UNCERTAINTY] >= 0)
		row->uncertainty_ns = (int64_t)read_number(p, COLUMN_UNCERTAINTY, NUMBER_MAX);
	row->mid_exposure_ns = (int64_t)read_number(p, COLUMN_TIME, NUMBER_MAX);
	row->file = p->values[p->column_at[COLUMN_FILE]];
	check_file_name(p, row->file);
}

static int add_row(struct files_table *table, const struct files_row *row)
{
	if ((table->row_count & (table->row_count - 1)) == 0) { /* 0 or a power of two: full */
		size_t room = table->row_count ? 2 * table->row_count : 1;
		struct files_row *rows = reallocarray(table->rows, room, sizeof(*rows));

		if (!rows)
			return -ENOMEM;
		table->rows = rows;
	}
	table->rows[table->row_count++] = *row;
	return 0;
}

/* Returns 0 or -ENOMEM. A line without an end that is no row was being written when a recorder or a
 * copy ended: what is before it stands. */
static int take_row(struct parser *p, struct files_table *table, char *line, bool has_end)
{
	bool failed_before = p->failed, may_be_cut = !has_end && table->row_count;
	struct diag *diag = p->diag;
	struct files_row row;
	int err = 0;

	p->diag = may_be_cut ? NULL : diag;
	p->failed = false;
	if (split(p, line))
		read_row(p, &row);
	if (!p->failed && table->row_count)
		check_order(p, &row, &table->rows[table->row_count - 1]);
	if (!p->failed)
		err = add_row(table, &row);
	if (p->failed && may_be_cut) {
		table->cut_line = p->line;
		p->failed = false;
	}
	p->diag = diag;
	p->failed |= failed_before;
	return err;
}

static int read_lines(struct parser *p, struct files_table *table)
{
	char *next = table->text;
	bool header = true;

	if (strncmp(next, "\xef\xbb\xbf", 3) == 0) /* a byte order mark of a spreadsheet */
		next += 3;
	for (char *line = next; line; line = next) {
		p->line++;
		next = strchr(line, '\n');
		if (next)
			*next++ = '\0';
		if (!*trim(line))
			continue;
		if (header) {
			read_header(p, line);
			header = false;
			if (p->failed)
				return -EINVAL;
			continue;
		}
		if (take_row(p, table, line, next))
			return -ENOMEM;
	}
	if (!p->failed && !table->row_count) {
		diag_add(p->diag,
			 "%s: no frames in it; expected the header %s and a line per image",
			 p->path, "shot,mid_exposure_ns,uncertainty_ns,file");
		p->failed = true;
	}
	return p->failed ? -EINVAL : 0;
}

int files_table_load(struct files_table *table, const char *path, struct diag *diag)
{
	struct parser p = {.path = path, .diag = diag};
	struct files_table made = {0};
	size_t size;
	int err = file_read(&made.text, &size, path, TABLE_SIZE_MAX, diag);

	if (err)
		return err;
	if (strlen(made.text) != size) {
		diag_add(diag, "%s: not a text: a NUL byte in it", path);
		err = -EINVAL;
	} else {
		err = read_lines(&p, &made);
	}
	if (err) {
		files_table_finish(&made);
		return err;
	}
	*table = made;
	return 0;
}

static int compare_ns(const void *a, const void *b)
{
	int64_t x = *(const int64_t *)a, y = *(const int64_t *)b;

	return (x > y) - (x < y);
}

/* One period at least, several where frames are missing. */
static int64_t step_ns(const struct files_row *row)
{
	return row[1].mid_exposure_ns - row[0].mid_exposure_ns;
}

/* A step that a missing frame does not lengthen: the lower quartile. */
static int64_t single_step_ns(const struct files_table *table)
{
	size_t count = table->row_count - 1;
	int64_t *steps_ns = reallocarray(NULL, count, sizeof(*steps_ns));
	int64_t single_ns = 0;

	if (!steps_ns)
		return 0;
	for (size_t i = 0; i < count; i++)
		steps_ns[i] = step_ns(&table->rows[i]);
	qsort(steps_ns, count, sizeof(*steps_ns), compare_ns);
	single_ns = steps_ns[count / 4];
	free(steps_ns);
	return single_ns;
}

int64_t files_table_period_ns(const struct files_table *table)
{
	int64_t single_ns = table->row_count > 1 ? single_step_ns(table) : 0;
	uint64_t sum_ns = 0, periods = 0;

	if (single_ns <= 0)
		return 0;
	for (size_t i = 0; i + 1 < table->row_count; i++) {
		uint64_t whole = ((uint64_t)step_ns(&table->rows[i]) + (uint64_t)single_ns / 2) /
				 (uint64_t)single_ns;

		sum_ns += whole > 0 ? (uint64_t)step_ns(&table->rows[i]) : 0;
		periods += whole;
	}
	return (int64_t)(sum_ns / periods);
}

void files_table_finish(struct files_table *table)
{
	free(table->rows);
	free(table->text);
	memset(table, 0, sizeof(*table));
}
