/*
 * The solver's own arguments, at the solution.
 */
#include "calib/solve/mrcal_inputs.h"

#include <errno.h>

#include "calib/solve/problem.h"

static void print_heading(FILE *file, const struct observations *o, const struct problem *p,
			  const struct solution *solution)
{
	fprintf(file, "{\"lens\": \"%s\", \"lens_count\": %d, \"core\": %s, \"square_m\": %.17g, ",
		solution->lens, p->lens_count,
		p->selections.do_optimize_intrinsics_core ? "true" : "false", p->square_m);
	fprintf(file, "\"frames\": %d, \"views\": %d, \"board\": [%d, %d], \"cameras\": [",
		p->frame_count, p->view_count, p->width, p->height);
	for (uint32_t c = 0; c < o->camera_count; c++)
		fprintf(file, "%s[\"%s\", %d, %d]", c ? ", " : "", o->cameras[c].name,
			o->cameras[c].width_px, o->cameras[c].height_px);
	fprintf(file, "]}\n");
}

static void print_numbers(FILE *file, const struct problem *p)
{
	size_t cameras = (size_t)p->camera_count, frames = (size_t)p->frame_count;

	fwrite(p->intrinsics, sizeof(double), cameras * (size_t)p->lens_count, file);
	fwrite(p->extrinsics, sizeof(double), (cameras - 1) * 6, file);
	fwrite(p->frames, sizeof(double), frames * 6, file);
	fwrite(p->warp, sizeof(double), 2, file);
	fwrite(p->pool, sizeof(*p->pool), (size_t)p->view_count * (size_t)p->corner_count, file);
	for (int v = 0; v < p->view_count; v++) {
		const int32_t of[3] = {p->views[v].iframe, p->views[v].icam.intrinsics,
				       p->views[v].icam.extrinsics};

		fwrite(of, sizeof(*of), 3, file);
	}
}

int mrcal_inputs_print(FILE *file, const struct observations *observations,
		       const struct solution *solution)
{
	struct problem problem;
	int err = problem_init_solved(&problem, observations, solution);

	if (err)
		return err;
	problem_set(&problem, solution);
	print_heading(file, observations, &problem, solution);
	print_numbers(file, &problem);
	problem_finish(&problem);
	return fflush(file) || ferror(file) ? -EIO : 0;
}
