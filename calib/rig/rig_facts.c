/*
 * What a rig was made from and what it is worth, for people and programs.
 */
#include "calib/rig/rig_facts.h"

#include "calib/board/sight.h"

static void print_board(FILE *file, const struct rig_facts *facts)
{
	const struct board *board = &facts->observations->board;

	fprintf(file, "board:\n  squares_x: %d\n  squares_y: %d\n", board->squares_x,
		board->squares_y);
	fprintf(file, "  square_m: %.17g\n  tag_part: %.17g\n", board->square_m, board->tag_part);
	fprintf(file, "  family: %s\n  first_id: %d\n", BOARD_TAG_FAMILY, board->first_id);
	fprintf(file, "  warp_x_m: %.3e # found\n  warp_y_m: %.3e\n", facts->solution->warp_m[0],
		facts->solution->warp_m[1]);
}

static void print_worth(FILE *file, const struct rig_facts *facts)
{
	const struct uncertainty *u = facts->uncertainty;
	struct vec3 worst = pose_apply(&facts->rt_stage_ref, facts->volume->p_ref_m[u->worst]);

	fprintf(file, "rms_px: %.4f\nheld_out_rms_px: %.4f # of views it was not made from\n",
		facts->solution->rms_px, facts->cross_check->held_out_rms_px);
	fprintf(file, "halves_differ_mm: %.4f # rigs from half of the views each\n",
		1e3 * facts->cross_check->halves_differ_m);
	fprintf(file, "uncertainty: # one sigma of points in the volume\n");
	fprintf(file, "  rms_mm: %.4f\n  worst_mm: %.4f\n", 1e3 * u->rms_m, 1e3 * u->worst_m);
	fprintf(file, "  worst_at_m: [%.3f, %.3f, %.3f]\n", worst.x, worst.y, worst.z);
}

static void print_verdict(FILE *file, const struct verdict *verdict)
{
	fprintf(file, "passed: %s\nlimits:\n", verdict->passed ? "true" : "false");
	for (int i = 0; i < VERDICT_LINES; i++)
		fprintf(file, "- {of: %s, limit_%s: %g, passed: %s}\n", verdict->lines[i].name,
			verdict->lines[i].unit, verdict->lines[i].limit,
			verdict_line_passed(&verdict->lines[i]) ? "true" : "false");
}

static void print_camera(FILE *file, const struct rig_facts *facts, uint32_t c)
{
	const struct observations *o = facts->observations;
	struct vec3 centre =
		pose_apply(&facts->rt_stage_ref, solution_centre_m(facts->solution, c));
	uint32_t views = 0;

	for (uint32_t v = 0; v < o->view_count; v++)
		views += o->views[v].camera == c;
	fprintf(file, "- name: %s\n  width: %d\n  height: %d\n", o->cameras[c].name,
		o->cameras[c].width_px, o->cameras[c].height_px);
	fprintf(file, "  views: %u\n  rms_px: %.4f\n", views, facts->solution->rms_camera_px[c]);
	fprintf(file, "  centre_m: [%.6f, %.6f, %.6f]\n", centre.x, centre.y, centre.z);
}

void rig_facts_print(FILE *file, const struct rig_facts *facts, const char *revision)
{
	const struct solution *solution = facts->solution;
	char hash[OBSERVATIONS_HASH_BYTES];

	observations_hash(facts->observations, hash);
	fprintf(file, "revision: \"%s\" # of all cameras, in this order\n", revision);
	fprintf(file, "software: \"%s\"\nobservations: \"%s\"\n", facts->software, hash);
	print_board(file, facts);
	fprintf(file, "lens: %s\nposes: %u\nviews: %u\n", solution->lens, solution->pose_count,
		solution->view_count);
	fprintf(file, "corners: %u\noutliers: %u\n", solution->used_count, solution->outlier_count);
	print_worth(file, facts);
	if (facts->verdict)
		print_verdict(file, facts->verdict);
	fprintf(file, "cameras:\n");
	for (uint32_t c = 0; c < solution->camera_count; c++)
		print_camera(file, facts, c);
}
