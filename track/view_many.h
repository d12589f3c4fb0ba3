/*
 * The builds of view_project_many(), of which view_pick_*.c takes one; meson gives each its name.
 */
#pragma once

#include "track/view.h"

typedef void view_project_many_fn(const struct view *view, const struct vec3 *p_stage_m, int count,
				  struct projection *out, bool *in_sight);

view_project_many_fn view_project_many_any, view_project_many_wide;

#ifndef VIEW_PROJECT_MANY
#define VIEW_PROJECT_MANY view_project_many_any
#endif
