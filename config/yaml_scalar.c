/*
 * Single values: text, names, numbers. Strict, because a number read wrong is a camera driven
 * wrong: 30fps, "120", 0x10, 1_000, nan and true are not numbers here.
 */
#include <ctype.h>
#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "config/yaml.h"

#define SHOWN 40 /* characters of a wrong value in a message */

struct scalar {
	const char *text; /* with a NUL behind it, borrowed from the document */
	int length;
	bool plain; /* not quoted */
};

static bool get_scalar(struct yaml *yaml, const struct yaml_value *value, const char *expected,
		       struct scalar *out)
{
	size_t length = 0;
	const char *text = NULL;

	if (value->node && fy_node_is_scalar(value->node))
		text = fy_node_get_scalar(value->node, &length);
	if (!text) {
		yaml_complain(yaml, value->place, value->field, "expected %s", expected);
		return false;
	}
	out->plain = fy_node_get_style(value->node) == FYNS_PLAIN;
	if (out->plain && (length == 0 || (length == 1 && *text == '~') ||
			   (length == 4 && memcmp(text, "null", 4) == 0))) {
		yaml_complain(yaml, value->place, value->field, "has no value; expected %s",
			      expected);
		return false;
	}
	out->text = fy_node_get_scalar0(value->node);
	out->length = (int)length;
	return out->text != NULL;
}

static void read_text(struct yaml *yaml, const struct yaml_value *value, const struct yaml_key *key,
		      char *target)
{
	struct scalar s;

	if (!get_scalar(yaml, value, key->kind == YAML_NAME ? "a name" : "a text", &s))
		return;
	for (int i = 0; i < s.length; i++) {
		unsigned char c = (unsigned char)s.text[i];

		if (c < 0x20 || c == 0x7f) {
			yaml_complain(yaml, value->place, value->field,
				      "control characters are not allowed");
			return;
		}
		if (key->kind == YAML_NAME && !isalnum(c) && c != '_' && c != '-') {
			yaml_complain(
				yaml, value->place, value->field,
				"'%.*s' may have only the letters A-Z and a-z, digits, _ and -",
				SHOWN, s.text);
			return;
		}
	}
	if (s.length == 0)
		yaml_complain(yaml, value->place, value->field, "is empty");
	else if ((size_t)s.length >= key->size)
		yaml_complain(yaml, value->place, value->field, "longer than %zu bytes",
			      key->size - 1);
	else
		memcpy(target, s.text, (size_t)s.length + 1);
}

static void read_bool(struct yaml *yaml, const struct yaml_value *value, bool *target)
{
	struct scalar s;

	if (!get_scalar(yaml, value, "true or false", &s))
		return;
	if (s.plain && strcmp(s.text, "true") == 0)
		*target = true;
	else if (s.plain && strcmp(s.text, "false") == 0)
		*target = false;
	else
		yaml_complain(yaml, value->place, value->field, "'%.*s' is neither true nor false",
			      SHOWN, s.text);
}

static void read_choice(struct yaml *yaml, const struct yaml_value *value,
			const struct yaml_key *key, int *target)
{
	char all[256] = "";
	struct scalar s;

	for (int i = 0; key->choices[i]; i++) {
		size_t used = strlen(all);

		snprintf(all + used, sizeof(all) - used, "%s%s", used ? " or " : "",
			 key->choices[i]);
	}
	if (!get_scalar(yaml, value, all, &s))
		return;
	for (int i = 0; key->choices[i]; i++)
		if (strcmp(s.text, key->choices[i]) == 0) {
			*target = i;
			return;
		}
	yaml_complain(yaml, value->place, value->field, "'%.*s' is unknown, expected %s", SHOWN,
		      s.text, all);
}

/* "a number from 1 to 1000 (hertz)", of which "a number" is the caller's. */
static void describe_range(char *out, size_t size, const char *what, const struct yaml_key *key)
{
	snprintf(out, size, "%s from %.10g to %.10g%s%s%s", what, key->min, key->max,
		 key->unit ? " (" : "", key->unit ? key->unit : "", key->unit ? ")" : "");
}

static void complain_number(struct yaml *yaml, const struct yaml_value *value,
			    const struct scalar *s, const char *expected)
{
	if (!s->plain)
		yaml_complain(yaml, value->place, value->field,
			      "'%.*s' is a text in quotes, expected %s", SHOWN, s->text, expected);
	else if (isdigit((unsigned char)s->text[0]) &&
		 isalpha((unsigned char)s->text[s->length - 1]))
		yaml_complain(yaml, value->place, value->field,
			      "'%.*s' is not a number, expected %s without a unit behind it", SHOWN,
			      s->text, expected);
	else
		yaml_complain(yaml, value->place, value->field, "'%.*s' is not %s", SHOWN, s->text,
			      expected);
}

/* A decimal number and nothing else: strtod alone would take nan, inf and hexadecimal. */
static bool parse_number(const struct scalar *s, double *number)
{
	char *end;

	if (!s->plain || strspn(s->text, "+-.0123456789eE") != (size_t)s->length)
		return false;
	*number = strtod(s->text, &end);
	return end == s->text + s->length;
}

static bool get_number(struct yaml *yaml, const struct yaml_value *value,
		       const struct yaml_key *key, double *number)
{
	char expected[160];
	struct scalar s;

	describe_range(expected, sizeof(expected), "a number", key);
	if (!get_scalar(yaml, value, expected, &s))
		return false;
	if (!parse_number(&s, number)) {
		complain_number(yaml, value, &s, expected);
		return false;
	}
	if (*number >= key->min && *number <= key->max)
		return true;
	yaml_complain(yaml, value->place, value->field, "%.*s is out of range, expected %s", SHOWN,
		      s.text, expected);
	return false;
}

static void read_int(struct yaml *yaml, const struct yaml_value *value, const struct yaml_key *key,
		     int *target)
{
	char expected[160];
	struct scalar s;
	double number;

	describe_range(expected, sizeof(expected), "a whole number", key);
	if (!get_scalar(yaml, value, expected, &s))
		return;
	if (!parse_number(&s, &number) || strspn(s.text, "+-0123456789") != (size_t)s.length)
		complain_number(yaml, value, &s, expected);
	else if (number < key->min || number > key->max)
		yaml_complain(yaml, value->place, value->field, "%.*s is out of range, expected %s",
			      SHOWN, s.text, expected);
	else
		*target = (int)number;
}

/* All 64 bits: a double would round them. */
static void read_wide(struct yaml *yaml, const struct yaml_value *value, const struct yaml_key *key,
		      void *target)
{
	uint64_t max = key->kind == YAML_INT64 ? INT64_MAX : UINT64_MAX, number;
	char expected[80];
	struct scalar s;

	snprintf(expected, sizeof(expected), "a whole number from 0 to %llu",
		 (unsigned long long)max);
	if (!get_scalar(yaml, value, expected, &s))
		return;
	errno = 0;
	number = strtoull(s.text, NULL, 10);
	if (!s.plain || strspn(s.text, "0123456789") != (size_t)s.length)
		complain_number(yaml, value, &s, expected);
	else if (errno == ERANGE || number > max)
		yaml_complain(yaml, value->place, value->field, "%.*s is out of range, expected %s",
			      SHOWN, s.text, expected);
	else
		memcpy(target, &number, sizeof(number));
}

void yaml_read_scalar(struct yaml *yaml, const struct yaml_value *value, const struct yaml_key *key,
		      void *target)
{
	double number;

	switch (key->kind) {
	case YAML_TEXT:
	case YAML_NAME:
		read_text(yaml, value, key, target);
		break;
	case YAML_BOOL:
		read_bool(yaml, value, target);
		break;
	case YAML_CHOICE:
		read_choice(yaml, value, key, target);
		break;
	case YAML_INT:
		read_int(yaml, value, key, target);
		break;
	case YAML_INT64:
	case YAML_UINT64:
		read_wide(yaml, value, key, target);
		break;
	case YAML_DOUBLE:
		if (get_number(yaml, value, key, &number))
			*(double *)target = number;
		break;
	case YAML_MICROS:
		if (get_number(yaml, value, key, &number))
			*(int64_t *)target = llround(number * 1000.0);
		break;
	case YAML_CUSTOM:
		break;
	}
}
