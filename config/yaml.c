/*
 * Files and messages on top of libfyaml; yaml_read.c reads mappings and lists, yaml_scalar.c
 * values.
 */
#include "config/yaml.h"

#include <errno.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include "base/file.h"
#include "config/utf8.h"

/* The library would write to standard error itself; its messages are collected instead. */
static void drop_output(struct fy_diag *diag, void *user, const char *text, size_t size)
{
	(void)diag;
	(void)user;
	(void)text;
	(void)size;
}

void yaml_complain(struct yaml *yaml, struct yaml_place place, const char *field,
		   const char *format, ...)
{
	char what[1024];
	va_list args;
	int used = snprintf(what, sizeof(what), "%s%s", field, *field ? ": " : "");

	va_start(args, format);
	vsnprintf(what + used, sizeof(what) - (size_t)used, format, args);
	va_end(args);
	/* the file's own text is in it: keep it one line, and off the terminal's controls */
	for (char *c = what; *c; c++)
		if ((unsigned char)*c < 0x20 || *c == 0x7f)
			*c = '?';
	yaml->failed = true;
	diag_add(yaml->diag, "%s:%d:%d: %s", yaml->path, place.line, place.column, what);
}

static int create_parser(struct yaml *yaml)
{
	struct fy_diag_cfg diag_cfg;
	struct fy_parse_cfg cfg = {.flags = FYPCF_ALLOW_DUPLICATE_KEYS |
					    FYPCF_DISABLE_ACCELERATORS | FYPCF_JSON_NONE};

	fy_diag_cfg_default(&diag_cfg);
	diag_cfg.fp = NULL;
	diag_cfg.output_fn = drop_output;
	diag_cfg.colorize = false;
	yaml->parse_errors = fy_diag_create(&diag_cfg);
	if (!yaml->parse_errors)
		return -ENOMEM;
	fy_diag_set_collect_errors(yaml->parse_errors, true);
	cfg.diag = yaml->parse_errors;
	yaml->parser = fy_parser_create(&cfg);
	return yaml->parser ? 0 : -ENOMEM;
}

/* True if the parser had something to say. */
static bool report_parse_errors(struct yaml *yaml)
{
	void *iterator = NULL;
	struct fy_diag_error *error;
	bool any = false;

	while ((error = fy_diag_errors_iterate(yaml->parse_errors, &iterator))) {
		yaml_complain(yaml, (struct yaml_place){error->line, error->column}, "",
			      "not YAML: %s", error->msg);
		any = true;
	}
	return any;
}

/* libfyaml goes by characters, so what is none is refused before. */
static int check_text(struct yaml *yaml, size_t size)
{
	size_t valid = utf8_valid_bytes(yaml->text, size), length = strlen(yaml->text);
	size_t bad = valid < length ? valid : length;
	struct yaml_place place = {1, 1};

	if (bad == size)
		return 0;
	for (size_t i = 0; i < bad; i++)
		place = yaml->text[i] == '\n' ? (struct yaml_place){place.line + 1, 1}
					      : (struct yaml_place){place.line, place.column + 1};
	yaml_complain(yaml, place, "", "not YAML: byte 0x%02x is no text (UTF-8)",
		      (unsigned char)yaml->text[bad]);
	return -EINVAL;
}

static int parse(struct yaml *yaml, size_t size)
{
	if (check_text(yaml, size))
		return -EINVAL;
	if (fy_parser_set_string(yaml->parser, yaml->text, size))
		return -ENOMEM;
	yaml->document = fy_parse_load_document(yaml->parser);
	if (report_parse_errors(yaml))
		return -EINVAL;
	if (!yaml->document || !fy_document_root(yaml->document)) {
		yaml_complain(yaml, (struct yaml_place){1, 1}, "", "the file is empty");
		return -EINVAL;
	}

	struct fy_document *second = fy_parse_load_document(yaml->parser);

	if (second) {
		fy_parse_document_destroy(yaml->parser, second);
		yaml_complain(yaml, (struct yaml_place){1, 1}, "",
			      "more than one document (---) in the file");
	}
	return report_parse_errors(yaml) || yaml->failed ? -EINVAL : 0;
}

int yaml_open(struct yaml *yaml, const char *path, size_t size_max, struct diag *diag)
{
	struct yaml made = {.path = path, .diag = diag};
	size_t size = 0;
	int err = file_read(&made.text, &size, path, size_max, diag);

	if (err)
		return err;
	err = create_parser(&made);
	if (!err)
		err = parse(&made, size);
	if (err == -ENOMEM)
		diag_add(diag, "%s: %s", path, strerror(ENOMEM));
	if (err) {
		yaml_close(&made);
		return err;
	}
	*yaml = made;
	return 0;
}

void yaml_close(struct yaml *yaml)
{
	if (yaml->document)
		fy_parse_document_destroy(yaml->parser, yaml->document);
	if (yaml->parser)
		fy_parser_destroy(yaml->parser);
	if (yaml->parse_errors)
		fy_diag_destroy(yaml->parse_errors);
	free(yaml->text);
	memset(yaml, 0, sizeof(*yaml));
}
