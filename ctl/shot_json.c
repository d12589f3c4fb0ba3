/*
 * Written by hand, not through a JSON library: the number of digits is part of the format.
 * Positions to 0.1 um, covariances to 6 digits, pixels to 0.0001.
 */
#include "ctl/shot_json.h"

#include <inttypes.h>
#include <math.h>

static const char *status_name(enum marker_status status)
{
	switch (status) {
	case MARKER_PREDICTED:
		return "predicted";
	case MARKER_TWO_CAMERA:
		return "two_camera";
	case MARKER_MEASURED:
		return "measured";
	case MARKER_MISSING:
		break;
	}
	return "missing";
}

static void write_string(FILE *out, const char *text)
{
	putc('"', out);
	for (; *text; text++) {
		unsigned char byte = (unsigned char)*text;

		if (byte == '"' || byte == '\\')
			fprintf(out, "\\%c", byte);
		else if (byte < 0x20)
			fprintf(out, "\\u%04x", byte);
		else
			putc(byte, out);
	}
	putc('"', out);
}

/* JSON has no word for what is not finite. */
static void write_number(FILE *out, const char *format, double value)
{
	if (!isfinite(value))
		fputs("null", out);
	else
		fprintf(out, format, value);
}

static void write_array(FILE *out, const char *format, const double *values, int count)
{
	for (int i = 0; i < count; i++) {
		putc(i ? ',' : '[', out);
		write_number(out, format, values[i]);
	}
	putc(']', out);
}

static void write_vec3(FILE *out, struct vec3 v)
{
	write_array(out, "%.7f", (const double[]){v.x, v.y, v.z}, 3);
}

static const char *actor_of(const struct layout *layout, int label)
{
	uint32_t a = 0;

	while (a + 1 < layout->actor_count && (uint32_t)label >= layout->actors[a + 1].first)
		a++;
	return layout->actors[a].name;
}

static void write_name(FILE *out, const struct marker *marker, const struct layout *layout)
{
	fputs("{\"label\":", out);
	if (marker->label < 0 || (uint32_t)marker->label >= layout->marker_count) {
		fputs("null", out);
		return;
	}
	write_string(out, layout->markers[marker->label].name);
	if (layout->actor_count > 1) {
		fputs(",\"actor\":", out);
		write_string(out, actor_of(layout, marker->label));
	}
}

static void write_layer(FILE *out, const char *name, const float p_m[3])
{
	fprintf(out, ",\"%s_m\":", name);
	write_vec3(out, (struct vec3){p_m[0], p_m[1], p_m[2]});
}

static void write_flags(FILE *out, const struct marker *marker)
{
	if (marker->flags & MARKER_STABILISED)
		write_layer(out, "stabilised", marker->stabilised_m);
	if (marker->flags & MARKER_NORMALISED)
		write_layer(out, "normalised", marker->normalised_m);
	if (marker->label >= 0) {
		fputs(",\"confidence\":", out);
		write_number(out, "%.4f", (double)marker->confidence);
	}
	if (marker->flags & MARKER_GONE)
		fputs(",\"gone\":true", out);
	if (marker->flags & MARKER_GHOST)
		fputs(",\"ghost\":true", out);
}

static void write_marker(FILE *out, const struct marker *marker, const struct layout *layout)
{
	write_name(out, marker, layout);
	if (marker->status == MARKER_MISSING) {
		fputs(",\"p_m\":null,\"cov_m2\":null", out);
	} else {
		fputs(",\"p_m\":", out);
		write_vec3(out, marker->p_stage_m);
		fputs(",\"cov_m2\":", out);
		write_array(out, "%.5e", marker->cov_m2, 6);
	}
	fputs(",\"residual_px\":", out);
	write_number(out, "%.4f", marker->residual_px);
	fprintf(out, ",\"cameras\":%d,\"status\":\"%s\"", marker->camera_count,
		status_name(marker->status));
	write_flags(out, marker);
	putc('}', out);
}

static void write_head(FILE *out, const struct head *head, const char *actor)
{
	double q_wxyz[4];

	pose_to_quaternion(&head->rt_stage_head, q_wxyz);
	fputs("{\"actor\":", out);
	write_string(out, actor[0] ? actor : "a");
	fputs(",\"q\":", out);
	write_array(out, "%.9f", q_wxyz, 4);
	fputs(",\"t_m\":", out);
	write_vec3(out, head->rt_stage_head.t);
	fputs(",\"residual_m\":", out);
	write_number(out, "%.7f", head->residual_m);
	if (head->jig_slip) {
		fputs(",\"jig_slip_m\":", out);
		write_number(out, "%.7f", head->slip_m);
	}
	putc('}', out);
}

void shot_json_write(FILE *out, const struct marker_set *set, const struct layout *layout)
{
	bool first = true;

	fprintf(out, "{\"shot\":%" PRIu64 ",\"mid_exposure_ns\":%" PRId64 ",\"markers\":[",
		set->shot, set->mid_exposure_ns);
	for (uint32_t m = 0; m < set->marker_count; m++) {
		if (m)
			putc(',', out);
		write_marker(out, &set->markers[m], layout);
	}
	fputs("],\"heads\":[", out);
	for (uint32_t h = 0; h < set->head_count; h++) {
		if (!set->heads[h].valid)
			continue;
		if (!first)
			putc(',', out);
		first = false;
		write_head(out, &set->heads[h], layout->actors[h].name);
	}
	fputs("]}\n", out);
}
