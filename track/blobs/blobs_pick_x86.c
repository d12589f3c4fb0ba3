/*
 * Which of the builds that give the same bits runs best on this processor.
 */
#include "track/blobs/blobs_parts.h"

blob_run_fn blob_run_deep, blob_run_wide, blob_run_deep_wide;

struct blob_builds blob_builds_any(void)
{
	return (struct blob_builds){blob_run, blob_run_deep};
}

struct blob_builds blob_builds_best(void)
{
	bool is_wide = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("bmi") &&
		       __builtin_cpu_supports("bmi2");

	return is_wide ? (struct blob_builds){blob_run_wide, blob_run_deep_wide}
		       : blob_builds_any();
}
