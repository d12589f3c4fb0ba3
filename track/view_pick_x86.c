/*
 * Which of the builds that give the same bits runs best on this processor.
 */
#include "track/view_many.h"

void view_project_many(const struct view *view, const struct vec3 *p_stage_m, int count,
		       struct projection *out, bool *in_sight)
{
	if (__builtin_cpu_supports("avx2"))
		view_project_many_wide(view, p_stage_m, count, out, in_sight);
	else
		view_project_many_any(view, p_stage_m, count, out, in_sight);
}
