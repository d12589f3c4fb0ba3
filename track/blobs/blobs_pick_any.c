/*
 * Which of the builds that give the same bits runs best on this processor.
 */
#include "track/blobs/blobs_parts.h"

blob_run_fn blob_run_deep;

struct blob_builds blob_builds_any(void)
{
	return (struct blob_builds){blob_run, blob_run_deep};
}

struct blob_builds blob_builds_best(void)
{
	return blob_builds_any();
}
