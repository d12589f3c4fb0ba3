/*
 * Observations kept: a text file in the form of mrcal's corners.vnl, "filename x y level" with all
 * corners of each view in order and "- - -" for those that were not seen, so that mrcal's tools
 * take it as --corners-cache. Board and cameras stand in comments. A view of camera ir0 in pose 12
 * is called ir0-000012.png. Numbers have 17 digits: what is read is what was written.
 */
#pragma once

#include "base/diag.h"
#include "calib/board/observations.h"

#define OBSERVATIONS_VIEWS_MAX 100000

/* Makes `path`, whole or not at all. Returns 0 or a negative errno with a message. */
int observations_write(const struct observations *observations, const char *path,
		       struct diag *diag);

/* Returns 0, -EINVAL with "path:line: ..." for the first thing that is wrong, or another negative
 * errno; on failure nothing is held. */
int observations_read(struct observations *observations, const char *path, struct diag *diag);
