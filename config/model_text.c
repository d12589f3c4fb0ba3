/*
 * A reader of just as much Python as a .cameramodel needs: enough to find the four fields that
 * matter and to say which of them is wrong. Fields it does not know are passed over.
 */
#include "config/model_text.h"

#include <ctype.h>
#include <errno.h>
#include <math.h>
#include <mrcal/mrcal.h>
#include <stdlib.h>
#include <string.h>

#define REMEDY "recalibrate or restore the file"
#define IMAGE_SIZE_MAX_PX 16384
#define DISTANCE_MAX_M 1000.0
#define SPLINE_KNOTS_MAX 500
#define LENS_NAMES                                                                                \
	"LENSMODEL_PINHOLE, STEREOGRAPHIC, LONLAT, LATLON, OPENCV4, OPENCV5, OPENCV8, OPENCV12, " \
	"CAHVOR or SPLINED_STEREOGRAPHIC"

enum { FIELD_LENSMODEL, FIELD_INTRINSICS, FIELD_EXTRINSICS, FIELD_IMAGERSIZE, FIELD_COUNT };

static const char *const field_names[FIELD_COUNT] = {"lensmodel", "intrinsics", "extrinsics",
						     "imagersize"};

struct field {
	int seen;
	bool readable; /* a list of finite numbers, or a string */
	int count;
	double values[6]; /* the first ones */
};

struct reader {
	const char *at;
	const char *path;
	struct diag *diag;
	bool failed;
	struct field fields[FIELD_COUNT];
	char lens_name[256];
};

static void complain(struct reader *r, const char *field, const char *what)
{
	diag_add(r->diag, "%s: %s: %s; " REMEDY, r->path, field, what);
	r->failed = true;
}

static void skip_space(struct reader *r)
{
	for (;;) {
		while (isspace((unsigned char)*r->at))
			r->at++;
		if (*r->at != '#')
			return;
		while (*r->at && *r->at != '\n')
			r->at++;
	}
}

static bool skip_char(struct reader *r, char wanted)
{
	skip_space(r);
	if (*r->at != wanted)
		return false;
	r->at++;
	return true;
}

/* A quoted string, perhaps with a b or r before it. Cuts off what does not fit into `out`. */
static bool read_string(struct reader *r, char *out, size_t size)
{
	size_t length = 0;

	skip_space(r);
	const char *p = r->at;
	while (*p == 'b' || *p == 'r')
		p++;
	char quote = *p;
	if (quote != '\'' && quote != '"')
		return false;
	for (p++; *p && *p != quote; p++) {
		if (*p == '\\' && p[1])
			p++;
		if (length + 1 < size)
			out[length++] = *p;
	}
	if (!*p)
		return false;
	out[length] = '\0';
	r->at = p + 1;
	return true;
}

/* Passes over a value: up to the comma or brace that ends it. */
static bool skip_value(struct reader *r)
{
	char text[8];
	int depth = 0;

	for (;;) {
		skip_space(r);
		char c = *r->at;
		if (!c)
			return false;
		if (depth == 0 && (c == ',' || c == '}'))
			return true;
		if (c == '\'' || c == '"') {
			if (!read_string(r, text, sizeof(text)))
				return false;
			continue;
		}
		if (strchr("[({", c))
			depth++;
		if (strchr("])}", c) && --depth < 0)
			return false;
		r->at++;
	}
}

static void complain_number(struct reader *r, const char *name, int index)
{
	char what[96];
	int length = (int)strcspn(r->at, ",] \t\r\n");

	snprintf(what, sizeof(what), "number %d is '%.*s', which is not a finite number", index + 1,
		 length < 24 ? length : 24, r->at);
	complain(r, name, what);
}

static void read_numbers(struct reader *r, struct field *field, const char *name)
{
	if (!skip_char(r, '[')) {
		complain(r, name, "expected a list of numbers");
		return;
	}
	while (skip_space(r), *r->at && *r->at != ']') {
		char *end;
		double value = strtod(r->at, &end);

		if (end == r->at || !isfinite(value)) {
			complain_number(r, name, field->count);
			return;
		}
		if (field->count < 6)
			field->values[field->count] = value;
		field->count++;
		r->at = end;
		if (!skip_char(r, ','))
			break;
	}
	if (skip_char(r, ']'))
		field->readable = true;
	else
		complain_number(r, name, field->count);
}

static void read_field(struct reader *r, int which)
{
	struct field *field = &r->fields[which];

	if (field->seen++) {
		complain(r, field_names[which], "given twice");
		return;
	}
	if (which != FIELD_LENSMODEL) {
		read_numbers(r, field, field_names[which]);
		return;
	}
	field->readable = read_string(r, r->lens_name, sizeof(r->lens_name));
	if (!field->readable)
		complain(r, "lensmodel", "expected a string such as 'LENSMODEL_OPENCV8'");
}

static int find_field(const char *name)
{
	for (int i = 0; i < FIELD_COUNT; i++)
		if (strcmp(name, field_names[i]) == 0)
			return i;
	return -1;
}

static bool read_dictionary(struct reader *r)
{
	char name[64];

	if (!skip_char(r, '{'))
		return false;
	while (skip_space(r), *r->at && *r->at != '}') {
		if (!read_string(r, name, sizeof(name)) || !skip_char(r, ':'))
			return false;
		int which = find_field(name);
		if (which >= 0)
			read_field(r, which);
		if (!skip_value(r))
			return false;
		if (!skip_char(r, ','))
			break;
	}
	return skip_char(r, '}');
}

/* libmrcal asserts or runs away on some configurations that it parses. */
static bool spline_is_sane(const mrcal_lensmodel_t *lens)
{
	const mrcal_LENSMODEL_SPLINED_STEREOGRAPHIC__config_t *c =
		&lens->LENSMODEL_SPLINED_STEREOGRAPHIC__config;

	return (c->order == 2 || c->order == 3) && c->Nx > c->order && c->Ny > c->order &&
	       c->Nx <= SPLINE_KNOTS_MAX && c->Ny <= SPLINE_KNOTS_MAX && c->fov_x_deg >= 1 &&
	       c->fov_x_deg < 360;
}

static bool check_lens(struct reader *r, mrcal_lensmodel_t *lens)
{
	char what[400];
	mrcal_lensmodel_type_t type = mrcal_lensmodel_type_from_name(r->lens_name);

	if (type == MRCAL_LENSMODEL_CAHVORE) {
		complain(r, "lensmodel",
			 "CAHVORE cannot be inverted; convert it with mrcal-convert-lensmodel");
		return false;
	}
	if (!mrcal_lensmodel_type_is_valid(type)) {
		snprintf(what, sizeof(what), "unknown model '%.64s', expected " LENS_NAMES,
			 r->lens_name);
		complain(r, "lensmodel", what);
		return false;
	}
	if (mrcal_lensmodel_from_name(lens, r->lens_name) &&
	    (lens->type != MRCAL_LENSMODEL_SPLINED_STEREOGRAPHIC || spline_is_sane(lens)))
		return true;
	snprintf(what, sizeof(what), "bad configuration of the model '%.128s'", r->lens_name);
	complain(r, "lensmodel", what);
	return false;
}

static void check_count(struct reader *r, int which, int expected)
{
	struct field *field = &r->fields[which];
	char what[128];

	if (!field->readable || field->count == expected)
		return;
	snprintf(what, sizeof(what), "expected %d numbers%s%.64s, found %d", expected,
		 which == FIELD_INTRINSICS ? " for " : "",
		 which == FIELD_INTRINSICS ? r->lens_name : "", field->count);
	complain(r, field_names[which], what);
	field->readable = false;
}

static void check_imager(struct reader *r)
{
	const struct field *field = &r->fields[FIELD_IMAGERSIZE];

	for (int i = 0; field->readable && i < 2; i++) {
		double pixels = field->values[i];

		if (pixels >= 32 && pixels <= IMAGE_SIZE_MAX_PX && pixels == floor(pixels))
			continue;
		complain(r, "imagersize", "expected [width, height] of 32 to 16384 pixels");
		return;
	}
}

static void check_extrinsics(struct reader *r)
{
	const struct field *field = &r->fields[FIELD_EXTRINSICS];

	if (!field->readable)
		return;
	for (int i = 0; i < 6; i++)
		if (fabs(field->values[i]) > (i < 3 ? 100.0 : DISTANCE_MAX_M)) {
			complain(r, "extrinsics",
				 i < 3 ? "the rotation is not in radians"
				       : "farther than 1000 m from the stage; are these "
					 "millimetres?");
			return;
		}
}

static void check_core(struct reader *r, const mrcal_lensmodel_t *lens)
{
	const struct field *field = &r->fields[FIELD_INTRINSICS];

	if (field->readable && mrcal_lensmodel_metadata(lens).has_core &&
	    !(field->values[0] > 0 && field->values[1] > 0))
		complain(r, "intrinsics", "the focal lengths (first two numbers) must be above 0");
}

int model_text_check(const char *text, size_t size, const char *path, struct diag *diag)
{
	struct reader r = {.at = text, .path = path, .diag = diag};
	mrcal_lensmodel_t lens;

	if (strlen(text) != size || !read_dictionary(&r)) {
		if (!r.failed)
			diag_add(diag,
				 "%s: not a complete camera model: a dictionary {'lensmodel': ...} "
				 "is expected; " REMEDY,
				 path);
		return -EINVAL;
	}
	for (int i = 0; i < FIELD_COUNT; i++)
		if (!r.fields[i].seen)
			complain(&r, field_names[i], "missing");
	check_count(&r, FIELD_EXTRINSICS, 6);
	check_count(&r, FIELD_IMAGERSIZE, 2);
	check_imager(&r);
	check_extrinsics(&r);
	if (r.fields[FIELD_LENSMODEL].readable && check_lens(&r, &lens)) {
		check_count(&r, FIELD_INTRINSICS, mrcal_lensmodel_num_params(&lens));
		check_core(&r, &lens);
	}
	return r.failed ? -EINVAL : 0;
}
