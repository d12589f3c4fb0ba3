/*
 * Four figures and four limits.
 */
#include "calib/report/verdict.h"

#include <string.h>

static uint32_t worst_camera(const struct solution *solution)
{
	uint32_t worst = 0;

	for (uint32_t c = 1; c < solution->camera_count; c++)
		if (solution->rms_camera_px[c] > solution->rms_camera_px[worst])
			worst = c;
	return worst;
}

struct verdict verdict_of(const struct calibration_limits *limits,
			  const struct observations *observations, const struct solution *solution,
			  const struct uncertainty *uncertainty, const struct cross_check *check)
{
	uint32_t worst = worst_camera(solution);
	struct verdict verdict = {
		.lines = {{"rms of the worst camera", "px", "", solution->rms_camera_px[worst],
			   limits->rms_px},
			  {"held-out error", "px", "", check->held_out_rms_px, limits->held_out_px},
			  {"uncertainty over the volume", "mm", "", 1e3 * uncertainty->rms_m,
			   limits->uncertainty_mm},
			  {"uncertainty at the worst place", "mm", "", 1e3 * uncertainty->worst_m,
			   limits->worst_mm}},
		.passed = true};

	memcpy(verdict.lines[0].of, observations->cameras[worst].name, NAME_BYTES);
	for (int i = 0; i < VERDICT_LINES; i++)
		verdict.passed &= verdict_line_passed(&verdict.lines[i]);
	return verdict;
}
