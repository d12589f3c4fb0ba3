/*
 * One block of lines a marker, so that two calibrations can be compared line by line.
 */
#include "calib/actor/actor_file.h"

static void write_vec3(FILE *out, const char *key, struct vec3 v)
{
	fprintf(out, "%s: [%.7f, %.7f, %.7f]", key, v.x, v.y, v.z);
}

static void write_learned(FILE *out, const struct layout *layout, const struct layout_learned *l)
{
	fputs("  learned:\n    ", out);
	write_vec3(out, "range_min_m", l->range_min_m);
	fputs("\n    ", out);
	write_vec3(out, "range_max_m", l->range_max_m);
	fprintf(out, "\n    speed_max_m_s: %.4f\n    rest_sd_m: %.7f\n", l->speed_max_m_s,
		l->rest_sd_m);
	fprintf(out, "    cov_m2: [%.5e, %.5e, %.5e, %.5e, %.5e, %.5e]\n", l->cov_m2[0],
		l->cov_m2[1], l->cov_m2[2], l->cov_m2[3], l->cov_m2[4], l->cov_m2[5]);
	if (l->neighbour_count)
		fputs("    neighbours:\n", out);
	for (int k = 0; k < l->neighbour_count; k++)
		fprintf(out, "    - {name: %s, spread_m: %.6f}\n",
			layout->markers[l->neighbours[k].marker].name, l->neighbours[k].spread_m);
}

static void write_marker(FILE *out, const struct layout *layout, uint32_t index)
{
	const struct layout_marker *m = &layout->markers[index];

	fprintf(out, "- name: %s\n  ", m->name);
	write_vec3(out, "neutral_m", m->neutral_m);
	fprintf(out, "\n  diameter_m: %.6g\n", m->diameter_m);
	if (m->group[0])
		fprintf(out, "  group: %s\n", m->group);
	if (m->segment[0])
		fprintf(out, "  segment: %s\n", m->segment);
	if (m->rigid)
		fputs("  rigid: true\n", out);
	if (m->mpeg4[0])
		fprintf(out, "  mpeg4: \"%s\"\n", m->mpeg4);
	if (m->learned.known)
		write_learned(out, layout, &m->learned);
}

void actor_file_write(FILE *out, const struct layout *layout, const char *calibrated)
{
	fputs("# An actor: layout and what his calibration learned; docs/configuration.md.\n"
	      "# Metres, head coordinates: x to the subject's left, y up, z out of the face.\n",
	      out);
	fprintf(out, "version: 1\nactor: %s\ncalibrated: \"%s\"\nmarkers:\n",
		layout->actors[0].name, calibrated);
	for (uint32_t i = 0; i < layout->marker_count; i++)
		write_marker(out, layout, i);
}
