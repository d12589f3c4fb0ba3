/*
 * Places are whole tenths of a micrometre. A line that was cut off is left out, with all behind it.
 */
#include "ctl/calibrate/actor_journal.h"

#include <errno.h>
#include <inttypes.h>
#include <jansson.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/exit_codes.h"

#define UNIT_M 1e-7
#define PLACE_MAX 20000000 /* 2 m */
#define SHOTS_MAX 4000     /* two minutes of one part */

static const char *const outcome_names[] = {"open", "captured", "skipped", "not_seen"};

const char *actor_outcome_name(int outcome)
{
	return outcome_names[outcome];
}

static int outcome_of(const char *name)
{
	for (int k = OUTCOME_CAPTURED; name && k <= OUTCOME_NOT_SEEN; k++)
		if (strcmp(outcome_names[k], name) == 0)
			return k;
	return OUTCOME_OPEN;
}

void actor_capture_finish(struct actor_capture *capture)
{
	actor_part_finish(&capture->neutral);
	for (int k = 0; k < ACTOR_POSE_COUNT; k++)
		actor_part_finish(&capture->poses[k]);
}

void actor_journal_close(struct actor_journal *journal)
{
	if (journal->file)
		fclose(journal->file);
	journal->file = NULL;
}

/* One row is the time and three numbers a marker, null for one that was not seen. */
static bool read_row(const json_t *row, uint32_t count, struct actor_shot *shot)
{
	size_t at = 1;

	shot->mid_exposure_ns = json_integer_value(json_array_get(row, 0));
	shot->count = count;
	for (uint32_t i = 0; i < count; i++) {
		double axes[3];

		shot->seen[i] = json_is_integer(json_array_get(row, at));
		if (!shot->seen[i]) {
			at++;
			continue;
		}
		for (int k = 0; k < 3; k++) {
			json_int_t number = json_integer_value(json_array_get(row, at++));

			if (number > PLACE_MAX || number < -PLACE_MAX)
				return false;
			axes[k] = (double)number * UNIT_M;
		}
		shot->p_m[i] = (struct vec3){axes[0], axes[1], axes[2]};
	}
	return at == json_array_size(row);
}

static int read_part(const json_t *line, uint32_t count, struct actor_part *part)
{
	static struct actor_shot shot; /* this thread's; large */
	const json_t *shots = json_object_get(line, "shots");
	size_t index;
	json_t *row;

	actor_part_clear(part);
	if (json_array_size(shots) > SHOTS_MAX)
		return -EINVAL;
	json_array_foreach(shots, index, row)
	{
		if (!read_row(row, count, &shot))
			return -EINVAL;
		int err = actor_part_add(part, &shot);
		if (err)
			return err;
	}
	return 0;
}

static int read_line(const json_t *line, uint32_t count, struct actor_capture *capture)
{
	const char *name = json_string_value(json_object_get(line, "part"));
	int outcome = outcome_of(json_string_value(json_object_get(line, "outcome")));
	int pose = name ? actor_prompt_find(name) : -1;

	if (!name || !outcome)
		return -EINVAL;
	if (strcmp(name, "neutral") == 0)
		return read_part(line, count, &capture->neutral);
	if (pose < 0)
		return -EINVAL;
	int err = read_part(line, count, &capture->poses[pose]);
	if (!err)
		capture->outcomes[pose] = outcome;
	return err;
}

static json_t *header_of(const struct layout *layout)
{
	json_t *names = json_array();

	for (uint32_t i = 0; i < layout->marker_count; i++)
		json_array_append_new(names, json_string(layout->markers[i].name));
	return json_pack("{s:i, s:o}", "capture", 1, "markers", names);
}

/* Returns the length of what could be read whole. */
static long read_lines(FILE *file, const struct layout *layout, struct actor_capture *capture)
{
	char *text = NULL;
	size_t size = 0;
	long whole = ftell(file);
	ssize_t length;

	while ((length = getline(&text, &size, file)) > 0 && text[length - 1] == '\n') {
		json_t *line = json_loadb(text, (size_t)length, 0, NULL);
		int err = line ? read_line(line, layout->marker_count, capture) : -EINVAL;

		json_decref(line);
		if (err)
			break;
		whole = ftell(file);
	}
	free(text);
	return whole;
}

static bool header_fits(FILE *file, const struct layout *layout)
{
	char *text = NULL;
	size_t size = 0;
	ssize_t length = getline(&text, &size, file);
	json_t *found = length > 0 ? json_loadb(text, (size_t)length, 0, NULL) : NULL;
	json_t *wanted = header_of(layout);
	bool fits = found && json_equal(found, wanted);

	json_decref(found);
	json_decref(wanted);
	free(text);
	return fits;
}

static int go_on(struct actor_journal *j, struct actor_capture *capture,
		 const struct layout *layout, struct diag *diag)
{
	if (!header_fits(j->file, layout)) {
		diag_add(diag,
			 "%s: is of other markers than this layout's: begin anew with --fresh, or "
			 "move it away",
			 j->path);
		return EXIT_CODE_BAD_INPUT;
	}
	long whole = read_lines(j->file, layout, capture);
	if (fseek(j->file, 0, SEEK_END) == 0 && ftell(j->file) > whole)
		fprintf(stderr, "stagectl: %s: the last part was cut off and is asked for again\n",
			j->path);
	if (ftruncate(fileno(j->file), whole) == 0 && fseek(j->file, whole, SEEK_SET) == 0)
		return EXIT_CODE_OK;
	diag_add(diag, "%s: cannot be written: %s", j->path, strerror(errno));
	return EXIT_CODE_INTERNAL;
}

static int begin_anew(struct actor_journal *j, const struct layout *layout, struct diag *diag)
{
	json_t *header = header_of(layout);
	bool good = ftruncate(fileno(j->file), 0) == 0 && fseek(j->file, 0, SEEK_SET) == 0 &&
		    json_dumpf(header, j->file, JSON_COMPACT) == 0 && putc('\n', j->file) != EOF &&
		    fflush(j->file) == 0;

	json_decref(header);
	if (!good)
		diag_add(diag, "%s: cannot be written: %s", j->path, strerror(errno));
	return good ? EXIT_CODE_OK : EXIT_CODE_INTERNAL;
}

int actor_journal_open(struct actor_journal *j, struct actor_capture *capture, const char *path,
		       const struct layout *layout, bool fresh, struct diag *diag)
{
	snprintf(j->path, sizeof(j->path), "%s", path);
	j->file = fopen(path, "r+");
	bool earlier = j->file && !fresh;
	if (!j->file && errno == ENOENT)
		j->file = fopen(path, "w+");
	if (!j->file) {
		diag_add(diag, "%s: cannot be written: %s", path, strerror(errno));
		return EXIT_CODE_INTERNAL;
	}
	int code = earlier ? go_on(j, capture, layout, diag) : begin_anew(j, layout, diag);
	if (code != EXIT_CODE_OK)
		actor_journal_close(j);
	return code;
}

static void write_row(FILE *file, const struct actor_part *part, uint32_t n)
{
	fprintf(file, "%s[%" PRId64, n ? "," : "", part->time_ns[n]);
	for (uint32_t i = 0; i < part->marker_count; i++) {
		struct vec3 p = part->p_m[(size_t)n * part->marker_count + i];

		if (isnan(p.x))
			fputs(",null", file);
		else
			fprintf(file, ",%ld,%ld,%ld", lround(p.x / UNIT_M), lround(p.y / UNIT_M),
				lround(p.z / UNIT_M));
	}
	putc(']', file);
}

int actor_journal_add(struct actor_journal *j, const char *name, int outcome,
		      const struct actor_part *part)
{
	fprintf(j->file, "{\"part\":\"%s\",\"outcome\":\"%s\",\"shots\":[", name,
		actor_outcome_name(outcome));
	for (uint32_t n = 0; n < part->shot_count && n < SHOTS_MAX; n++)
		write_row(j->file, part, n);
	fputs("]}\n", j->file);
	if (fflush(j->file) != 0 || fdatasync(fileno(j->file)) != 0 || ferror(j->file))
		return errno ? -errno : -EIO;
	return 0;
}
