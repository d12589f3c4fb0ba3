/*
 * Which of the builds that give the same bits runs best on this processor.
 */
#include "track/blobs_parts.h"

blob_run_fn blob_run_wide;

blob_run_fn *blob_run_best(void)
{
	return __builtin_cpu_supports("avx2") ? blob_run_wide : blob_run;
}
